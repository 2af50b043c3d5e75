"""The top of the page: the verdict, a few key numbers, and what other parts of the page write in the same way."""

import math
from dataclasses import dataclass

import numpy as np
import scipy.special

from vegglue.case.case_effects import parameters_of_effects
from vegglue.case.schema import Case
from vegglue.flow.status import FAILED
from vegglue.measurements.kinds import kind_of
from vegglue.pages.posterior_words import identification, measurement_error
from vegglue.pages.prior_words import off_its_prior, pressed_bounds
from vegglue.pages.typography import NARROW, decimals, percent, plus_minus, short, symbol_html, unit_html
from vegglue.pages.validation_words import DOUBTED, UNBELIEVED
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.results.verdict import is_too_small
from vegglue.wording.numbers import listed, so_many

# Largest |Q - Q_in| over all that enters [-] of a sound member: a hundredth of what a flow meter can tell.
MASS_LIMIT = 1e-4
# Standard deviation of log10 [-] above which a value is told as a power of ten: below, both sides of it are alike.
WIDE = 0.05
# Parameters among the key numbers: with sigma and the members, six numbers fit the first screen.
PARAMETERS_SHOWN = 4


@dataclass(frozen=True)
class KeyNumber:
    """One number of the summary (HTML): what it is, the number, what to think of it."""

    name: str
    value: str
    remark: str


def verdict_of(case: Case, posterior: Posterior) -> str:
    """The one sentence on top: what is known now, and how well the model does."""
    if not posterior.claimed:
        size, members = max(posterior.weighting.effective_size, 1.0), posterior.sample.members
        few = f"the weights are worth {size:.0f} of {members:,} members, too few to say what is identified"
        return f"A first look only: {few}. {_how_well(posterior)}"
    at_bound = [name for name in posterior.parameters if pressed_bounds(posterior, name)]
    known = [name for name in posterior.parameters if posterior.marginals.identified[name] and name not in at_bound]
    unknown = [name for name in posterior.parameters if name not in {*known, *at_bound}]
    by = f"by these {so_many(posterior.fit.used, 'station')}"
    sentence = f"{_in_a_list(case, known)} {_are(known)} identified {by}" if known else f"Nothing is identified {by}"
    if at_bound:
        sentence += f"; {_in_a_list(case, at_bound)} {_are(at_bound)} at a bound of the prior, which ends the range"
    if unknown:
        sentence += f"; {_in_a_list(case, unknown)} {_are(unknown)} not"
    return f"{sentence}. {_how_well(posterior)}"


def _how_well(posterior: Posterior) -> str:
    kind = next(iter(posterior.fit.rmse))
    miss = posterior.fit.rmse[kind]
    missed = f"The model misses the {kind_of(kind).words} measurements by {with_unit(miss, kind)} (root mean square)"
    return f"{missed}{against_measurement_error(posterior, kind, miss)}."


def against_measurement_error(posterior: Posterior, kind: str, miss: float) -> str:
    """The end of a sentence on a root mean square misfit: how it compares with the error of the measurements (HTML)."""
    error = measurement_error(posterior, kind)
    if not np.isfinite(error):
        return "; without standard errors nothing can be said of how large it should be"
    if unexplained_error(posterior, kind, miss):
        return f", {short(miss / error, 2)} times the measurement error of {with_unit(error, kind)}"
    if miss > error and _misfit_below(posterior, DOUBTED):
        return f", which the measurement error of {with_unit(error, kind)} hardly explains"
    less = "far less" if miss < error and _misfit_too_small(posterior) else "no more"
    return f", {less} than the measurement error of {with_unit(error, kind)} explains"


def key_numbers(case: Case, posterior: Posterior) -> list[KeyNumber]:
    """Four to six numbers for the first screen."""
    parameters = [
        KeyNumber(symbol(case, name).replace("_", "_<wbr>"), estimate(posterior, name), _remark(posterior, name))
        for name in _first_read(case, posterior)[:PARAMETERS_SHOWN]
    ]
    kind = next(iter(posterior.fit.sigma))
    error = measurement_error(posterior, kind)
    against = f"measurement error {with_unit(error, kind)}" if np.isfinite(error) else "measurement error unknown"
    sigma = KeyNumber(
        f"error <var>σ</var> of the likelihood ({kind_of(kind).words})",
        with_unit(posterior.fit.sigma[kind], kind),
        against,
    )
    effective = f"{posterior.weighting.effective_size:,.0f}"
    size = KeyNumber("effective members", effective, f"of {posterior.sample.members:,}")
    return [*parameters, sigma, size]


def _first_read(case: Case, posterior: Posterior) -> list[str]:
    """The parameters, those of effects first: they are what was found."""
    added = parameters_of_effects(case)
    return sorted(posterior.parameters, key=lambda name: name not in added)


def _remark(posterior: Posterior, name: str) -> str:
    pressed = pressed_bounds(posterior, name)
    if pressed:
        return f"presses against its {' and '.join(pressed)} bound"
    if off_its_prior(posterior, name):
        return "outside the 95 % range of its prior"
    return identified_width(posterior, name)


def identified_width(posterior: Posterior, name: str) -> str:
    """'identified, 12 % of the prior width'."""
    return f"{identification(posterior, name)}, {percent(posterior.marginals.width_ratio[name])} of the prior width"


