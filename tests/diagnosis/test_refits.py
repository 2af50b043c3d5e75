"""Which of the refits are kept as rivals, in which groups, and the evidence of a refit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.stats
from coarse_twin import coarse_twin
from linear_baseline import CASE_OF_TWINS, at_best, linear_engine, measured_linearly, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, log_evidence, search_model
from vegglue.calibration.candidates import Candidate, start_with, with_effect
from vegglue.calibration.fit import covariance, fit
from vegglue.calibration.noise import noise_of
from vegglue.case.parameter_space import theta_at, z_of
from vegglue.diagnosis.competition import Hypothesis, chances_of
from vegglue.diagnosis.odds import tempering
from vegglue.diagnosis.refits import RefitTrial, pruned, refits_of
from vegglue.diagnosis.search_state import rivals_among
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, Wanted, always, linearise
from vegglue.progress import silent

Kept = tuple[dict[str, float], tuple[tuple[str, ...], ...]]


def kept(fall: list[float], alike: dict[tuple[int, int], float]) -> Kept:
    """Of refits a, b, c, ... that lower the objective by `fall`; alike: cosines of traces, else 0."""
    cosine = np.eye(len(fall))
    for (i, j), value in alike.items():
        cosine[i, j] = cosine[j, i] = value
    chance = chances_of([Hypothesis("effect", "abcdef"[j], 0.5 * one, j, None) for j, one in enumerate(fall)])
    return rivals_among("abcdef"[: len(fall)], chance, cosine)


def test_what_is_clearly_best_stands_alone() -> None:
    assert kept([40.0, 15.0, 5.0], {})[1] == (("a",),)
    assert kept([12.0], {}) == ({"a": 1.0}, (("a",),))


def test_what_leaves_the_same_trace_is_one_group() -> None:
    chance, groups = kept([30.0, 29.0, 26.0], {(0, 1): 0.95})
    assert groups == (("a", "b"), ("c",))
    assert list(chance) == ["a", "b", "c"]
    assert sum(chance.values()) == pytest.approx(1.0)


def test_what_fits_far_worse_is_no_company_for_its_trace() -> None:
    assert kept([60.0, 20.0], {(0, 1): 0.98})[1] == (("a",),)


def test_many_unlikely_ones_are_kept_until_the_set_holds_its_share() -> None:
    chance, groups = kept([12.0] + 5 * [4.8], {})
    assert chance["a"] < 0.95
    assert sum(chance.values()) >= 0.95
    assert len(groups) == 5


def test_of_less_than_all_chances_the_set_holds_its_share_of_what_effects_have() -> None:
    """Where a place has the other half of the chances, 95 % of a half are enough."""
    chance, groups = rivals_among("ab", np.array([0.49, 0.01]), np.eye(2))
    assert groups == (("a",),)
    assert chance == {"a": 0.49}


@pytest.mark.parametrize(("errors_away", "dropped"), [(0.5, True), (1.5, True), (3.0, False), (8.0, False)])
@pytest.mark.parametrize("name", ["edge_mixing", "discharge_error"])
def test_what_the_data_no_longer_need_is_dropped(name: str, errors_away: float, dropped: bool) -> None:
    """Also where it has one sign only: its prior ends at off, so that it seemed to be far from there always."""
    effect = library(None)[name]
    one = Candidate(effect, experiments=("low",) if effect.name == "discharge_error" else ())
    case = with_effect(CASE_OF_TWINS, one, {shape.name: shape.default for shape in effect.shapes})
    station, z, step = stations_of(case, ("A", "B"), 4), np.zeros(len(case.parameters)), 1e-4
    z[-1] = z_of(case.parameters[one.parameter], effect.amplitude.at(0.2 * effect.amplitude.plausible_gain))
    beside = theta_at(case, z + np.outer([-step, 0.0, step], np.arange(z.size) == z.size - 1))[one.parameter]
    before, gain, after = (effect.amplitude.gain(float(value)) for value in beside)
    slope = np.zeros((len(station), z.size))
    # So much of the gain is one error of the data: with residuals of zero they want what there is.
    slope[0, -1] = 0.01 * errors_away / gain * (after - before) / (2.0 * step)
    engine = linear_engine(lambda model: (np.zeros(len(station)), slope[:, : len(model.names)]))
    base = at_best(case, station, slope @ z, slope, engine)
    point = replace(base.fitted.point, z=z, prediction=slope @ z)
    fitted = replace(base.fitted, point=point, covariance=covariance(base.noise, point))
    left, names = pruned(replace(base, fitted=fitted), [one.name], silent)
    assert names == [one.name] * dropped
    assert (one.key in left.model.case.effects) != dropped


def test_chances_are_those_of_the_evidence_where_little_is_explained() -> None:
    """Odds e^1, but for fingerprints that may be wrong."""
    chance = chances_of([Hypothesis("effect", name, size, 0, None) for name, size in (("a", 1.0), ("b", 0.0))])
    assert chance.sum() == pytest.approx(1.0)
    assert chance[0] / chance[1] == pytest.approx(np.e, rel=0.01)
    assert tempering(np.array([-5.0, 0.0])) == pytest.approx(1.0)


def test_long_traces_may_be_wrong_and_prove_less() -> None:
    """With 15 % of error, evidence of 800 counts w = 37 times less: 37 more are odds of e^1."""
    chance = chances_of([Hypothesis("effect", name, size, 0, None) for name, size in (("a", 800.0), ("b", 763.0))])
    assert chance[0] / chance[1] == pytest.approx(np.e, rel=0.1)
    ratios = [a / b for b, a in pairwise(tempering(np.array([0.0, 10.0, 100.0, 1000.0])))]
    assert all(ratio > 1.0 for ratio in ratios)


def test_chances_do_not_hang_on_the_order() -> None:
    made = [Hypothesis("effect", name, size, 0, None) for name, size in (("a", 3.0), ("b", 9.0), ("c", -4.0))]
    assert chances_of(made[::-1])[::-1] == pytest.approx(chances_of(made))


@pytest.mark.parametrize("columns", [1, 3, 4])
def test_the_evidence_of_a_linear_model_is_that_of_its_gaussian(columns: int) -> None:
    """ln N(y; 0, C + J J'): Laplace's approximation is exact there, whatever the parameters."""
    slope, values = measured_linearly(("A", "B"), 4, columns)
    station = stations_of(CASE_OF_TWINS, ("A", "B"), 4)
    base = at_best(CASE_OF_TWINS, station, values, slope)
    covariance = np.diag(station["standard_error"].to_numpy() ** 2) + slope @ slope.T
    density = scipy.stats.multivariate_normal(np.zeros(len(values)), covariance).logpdf(values)
    assert log_evidence(base) - 0.5 * len(values) * np.log(2.0 * np.pi) == pytest.approx(density)


def test_a_parameter_that_changes_nothing_costs_nothing() -> None:
    slope, values = measured_linearly(("A",), 5, 3)
    station = stations_of(CASE_OF_TWINS, ("A",), 5)
    idle = np.hstack([slope, np.zeros((len(slope), 1))])
    found = [log_evidence(at_best(CASE_OF_TWINS, station, values, one)) for one in (slope, idle)]
    assert found[1] == pytest.approx(found[0])


def test_a_parameter_that_explains_nothing_is_charged() -> None:
    slope, values = measured_linearly(("A",), 5, 2)
    station = stations_of(CASE_OF_TWINS, ("A",), 5)
    basis = np.linalg.qr(np.column_stack([slope, values]))[0]
    other = np.random.default_rng(9).standard_normal((len(slope), 1))
    other = 0.05 * (other - basis @ (basis.T @ other))
    found = [log_evidence(at_best(CASE_OF_TWINS, station, values, one)) for one in (slope, np.hstack([slope, other]))]
    length = float(np.sum((other / 0.01) ** 2))
    assert found[1] - found[0] == pytest.approx(-0.5 * np.log1p(length)), "Occam's factor"


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_of_all_starts_the_best_end_counts(order: tuple[int, ...]) -> None:
    """One starts where no flow is found, one where predictions are off, one beyond amplitudes of 1."""
    station, one = stations_of(CASE_OF_TWINS, ("A",), 4), Candidate(library(None)["viscosity"])
    count, parameters = len(station), len(CASE_OF_TWINS.parameters)
    slope = 0.01 * np.random.default_rng(3).standard_normal((count, parameters + 1))
    values = np.full(count, 0.4)

    def linearised(model: Model, z: Array, _: Point | None = None, wanted: Wanted = always) -> Point | None:
        amplitude = z[-1] if z.size > parameters else 0.0
        prediction = values + 0.03 * (amplitude < 1.0) + slope[:, : z.size] @ z
        return Point(z, prediction, slope[:, : z.size], {}) if amplitude > -1.0 and wanted(prediction) else None

    engine = replace(linear_engine(lambda _: None), linearise=linearised)
    base = at_best(CASE_OF_TWINS, station, values, slope[:, :parameters], engine)
    found = linearised(base.model, np.zeros(parameters))
    assert found is not None
    starts = tuple(np.append(np.zeros(parameters), (-8.0, 0.5, 1.5)[k]) for k in order)
    search = search_model(replace(base, fitted=replace(base.fitted, point=found)))
    (refit,) = refits_of(search, [RefitTrial(one, {}, starts)])
    assert refit is not None
    assert refit.fitted.point.z[-1] > 1.0
    (none,) = refits_of(search, [RefitTrial(one, {}, starts[:0])])
    assert none is None
    just, more = (RefitTrial(one, {}, starts, refit.log_factor + short) for short in (-0.1, 0.1))
    again, useless = refits_of(search, [just, more])
    assert again is not None
    assert again.log_factor == refit.log_factor
    assert useless is None


@pytest.mark.slow
def test_an_inflow_that_is_not_developed_is_calibrated_in_all_its_modes() -> None:
    """Four modes, of which the first is the amplitude of the hypothesis."""
    model, point = coarse_twin()
    one, skew = (Candidate(library(None)[name]) for name in ("inflow_distribution", "inflow_skew"))
    modes = {"excess": 0.5, "first_other": -0.3, "second_other": 0.0, "third_other": 0.6}
    case = with_effect(model.case, one, {"mode": 1.0})
    z = np.append(point.z, [z_of(case.parameters[f"{one.key}_{name}"], value) for name, value in modes.items()])
    there = linearise(replace(model, case=case), z, point)
    assert there is not None
    model = replace(model, station=model.station.assign(value=there.prediction))
    noise = noise_of(model.station)
    search = search_model(Baseline(model, noise, fit(model, noise, point), None, None))
    tried = ((one, {"mode": 1.0}), (skew, dict[str, float]()))
    refit, of_skew = refits_of(
        search, [RefitTrial(of, shapes, (start_with(of, search.point.z, 0.1),)) for of, shapes in tried]
    )
    assert refit is not None
    assert of_skew is not None
    assert refit.amplitude == pytest.approx(0.5, abs=0.1)
    assert refit.log_factor > of_skew.log_factor + 10.0
    case = with_effect(search.model.case, one, {"mode": 1.0})
    found = theta_at(case, refit.fitted.point.z)
    assert float(found["inflow_distribution_third_other"][0]) == pytest.approx(0.6, abs=0.15)
