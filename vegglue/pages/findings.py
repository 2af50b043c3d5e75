"""The list below "Caveats" of the page: what the posterior says (HTML), what limits the use of the result first.

The facts that the terminal prints too are written in posterior_words.py and homogeneity_words.py; what a diagnosis
found is written in cause_words.py and diagnosis_words.py.
"""

import html
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from vegglue.case.channel_geometry import discharges_upstream_of
from vegglue.case.schema import Case
from vegglue.flow.status import FAILED, STATUS_WORDS, members_with
from vegglue.inference.command_ensemble import doubts_of_predictions
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import Observations, section_place
from vegglue.measurements.plant_survey import RigidCylinder
from vegglue.measurements.section_discharge import changing_discharge
from vegglue.pages.homogeneity_words import homogeneity_in_words, homogeneity_rejected
from vegglue.pages.key_numbers import (
    MASS_LIMIT,
    against_measurement_error,
    largest_mass_error,
    mass_in_words,
    plant_parameter,
    symbol,
    unexplained_error,
    with_unit,
)
from vegglue.pages.page_file import set_as_code
from vegglue.pages.posterior_words import (
    canopy_in_words,
    correlations_in_words,
    fit_in_words,
    parameter_in_words,
    search_in_words,
    weights_in_words,
)
from vegglue.pages.prior_words import off_its_prior, pressed_bounds
from vegglue.pages.run import Run, command_about, median_plants
from vegglue.pages.typography import NARROW, Notation, fixed, html_notation, plus_minus, short
from vegglue.pages.validation_words import UNBELIEVED, validation_in_words
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.results.verdict import is_too_small
from vegglue.wording.numbers import so_many
from vegglue.wording.sentences import phrase, sentences

# Share of failed members [-] above which it is a doubt: fewer hardly change what the others say of the prior.
FAILED_TOLERATED = 0.01
# Standard errors [-] between measured and prescribed discharge, beyond which chance explains it 1 time in 20.
DISCHARGE_DOUBTED = 2.0


@dataclass(frozen=True)
class Finding:
    """One sentence or two (HTML), about one subject; `doubt` marks what limits the use of the result."""

    subject: str
    text: str
    doubt: bool = False


def findings(run: Run) -> list[Finding]:
    """All sentences, those that limit the use of the result first."""
    case, observations, posterior = run.case, run.observations, run.posterior
    notation = html_notation({name: symbol(case, name) for name in posterior.parameters})
    found = [
        *(_parameter(posterior, name, notation) for name in posterior.parameters),
        *_correlations(posterior, notation),
        *_canopy_correction(posterior, notation),
        *_plants(case, posterior, run.cylinder),
        *_canopy_height(run),
        *(_residual(posterior, kind) for kind in posterior.fit.sigma),
        _fit(posterior, notation),
        *_refinement(posterior),
        *_homogeneity(case, posterior),
        *_flagged(observations),
        *_set_aside_since(run),
        *_discharge(case, observations),
        _weights(posterior, notation),
        *([] if run.ensemble is None else [_members(run.ensemble, posterior), *_mass(run.ensemble)]),
        *([] if run.ensemble is None else _of_predictions(run.ensemble)),
        *_engine(case),
    ]
    return sorted(found, key=lambda finding: not finding.doubt)


def _html(sentences: Iterable[str]) -> str:
    """Plain sentences as one piece of HTML, commands in `backticks` set as code."""
    return set_as_code(html.escape(" ".join(sentences)))


def _parameter(posterior: Posterior, name: str, notation: Notation) -> Finding:
    pressed = pressed_bounds(posterior, name)
    sentences = parameter_in_words(posterior, name, notation)
    if len(pressed) == 1:
        side = "below" if pressed == ["upper"] else "above"
        sentences.append(f"The data bound it from {side} only, and the bound, not the data, ends the range.")
    doubt = bool(pressed) or off_its_prior(posterior, name) or not posterior.marginals.identified[name]
    return Finding("parameter", " ".join(sentences), doubt)


def _correlations(posterior: Posterior, notation: Notation) -> Iterator[Finding]:
    sentences = correlations_in_words(posterior, notation)
    if sentences:
        yield Finding("correlation", " ".join(sentences))


