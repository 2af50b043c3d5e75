"""What a report states was found as values, and which of it limits the use of the result."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from posteriors import a_posterior, changed
from report_runs import MEMBERS

from vegglue.case.schema import EffectEntry
from vegglue.case.site_schema import Inflow
from vegglue.inference.statements import (
    MisfitOfExperiments,
    NoPosteriorClaimed,
    ParameterAtBound,
    ParameterNotIdentified,
    ParameterOffPrior,
    WeightSummary,
    off_its_prior,
    transfer_statements,
    weight_statements,
)
from vegglue.pages.findings import CylinderCompared, DischargeMeasured, MassError, findings
from vegglue.pages.measured_figures import residuals
from vegglue.pages.parameters import (
    ResidualCompared,
    fit_rows,
    key_parameters,
    parameter_row,
    parameter_rows,
    posterior_verdict,
)
from vegglue.pages.run import Run
from vegglue.results.posterior import Transfer
from vegglue.wording.sentences import sentence

pytestmark = pytest.mark.slow  # whole runs


def found_in(run: Run, kind: type, **changes: object) -> list[tuple[Any, bool]]:
    """Statements of a kind about a run whose posterior has other fields, and whether each limits its use."""
    other = replace(run, posterior=changed(run.posterior, **changes))
    return [(one, limits) for one, limits in findings(other) if isinstance(one, kind)]


def test_what_is_not_identified_limits_the_use(d3a: tuple[Run, str]) -> None:
    run, known = d3a[0], {"n_b": True, "k_s": True, "phi": False}
    ((found, limits),) = found_in(run, ParameterNotIdentified, identified=known, width_ratio=dict.fromkeys(known, 0.96))
    assert (found.parameter.name, found.share, limits) == ("phi", 0.96, True)
    verdict = posterior_verdict(run.case, changed(run.posterior, identified=known, effective_size=500.0))
    groups = verdict.identified, verdict.at_bound, verdict.unknown
    assert [[one.name for one in group] for group in groups] == [["n_b", "k_s"], [], ["phi"]]


def test_what_ends_at_a_bound_is_not_identified(toy: tuple[Run, str]) -> None:
    """A drag at the lower bound of its prior was `identified by these stations` above a table that said otherwise."""
    run, marginals = toy[0], toy[0].posterior.marginals
    known, hit = dict.fromkeys(marginals.identified, True), marginals.bound_hit | {"phi": np.array([True, False])}
    verdict = posterior_verdict(run.case, changed(run.posterior, identified=known, bound_hit=hit, effective_size=500.0))
    assert [one.name for one in verdict.at_bound] == ["phi"]
    ((found, limits),) = found_in(run, ParameterAtBound, bound_hit=hit)
    assert (found.parameter.name, found.side, limits) == ("phi", "lower", True)


def test_powers_of_ten_only_over_decades(toy: tuple[Run, str]) -> None:
    run, marginals = toy[0], toy[0].posterior.marginals
    n_b, phi = parameter_row(run, "n_b"), parameter_row(run, "phi")
    assert (n_b.power, phi.wide) == (None, False)
    vague = replace(run, posterior=changed(run.posterior, log10_sd=marginals.log10_sd | {"phi": 0.2}))
    assert parameter_row(vague, "phi").wide


def test_a_parameter_off_its_prior(d3a: tuple[Run, str]) -> None:
    run, own = d3a[0], d3a[0].posterior.marginals
    levels = own.prior_quantiles | {"n_b": own.median["n_b"] * np.linspace(2.0, 3.0, own.quantiles["n_b"].size)}
    free = {name: np.zeros(2, bool) for name in own.bound_hit}
    changes = {"prior_quantiles": levels, "bound_hit": free, "effective_size": 3000.0}
    off = changed(run.posterior, **changes)
    assert [name for name in off.parameters if off_its_prior(off, name)] == ["n_b"]
    ((found, limits),) = found_in(run, ParameterOffPrior, **changes)
    assert (found.parameter.name, limits) == ("n_b", True)
    assert not off_its_prior(changed(off, effective_size=30.0), "n_b"), "a first estimate is not compared"


@pytest.mark.parametrize(("size", "few"), [(30.0, True), (3000.0, False)])
def test_few_effective_members_claim_nothing(d3a: tuple[Run, str], size: float, few: bool) -> None:
    run = d3a[0]
    assert bool(found_in(run, NoPosteriorClaimed, effective_size=size, pareto_k=0.2)) == few
    posterior = changed(run.posterior, effective_size=size)
    assert posterior_verdict(run.case, posterior).claimed != few
    assert (key_parameters(replace(run, posterior=posterior))[0].identification == "unknown") == few


@pytest.mark.parametrize(("error", "compared"), [(0.001, "exceeds"), (0.5, "explained"), (math.nan, "unknown")])
def test_whether_the_residual_exceeds_the_measurement_error(d3a: tuple[Run, str], error: float, compared: str) -> None:
    station = d3a[0].posterior.station.assign(standard_error=error)
    ((found, limits),) = found_in(d3a[0], ResidualCompared, station=station)
    assert (found.compared, limits) == (compared, compared == "exceeds")
    assert found.error == pytest.approx(error, nan_ok=True)


def test_lost_water_limits_the_use(d3a: tuple[Run, str]) -> None:
    run = d3a[0]
    leaking = replace(run, ensemble=replace(run.ensemble, mass_error=np.full(MEMBERS, 3e-3)))
    for each, expected in ((run, False), (leaking, True)):
        ((_, limits),) = found_in(each, MassError)
        assert limits == expected


def test_a_stream_that_joins_below_a_section_is_not_missing_in_it(d3a: tuple[Run, str]) -> None:
    run = d3a[0]
    given = run.case.experiments["D3a"]
    joined = given.model_copy(update={"discharge": given.discharge | {"stream": 1.0}})
    for place, total in (((420.0, 422.0), 2.66), ((20.0, 22.0), 3.66)):
        inflows = run.case.inflows | {"stream": Inflow(side="north", range=place)}
        case = run.case.model_copy(update={"inflows": inflows, "experiments": {"D3a": joined}})
        found = found_in(replace(run, case=case), DischargeMeasured)
        assert any(one.prescribed == pytest.approx(total) for one, _ in found)


@pytest.mark.parametrize(("x", "acts"), [(20.0, True), (420.0, False)])
def test_what_an_effect_lets_in_is_not_missing_from_the_discharge(d3a: tuple[Run, str], x: float, acts: bool) -> None:
    """A model with an inflow that had been found was said to be given too little, by 8.8 standard errors."""
    run = d3a[0]
    entry = EffectEntry(effect="unlisted_inflow", values={"discharge": "n_b", "x": x, "y": 0.0})
    case = run.case.model_copy(update={"effects": {"spring": entry}})
    found = found_in(replace(run, case=case), DischargeMeasured)
    assert found
    assert all(("spring" in one.changed_by) == acts for one, _ in found)
    assert not acts or not any(limits for _, limits in found)


def test_a_residual_names_its_experiment(toy: tuple[Run, str]) -> None:
    captions = [picture.caption for picture in residuals(toy[0]) if picture.name.startswith("quantiles")]
    assert all(
        any(name in caption for name in ("with S/1", "without S/1", "with,", "without,")) for caption in captions
    )


def test_sigma_of_a_study_is_that_of_velocities(d3a: tuple[Run, str]) -> None:
    sigma = d3a[0].posterior.fit.sigma | {"level": 0.002}
    velocity, level, _ = fit_rows(replace(d3a[0], posterior=changed(d3a[0].posterior, sigma=sigma)))
    assert velocity.study is not None
    assert level.study is None


def test_an_experiment_without_a_fit_of_its_own_has_none() -> None:
    alone, one = np.array([12.0, np.nan]), np.array([np.nan])
    found = Transfer(
        scale=1.0, gain=8.0, more=1, p_all=0.1, experiments=np.array(["June", "July"], object), chi2=np.array([0.5]),
        value=np.array([[1.0], [1.1]]), error=np.array([[0.1], [0.1]]), freedom=np.array([1]), p=np.array([0.5]),
        misfit_together=np.array([20.0, 15.0]), misfit_alone=alone, stations=np.array([15, 15]),
    )  # fmt: skip
    posterior = replace(changed(a_posterior(False), theta={"n_b": one}), transfer=found)
    (misfits,) = (each for each in transfer_statements(posterior, {}) if isinstance(each, MisfitOfExperiments))
    assert "nan" not in sentence(misfits)


def test_a_tail_without_an_index_has_no_number() -> None:
    summary = next(weight_statements(changed(a_posterior(False), pareto_k=float("nan"))))
    assert isinstance(summary, WeightSummary)
    assert "nan" not in sentence(summary)


def test_limits_come_first(d3a: tuple[Run, str]) -> None:
    limits = [limit for _, limit in findings(d3a[0])]
    assert limits == sorted(limits, reverse=True)


def test_drag_is_compared_with_rigid_cylinders(d3a: tuple[Run, str]) -> None:
    run, identified = d3a[0], d3a[0].posterior.marginals.identified
    assert run.cylinder is not None
    ratio = run.posterior.marginals.median["phi"] / run.cylinder.quantile(0.5)
    for known, expected in ((True, pytest.approx(ratio)), (False, None)):
        ((found, _),) = found_in(run, CylinderCompared, identified=identified | {"phi": known})
        assert found.ratio == expected


def test_a_table_compares_with_the_study_and_with_known_values(d3a: tuple[Run, str]) -> None:
    run, marginals = d3a[0], d3a[0].posterior.marginals
    n_b, _, phi = parameter_rows(run)
    off, sd = marginals.median["n_b"] - 0.098, marginals.sd["n_b"]
    assert n_b.study == (0.098, 0.008)
    assert n_b.study_difference == pytest.approx(off / np.hypot(sd, 0.008), abs=0.05)
    assert n_b.known is not None
    assert n_b.known_difference == pytest.approx((marginals.median["n_b"] - n_b.known) / sd)
    power = marginals.log10_median["phi"] - np.log10(39.81)
    assert phi.study == (1.6, 0.2)
    assert phi.known_difference == pytest.approx(power / marginals.log10_sd["phi"])
