"""GLUE against a linear model with Gaussian errors, whose posterior is known in closed form."""

import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from vegglue.case.config import load_case
from vegglue.case.parameter_space import quantile, sample_prior
from vegglue.case.schema import CanopyCorrection, Case, Parameter
from vegglue.effects.plant_laws import baptist_chezy
from vegglue.errors import InputError
from vegglue.flow.status import FAILED
from vegglue.inference.glue import glue
from vegglue.inference.posterior_summary import correct_phi_for_canopy, marginals, prior_mass_near_bounds
from vegglue.inference.statements import (
    CanopyCorrected,
    NoPosteriorClaimed,
    ParameterAtBound,
    ParameterNotIdentified,
    ParametersCorrelated,
    posterior_statements,
)
from vegglue.measurements.observations import Observations
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import LEVELS, Posterior

MEMBERS = 32768
SIGMA = 0.08
DESIGN = np.array([[1.0, 0.0, 0.2], [0.0, 1.0, 0.3], [1.0, 1.0, 0.0], [0.5, -0.5, 1.0], [0.2, 0.4, 1.0]])
TWICE = np.vstack([DESIGN, DESIGN])  # enough readings of a kind for their errors to come from the residual
TRUTH = np.array([0.5, 0.4, 0.2])  # a, b and log10 of c


def a_case(**infer: object) -> Case:
    priors = {
        "a": {"distribution": "uniform", "low": 0, "high": 1, "unit": "m"},
        "b": {"distribution": "uniform", "low": 0, "high": 1, "unit": "m"},
        "c": {"distribution": "loguniform", "low": 0.1, "high": 10, "unit": "-"},
    }
    return Case.model_validate({
        "source": Path("toy.yaml"), "name": "toy", "grid": {"x": [0, 10], "y": [0, 10], "cell": [1, 1]},
        "bed": [{"trapezoid": {"axis": 5, "bottom_width": 3, "bank_slope": 1, "bed_slope": 0, "level": 0}}],
        "friction": {"classes": {"bed": {"law": "manning", "n": "a"}}, "default": "bed"},
        "plants": {"stands": {"willow": {"phi": "c", "canopy_height": 0.8}}},
        "inflows": {"upstream": {"side": "west"}}, "experiments": {"E": {"discharge": {"upstream": 1}, "level": 1}},
        "parameters": priors, "infer": infer,
    })  # fmt: skip


def stations(value: np.ndarray, standard_error: float = math.nan, kind: object = "velocity") -> pd.DataFrame:
    count = len(value)
    return pd.DataFrame({
        "experiment": "E", "kind": kind, "section": "S", "x": np.arange(count) + 0.5, "y": 1.5, "value": value,
        "standard_error": standard_error, "used": True, "reason": "", "depth": math.nan, "device": "",
    })  # fmt: skip


def seen(parameters: dict[str, np.ndarray]) -> np.ndarray:
    return np.transpose([parameters["a"], parameters["b"], np.log10(parameters["c"])])


def an_ensemble(case: Case, table: pd.DataFrame, design: np.ndarray = DESIGN, members: int = MEMBERS) -> Ensemble:
    parameters = sample_prior(case.parameters, members, seed=7)
    nothing = np.zeros(members)
    return Ensemble(
        parameters=parameters, prediction=seen(parameters) @ design.T, status=np.zeros(members, np.int8),
        reason=np.full(members, "", object), iterations=np.zeros(members, np.int32), mass_error=nothing,
        seconds=nothing, section_flow=np.zeros((members, 1, 1)), station=table, experiments=("E",),
        sections=(("S", 0.5),),
        config="name: toy", config_hash="0" * 64, seed=7, version="0",
    )  # fmt: skip


def observed(table: pd.DataFrame) -> Observations:
    others: dict[str, Any] = {field.name: {} for field in fields(Observations) if field.name != "table"}
    return Observations(table=table, **others)


