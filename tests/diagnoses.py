"""Diagnoses that tests of files, figures and the report share: small, with every standing an effect can have."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from vegglue.measurements.plausibility import ImplausibleValues, Symptom
from vegglue.results.causes import (
    AmplitudeEstimate,
    CandidateEffect,
    CandidateLaw,
    CandidateLaws,
    Detectability,
    FaultyInstrument,
    FieldFound,
    LocalAnomaly,
    ModelErrorUsed,
    PatchOutline,
    PlaceMap,
    Rival,
    ScoreTest,
    Step,
)
from vegglue.results.diagnosis import Diagnosis, FirstScreening, Misfit, ParameterEstimates, Predictions
from vegglue.results.verdict import (
    ChiSquare,
    EffectFound,
    EffectsTested,
    EstimatedErrors,
    LawStandsOut,
    NeighboursCorrelated,
    Verdict,
)

STATIONS = 6
PARTS = ("verdict", "misfit", "errors", "first_screening", "parameters", "predictions", "place_map")
PARTS_OF_CANDIDATE = ("amplitude", "test", "detectability")


def changed(whole: Any, parts: tuple[str, ...], changes: dict[str, dict[str, Any]]) -> Any:
    """The value with some fields of some of its parts replaced: changes = {part: {field: value}}."""
    assert set(changes) <= set(parts)
    return replace(whole, **{part: replace(getattr(whole, part), **fields) for part, fields in changes.items()})


def a_candidate_effect(name: str, shapes: dict[str, float] | None = None, **parts: dict[str, Any]) -> CandidateEffect:
    """parts: fields to be changed, e.g. test={"score": 0.3}."""
    candidate_effect = CandidateEffect(
        name=name, title="Störung – größer als 0", shapes=shapes or {},
        amplitude=AmplitudeEstimate(
            value=0.1 + 0.2, interval95=(-np.inf, 1 / 3), unit="m2/s", off=0.0, scale=0.5, refitted=False,
            objective=210.0, support=(-8.0, 9.0),
        ),
        test=ScoreTest(score=7.3, p_family=0.0002),
        detectability=Detectability(visibility=0.9, smallest=0.05, testable=True, confounder="k_s", cosine=-0.4),
    )  # fmt: skip
    return changed(candidate_effect, PARTS_OF_CANDIDATE, parts)


def an_anomaly(**fields: Any) -> LocalAnomaly:
    """Of more drag at x = 33.0, y = -0.6 m; fields: to be changed."""
    usual = LocalAnomaly(
        x=33.0, y=-0.6, length=1.8, width=0.45, term="drag", effect="unlisted_object", amplitude=0.4,
        interval95=(0.3, 0.5), unit="1/m", score=12.0, experiments=("low", "high"), odds={"eddies": 30.0, "bed": 4.0},
        plausible=1.0,
    )  # fmt: skip
    return replace(usual, **fields)


def a_patch(angle: float = -15.0, **fields: Any) -> LocalAnomaly:
    """Plants that are not on the map, so many degrees off x; fields: to be changed."""
    outline = PatchOutline(
        angle=angle, height=0.9, proportional=0.0, length_error=0.6, width_error=0.2, angle_error=4.0, like="reeds"
    )
    usual = an_anomaly(
        effect="unlisted_patch", length=3.0, width=1.25, unit="-", amplitude=4.0, interval95=(3.0, 5.5), plausible=5.0,
        x_error=0.8, y_error=0.15, outline=outline,
    )  # fmt: skip
    return replace(usual, **fields)


def an_instrument(**fields: Any) -> FaultyInstrument:
    """One reading of velocity that is off, at x = 36.0, y = 1.0 m; fields: to be changed."""
    usual = FaultyInstrument(
        kind="reading", x=36.0, y=1.0, stations=(1,), offset=0.1, interval95=(0.08, 0.12), unit="m/s", log_factor=9.5
    )
    return replace(usual, **fields)


def a_field(**fields: Any) -> FieldFound:
    """Of friction; fields: to be changed."""
    usual = FieldFound(
        term="friction", size=0.4, length=7.5, width=1.5, log_factor=40.5, value=0.6, error=0.1, x=31.0, y=0.5
    )
    return replace(usual, **fields)


def an_effect_found(name: str = "eddies", **fields: Any) -> EffectFound:
    """Of 0.3 m2/s with one rival; fields: to be changed."""
    rival = Rival("mixing[D3]", "effect", 0.28)
    return replace(EffectFound(name, "Störung – größer als 0", 0.3, (0.2, 0.4), "m2/s", 0.7, (), (rival,)), **fields)


# Values that no flow can have, which a verdict doubts before all else.
IMPLAUSIBLE = ImplausibleValues(
    "velocity", "probe", "m/s", Symptom.FAST, "cm/s", 98.0, 2, 2, (41.0, 36.0, -1.0), (("low", "D3"),)
)


def candidate_laws_of(*names: str, **fields: Any) -> CandidateLaws:
    """Laws of the speed on the banks, of these names and chances that fall by half; fields: to be changed."""
    laws = tuple(
        CandidateLaw(
            name=name, term="friction of the banks", quantity="the speed",
            title="Friction of the banks changes at one value of the speed", equation="k -> k exp(a g)",
            reference=0.4, scale=0.5, strength=-0.8, chance=0.5 ** (number + 1),
        )
        for number, name in enumerate(names)
    )  # fmt: skip
    return replace(CandidateLaws(p=1 / 3001, tried=65, chance=sum(one.chance for one in laws), laws=laws), **fields)


def a_diagnosis(
    candidate_effects: tuple[CandidateEffect, ...] | None = None,
    steps: tuple[Step, ...] | None = None,
    **parts: dict[str, Any],
) -> Diagnosis:
    """Two experiments, one section and a gauge each; an effect accepted, a rival, one less likely, one untestable.

    parts: fields to be changed, e.g. verdict={"kind": "identified"}.
    """
    random = np.random.default_rng(3)
    station = pd.DataFrame({
        "experiment": ["low"] * 3 + ["high"] * 3, "kind": ["velocity", "velocity", "level"] * 2,
        "section": ["D3", "D3", ""] * 2, "x": [36.0, 36.0, 60.0] * 2, "y": [-1.0, 1.0, 0.0] * 2,
        "value": [0.4, 0.5, 1.2, 0.6, 0.7, np.nan], "standard_error": [0.01, 0.01, 0.002] * 2,
        "used": [True] * 5 + [False], "reason": [""] * 5 + ["the gauge was dry"], "depth": np.nan, "device": "",
    })  # fmt: skip
    zones = pd.DataFrame({
        "experiment": ["low", "low", "high"], "section": ["D3", "gauges", "D3"], "zone": ["floor", "level", "edge"],
        "stations": [2, 1, 2], "mean": [0.02, -0.001, np.nan], "standard_error": [0.004, 0.002, 0.004],
        "chi2": [11.0, 0.3, 2.0],
    })  # fmt: skip
    refitted = {"refitted": True}
    usual = (
        a_candidate_effect("eddies", amplitude=refitted),
        a_candidate_effect("mixing[D3]", {"width": 0.1}, amplitude=refitted),
        a_candidate_effect("wind", test={"score": 0.3, "p_family": 1.0}, detectability={"testable": False}),
        a_candidate_effect("turning", test={"score": -1.0, "p_family": 0.7}),
    )
    step = Step(
        "eddies", ("eddies", "mixing[D3]"), (0.7, 0.28), (("eddies", "mixing[D3]"),), 2300.5, 248.1, 0.0, {"bed": 0.02},
        {"bed": an_anomaly(term="bed", unit="m")},
    )  # fmt: skip
    diagnosis = Diagnosis(
        name="open-x", version="0.1.0", candidate_effects=usual if candidate_effects is None else candidate_effects,
        steps=(step,) if steps is None else steps,
        verdict=Verdict(
            "one-of", ChiSquare(5.1, 3, 0.2), (an_effect_found(),), (an_anomaly(),), tested=EffectsTested(3, 4, 3),
            notes=(NeighboursCorrelated(0.1), LawStandsOut(candidate_laws_of("law_bank_speed_step"), ("eddies",))),
        ),
        misfit=Misfit(chi2_first=2300.5, chi2=5.1, freedom=3, p=0.2, zones=zones),
        errors=EstimatedErrors(correlation=0.1, scale=1.0, grid_error=0.001, flagged=(1,)),
        predictions=Predictions(
            station, first=random.random(STATIONS), last=random.random(STATIONS),
            error=np.array([0.01, 0.01, 0.002, 0.01, 0.01, np.nan]),
        ),
        place_map=PlaceMap(
            "drag", np.repeat([30.0, 33.0, 36.0], 2), np.tile([-0.6, 0.6], 3), random.normal(size=6)
        ),
        first_screening=FirstScreening(
            3.4, {"eddies": 45.2, "mixing[D3]": 43.0, "wind": 0.3, "turning": -1.0}, ("eddies", "mixing[D3]", "wind"),
            cosine=np.array([[1, 0.96, 0.1], [0.96, 1, 0.2], [0.1, 0.2, 1]]),
        ),
        parameters=ParameterEstimates({"n_b": 0.035}, {"n_b": (0.03, 0.02, 0.04)}),
        places=(an_anomaly(),), instruments=(an_instrument(),), model_error=ModelErrorUsed(0.05, 0.01, 0.5, 1.25),
    )  # fmt: skip
    return changed(diagnosis, PARTS, parts)


SOUND = {"kind": "nothing-missing", "effects": (), "places": (), "notes": (), "clears_the_model": True}
NOTHING = a_diagnosis(
    candidate_effects=(), steps=(), verdict=SOUND,
    misfit={"zones": pd.DataFrame(), "p": np.nan}, errors={"flagged": ()}, parameters={"first": {}, "last": {}},
    first_screening={"scores": {}, "compared": (), "cosine": np.zeros((0, 0))},
    place_map={"x": np.zeros(0), "y": np.zeros(0), "score": np.zeros(0)},
)  # fmt: skip
NOTHING = replace(NOTHING, places=(), instruments=(), model_error=None)
NO_LOCATION = replace(a_diagnosis(verdict={"places": ()}), places=(), instruments=(), model_error=None)
# A field and places of other terms, and instruments that stood at no one place.
EVERY_KIND = replace(
    a_diagnosis(verdict={"kind": "none-of-these", "field": a_field()}, place_map={"term": "inflow"}),
    places=(
        an_anomaly(term="inflow", effect="unlisted_inflow", unit="m3/s"),
        an_anomaly(term="bed", odds={}),
        a_patch(),
    ),
    instruments=(an_instrument(), an_instrument(kind="probe", x=np.nan, stations=(0, 3), interval95=(-np.inf, 0.2))),
    field=a_field(),
    laws=candidate_laws_of("law_bank_speed_step", "law_bank_speed_ramp"),
)