def _plants(case: Case, posterior: Posterior, cylinder: RigidCylinder | None) -> Iterator[Finding]:
    name = plant_parameter(case)
    if name is None or cylinder is None:
        return
    inferred = posterior.marginals.median[name] if posterior.canopy is None else posterior.canopy.median
    median = cylinder.quantile(0.5)
    if not posterior.marginals.identified[name]:
        comparison = "the flow at these stations cannot tell whether that is so"
    else:
        comparison = f"the flow asks for {short(inferred / median, 2)} times as much"
    undergrowth = phrase("undergrowth_assumption", cylinder.undergrowth_density)
    yield Finding(
        "plants",
        f"Rigid cylinders of the surveyed size would have {symbol(case, name)} = "
        f"{plus_minus(cylinder.mean, cylinder.standard_deviation)} (median {short(median, 2)}); {comparison}. "
        f"{html.escape(undergrowth)}",
    )


def _canopy_correction(posterior: Posterior, notation: Notation) -> Iterator[Finding]:
    sentences = canopy_in_words(posterior, notation)
    if sentences:
        yield Finding("canopy", " ".join(sentences))


def _canopy_height(run: Run) -> Iterator[Finding]:
    for (experiment, section), canopy in run.observations.canopy_height.items():
        where = f"the verticals inside the plants at {html.escape(section)} ({html.escape(experiment)})"
        if canopy.unknown is not None:
            yield Finding("canopy", f"No canopy height could be read off {where}: {html.escape(canopy.unknown.value)}.")
            continue
        used = ", ".join(
            f"{height:g}{NARROW}m" for height in np.unique(median_plants(run, experiment).canopy_height.round(3))
        )
        height = plus_minus(canopy.value, canopy.standard_error)
        yield Finding("canopy", f"Read off {where}, the canopy is {height}{NARROW}m high; the model was given {used}.")


def _residual(posterior: Posterior, kind: str) -> Finding:
    miss = posterior.fit.best_rmse[kind]
    text = (
        f"The best member misses the {kind_of(kind).words} measurements by {with_unit(miss, kind)}"
        f"{against_measurement_error(posterior, kind, miss)}"
    )
    if not unexplained_error(posterior, kind, miss):
        return Finding("residual", f"{text}.")
    return Finding("residual", f"{text}: something the model does not have hides in the residual.", doubt=True)


def _fit(posterior: Posterior, notation: Notation) -> Finding:
    used = posterior.station["used"].to_numpy()
    value = posterior.station["value"].to_numpy(float)[used]
    low, high = posterior.predicted.model_band[0][used], posterior.predicted.model_band[-1][used]
    inside = int(np.sum((value >= low) & (value <= high)))
    of_model = f"The 95{NARROW}% range of the model alone, without residual error, holds {inside} of them."
    return Finding("fit", " ".join([*fit_in_words(posterior, notation), of_model]))


def _refinement(posterior: Posterior) -> Iterator[Finding]:
    refined = posterior.refinement
    if refined is None:
        return
    estimated = refined.error_model.errors == "estimated"
    search, *errors = search_in_words(posterior, refined)
    yield Finding("errors", _html(errors), doubt=estimated)
    yield Finding("draws", _html([search]))
    misfit = refined.misfit
    odd = not estimated and (misfit.p_misfit < UNBELIEVED or is_too_small(misfit.chi2, misfit.freedom))
    doubt = odd or bool(refined.misfit.outlier.any())
    yield Finding("validation", _html(validation_in_words(posterior, refined)), doubt)


def _homogeneity(case: Case, posterior: Posterior) -> Iterator[Finding]:
    if posterior.transfer is not None:
        sentences = homogeneity_in_words(posterior, posterior.transfer, case.reference.table if case.reference else {})
        yield Finding("homogeneity", _html(sentences), doubt=homogeneity_rejected(posterior.transfer))


def _set_aside_since(run: Run) -> Iterator[Finding]:
    """Readings of the posterior that a diagnosis made after it set aside."""
    if many := run.set_aside_since:
        of = f"{so_many(many, 'reading')} that the diagnosis set aside {'is' if many == 1 else 'are'}"
        again = f"{command_about(run, 'infer')} makes one without"
        yield Finding("stations", f"{of} still in this posterior; {again}.", doubt=True)