def infer(
    table: pd.DataFrame,
    design: np.ndarray = DESIGN,
    members: int = MEMBERS,
    failed: tuple[int, ...] = (),
    **settings: object,
) -> Posterior:
    case = a_case(**settings)
    ensemble = an_ensemble(case, table, design, members)
    for member in failed:
        ensemble.prediction[member] = math.nan
        ensemble.status[member] = FAILED
    return glue(ensemble, case, observed(table))


def measured(seed: int = 3, design: np.ndarray = DESIGN) -> np.ndarray:
    return design @ TRUTH + SIGMA * np.random.default_rng(seed).standard_normal(len(design))


def closed_form(value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    covariance = SIGMA**2 * np.linalg.inv(DESIGN.T @ DESIGN)
    return covariance @ DESIGN.T @ value / SIGMA**2, covariance


@pytest.fixture(scope="module")
def toy() -> Posterior:
    return infer(stations(measured(), SIGMA), sigma="known")


def test_moments_are_those_of_the_closed_form(toy: Posterior) -> None:
    mean, covariance = closed_form(measured())
    sd = np.sqrt(np.diag(covariance))
    got = np.array([toy.marginals.median["a"], toy.marginals.median["b"], toy.marginals.log10_median["c"]])
    spread = np.array([toy.marginals.sd["a"], toy.marginals.sd["b"], toy.marginals.log10_sd["c"]])
    # Of a mean, in standard deviations; a median has 1.25 times that.
    error = 1 / math.sqrt(toy.weighting.effective_size)
    assert np.all(np.abs(got - mean) < 3 * 1.25 * error * sd)
    assert np.all(np.abs(spread / sd - 1) < 3 * error / math.sqrt(2))
    normal = np.array([-1.95996, -0.67449, 0, 0.67449, 1.95996])
    assert toy.marginals.quantiles["a"] == pytest.approx(mean[0] + sd[0] * normal, abs=5 * error * sd[0])


def test_correlation_is_that_of_the_closed_form(toy: Posterior) -> None:
    covariance = closed_form(measured())[1]
    sd = np.sqrt(np.diag(covariance))
    assert toy.marginals.correlation == pytest.approx(
        covariance / np.outer(sd, sd), abs=3 / math.sqrt(toy.weighting.effective_size)
    )


def test_effective_size_of_independent_parameters() -> None:
    sd = np.array([0.06, 0.09, 0.2])
    design = SIGMA * np.diag(1 / sd)
    posterior = infer(stations(design @ TRUTH, SIGMA), design, sigma="known")
    expected = MEMBERS * np.prod(2 * math.sqrt(math.pi) * sd / np.array([1.0, 1.0, 2.0]))
    assert posterior.weighting.effective_size == pytest.approx(expected, rel=0.05)


def test_model_band_is_that_of_the_closed_form_and_total_adds_the_error(toy: Posterior) -> None:
    mean, covariance = closed_form(measured())
    sd = np.sqrt(np.diag(DESIGN @ covariance @ DESIGN.T))
    tolerance = 5 * sd.max() / math.sqrt(toy.weighting.effective_size)
    for level, normal in zip(LEVELS, (-1.95996, -0.67449, 0.0, 0.67449, 1.95996), strict=True):
        row = LEVELS.index(level)
        assert toy.predicted.model_band[row] == pytest.approx(DESIGN @ mean + normal * sd, abs=tolerance)
        assert toy.predicted.total_band[row] == pytest.approx(
            DESIGN @ mean + normal * np.hypot(sd, SIGMA), abs=tolerance
        )


def test_draws_and_predictive_agree_with_the_weights(toy: Posterior) -> None:
    mean = float(np.sum(toy.sample.weights * toy.sample.theta["a"]))
    assert toy.sample.theta["a"][toy.predicted.draws].mean() == pytest.approx(mean, abs=0.1 * toy.marginals.sd["a"])
    spread = toy.predicted.predictive.reshape(-1, len(DESIGN)).std(axis=0)
    assert spread == pytest.approx((toy.predicted.total_band[-1] - toy.predicted.total_band[0]) / 3.92, rel=0.06)


def test_same_input_gives_the_same_numbers(toy: Posterior) -> None:
    again = infer(stations(measured(), SIGMA), sigma="known")
    assert np.array_equal(again.predicted.predictive, toy.predicted.predictive)
    assert np.array_equal(again.predicted.draws, toy.predicted.draws)


def test_sigma_is_the_residual_of_the_best_member() -> None:
    table = stations(measured(design=TWICE))
    posterior = infer(table, TWICE)
    square = np.mean((table["value"].to_numpy() - posterior.sample.prediction) ** 2, axis=1)
    assert posterior.sample.best == np.argmin(square)
    assert posterior.fit.sigma == {"velocity": pytest.approx(math.sqrt(square.min()))}
    assert posterior.fit.best_rmse == posterior.fit.sigma
    ratio = posterior.sample.weights[10] / posterior.sample.weights[posterior.sample.best]
    assert ratio == pytest.approx(math.exp(-0.5 * len(table) * (square[10] / square.min() - 1)))
    assert math.isnan(posterior.fit.chi2)


def test_each_kind_of_measurement_has_its_own_sigma() -> None:
    design = np.vstack([TWICE, TWICE])
    posterior = infer(stations(measured(design=design), kind=["velocity"] * 10 + ["level"] * 10), design)
    residual = measured(design=design) - posterior.sample.prediction[posterior.sample.best]
    assert posterior.fit.sigma["velocity"] == pytest.approx(math.sqrt(np.mean(residual[:10] ** 2)))
    assert posterior.fit.sigma["level"] == pytest.approx(math.sqrt(np.mean(residual[10:] ** 2)))
    assert posterior.fit.noise.tolist() == [posterior.fit.sigma["velocity"]] * 10 + [posterior.fit.sigma["level"]] * 10


@pytest.mark.parametrize(("stated", "error"), [(0.004, 0.004), (math.nan, 0.003)])
def test_one_gauge_does_not_take_all_the_weight(stated: float, error: float) -> None:
    """The size of its error is that stated, or the usual one: a member passes through one reading."""
    velocities = stations(measured(design=TWICE))
    gauge = stations(0.05 * TRUTH[:1], stated, "level")
    posterior = infer(pd.concat([velocities, gauge], ignore_index=True), np.vstack([TWICE, [0.05, 0.0, 0.0]]))
    assert posterior.fit.sigma["level"] == error
    alone = infer(velocities, TWICE)
    assert posterior.fit.sigma["velocity"] == pytest.approx(alone.fit.sigma["velocity"], rel=0.1)
    assert posterior.weighting.effective_size > 0.2 * alone.weighting.effective_size


def test_unused_stations_have_bands_but_no_say(toy: Posterior) -> None:
    table = pd.concat([stations(measured(), SIGMA), stations(np.array([99.0]), SIGMA)], ignore_index=True)
    table["used"] = [True] * 5 + [False]
    posterior = infer(table, np.vstack([DESIGN, [1, 0, 0]]), sigma="known")
    assert posterior.sample.weights == pytest.approx(toy.sample.weights)
    assert posterior.fit.used == 5
    assert posterior.predicted.model_band[2, 5] == pytest.approx(posterior.marginals.median["a"])
    assert np.isnan(posterior.sample.log_likelihood[:, 5]).all()


def test_failed_members_have_no_weight_and_are_counted() -> None:
    whole = infer(stations(measured(), SIGMA), sigma="known")
    posterior = infer(stations(measured(), SIGMA), failed=(whole.sample.best, 11), sigma="known")
    assert (posterior.sample.failed, posterior.sample.members) == (2, MEMBERS)
    assert posterior.sample.weights[[whole.sample.best, 11]].tolist() == [0, 0]
    assert posterior.sample.weights.sum() == pytest.approx(1)
    assert np.isfinite(posterior.predicted.model_band).all()
    assert posterior_statements(posterior)[0].failed == 2


def test_chi2_against_known_errors() -> None:
    table = stations(measured(), SIGMA)
    posterior = infer(table, sigma="known")
    residual = table["value"].to_numpy() - posterior.sample.prediction[posterior.sample.best]
    assert posterior.fit.chi2 == pytest.approx(np.sum((residual / SIGMA) ** 2))


def test_efficiency_as_weight_and_threshold() -> None:
    table = stations(measured())
    posterior = infer(table, likelihood="nse", behavioural=0.7)
    value = table["value"].to_numpy()
    efficiency = 1 - np.sum((value - posterior.sample.prediction) ** 2, axis=1) / np.sum((value - value.mean()) ** 2)
    expected = np.where(efficiency >= 0.7, efficiency, 0)
    assert posterior.sample.efficiency == pytest.approx(efficiency)
    assert posterior.sample.weights == pytest.approx(expected / expected.sum())
    assert posterior.weighting.weighed == np.sum(efficiency >= 0.7)
    assert infer(table, likelihood="nse").sample.weights.min() == 0


def test_inverse_error_variance_as_weight() -> None:
    table = stations(measured())
    posterior = infer(table, likelihood="inverse-variance", behavioural=0.5)
    square = np.sum((table["value"].to_numpy() - posterior.sample.prediction) ** 2, axis=1)
    kept = posterior.sample.efficiency >= 0.5
    assert posterior.sample.weights[kept] == pytest.approx(1 / square[kept] / np.sum(1 / square[kept]))
    assert not posterior.sample.weights[~kept].any()


ONE_UNSTATED = stations(measured(), SIGMA).assign(standard_error=[SIGMA, SIGMA, math.nan, SIGMA, SIGMA])
# Of the ensemble of `infer` with ten stations, what member 5 predicts.
PERFECT = an_ensemble(a_case(), stations(measured(design=TWICE)), TWICE).prediction[5]


@pytest.mark.parametrize(
    ("table", "settings", "names"),
    [
        (stations(measured()), {"likelihood": "nse", "behavioural": 1.5}, r"infer\.behavioural: .* 1\.5, "),
        # No threshold is set: the message names the likelihood.
        (stations(measured() + 100.0), {"likelihood": "nse"}, r"infer\.likelihood: nse .* 0, the best has -\d"),
        (ONE_UNSTATED, {"sigma": "known"}, r"1 value of velocity.* x = 2\.5"),
        (stations(PERFECT), {"design": TWICE}, "observations: .* velocity .*known"),
        (stations(measured()).assign(used=False), {}, "observations: .*check"),
        (stations(measured()), {"members": 16, "failed": tuple(range(16))}, "ensemble: .* 16 "),
        (stations(np.full(5, 0.3)), {"likelihood": "nse"}, "observations: .*gaussian"),
    ],
)
def test_what_cannot_be_weighed_is_refused(table: pd.DataFrame, settings: dict[str, Any], names: str) -> None:
    with pytest.raises(InputError, match=names):
        infer(table, **settings)


def test_other_stations_than_simulated_are_refused() -> None:
    case, table = a_case(), stations(measured())
    with pytest.raises(InputError, match=r"observations: .* 5 .* 5 .*simulate"):
        glue(an_ensemble(case, table), case, observed(table.assign(x=table["x"] + 1)))


def test_insensitive_parameter_is_not_identified_and_hits_no_bound() -> None:
    design = DESIGN * [1, 1, 0]
    posterior = infer(stations(design @ TRUTH, SIGMA), design, sigma="known")
    assert posterior.marginals.identified == {"a": True, "b": True, "c": False}
    assert posterior.marginals.width_ratio["c"] == pytest.approx(1, abs=0.1)
    assert not posterior.marginals.bound_hit["c"].any()
    unknown = [one.parameter.name for one in posterior_statements(posterior) if isinstance(one, ParameterNotIdentified)]
    assert unknown == ["c"]


def test_mass_near_a_bound_by_chance_is_no_hit() -> None:
    near = hits = 0
    for seed in range(40):
        value = DESIGN @ TRUTH + SIGMA * np.random.default_rng(seed).standard_normal(len(DESIGN))
        table = stations(value * [1, 1, 1, 0, 0], 1.5 * SIGMA)
        posterior = infer(table, DESIGN * [1, 1, 0], members=150, sigma="known")
        near += int(np.sum(posterior.marginals.bound_mass["c"] > 0.05))
        hits += int(np.sum(posterior.marginals.bound_hit["c"]))
    assert near > 0  # some 13 effective members: chance alone puts more than 0.05 there, or this test shows nothing
    assert hits == 0


@pytest.mark.parametrize(("true_a", "side"), [(0.0, 0), (1.0, 1)])
def test_a_parameter_at_a_bound_hits_it(true_a: float, side: int) -> None:
    design = SIGMA * np.diag(1 / np.array([0.05, 0.1, 0.2]))
    posterior = infer(stations(design @ [true_a, 0.5, 0.0], SIGMA), design, sigma="known")
    assert posterior.marginals.bound_hit["a"].tolist() == [side == 0, side == 1]
    half_a_normal = 2 * 0.1554  # 2 (Phi(0.4) - 1/2)
    assert posterior.marginals.bound_mass["a"][side] == pytest.approx(half_a_normal, abs=0.05)
    assert not posterior.marginals.bound_hit["b"].any()
    (at,) = (one for one in posterior_statements(posterior) if isinstance(one, ParameterAtBound))
    assert (at.parameter.name, at.side) == ("a", ("lower", "upper")[side])


def test_parameter_settled_near_a_bound_is_no_hit() -> None:
    """Three standard deviations off a bound, all of it within 2 % of the prior's range of that bound."""
    design = SIGMA * np.diag(1 / np.array([0.003, 0.4, 0.4]))
    posterior = infer(stations(design @ [0.009, 0.5, 0.0], SIGMA), design, members=8192, sigma="known")
    assert posterior.marginals.bound_mass["a"][0] > 0.95
    assert not posterior.marginals.bound_hit["a"].any()


def test_few_members_are_few_effective_ones(toy: Posterior) -> None:
    few = infer(stations(measured(), SIGMA), members=512, sigma="known")
    assert few.weighting.effective_size < 100 < toy.weighting.effective_size
    assert any(isinstance(one, NoPosteriorClaimed) for one in posterior_statements(few))
    assert not any(isinstance(one, NoPosteriorClaimed) for one in posterior_statements(toy))


def test_parameters_that_make_up_for_one_another_are_correlated() -> None:
    design = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.1], [0.3, 0.0, 0.0], [0.0, 0.0, 0.3]])
    posterior = infer(stations(design @ TRUTH, SIGMA), design, sigma="known")
    assert posterior.marginals.correlation[0, 1] < -0.7
    (pair,) = (one for one in posterior_statements(posterior) if isinstance(one, ParametersCorrelated))
    assert (pair.first.name, pair.second.name, pair.correlation < -0.7) == ("a", "b", True)
    few = replace(posterior, weighting=replace(posterior.weighting, effective_size=2.0))
    assert not any(isinstance(one, ParametersCorrelated) for one in posterior_statements(few)), "any two members are"


