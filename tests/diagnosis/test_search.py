"""The search for a law in the small channel of twins: silent where nothing is hidden, and right where a law is.

A listed effect is called by its name. One data set of an independent code in the end.
"""

from dataclasses import replace
from functools import cache

import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import at_point
from vegglue.calibration.law_screening import LEAST_SPREAD, law_fingerprints, laws_in_case, products_in_case
from vegglue.calibration.noise import noise_of
from vegglue.diagnosis.law_search import Discovery, discover_laws
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point
from vegglue.progress import silent
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.hidden_effect import TwinBase, measured_twin, true_place, twin_base


@pytest.fixture(scope="module")
def model() -> Model:
    """On larger cells: the truth is made on smaller ones."""
    return coarse_twin()[0]


@pytest.fixture(scope="module")
def point() -> Point:
    return coarse_twin()[1]


def test_laws_are_measured_by_what_the_data_have_seen(model: Model, point: Point) -> None:
    laws = {one.law.name: one for one in laws_in_case(model, point, ["bank_trend", "bed_trend"])}
    assert len(laws) > 30
    assert "law_bank_along_trend" not in laws, "bank_trend competes by itself"
    assert "law_bank_depth_power" in laws, "depth_dependent_bank does not compete here"
    for one in laws.values():
        low, high = one.seen
        assert low < high
        for settings in one.candidate.settings():
            rounded = 1.05  # a reference has two digits
            assert low <= settings.get("reference", low) * rounded or one.law.quantity.name == "along"
    low, high = laws["law_floor_depth_ramp"].seen
    assert 0.5 < low < high < 1.3
    assert high - low > LEAST_SPREAD
    low, high = laws["law_plants_front_fading"].seen
    assert 0.0 < low < high < 4.0, "no section crosses a patch; what is in it is seen all the same"


def test_a_section_of_which_nothing_is_used_has_seen_nothing(model: Model, point: Point) -> None:
    """Outside the grid it counted as measured at the end of the channel, and laws as seen there."""
    station, last = model.station, model.station["section"] == "C"
    station = station.assign(used=station["used"] & ~last, x=station["x"].mask(last, model.case.grid.x[1] + 5.0))
    without = station[station["used"]].reset_index(drop=True)
    kept, left_out = (laws_in_case(replace(model, station=table), point, []) for table in (station, without))
    assert [(one.law.name, one.seen) for one in kept] == [(one.law.name, one.seen) for one in left_out]


def test_laws_are_looked_for_with_no_listed_effect_beside_them(model: Model, point: Point) -> None:
    """`--without` all of them ended in a traceback."""
    noise = noise_of(model.station)
    base = Baseline(model, noise, at_point(noise, point), None, None)
    found = law_fingerprints(base, tuple(library()))
    assert found.listed.candidates == []
    assert found.listed.values.shape == (len(model.station), 0)
    assert len(found.every.candidates) == len(found.laws) > 30


@cache
def ground_of(seed: int, fine: bool) -> TwinBase:
    """The truth before something is hidden in it: most tests share it."""
    model = CaseRun(CASE).model if fine else coarse_twin()[0]
    return twin_base(model, true_place(len(model.names), seed))


def searched(hidden: list[str], seed: int, fine: bool = False) -> Discovery:
    """What is found in measurements of a truth that hides something at a ratio of 8, errors white."""
    ground = ground_of(seed, fine)
    station, _ = measured_twin(ground, hidden, 8.0, "white", seed)
    return discover_laws(replace(ground.model, station=station), without=(), watch=silent)


def test_products_have_the_references_of_both_laws(model: Model, point: Point) -> None:
    law = next(one for one in laws_in_case(model, point, []) if one.law.name == "law_viscosity_offset_step")
    products = {one.law.quantity.name: one for one in products_in_case(model, point, law, 0.6)}
    assert {"depth", "speed", "along", "edge"} <= set(products)
    assert "offset" not in products
    for one in products.values():
        assert {settings["first"] for settings in one.candidate.settings()} == {0.6}
    assert len(products["along"].candidate.settings()) == 1
    assert len(products["edge"].candidate.settings()) > 5
    # The step changes by nearly 1 over what was seen, and the trend by what was seen of x/L.
    low, high = products["along"].seen
    assert products["along"].candidate.amplitude.scale == pytest.approx(0.5 / (high - low), rel=0.05)


def test_every_silence_has_words_of_its_own() -> None:
    """Water below 5 cm has no cell in which a law acts: errors alone left as much in 100 % of no cases."""
    found = [Discovery(0.4, 65, (), {}), Discovery(0.001, 65, (), {}), Discovery(1.0, 0, (), {})]
    assert [one.alarmed for one in found] == [False, True, False]
    assert len({one.sentence for one in found}) == 3


@pytest.mark.slow
def test_with_nothing_hidden_no_law_is_named() -> None:
    """Three seeds; each names one by chance in at most 5 %."""
    for seed in (2, 6, 7):
        found = searched([], seed)
        assert found.laws == (), found.sentence


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "seed"),
    [
        ("law_viscosity_offset_step", 2),
        ("law_floor_along_part", 2),
        ("law_bank_along_part", 6),
        ("law_advection_offset_step", 2),
        ("law_advection_along_part", 2),
        ("law_advection_depth_power", 2),
    ],
)
def test_a_hidden_law_is_found(hidden: str, seed: int) -> None:
    """Its term and its quantity."""
    found = searched([hidden], seed)
    assert found.best is not None, found
    assert found.best.law.name.rsplit("_", 1)[0] == hidden.rsplit("_", 1)[0]
    assert found.product is None, found.product


@pytest.mark.slow
def test_a_law_that_changes_along_the_channel_is_a_product() -> None:
    hidden = ["law_viscosity_offset_step=-1.12", "law_viscosity_offset_step_by_along=-3"]
    found = searched(hidden, 2, fine=True)  # on larger cells errors alone leave as much in 1 % of cases
    assert found.best is not None, found
    assert found.best.law.subject == ("viscosity", "offset")
    assert found.product is not None, found
    assert found.product.found.law.name == f"{found.best.law.name}_by_along"
    low, high = found.product.found.interval95
    assert low < -3.0 < high


@pytest.mark.slow
def test_banks_smoother_in_fast_water() -> None:
    """The speed is in the set; depth and a listed law of depth leave the same trace, and the listed one goes first."""
    found = searched(["law_bank_speed_step"], 2)
    assert {law.law.term.name for law in found.laws} == {"bank"}
    assert "speed" in {law.law.quantity.name for law in found.laws}
    assert set(found.others) <= {"depth_dependent_bank", "bank_vegetation"}


@pytest.mark.slow
def test_a_listed_effect_is_called_by_its_name() -> None:
    found = searched(["bank_trend"], 2)
    assert found.best is None
    assert max(found.others, key=found.others.__getitem__) == "bank_trend"
    left_out = "law_bank_along_trend"
    assert left_out not in {law.law.name for law in found.laws}
