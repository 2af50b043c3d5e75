"""diagnosis.h5: what is written comes back exactly, and xarray reads it."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from vegglue.diagnosis import Diagnosis, Step, Suspect, Where, as_json
from vegglue.errors import InputError
from vegglue.store import read_diagnosis, write_diagnosis

HASH = "d" * 64
STATIONS = 6


def a_suspect(name: str, **changes: Any) -> Suspect:
    suspect = Suspect(
        name=name, title="Störung – größer als 0", unit="m2/s", amplitude=0.1 + 0.2, interval95=(-np.inf, 1 / 3),
        score=7.3, p_family=0.0002, visibility=0.9, smallest_detectable=0.05, testable=True, refitted=False,
        objective=210.0, mimicked_by="k_s", likeness=-0.4, shapes={},
    )  # fmt: skip
    return replace(suspect, **changes)


def a_diagnosis(**changes: Any) -> Diagnosis:
    """Two experiments, one section and a gauge each; an effect accepted, a rival, one rejected, one untestable."""
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
        steps=(Step("eddies", ("eddies", "mixing[D3]"), (("eddies", "mixing[D3]"),), 2300.5, 248.1, 0.0),),
        where=Where(33.0, -0.6, ("low", "high"), 0.4, 12.0), chi2_first=2300.5, chi2=5.1, freedom=3, p_misfit=0.2,
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


@pytest.mark.parametrize("diagnosis", [a_diagnosis(), NOTHING, a_diagnosis(where=None)])
def test_diagnosis_comes_back_as_it_went(tmp_path: Path, diagnosis: Diagnosis) -> None:
    write_diagnosis(tmp_path / "diagnosis.h5", diagnosis, "name: open-x\n", HASH)
    back = read_diagnosis(tmp_path / "diagnosis.h5", HASH)
    for field in fields(Diagnosis):
        one, other = getattr(diagnosis, field.name), getattr(back, field.name)
        assert type(one) is type(other), field.name
        if isinstance(one, pd.DataFrame):
            pd.testing.assert_frame_equal(other, one, check_column_type=False)
        elif isinstance(one, np.ndarray | float):
            np.testing.assert_array_equal(other, one)
        else:
            assert one == other
    assert as_json(back) == as_json(diagnosis)


def test_diagnosis_of_another_config_is_refused(tmp_path: Path) -> None:
    write_diagnosis(tmp_path / "diagnosis.h5", a_diagnosis(), "", HASH)
    with pytest.raises(InputError, match="run `vegglue diagnose CONFIG` again"):
        read_diagnosis(tmp_path / "diagnosis.h5", "e" * 64)
    with pytest.raises(InputError, match="run `vegglue diagnose CONFIG`"):
        read_diagnosis(tmp_path / "other.h5")


@pytest.mark.parametrize("diagnosis", [a_diagnosis(), NOTHING])
def test_xarray_opens_every_group_of_a_diagnosis(tmp_path: Path, diagnosis: Diagnosis) -> None:
    xarray = pytest.importorskip("xarray")
    write_diagnosis(tmp_path / "diagnosis.h5", diagnosis, "", HASH)
    for group in ("stations", "suspects", "zones", "places", "alike"):
        with xarray.open_dataset(tmp_path / "diagnosis.h5", group=group, engine="h5netcdf") as data:
            data.load()
            assert not any(name.startswith("phony") for name in data.sizes)
            if group == "stations":
                assert data["prediction_first"].dims == ("station",)
            if group == "alike":
                assert data["cosine"].values.tolist() == diagnosis.cosine.tolist()