def chezy(phi: float, canopy_height: float, depth: float) -> float:
    above = math.sqrt(9.81) / 0.41 * math.log(depth / canopy_height) if depth > canopy_height else 0.0
    return (1 / 60**2 + phi / (2 * 9.81)) ** -0.5 + above


@pytest.mark.parametrize(("from_height", "to_height"), [(0.8, 1.06), (0.8, 1.36), (0.8, 2.0), (1.06, 0.8), (0.8, 0.8)])
def test_corrected_phi_gives_the_same_resistance(from_height: float, to_height: float) -> None:
    phi = np.array([0.5, 1.0, 2.0])
    corrected = correct_phi_for_canopy(phi, from_height, to_height, 1.36, 60.0)
    before = [chezy(value, from_height, 1.36) for value in phi]
    assert [chezy(value, to_height, 1.36) for value in corrected] == pytest.approx(before)
    assert correct_phi_for_canopy(corrected, to_height, from_height, 1.36, 60.0) == pytest.approx(phi)
    assert np.all(np.diff(corrected) > 0)


def test_correction_stands_on_the_law_of_the_solver() -> None:
    phi, bare = np.array([[0.5, 1.0], [2.0, 40.0]]), np.array([60.0, 30.0])
    corrected = correct_phi_for_canopy(phi, 0.8, 1.06, 1.36, bare)
    law = np.vectorize(baptist_chezy)
    assert law(corrected, 1.06, 1.36, bare) == pytest.approx(law(phi, 0.8, 1.36, bare), rel=1e-14)


