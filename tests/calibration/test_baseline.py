"""A baseline, its point on coarse cells, and how long it is kept."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from built_models import model_of
from coarse_twin import coarse_twin
from linear_baseline import CASE_OF_TWINS, at_best, stations_of
from scipy.special import ndtr

from vegglue.arrays import Array
from vegglue.calibration import baseline
from vegglue.calibration.baseline import MOST_KEPT, PRIOR_POINTS, START_SPREAD, Baseline, kept_baseline, places_of_prior
from vegglue.calibration.fit import fit, objective
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.engine.interface import Model, Point, Wanted
from vegglue.measurements.observations import read_observations


@pytest.mark.parametrize("away", [0.0, 0.1])
def test_a_flow_on_coarse_cells_is_found_once_at_a_place(away: float, monkeypatch: pytest.MonkeyPatch) -> None:
    station, places = stations_of(CASE_OF_TWINS, ("A", "B"), 4), list[Array]()
    slope = np.zeros((len(station), len(CASE_OF_TWINS.parameters)))
    base = at_best(CASE_OF_TWINS, station, np.zeros(len(station)), slope)
    known = replace(base.fitted.point, z=base.fitted.point.z + away)

    def linearise(model: Model, z: Array, near: Point) -> Point:
        places.append(z)
        return replace(near, z=z)

    monkeypatch.setattr(baseline, "linearise", linearise)
    found = baseline.with_coarse_point(replace(base, coarse=base.model, on_coarse=known)).on_coarse
    assert found is not None
    assert np.array_equal(found.z, base.fitted.point.z)
    assert len(places) == (away > 0.0)


def test_where_coarse_cells_fit_best_fine_ones_may_have_no_flow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stream near the critical depth was refused then, though its own prior has flows."""
    model, _ = coarse_twin()
    real, refused = baseline.linearise_from, list[Array]()

    def none_at_first(of: Model, z: Array, near: Point | None) -> Point | None:
        if of is model and not refused:
            refused.append(z)
            return None
        return real(of, z, near)

    monkeypatch.setattr(baseline, "linearise_from", none_at_first)
    found = baseline.baseline(model)
    assert len(refused) == 1
    assert np.isfinite(found.fitted.chi2)


ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def model() -> Model:
    case = load_case(ROOT / "configs" / "twin.yaml")
    return model_of(case, read_observations(case))


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Model]:
    """The models that a baseline was computed of."""
    models: list[Model] = []

    def computed(model: Model) -> Any:
        models.append(model)
        return Baseline(model, SimpleNamespace(), SimpleNamespace(), None, None)  # type: ignore[arg-type]

    monkeypatch.setattr(baseline, "baseline", computed)
    monkeypatch.setattr(baseline, "_kept", type(baseline._kept)())
    return models


def named(model: Model, **changes: Any) -> Model:
    return replace(model, case=model.case.model_copy(update=changes))


def test_the_same_model_is_computed_once_whatever_it_is_called(model: Model, made: list[Model]) -> None:
    other = named(model, name="other", title="of another name")
    first, second = kept_baseline(model), kept_baseline(other)
    assert len(made) == 1
    assert second.fitted is first.fitted
    assert second.model.case.name == "other"


@pytest.mark.parametrize(
    "changed",
    [
        lambda model: replace(model, station=model.station.assign(value=model.station["value"] + 1e-9)),
        lambda model: replace(model, station=model.station.assign(used=False)),
        lambda model: replace(model, site=replace(model.site, bed=model.site.bed + 1e-9)),
        lambda model: named(model, eddy_viscosity=0.02),
        lambda model: named(model, model_error=model.case.model_error.model_copy(update={"friction": 0.5})),
        lambda model: named(model, parameters=dict(list(model.case.parameters.items())[:-1])),
    ],
)
def test_another_model_is_computed_by_itself(changed: Any, model: Model, made: list[Model]) -> None:
    kept_baseline(model)
    kept_baseline(changed(model))
    assert len(made) == 2


def test_codes_of_others_are_asked_each_time(model: Model, made: list[Model]) -> None:
    of_others = replace(model, engine=replace(model.engine, name="command"))
    with_file = named(model, effect_file=Path("own.py"))
    for one in (of_others, of_others, with_file, with_file):
        kept_baseline(one)
    assert len(made) == 4


def test_no_more_are_kept_than_a_case_and_its_child(model: Model, made: list[Model]) -> None:
    models = [named(model, eddy_viscosity=0.01 * (1 + k)) for k in range(MOST_KEPT + 1)]
    for one in [*models, models[0]]:
        kept_baseline(one)
    assert len(made) == MOST_KEPT + 2


@pytest.mark.parametrize("parameters", [1, 4, 9])
def test_places_of_the_prior_begin_in_its_middle_and_fill_each_axis(parameters: int) -> None:
    """With many parameters, too, they lie on both sides of the middle of each, in shares of their own."""
    places = places_of_prior(parameters)
    assert places.shape == (PRIOR_POINTS, parameters)
    assert not places[0].any()
    shares = np.sort(ndtr(places[1:] / START_SPREAD), axis=0)
    assert np.diff(shares, axis=0).min() > 0.99 / PRIOR_POINTS
    assert shares[0].max() < 0.2
    assert shares[-1].min() > 0.8
    assert np.unique(places, axis=0).shape == places.shape


def test_where_fits_end_in_different_minima_each_point_of_the_prior_is_a_start() -> None:
    """Wells of y = sin(4 z), the deeper the nearer to z = -1.2: the two best starts end in others than the deepest."""

    def at(z: Array) -> Point:
        prediction = np.array([0.05 * np.sin(4.0 * z[0]), 0.015 * (z[0] + 1.2), 0.5 * z[1]])
        return Point(z, prediction, np.array([[0.2 * np.cos(4.0 * z[0]), 0.0], [0.015, 0.0], [0.0, 0.5]]), {})

    def linearise(model: Any, z: Array, near: Point | None, wanted: Wanted) -> Point | None:
        return at(z) if wanted(at(z).prediction) else None

    station = pd.DataFrame({"experiment": "a", "kind": "level", "section": "", "x": 0.0, "y": 0.0,
                            "value": [0.0] * 3, "standard_error": 0.005, "used": True})  # fmt: skip
    model: Any = SimpleNamespace(
        engine=SimpleNamespace(linearise=linearise),
        names=("first", "second"),
        site=SimpleNamespace(bed=np.zeros((4, 5))),
    )
    noise = noise_of(station)
    starts = sorted([at(z) for z in places_of_prior(2)], key=lambda point: objective(noise, point))
    of_best = [fit(model, noise, start).objective for start in starts[: baseline.FITTED_POINTS]]
    found = baseline._best_from_prior(model, noise)
    assert objective(noise, found) < min(of_best) - baseline.ONE_MINIMUM
    assert found.z[0] == pytest.approx(-np.pi / 4.0, abs=0.05)