def _in_a_list(case: Case, names: list[str]) -> str:
    return listed([symbol(case, name) for name in names])


def _are(names: list[str]) -> str:
    return "is" if len(names) == 1 else "are"


def symbol(case: Case, name: str) -> str:
    """How a parameter is written on the page."""
    return symbol_html(case.parameters[name].symbol or name)


def as_power(posterior: Posterior, name: str) -> bool:
    """Whether a parameter is written as a power of ten: it has a log10, and its prior spans more than a decade."""
    low, high = posterior.marginals.prior_quantiles[name][[0, -1]]
    return name in posterior.marginals.log10_median and high > 10 * low


def study_value(case: Case, posterior: Posterior, name: str) -> tuple[float, float] | None:
    """Median and standard deviation another study gives, NaN where it gives none, as a power where ours is told so.

    What it gives in that form comes first; what it gives in the other alone is turned into it.
    """
    table = case.reference.table if case.reference else {}
    powers, plain = table.get(f"log10_{name}"), table.get(name)
    own, other = (powers, plain) if as_power(posterior, name) else (plain, powers)
    if own is not None:
        return _with_sd(own)
    if other is None or (other is plain and _with_sd(other)[0] <= 0.0):
        return None
    return _to_power(*_with_sd(other)) if other is plain else _from_power(*_with_sd(other))


def _with_sd(stated: float | tuple[float, float]) -> tuple[float, float]:
    return stated if isinstance(stated, tuple) else (stated, math.nan)


def _to_power(value: float, sd: float) -> tuple[float, float]:
    """log10 of value ± sd, as the sd is small."""
    return _rounded(math.log10(value), sd / (value * math.log(10.0)))


def _from_power(exponent: float, sd: float) -> tuple[float, float]:
    """10^(exponent ± sd), as the sd is small."""
    return _rounded(10.0**exponent, sd * 10.0**exponent * math.log(10.0))


def _rounded(value: float, sd: float) -> tuple[float, float]:
    """Both to two significant figures of sd, or value to three of its own: nobody gave more."""
    places = decimals(sd) if math.isfinite(sd) else decimals(value, 3)
    return round(value, places), round(sd, places)


def estimate(posterior: Posterior, name: str) -> str:
    """Median ± standard deviation (HTML, with unit); as a power of ten where as_power says so and it is WIDE."""
    unit = unit_html(posterior.sample.unit[name])
    unit = f'{NARROW}<span class="unit">{unit}</span>' if unit else ""
    if as_power(posterior, name) and posterior.marginals.log10_sd[name] > WIDE:
        power = plus_minus(posterior.marginals.log10_median[name], posterior.marginals.log10_sd[name])
        return f"10<sup>{power}</sup>{unit}"
    return plus_minus(posterior.marginals.median[name], posterior.marginals.sd[name]) + unit


def plant_parameter(case: Case) -> str | None:
    """The parameter that is phi of a stand growing in a patch, if there is one."""
    stands = [case.plants.stands[patch.stand] for patch in case.plants.patches]
    return next((stand.phi for stand in stands if isinstance(stand.phi, str)), None)


def unexplained_error(posterior: Posterior, kind: str, miss: float) -> bool:
    """Whether errors alone leave a root mean square misfit as large as this less than once in 1,000 times.

    miss > error sqrt(chi2_n^-1(0.999) / n), n used stations of the kind; a refined posterior that knows the correlation
    of its errors adds its own p-value of the misfit. False where the measurement error is not known.
    """
    used = posterior.station["used"] & (posterior.station["kind"] == kind)
    count = max(int(used.sum()), 1)
    error, doubted = measurement_error(posterior, kind), _misfit_below(posterior, UNBELIEVED)
    return miss > error * float(np.sqrt(scipy.special.chdtri(count, UNBELIEVED) / count)) or (doubted and miss > error)


def _misfit_below(posterior: Posterior, chance: float) -> bool:
    """Whether stated errors leave so much at all stations together less often than that; unknown counts as no."""
    refined = posterior.refinement
    return refined is not None and refined.error_model.errors == "stated" and refined.misfit.p_misfit < chance


def _misfit_too_small(posterior: Posterior) -> bool:
    """Whether stated errors leave so little at all stations together by chance hardly ever; unknown counts as no."""
    refined = posterior.refinement
    stated = refined is not None and refined.error_model.errors == "stated"
    return stated and refined is not None and is_too_small(refined.misfit.chi2, refined.misfit.freedom)


def with_unit(value: float, kind: str) -> str:
    """A residual or error of a kind of measurement with its unit (HTML)."""
    return f"{short(value, 2)}{NARROW}{unit_html(kind_of(kind).unit)}"


def largest_mass_error(ensemble: Ensemble) -> float:
    """Largest |Q - Q_in| over all that enters, of the solved members [-]."""
    return float(np.max(ensemble.mass_error[ensemble.status != FAILED]))


def mass_in_words(ensemble: Ensemble) -> str:
    """How much of its discharge a member loses or gains at most, against MASS_LIMIT (one sentence)."""
    worst = largest_mass_error(ensemble)
    return (
        f"No member loses or gains more than {short(worst, 2)} of its discharge at any section, "
        f"{'below' if worst < MASS_LIMIT else 'above'} the limit of {short(MASS_LIMIT, 1)}."
    )