def _flagged(observations: Observations) -> Iterator[Finding]:
    for _, row in observations.table[~observations.table["used"]].iterrows():
        yield Finding(
            "flagged",
            f"Not used: {html.escape(str(row['experiment']))} at x = {row['x']:g} m, y = {row['y']:g} m, "
            f"{html.escape(row['reason'])}.",
        )


def _discharge(case: Case, observations: Observations) -> Iterator[Finding]:
    for (experiment, section), rules in observations.discharge.items():
        x = section_place(observations.table, experiment, section)
        given = discharges_upstream_of(case, case.experiments[experiment], x)
        if given is None:
            continue
        prescribed = None if any(isinstance(value, str) for value in given) else sum(map(float, given))
        measured = rules["profile"]
        text = (
            f"The verticals at {html.escape(section)} ({html.escape(experiment)}) add up to "
            f"{plus_minus(measured.value, measured.standard_error)}{NARROW}m³/s"
        )
        if prescribed is None:
            yield Finding("discharge", f"{text}; the discharge is itself a parameter.")
            continue
        if changed := changing_discharge(case, experiment, x):
            more = f"; the model was given {short(prescribed)}{NARROW}m³/s, and {html.escape(changed)} changes that"
            yield Finding("discharge", f"{text}{more}.")
            continue
        off = (measured.value - prescribed) / measured.standard_error
        yield Finding(
            "discharge",
            f"{text}; the model was given {short(prescribed)}{NARROW}m³/s, {fixed(abs(off), 1)} standard errors "
            f"{'less' if off > 0 else 'more'}.",
            doubt=abs(off) > DISCHARGE_DOUBTED,
        )


def _weights(posterior: Posterior, notation: Notation) -> Finding:
    doubt = not posterior.claimed or posterior.weighting.pareto_k > TRUSTED_K_HAT
    return Finding("weights", set_as_code(" ".join(weights_in_words(posterior, notation))), doubt)


def failed_of_weighed(ensemble: Ensemble | None, posterior: Posterior) -> tuple[int, int]:
    """How many of the members that a posterior weighs failed, and how many these are: draws of its own where it was
    refined, as the ensemble then only says where to begin.
    """
    if posterior.refinement is not None or ensemble is None:
        return posterior.sample.failed, posterior.sample.members
    return members_with(ensemble.status, FAILED), len(ensemble.status)


def too_many_failed(ensemble: Ensemble | None, posterior: Posterior) -> bool:
    """Whether so many of them failed that it is a doubt."""
    failed, members = failed_of_weighed(ensemble, posterior)
    return failed > FAILED_TOLERATED * members


def _members(ensemble: Ensemble, posterior: Posterior) -> Finding:
    newton, marched, failed, run = (members_with(ensemble.status, number) for number in STATUS_WORDS)
    own = f"{so_many(newton, 'member')} solved by Newton's method, {marched:,} by marching in time"
    text = f"{so_many(run, 'member')} run by the command" if ensemble.by_command else own
    told = "; they have no weight" if failed else ""
    if failed and posterior.refinement is not None:
        of_draws, draws = failed_of_weighed(ensemble, posterior)
        told = f"; the posterior is of {so_many(draws, 'draw')} of its own, of which {of_draws or 'none'} failed"
    return Finding("members", f"{text}, {failed:,} failed{told}.", doubt=too_many_failed(ensemble, posterior))


def _mass(ensemble: Ensemble) -> Iterator[Finding]:
    if not ensemble.by_command:
        yield Finding("mass", mass_in_words(ensemble), doubt=largest_mass_error(ensemble) >= MASS_LIMIT)


def _of_predictions(ensemble: Ensemble) -> Iterator[Finding]:
    for text in sentences(doubts_of_predictions(ensemble)):
        yield Finding("engine", _html([text]), doubt=True)


def _engine(case: Case) -> Iterator[Finding]:
    if case.engine is not None:
        told = (
            "Predictions are those of the command of `engine`; the flow that is drawn, and what an effect or a place "
            "would change, are those of the built-in engine at the same parameters."
        )
        yield Finding("engine", _html([told]))
