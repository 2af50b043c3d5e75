"""What a report says was found, and which of it limits the use of the result."""

import re
from dataclasses import replace

import numpy as np
import pytest
from posteriors import a_posterior, changed
from report_runs import MEMBERS

from vegglue.case.schema import EffectEntry
from vegglue.case.site_schema import Inflow
from vegglue.cli.brief_posterior import brief_posterior
from vegglue.pages.findings import findings
from vegglue.pages.homogeneity_words import homogeneity_in_words
from vegglue.pages.key_numbers import estimate, key_numbers, verdict_of
from vegglue.pages.measured_figures import residuals
from vegglue.pages.posterior_words import parameter_in_words, weights_in_words
from vegglue.pages.prior_words import off_its_prior
from vegglue.pages.run import Run
from vegglue.pages.tables import fit_rows, health_facts, parameter_rows
from vegglue.results.posterior import Transfer

pytestmark = pytest.mark.slow  # whole pages


def said(run: Run, subject: str, **changes: object) -> tuple[str, bool]:
    other = replace(run, posterior=changed(run.posterior, **changes))
    found = [finding for finding in findings(other) if finding.subject == subject]
    return " ".join(finding.text for finding in found).replace("\u202f", " "), any(finding.doubt for finding in found)


def test_says_what_is_not_identified(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    known = {"n_b": True, "k_s": True, "phi": False}
    text, doubt = said(run, "parameter", identified=known, width_ratio={"n_b": 0.1, "k_s": 0.1, "phi": 0.96})
    assert "is not identified: its 95 % range" in text
    assert "is still 96 % of the prior's (identified means below 50 %)" in text
    assert doubt
    sentence = re.sub(
        "<[^>]*>", "", verdict_of(run.case, changed(run.posterior, identified=known, effective_size=500.0))
    )
    assert sentence.startswith("nb and ks are identified by these 20 stations; φ is not.")


def test_what_ends_at_a_bound_is_not_said_to_be_identified(toy: tuple[Run, str]) -> None:
    """A drag at the lower bound of its prior was `identified by these stations` above a table that said otherwise."""
    run, _ = toy
    marginals = run.posterior.marginals
    known, hit = dict.fromkeys(marginals.identified, True), marginals.bound_hit | {"phi": np.array([True, False])}
    told = verdict_of(run.case, changed(run.posterior, identified=known, bound_hit=hit, effective_size=500.0))
    sentence = re.sub("<[^>]*>", "", told)
    assert " are identified by these 21 stations; φ is at a bound of the prior, which ends the range." in sentence


def test_tells_powers_of_ten_only_over_decades(toy: tuple[Run, str]) -> None:
    posterior = toy[0].posterior
    manning, drag = (row.posterior for row in parameter_rows(toy[0])[:2])
    assert float(manning.split()[0]) == pytest.approx(posterior.marginals.median["n_b"], rel=0.01)
    assert float(drag.split()[0]) == pytest.approx(posterior.marginals.median["phi"], rel=0.01), "known to a tenth"
    vague = changed(posterior, log10_sd=posterior.marginals.log10_sd | {"phi": 0.2})
    assert estimate(vague, "phi").startswith("10<sup>")


def test_both_ends_of_a_narrow_range_are_told_apart(toy: tuple[Run, str]) -> None:
    ends = np.array([102.346, 102.36, 102.368, 102.38, 102.391])  # a level in a datum
    own = toy[0].posterior.marginals
    level = changed(
        toy[0].posterior, quantiles=own.quantiles | {"n_b": ends}, median=own.median | {"n_b": 102.368},
        sd=own.sd | {"n_b": 0.012}, identified=own.identified | {"n_b": True},
    )  # fmt: skip
    row = parameter_rows(replace(toy[0], posterior=level))[0]
    assert row.range95 == "102.35 to 102.39"
    assert row.posterior.replace("\u00a0", " ").startswith("102.37 ± 0.01")
    assert "95 % range 102.35 to 102.39" in parameter_in_words(level, "n_b")[0]


def test_says_at_which_bound_a_parameter_presses(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    hit = run.posterior.marginals.bound_hit | {"phi": np.array([False, True])}
    mass = run.posterior.marginals.bound_mass | {"phi": np.array([0.0, 0.14])}
    text, doubt = said(run, "parameter", bound_hit=hit, bound_mass=mass)
    assert "presses against the upper bound of its prior, 100: 0.14 of the posterior lies within 2 %" in text
    assert "The data bound it from below only" in text
    assert doubt


def test_says_that_a_parameter_lies_off_its_prior(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    own = run.posterior.marginals
    levels = own.prior_quantiles | {"n_b": own.median["n_b"] * np.linspace(2.0, 3.0, own.quantiles["n_b"].size)}
    free = {name: np.zeros(2, bool) for name in own.bound_hit}
    off = changed(run.posterior, prior_quantiles=levels, bound_hit=free, effective_size=3000.0)
    assert [name for name in off.parameters if off_its_prior(off, name)] == ["n_b"]
    text, doubt = said(run, "parameter", prior_quantiles=levels, bound_hit=free, effective_size=3000.0)
    assert "lies outside the range that its prior holds for 95 % likely" in text
    assert doubt
    assert "outside its prior's 95 %" in "\n".join(brief_posterior(off, "posterior.h5", "d3a.yaml"))
    few = changed(off, effective_size=30.0)
    assert not off_its_prior(few, "n_b"), "a first look says nothing of its prior"


@pytest.mark.parametrize(("size", "provisional"), [(30.0, True), (3000.0, False)])
def test_says_when_few_members_carry_the_weight(d3a: tuple[Run, str], size: float, provisional: bool) -> None:
    run, _ = d3a
    text, doubt = said(run, "weights", effective_size=size, pareto_k=0.2)
    assert ("no posterior is claimed" in text) == doubt == provisional
    posterior = changed(run.posterior, effective_size=size)
    sentence = verdict_of(run.case, posterior)
    assert sentence.startswith("A first look only") == provisional
    assert ("too few to say what is identified" in sentence) == provisional
    assert key_numbers(run.case, posterior)[0].remark.startswith("too few members to tell") == provisional
    assert parameter_rows(replace(run, posterior=posterior))[0].identified.startswith("too few members") == provisional


@pytest.mark.parametrize(("error", "hides"), [(0.001, True), (0.5, False)])
def test_says_whether_the_residual_exceeds_the_measurement_error(
    d3a: tuple[Run, str], error: float, hides: bool
) -> None:
    run, _ = d3a
    station = run.posterior.station.assign(standard_error=error)
    text, doubt = said(run, "residual", station=station)
    assert ("something the model does not have hides in the residual" in text) == doubt == hides
    assert f"measurement error of {error:g} m/s" in text.replace("0.0010", "0.001").replace("0.50", "0.5")


def test_says_when_nothing_is_known_of_the_measurement_error(toy: tuple[Run, str]) -> None:
    text, doubt = said(toy[0], "residual")
    assert "without standard errors nothing can be said" in text
    assert not doubt


def test_says_when_water_is_lost(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    leaking = replace(run, ensemble=replace(run.ensemble, mass_error=np.full(MEMBERS, 3e-3)))
    for each, doubt in ((run, False), (leaking, True)):
        mass = next(finding for finding in findings(each) if finding.subject == "mass")
        assert mass.doubt == doubt


def test_a_stream_that_joins_below_a_section_is_not_missing_in_it(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    given = run.case.experiments["D3a"]
    joined = given.model_copy(update={"discharge": given.discharge | {"stream": 1.0}})
    for place, total in (((420.0, 422.0), "2.66"), ((20.0, 22.0), "3.66")):
        inflows = run.case.inflows | {"stream": Inflow(side="north", range=place)}
        case = run.case.model_copy(update={"inflows": inflows, "experiments": {"D3a": joined}})
        told = [one.text for one in findings(replace(run, case=case)) if one.subject == "discharge"]
        assert any(f"the model was given {total}" in text for text in told), told


@pytest.mark.parametrize(("x", "changed"), [(20.0, True), (420.0, False)])
def test_what_an_effect_lets_in_is_not_missing_from_the_discharge(
    d3a: tuple[Run, str], x: float, changed: bool
) -> None:
    """A model with an inflow that had been found was said to be given too little, by 8.8 standard errors."""
    run, _ = d3a
    entry = EffectEntry(effect="unlisted_inflow", values={"discharge": "n_b", "x": x, "y": 0.0})
    case = run.case.model_copy(update={"effects": {"spring": entry}})
    told = [one for one in findings(replace(run, case=case)) if one.subject == "discharge"]
    assert told
    assert all(("spring changes that" in one.text) == changed for one in told), told
    assert not changed or not any(one.doubt for one in told)


def test_a_residual_names_its_experiment(toy: tuple[Run, str]) -> None:
    captions = [picture.caption for picture in residuals(toy[0]) if "the largest is" in picture.caption]
    assert re.search(r"at with(out)? S/1, y = [\d.]+ m", captions[0])
    assert re.search(r"at with(out)?, x = [\d.]+ m", captions[1])


def test_sigma_of_a_study_is_that_of_velocities(d3a: tuple[Run, str]) -> None:
    sigma = d3a[0].posterior.fit.sigma | {"level": 0.002}
    velocity, level, _ = fit_rows(replace(d3a[0], posterior=changed(d3a[0].posterior, sigma=sigma)))
    assert velocity.study != "–"
    assert level.study == "–"


def test_an_experiment_without_a_fit_of_its_own_is_said_to_have_none() -> None:
    alone = np.array([12.0, np.nan])
    one = np.array([np.nan])
    found = Transfer(
        scale=1.0, gain=8.0, more=1, p_all=0.1, experiments=np.array(["June", "July"], object), chi2=np.array([0.5]),
        value=np.array([[1.0], [1.1]]), error=np.array([[0.1], [0.1]]), freedom=np.array([1]), p=np.array([0.5]),
        misfit_together=np.array([20.0, 15.0]), misfit_alone=alone, stations=np.array([15, 15]),
    )  # fmt: skip
    said = " ".join(homogeneity_in_words(changed(a_posterior(False), theta={"n_b": one}), found, {}))
    assert "15 together and not found alone over 15 stations (July)" in said


def test_the_time_of_members_is_not_told_as_that_of_processors(toy: tuple[Run, str]) -> None:
    """It goes by the clock, loops compiled and other work on the machine included."""
    facts = dict(health_facts(toy[0]))
    assert "time of all processes together" in facts
    assert not any("processor" in name for name in facts)


def test_a_tail_that_nobody_knows_has_no_index() -> None:
    said = weights_in_words(changed(a_posterior(False), pareto_k=float("nan")))[0]
    assert said.endswith("too few stand out to tell the index k-hat of their tail.")


def test_doubts_come_first(d3a: tuple[Run, str]) -> None:
    doubts = [finding.doubt for finding in findings(d3a[0])]
    assert doubts == sorted(doubts, reverse=True)


def test_compares_with_rigid_cylinders(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    assert run.cylinder is not None
    text, _ = said(run, "plants", identified=run.posterior.marginals.identified | {"phi": True})
    ratio = run.posterior.marginals.median["phi"] / run.cylinder.quantile(0.5)
    assert f"the flow asks for {ratio:.0f} times as much" in text
    text, _ = said(run, "plants", identified=run.posterior.marginals.identified | {"phi": False})
    assert "cannot tell whether that is so" in text
