"""A refined posterior of the short reach of docs/own_case.md, made and stored as a user would, and its parts."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from posteriors import assert_same
from reach import COARSE, said_to, write_reach

from vegglue.calibration.fit import MapEstimate, fit
from vegglue.calibration.noise import Noise, covariance_of, noise_of, with_correlation
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at, z_at
from vegglue.case.prior import sample_prior
from vegglue.case.schema import Case
from vegglue.engine.interface import Point, linearise, predict
from vegglue.engine.model import model_of
from vegglue.ensemble.solve_ensemble import solve_ensemble
from vegglue.errors import InputError
from vegglue.inference.homogeneity import equal_values_test, one_experiment, transfer, without_prior
from vegglue.inference.map_and_errors import distinct_modes, modes_and_errors, standardised_residual, starting_points
from vegglue.inference.refine import log_posterior, refinable, refine, solved_for
from vegglue.inference.tried_members import members_of, points_of_prior
from vegglue.measurements.observations import Observations, read_observations
from vegglue.parallel import at_most
from vegglue.report_page.homogeneity_words import homogeneity_in_words
from vegglue.report_page.posterior_words import describe
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior, Transfer
from vegglue.solver.status import FAILED
from vegglue.storage.result_files import read_ensemble, read_posterior, write_posterior

KNOWN = ("simulate: {members: 1024, seed: 7}", "simulate: {members: 64, seed: 7}\ninfer: {sigma: known}")
ERRORS = ("velocities.csv, experiment: June}", "velocities.csv, experiment: June, standard_error: 0.01}")


def made(folder: Path, *changes: tuple[str, str]) -> tuple[Case, Observations, Ensemble]:
    case = load_case(write_reach(folder, *changes))
    observations = read_observations(case)
    solve_ensemble(case, observations, folder / "ensemble.h5", 1, lambda progress: None)
    return case, observations, read_ensemble(folder / "ensemble.h5")


@pytest.fixture(scope="module")
def reach(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Observations, Ensemble]:
    return made(tmp_path_factory.mktemp("known"), KNOWN, ERRORS)


@pytest.fixture(scope="module")
def refined(reach: tuple[Case, Observations, Ensemble]) -> Posterior:
    case, observations, ensemble = reach
    with at_most(1):
        return refine(ensemble, case, observations)


@pytest.fixture(scope="module")
def noise(reach: tuple[Case, Observations, Ensemble]) -> Noise:
    case, observations, ensemble = reach
    model = model_of(case, observations)
    return modes_and_errors(model, members_of(ensemble, model), "known").noise


@pytest.mark.slow
def test_a_thousand_effective_draws_around_the_truth(refined: Posterior) -> None:
    assert refined.settings.method == "refine"
    assert refined.weighting.effective_size >= 1000
    assert refined.sample.failed == 0
    assert refined.weighting.pareto_k < 0.7
    assert refined.sample.weights.sum() == pytest.approx(1)
    for name, truth in (("n_b", 0.05), ("phi", 8.0)):
        low, high = refined.marginals.quantiles[name][[0, -1]]
        assert low < truth * 1.1
        assert high > truth * 0.9
        assert refined.marginals.identified[name]


def test_draws_are_runs_of_the_model(reach: tuple[Case, Observations, Ensemble], refined: Posterior) -> None:
    case, observations, _ = reach
    model = model_of(case, observations)
    some = [refined.sample.best, 5, 200]
    z = z_at(case, {name: values[some] for name, values in refined.sample.theta.items()})
    for row, member in zip(z, some, strict=True):
        alone = linearise(model, row)
        assert alone is not None
        assert refined.sample.prediction[member] == pytest.approx(alone.prediction, abs=1e-5)


def test_draws_are_as_exact_as_measurements_can_tell(
    reach: tuple[Case, Observations, Ensemble], refined: Posterior, noise: Noise
) -> None:
    model = model_of(*reach[:2])
    heavy = np.argsort(-refined.sample.weights)[:32]
    z = z_at(reach[0], {name: values[heavy] for name, values in refined.sample.theta.items()})
    middle = linearise(model, z[0])
    assert middle is not None
    drawn = solved_for(model, noise)
    assert drawn.case.numerics.tolerance == pytest.approx(0.02 * 0.01)
    exact, found = (predict(one, [middle], z) for one in (model, drawn))
    assert found == pytest.approx(exact, abs=0.01 * 0.01)
    assert log_posterior(noise, z, found) == pytest.approx(log_posterior(noise, z, exact), abs=0.02)


def test_the_log_density_is_that_of_errors_and_prior(
    reach: tuple[Case, Observations, Ensemble], refined: Posterior, noise: Noise
) -> None:
    assert refined.refinement is not None
    assert np.sqrt(np.mean(noise.grid_error**2)) == pytest.approx(refined.refinement.error_model.grid_error)
    z = z_at(reach[0], refined.sample.theta)[:50]
    errors = scipy.stats.multivariate_normal(np.zeros(15), covariance_of(noise))
    expected = errors.logpdf(noise.value - refined.sample.prediction[:50]) + scipy.stats.norm.logpdf(z).sum(axis=1)
    found = refined.refinement.draws.log_density[:50]
    assert found - found[0] == pytest.approx(expected - expected[0], abs=1e-6)


@pytest.mark.slow
def test_numbers_do_not_depend_on_the_jobs(reach: tuple[Case, Observations, Ensemble], refined: Posterior) -> None:
    case, observations, ensemble = reach
    with at_most(2):
        again = refine(ensemble, case, observations)
    assert np.array_equal(again.sample.weights, refined.sample.weights)
    assert np.array_equal(again.sample.prediction, refined.sample.prediction)
    assert np.array_equal(again.predicted.predictive, refined.predicted.predictive)


def test_everything_comes_back_from_the_file(refined: Posterior, tmp_path: Path) -> None:
    write_posterior(tmp_path / "posterior.h5", refined, "name: brook", "0" * 64)
    back = read_posterior(tmp_path / "posterior.h5", "0" * 64)
    assert back.refinement is not None
    assert_same(back, refined)
    assert list(back.refinement.groups.left_out) == ["June above", "June patch", "June below"]
    assert describe(back) == describe(refined)


# Weighted draws are resampled for ArviZ. Some come twice, which its shape of a tail takes for heavy: 0.702, ours 0.11.
@pytest.mark.slow  # arviz takes a second to import
@pytest.mark.filterwarnings("ignore:Estimated shape parameter of Pareto:UserWarning")
def test_arviz_reads_draws_likelihood_and_prior(refined: Posterior, tmp_path: Path) -> None:
    arviz = pytest.importorskip("arviz")
    write_posterior(tmp_path / "posterior.h5", refined, "name: brook", "0" * 64)
    data = arviz.from_netcdf(tmp_path / "posterior.h5")
    assert float(data.posterior["n_b"].mean()) == pytest.approx(
        float(refined.sample.weights @ refined.sample.theta["n_b"]), rel=0.01
    )
    assert float(data.prior["n_b"].std()) == pytest.approx(0.08 / math.sqrt(12), rel=0.1)
    assert float(data.posterior["n_b"].std()) < 0.2 * float(data.prior["n_b"].std())
    scored = arviz.loo(data, var_name="measured")
    assert refined.refinement is not None
    assert float(scored.elpd_loo) == pytest.approx(refined.refinement.leave_one_out.elpd, abs=0.3)
    data.close()


def test_what_is_said(refined: Posterior) -> None:
    said = " ".join(describe(refined))
    for part in ("downhill", "one mode", "errors are those stated", "chi2 = ", "log predictive density", "50 % band"):
        assert part in said, part
    assert "estimated from what" not in said
    assert "no posterior is claimed" not in said


@pytest.mark.slow
def test_errors_taken_from_the_residual_are_said_to_be(tmp_path: Path) -> None:
    case, observations, ensemble = made(tmp_path, (KNOWN[0], "simulate: {members: 64, seed: 7}"))
    posterior = refine(ensemble, case, observations)
    assert posterior.refinement is not None
    assert posterior.refinement.error_model.errors == "estimated"
    left = posterior.fit.best_residual
    assert posterior.fit.sigma["velocity"] == pytest.approx(math.sqrt(np.mean(left**2) * 15 / 13), rel=0.05)
    said = " ".join(describe(posterior))
    assert "estimated from what the best place leaves" in said
    assert "degrees of freedom" not in said


def test_an_informal_likelihood_is_not_refined(reach: tuple[Case, Observations, Ensemble]) -> None:
    case = reach[0]
    for changes in ({"likelihood": "nse"}, {"behavioural": 0.5}):
        assert not refinable(case.model_copy(update={"infer": case.infer.model_copy(update=changes)}))
    assert refinable(case)


@pytest.mark.slow
def test_the_method_can_be_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = write_reach(tmp_path, COARSE, (KNOWN[0], "simulate: {members: 64, seed: 7}"))
    monkeypatch.chdir(tmp_path)
    assert said_to(monkeypatch, capsys, "simulate", config, "--jobs", 1) == (0, "")
    for method in ("refine", "glue"):
        assert said_to(monkeypatch, capsys, "infer", config, "--method", method, "--jobs", 1) == (0, "")
        assert read_posterior(tmp_path / "runs/brook/posterior.h5").settings.method == method
    config.write_text(config.read_text(encoding="utf-8") + "infer: {likelihood: nse}\n", encoding="utf-8")
    assert said_to(monkeypatch, capsys, "infer", config, "--jobs", 1) == (0, "")
    assert read_posterior(tmp_path / "runs/brook/posterior.h5").settings.method == "glue"
    code, told = said_to(monkeypatch, capsys, "infer", config, "--method", "refine")
    assert code == 2
    assert "got an informal likelihood" in told


def test_missing_standard_errors_are_told(reach: tuple[Case, Observations, Ensemble]) -> None:
    case, observations, ensemble = reach
    unknown = replace(observations, table=observations.table.assign(standard_error=math.nan))
    with pytest.raises(
        InputError,
        match="no standard error is stated for 15 of velocity, the first at x = 8, y = -2 m: add",
    ):
        refine(ensemble, case, unknown)


def test_far_places_are_solved_on_their_own(reach: tuple[Case, Observations, Ensemble]) -> None:
    case, observations, ensemble = reach
    model = model_of(case, observations)
    point = linearise(model, np.zeros(2))
    assert point is not None
    z = z_at(case, ensemble.parameters)[:40]  # all over the prior
    assert predict(model, [point], z) == pytest.approx(ensemble.prediction[:40], abs=1e-4)


def test_starts_are_the_best_that_lie_apart(reach: tuple[Case, Observations, Ensemble]) -> None:
    case, observations, ensemble = reach
    noise, z = noise_of(observations.table), z_at(case, ensemble.parameters)
    starts = starting_points(noise, z, ensemble.prediction)
    logs = log_posterior(noise, z, ensemble.prediction)
    assert np.array_equal(starts[0], z[np.argmax(logs)])
    apart = np.linalg.norm(starts[:, None] - starts[None], axis=2) + np.eye(len(starts))
    assert apart.min() > 0.7


@pytest.mark.parametrize("rule", ["known", "best-member"])
def test_an_ensemble_without_a_solved_member_is_told(reach: tuple[Case, Observations, Ensemble], rule: str) -> None:
    case, observations, ensemble = reach
    none = replace(
        ensemble, status=np.full_like(ensemble.status, FAILED), prediction=np.full_like(ensemble.prediction, np.nan)
    )
    case = case.model_copy(update={"infer": case.infer.model_copy(update={"sigma": rule})})
    with pytest.raises(InputError, match=f"none of the {len(none.status)} members was solved"):
        refine(none, case, observations)


@pytest.mark.slow
def test_points_of_the_prior_lead_to_the_same_posterior(
    reach: tuple[Case, Observations, Ensemble], refined: Posterior
) -> None:
    case, observations, _ = reach
    with at_most(1):
        found = refine(None, case, observations)
    assert found.settings.ensemble_hash == ""
    assert found.weighting.effective_size >= 1000
    assert found.refinement is not None
    assert refined.refinement is not None
    assert found.refinement.modes.mode_chi2 == pytest.approx(refined.refinement.modes.mode_chi2, rel=1e-3)
    for name, quantiles in refined.marginals.quantiles.items():
        sd = refined.marginals.sd[name]
        assert found.marginals.quantiles[name] == pytest.approx(quantiles, abs=0.15 * sd)
    assert "of the prior" in describe(found)[0]


def test_points_of_the_prior_are_tried_on_coarse_cells(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path, ("cell: [1.0, 0.5]", "cell: [0.625, 0.375]"), KNOWN, ERRORS))
    model = model_of(case, read_observations(case))
    tried = points_of_prior(model)
    assert tried.prediction.shape == (64, len(model.station))
    own = linearise(model, tried.z[3])
    assert own is not None
    apart = np.abs(tried.prediction[3] - own.prediction).max()
    assert 1e-6 < apart < 0.1
    assert np.array_equal(tried.z, points_of_prior(model).z)


def test_without_a_prior_nothing_is_tried(reach: tuple[Case, Observations, Ensemble]) -> None:
    model = model_of(*reach[:2])
    with pytest.raises(InputError, match="expected a prior or more"):
        points_of_prior(replace(model, case=model.case.model_copy(update={"parameters": {}})))


def test_ends_of_the_search_are_counted_once() -> None:
    def end(place: float, objective: float) -> MapEstimate:
        point = Point(np.array([place]), np.zeros(1), np.zeros((1, 1)), {})
        return MapEstimate(point, objective, objective, np.eye(1))

    found = distinct_modes([end(2.5, 12.0), end(0.1, 10.1), end(0.0, 10.0), end(9.0, 80.0)])
    assert [one.objective for one in found] == [10.0, 12.0]


def test_what_stands_out_is_standard_normal_otherwise(reach: tuple[Case, Observations, Ensemble]) -> None:
    case, observations, _ = reach
    model = model_of(case, observations)
    point = linearise(model, np.zeros(2))
    assert point is not None
    noise = with_correlation(noise_of(observations.table), 0.4, 1.0)
    random = np.random.default_rng(1)
    clean = [
        standardised_residual(replace(noise, value=point.prediction + noise.lower @ random.normal(size=15)), point)
        for _ in range(400)
    ]
    assert np.std(clean) == pytest.approx(1, abs=0.08)
    value = point.prediction.copy()
    value[4] += 0.1
    assert np.argmax(np.abs(standardised_residual(replace(noise, value=value), point))) == 4


def test_homogeneity_of_the_papers_table() -> None:
    bed = equal_values_test(np.array([0.062, 0.098, 0.104]), np.array([0.007, 0.008, 0.010]))
    assert bed[:2] == (pytest.approx(16.9, abs=0.05), 2)
    assert equal_values_test(np.array([0.99, 2.70, 4.0]), np.array([0.28, 0.33, 0.44]))[0] == pytest.approx(
        37.6, abs=0.05
    )
    assert equal_values_test(np.array([1.0, 1.2, np.nan]), np.array([0.1, 0.1, np.nan])) == (
        pytest.approx(2), 1, pytest.approx(scipy.stats.chi2.sf(2, 1)),
    )  # fmt: skip
    assert math.isnan(equal_values_test(np.array([1.0, np.nan]), np.array([0.1, np.nan]))[0])


def test_the_prior_is_taken_off(reach: tuple[Case, Observations, Ensemble]) -> None:
    case = reach[0]
    likelihood, error = np.array([0.4, -0.3]), np.array([0.1, 0.9])
    variance = 1 / (1 + 1 / error**2)
    value, own = without_prior(case, likelihood * variance / error**2, variance)
    exact = theta_at(case, likelihood)
    assert value[0] == pytest.approx(exact["n_b"][0], rel=1e-3)
    assert value[1] == pytest.approx(math.log10(exact["phi"][0]), abs=0.03)
    assert own[0] == pytest.approx(0.1 * 0.08 * scipy.stats.norm.pdf(0.4), rel=0.01)
    assert np.isnan(without_prior(case, np.zeros(2), np.array([0.1, 0.8]))[0]).tolist() == [False, True]


TWO = (
    "  June: {discharge: 2.0, level: 0.95}",
    "  June: {discharge: 2.0, level: 0.95}\n  July: {discharge: 2.0, level: 0.95, stands: {willow: {phi: 8}}}",
)


@pytest.mark.parametrize(("rough", "moves"), [(0.05, False), (0.07, True)])
def test_a_bed_that_changes_between_experiments_is_noticed(tmp_path: Path, rough: float, moves: bool) -> None:
    case = load_case(write_reach(tmp_path, COARSE, KNOWN, ERRORS, TWO))
    once = read_observations(case)
    table = once.table.loc[once.table.index.repeat(2)].reset_index(drop=True)
    table["experiment"] = np.tile(["June", "July"], len(once.table))
    random = np.random.default_rng(5)
    model = model_of(case, replace(once, table=table))
    for experiment, n_b in (("June", 0.05), ("July", rough)):
        point = linearise(model, z_at(case, {"n_b": np.array([n_b]), "phi": np.array([8.0])})[0])
        assert point is not None
        rows = (table["experiment"] == experiment).to_numpy()
        table.loc[rows, "value"] = point.prediction[rows] + 0.01 * random.normal(size=rows.sum())
    middle = linearise(model, np.zeros(2))
    assert middle is not None
    joint = fit(model, noise_of(table), middle).point
    found = transfer(model, noise_of(table), joint, True)
    assert found is not None
    assert list(found.experiments) == ["June", "July"]
    assert (found.p[0] < 1e-3) == moves
    assert np.isnan(found.value[1, 1])  # phi is a number in July
    assert np.all(found.misfit_alone < found.misfit_together)
    assert (found.p_all < 1e-3) == moves
    assert (found.scale, found.more) == (pytest.approx(1, abs=0.3), 1)
    twice = with_correlation(noise_of(table.assign(standard_error=0.005)), 0.0, 3.0)
    again, free = (transfer(model, errors, joint, False) for errors in (twice, noise_of(table)))
    assert again is not None
    assert free is not None
    assert again.scale == pytest.approx(2 * free.scale, rel=0.05)  # its own, whatever the joint fit asked for
    assert again.chi2[0] == pytest.approx(free.chi2[0], rel=0.1, abs=0.1)


@pytest.mark.parametrize(
    ("apart", "words"), [(0.0, "will do"), (0.028, "hardly one value"), (0.06, "not one value for all")]
)
def test_what_is_said_of_experiments(refined: Posterior, apart: float, words: str) -> None:
    value, error = np.array([0.05, 0.05 + apart]), np.array([0.01, 0.008])
    chi2, freedom, p = equal_values_test(value, error)
    found = Transfer(
        scale=1.0, gain=chi2, more=1, p_all=p, experiments=np.array(["June", "July"], object),
        value=np.column_stack([value, [1.0, np.nan]]), error=np.column_stack([error, [0.1, np.nan]]),
        chi2=np.array([chi2, np.nan]), freedom=np.array([freedom, 0]), p=np.array([p, np.nan]),
        misfit_together=np.array([20.0, 15.0]), misfit_alone=np.array([12.0, 13.0]), stations=np.array([15, 15]),
    )  # fmt: skip
    said = homogeneity_in_words(refined, found, {"chi2_n_b": 16.9})
    assert words in said[0]
    assert "0.05 ± 0.01 (June)" in said[0]
    assert "the source has 16.9" in said[0]
    assert len(said) == 3  # nothing of phi, which one experiment alone tells
    assert ("does not carry over" in said[-1]) == (words == "not one value for all")


def test_errors_of_one_experiment_are_those_of_all(reach: tuple[Case, Observations, Ensemble]) -> None:
    case, observations, _ = reach
    noise = with_correlation(noise_of(observations.table), 0.3, 1.2)
    model, own = one_experiment(model_of(case, observations), noise, "June")
    assert own.lower @ own.lower.T == pytest.approx(covariance_of(noise))
    assert list(model.case.experiments) == ["June"]


@pytest.mark.slow
def test_a_long_markov_chain_finds_the_same(
    reach: tuple[Case, Observations, Ensemble], refined: Posterior, noise: Noise
) -> None:
    emcee = pytest.importorskip("emcee")
    case, observations, _ = reach
    model = model_of(case, observations)
    best = z_at(case, {name: values[[refined.sample.best]] for name, values in refined.sample.theta.items()})[0]
    point = linearise(model, best)
    assert point is not None
    sampler = emcee.EnsembleSampler(
        32, 2, lambda z: log_posterior(noise, z, predict(model, [point], z)), vectorize=True
    )
    sampler.random_state = np.random.RandomState(3).get_state()
    sampler.run_mcmc(best + 0.02 * np.random.default_rng(4).normal(size=(32, 2)), 1500)
    chain = theta_at(case, sampler.get_chain(discard=300, flat=True))
    independent = 1200 * 32 / sampler.get_autocorr_time(discard=300, tol=40).max()
    for name, values in chain.items():
        error = refined.marginals.sd[name] * math.sqrt(1 / independent + 1 / refined.weighting.effective_size)
        assert refined.sample.weights @ refined.sample.theta[name] == pytest.approx(values.mean(), abs=4 * error)
        assert refined.marginals.sd[name] == pytest.approx(values.std(), rel=4 / math.sqrt(2 * min(independent, 1000)))


def test_priors_of_the_file_are_draws_from_the_prior(
    refined: Posterior, reach: tuple[Case, Observations, Ensemble]
) -> None:
    assert refined.refinement is not None
    expected = sample_prior(reach[0].parameters, refined.sample.members, 7)
    assert np.array_equal(refined.refinement.draws.prior_theta["phi"], expected["phi"])