def test_correction_ends_at_the_bare_bed_and_at_a_wall() -> None:
    phi = np.array([0.0, 100.0])
    assert correct_phi_for_canopy(phi, 0.8, 1.36, 1.36, 60.0)[0] == 0
    assert correct_phi_for_canopy(phi, 1.36, 0.5, 1.36, 60.0)[1] == math.inf


def test_canopy_correction_stands_beside_the_raw_median() -> None:
    asked = {"stand": "willow", "from_height": 0.8, "to_height": 1.06, "depth": 1.36}
    case = a_case(sigma="known").model_copy(update={"canopy_correction": CanopyCorrection.model_validate(asked)})
    table = stations(measured(), SIGMA)
    posterior = glue(an_ensemble(case, table), case, observed(table))
    assert posterior.canopy is not None
    raw = posterior.marginals.median["c"]
    expected = correct_phi_for_canopy(np.array([raw]), 0.8, 1.06, 1.36, 60.0)[0]
    assert posterior.canopy.median == pytest.approx(expected, rel=1e-3)
    assert 10**posterior.canopy.log10_median == pytest.approx(expected, rel=1e-3)
    (corrected,) = (one for one in posterior_statements(posterior) if isinstance(one, CanopyCorrected))
    assert (corrected.before, corrected.median) == (raw, posterior.canopy.median)


def test_a_prior_that_ends_where_it_is_largest_is_no_bound_that_is_pressed() -> None:
    """Half a normal prior, as an effect of one sign has."""
    flat = Parameter(distribution="uniform", low=1.0, high=3.0, unit="-")
    half = Parameter(distribution="normal", mean=0.0, sd=0.05, low=0.0, high=3.0, unit="-")
    decades = Parameter(distribution="loguniform", low=0.01, high=100.0, unit="-")
    open_ended = Parameter(distribution="lognormal", median=1.0, log_sd=0.5, unit="-")
    assert prior_mass_near_bounds(flat) == pytest.approx([0.02, 0.02])
    assert prior_mass_near_bounds(decades) == pytest.approx([0.02, 0.02])
    assert prior_mass_near_bounds(half) == pytest.approx([0.770, 0.0], abs=1e-3)
    assert np.isnan(prior_mass_near_bounds(open_ended)).all()
    twin = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
    case = twin.model_copy(update={"parameters": {"a": half}})
    values = quantile(half, (np.arange(4000) + 0.5) / 4000)
    told = marginals({"a": values}, case, np.full(4000, 1 / 4000))
    assert told.bound_mass["a"][0] > 0.7
    assert not told.bound_hit["a"].any()
