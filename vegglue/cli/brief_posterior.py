"""What an inference found, on one screen: parameters as a table, the fit, doubts, and where the rest is kept."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from vegglue.case.schema import Case
from vegglue.cli.output import command_line
from vegglue.errors import shown_path
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.pages.homogeneity_words import homogeneity_rejected, moving_parameters
from vegglue.pages.posterior_words import correlated_pairs, errors_by_kind, fit_in_words
from vegglue.pages.prior_words import off_its_prior, pressed_bounds
from vegglue.pages.typography import PLAIN_TEXT
from vegglue.pages.validation_words import chi2_in_words, where_it_stands
from vegglue.results.posterior import CLAIMED_FROM, Posterior

# A terminal as it opens is 24 lines high; lines up to 100 columns are read without turning the head.
LINES, COLUMNS = 24, 100
# Parameters in the table and pairs named, at most, so that the fit and the doubts still have room.
MOST_PARAMETERS, MOST_PAIRS = 10, 3
_number = PLAIN_TEXT.number


def show_posterior(case: Case, folder: Path, posterior: Posterior) -> None:
    """Print what was found of a case; the posterior is kept in its folder."""
    command = command_line("report", shown_path(case.source), runs=folder.parent)
    for line in brief_posterior(posterior, f"{folder / 'posterior.h5'}", command):
        print(line)


def brief_posterior(posterior: Posterior, kept_in: str, command: str) -> list[str]:
    """At most LINES lines of COLUMNS: how it was found, parameters, fit, doubts, and where all of it is.

    command: that makes the report, on one line however long it is, as it is copied.
    """
    head = _wrapped([_found(posterior)]) + _table(posterior)
    where = f"All of it: {kept_in}; in sentences and figures:"
    foot = [f"{where} {command}"] if len(f"{where} {command}") <= COLUMNS else [where, f"  {command}"]
    body = [_wrapped([text]) for text in (*_fit(posterior), *doubts(posterior))]
    room, shown = LINES - len(head) - len(foot) - 1, []
    while body and len(body[0]) <= room:
        room -= len(body[0])
        shown += body.pop(0)
    more = [f"- {len(body)} more: see the report"] if body else []
    return [*head, *shown, *more, *foot]


def _wrapped(paragraphs: Sequence[str]) -> list[str]:
    return [line for text in paragraphs for line in textwrap.wrap(text, COLUMNS, subsequent_indent="  ")]


def _found(posterior: Posterior) -> str:
    sample, effective = posterior.sample, posterior.weighting.effective_size
    size = f"{effective:,.0f}" if effective >= CLAIMED_FROM else _number(effective, 3)
    failed = f" ({sample.failed:,} failed)" if sample.failed else ""
    stations = f"{posterior.fit.used} of {len(posterior.station)} stations used"
    if posterior.refinement is None:
        return f"{sample.members:,} members{failed}, worth {size} equal ones; {stations}."
    modes = posterior.refinement.modes.mode_chi2.size
    around = "one mode" if modes == 1 else f"{modes} modes"
    return f"{sample.members:,} members drawn around {around}{failed}, worth {size} equal ones; {stations}."


def _table(posterior: Posterior) -> list[str]:
    """A row for each parameter: median, standard deviation, 95 % range, its share of the prior's, what is odd."""
    rows = [("parameter", "median", "sd", "95 % range", "of prior", "")]
    for name in posterior.parameters[:MOST_PARAMETERS]:
        marginals = posterior.marginals
        low, high = (_number(float(value), 3) for value in marginals.quantiles[name][[0, -1]])
        share = PLAIN_TEXT.share(marginals.width_ratio[name])
        unit = f" {posterior.sample.unit[name]}".removesuffix(" -")
        median, sd = _number(marginals.median[name], 3), _number(marginals.sd[name], 2)
        rows.append((f"{name}{unit}", median, sd, f"{low} .. {high}", share, _odd(posterior, name)))
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(row[j].rjust(widths[j]) for j in range(1, 5)), row[5]]).rstrip()
        for row in rows
    ]
    left = len(posterior.parameters) - MOST_PARAMETERS
    return [*lines, f"and {left} more parameters"] if left > 0 else lines


def _odd(posterior: Posterior, name: str) -> str:
    at = " and ".join(pressed_bounds(posterior, name))
    pressing = f"at its {at} bound" if at else ""
    unknown = "" if posterior.marginals.identified[name] or not posterior.claimed else "not identified"
    off = "outside its prior's 95 %" if off_its_prior(posterior, name) else ""
    return ", ".join(filter(None, (unknown, pressing, off)))


def _fit(posterior: Posterior) -> list[str]:
    said = fit_in_words(posterior)
    refined = posterior.refinement
    if refined is None:
        return said
    if refined.error_model.errors == "estimated":
        sizes = errors_by_kind(posterior.fit.sigma, "for")
        return [*said, f"Errors are estimated from this misfit ({sizes}): they do not test the model."]
    missing = "something is missing in the model or its data; `vegglue diagnose` asks what."
    return [*said, chi2_in_words(refined.misfit, missing)]


def doubts(posterior: Posterior) -> list[str]:
    """What limits how far a posterior is to be trusted, one short sentence each, the gravest first."""
    return [f"- {text}" for text in (*_of_weights(posterior), *_of_transfer(posterior), *_of_stations(posterior))]


def _of_weights(posterior: Posterior) -> list[str]:
    found, k_hat = [], posterior.weighting.pareto_k
    if not posterior.claimed:
        found.append(f"No posterior is claimed: fewer than {CLAIMED_FROM} effective members. Take it as a first look.")
    if k_hat > TRUSTED_K_HAT:
        found.append(f"Few members carry the weight (k-hat {_number(k_hat, 2)}, to be trusted below {TRUSTED_K_HAT}).")
    pairs, names = correlated_pairs(posterior), posterior.parameters
    if pairs:
        of_pair = [f"{names[i]} and {names[j]} ({posterior.marginals.correlation[i, j]:+.2f})" for i, j in pairs]
        rest = f", and {len(pairs) - MOST_PAIRS} more pairs" if len(pairs) > MOST_PAIRS else ""
        found.append(f"Told together better than alone: {', '.join(of_pair[:MOST_PAIRS])}{rest}.")
    return found


def _of_transfer(posterior: Posterior) -> list[str]:
    transfer = posterior.transfer
    if transfer is None or not homogeneity_rejected(transfer):
        return []
    moving = [name for name, moves in zip(posterior.parameters, moving_parameters(transfer), strict=True) if moves]
    what = " and ".join(moving) or "the parameters together"
    larger = f", even with errors {transfer.scale:.1f} times as large" if transfer.scale > 1.0 else ""
    return [f"One value does not fit all experiments{larger}: {what} would have to move; `vegglue diagnose` asks why."]


def _of_stations(posterior: Posterior) -> list[str]:
    if posterior.refinement is None or not posterior.refinement.misfit.outlier.any():
        return []
    misfit = posterior.refinement.misfit
    count = int(misfit.outlier.sum())
    worst = misfit.worst_outlier
    where = where_it_stands(posterior, worst)
    stand = "station stands" if count == 1 else "stations stand"
    return [f"{count} {stand} out, most of all {where}, by {misfit.surprise[worst]:+.1f} of its errors; kept."]
