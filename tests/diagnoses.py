"""Diagnoses that tests of files, figures and the report share: small, with every standing an effect can have."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from vegglue.results.diagnosis import Diagnosis, Step, Suspect, Where

STATIONS = 6


def a_suspect(name: str, **changes: Any) -> Suspect:
    suspect = Suspect(
        name=name, title="Störung – größer als 0", unit="m2/s", amplitude=0.1 + 0.2, interval95=(-np.inf, 1 / 3),
        score=7.3, p_family=0.0002, visibility=0.9, smallest_detectable=0.05, testable=True, refitted=False,
        objective=210.0, mimicked_by="k_s", likeness=-0.4, shapes={}, off=0.0, scale=0.5,
    )  # fmt: skip
    return replace(suspect, **changes)


def a_diagnosis(**changes: Any) -> Diagnosis:
    """Two experiments, one section and a gauge each; an effect accepted, a rival, one less likely, one untestable."""
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
    names = ("eddies", "mixing[D3]", "wind")
    diagnosis = Diagnosis(
        name="open-x", verdict="one-of", sentence="Missing: eddies of 0.3 m²/s.", remarks=("Fehler zählen – doppelt.",),
        suspects=(
            a_suspect("eddies", refitted=True), a_suspect("mixing[D3]", refitted=True, shapes={"width": 0.1}),
            a_suspect("wind", testable=False, score=0.3, p_family=1.0), a_suspect("turning", score=-1.0, p_family=0.7),
        ),
        steps=(Step("eddies", ("eddies", "mixing[D3]"), (0.7, 0.28), (("eddies", "mixing[D3]"),), 2300.5, 248.1, 0.0),),
        not_excluded=(), where=Where(33.0, -0.6, ("low", "high"), 0.4, 12.0),
        chi2_first=2300.5, chi2=5.1, freedom=3, p_misfit=0.2,
        correlation=0.1, scale=1.0, grid_error=0.001, flagged=(1,), threshold=3.4,
        first_scores={"eddies": 45.2, "mixing[D3]": 43.0, "wind": 0.3, "turning": -1.0},
        first_parameters={"n_b": 0.035}, parameters={"n_b": (0.03, 0.02, 0.04)},
        zones=zones, station=station, prediction_first=random.random(STATIONS), prediction=random.random(STATIONS),
        error=np.array([0.01, 0.01, 0.002, 0.01, 0.01, np.nan]), map_x=np.repeat([30.0, 33.0, 36.0], 2),
        map_y=np.tile([-0.6, 0.6], 3), map_score=random.normal(size=6), cosine_names=names,
        cosine=np.array([[1, 0.96, 0.1], [0.96, 1, 0.2], [0.1, 0.2, 1]]), version="0.1.0",
    )  # fmt: skip
    return replace(diagnosis, **changes)


NOTHING = a_diagnosis(
    verdict="nothing-missing", suspects=(), steps=(), where=None, flagged=(), remarks=(), parameters={},
    first_scores={}, first_parameters={},
    zones=pd.DataFrame(), map_x=np.zeros(0), map_y=np.zeros(0), map_score=np.zeros(0), cosine_names=(),
    cosine=np.zeros((0, 0)), p_misfit=np.nan,
)  # fmt: skip
