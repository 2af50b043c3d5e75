"""Remarks of checks as they are printed: a person read `check_remarks.txt` once, and each change is to be read again.

`PYTHONPATH=tests python tests/wording/test_check_remarks.py` writes the file anew.
"""

import re
from pathlib import Path

from vegglue.diagnosis import channel_check, flow_check, station_check
from vegglue.diagnosis.effect_contract import Breach, ContractRule
from vegglue.measurements.adv_section import DeadProbe
from vegglue.measurements.kinds import UnstatedErrors, Unused
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues, Symptom
from vegglue.measurements.section_discharge import CarriedDischarge, DischargeMismatch
from vegglue.wording.sentences import macros, sentence, tag_of

FILE = Path(__file__).with_suffix("").parent / "check_remarks.txt"
BEYOND = channel_check.BeyondGrid("y", (4.0, 9.0), (-5.0, 5.0), False)
CARRIED = CarriedDischarge("low", "D0", 36.0, 2.07, (1.9, 2.24), (1.4, 1.4), 0.85, 17, True)
UNSTATED = UnstatedErrors((("velocity", 1), ("level", 2)), (8.0, 2.0), ("u_se",), ("level_se",), (0.015, "m/s"))


def values(symptom: Symptom, unit: str = "", size: float = 101.0, count: int = 5) -> ImplausibleValues:
    level = symptom in (Symptom.LEVEL_UNIT, Symptom.DATUM, Symptom.BELOW_BED, Symptom.HIGH, Symptom.LOW)
    quantity, instrument, si_unit = ("level", "gauge", "m") if level else ("velocity", "probe", "m/s")
    places = (("low", "G1"), ("mid", None)) if level else (("low", "D0"),)
    return ImplausibleValues(quantity, instrument, si_unit, symptom, unit, size, count, 15, (47.7, 20.0, -2.0), places)


EXAMPLES = [
    *(values(one, size=0.65) for one in Symptom),
    values(Symptom.FAST, "cm/s", count=15),
    values(Symptom.MISSING_MARK, count=1),
    values(Symptom.LEVEL_UNIT, "ft", 2.2, 1),
    ImplausibleOutlet("June", 95.0, 95.0, 9.0, 0.0024),
    DischargeMismatch((CARRIED, CARRIED)),
    flow_check.DischargeUnlike("low", 50.0, 0.6, CARRIED),
    DeadProbe(25, 0.009, 0.48, 0.004, 0.068),
    UNSTATED,
    channel_check.ErrorsRefused(("infer", "diagnose", "run"), UNSTATED),
    channel_check.PatchWithoutCells("p1", True, None),
    channel_check.PatchWithoutCells("p1", False, BEYOND),
    channel_check.PatchAreaMissed("p1", 20.0, 4.0, BEYOND),
    channel_check.SurveyLeftOut(6, 0.077, 0.085, 0.091, 1.3, 24.0, 12.0, 0.05, 0.04, False),
    channel_check.SurveyLeftOut(6, 0.121, 0.085, 0.091, 2.1, 36.0, 36.0, 0.15, 0.04, True),
    channel_check.ErrorsAssumed(0.1, 0.03, 0.02, 0.1),
    channel_check.ErrorsAssumed(0.0, 0.03, 0.02, 0.0),
    channel_check.SteepCellsLikeFloor(0.36, 0.2),
    channel_check.CanopyEmergent("reed", (0.7, 1.4), ("low", "mid"), (0.85, 1.1), False, "constant"),
    channel_check.CanopyUnlikeMeasured("D3", "D3b", 1.06, "willow", (0.8, 0.8)),
    channel_check.BankLawHeld("bank", 5.0, True, 0.54, 1.3, (("low", 0.5), ("mid", 0.29))),
    channel_check.UnitOfPrior("d", "cm/s", "zero_offset", "offset", "m/s"),
    flow_check.GridEndInBend(False, 25.0),
    flow_check.OutletDry("dry", -0.5, 0.04, False),
    flow_check.Supercritical("June", 0.05, 1.7),
    flow_check.OutletAboveGauge(36.0, 4.0, (("low", 0.95, 0.05), ("mid", 1.05, 0.03))),
    flow_check.ComponentsExchanged(("low", "high"), 0.01, 0.33),
    flow_check.FlowUpstream(("low",), -0.4, False),
    flow_check.SectionsUpstream("June", ("A", "B"), -0.2),
    flow_check.LevelsRiseDownstream(("low", "high"), (0.4, 0.41), 20.0, 38.0),
    flow_check.VelocitiesTurned("right", ("low",), (12.2,), 3, (("high", 0.2),)),
    flow_check.ProbeTurned(0.45, "left", 5.2, 4),
    station_check.StationsOutsideGrid("low", 2, (-1.0, 0.0)),
    station_check.StationsOnLand("low", 1, (12.0, 4.6), 0.34, True),
    station_check.SharedPlaces("velocity", "low", 2, (12.0, -0.7), ("A", "B")),
    station_check.AxesExchanged(4, (-1.0, 12.0)),
    station_check.StationsOnMap((683132.0, 247479.0)),
    station_check.PlacesInOtherUnit(4, 6, (65.6168, -3.28084), "ft"),
    station_check.StationsOnPatchEdge("D3", "p1", (4.0, 5.5)),
    station_check.StationsNearWall("x4.2", (0.01, 0.02), 0.1),
    station_check.HeightsFromSurface(4, 4, (20.0, -1.0)),
    station_check.HeightsExchanged(Path("velocities.csv"), "z", 4, 4, (30.0, -1.0)),
    station_check.HeightsTakenForLevels("points.csv", ("low",), (0.051,), 5.0, 35.0, 0.03, "z [mm]"),
    station_check.PointsOutsideWater(2, ("s20",), ("low",), Unused.BELOW_BED, (20.0, -1.0), -0.1, 1.04, False),
    station_check.ErrorsAcrossPlants((("low", "D3"),), (0.03, 0.03), (0.002, 0.004), (0.005, 0.005)),
    Breach(ContractRule.OFF_IS_OFF, "strength", water="moving"),
    Breach(ContractRule.POWER, "strength", (2,)),
]


def rendered() -> str:
    return "".join(f"{tag_of(one)}: {sentence(one)}\n" for one in EXAMPLES)


def test_remarks_are_worded_as_they_were_read() -> None:
    assert rendered() == FILE.read_text(encoding="utf-8")


def test_programs_are_no_persons() -> None:
    persons = re.compile(r"\b(who|whoever|nobody|tells?|told|says?|said|hears?|heard|asks?|asked|speaks?)\b", re.I)
    assert [line for line in rendered().splitlines() if persons.search(line)] == []


def test_every_rule_and_symptom_has_words() -> None:
    assert {rule for rule in ContractRule if not sentence(Breach(rule, "c", (1.0, 2.0, 3.0), "still"))} == set()
    assert len({sentence(values(one)).partition(": ")[2] for one in Symptom}) == len(Symptom)
    assert {"no_parameters", "outlet_without_cells", "parameter_idle"} <= macros().keys()


if __name__ == "__main__":
    FILE.write_text(rendered(), encoding="utf-8")
