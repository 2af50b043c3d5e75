"""Words the report says in several places: a parameter, its estimate, what the data are worth (HTML)."""

import numpy as np
import scipy.stats

from vegglue.ensemble import FAILED, Ensemble
from vegglue.likelihood import root_mean_square
from vegglue.posterior import Posterior
from vegglue.schema import Case
from vegglue.typography import NARROW, plus_minus, short, symbol_html, unit_html

# Chance below which a misfit is no chance any more.
SELDOM = 1e-3


def symbol(case: Case, name: str) -> str:
    """How a parameter is written on the page."""
    return symbol_html(case.parameters[name].symbol or name)


def as_power(posterior: Posterior, name: str) -> bool:
    """Whether a parameter is told as a power of ten: looked at in log10, over more than a decade of its prior."""
    low, high = posterior.prior_quantiles[name][[0, -1]]
    return name in posterior.log10_median and high > 10 * low


def estimate(posterior: Posterior, name: str) -> str:
    """Median ± standard deviation, as a power of ten where as_power says so (HTML, with unit)."""
    unit = unit_html(posterior.unit[name])
    unit = f'{NARROW}<span class="unit">{unit}</span>' if unit else ""
    if as_power(posterior, name):
        power = plus_minus(posterior.log10_median[name], posterior.log10_sd[name])
        return f"10<sup>{power}</sup>{unit}"
    return plus_minus(posterior.median[name], posterior.sd[name]) + unit


def plant_parameter(case: Case) -> str | None:
    """The parameter that is phi of a stand growing in a patch, if there is one."""
    stands = [case.plants.stands[patch.stand] for patch in case.plants.patches]
    return next((stand.phi for stand in stands if isinstance(stand.phi, str)), None)


def measurement_error(posterior: Posterior, kind: str) -> float:
    """Root mean square standard error of the used stations of a kind [SI]; NaN when one is unknown."""
    station = posterior.station
    error = station.loc[station["used"].astype(bool) & (station["kind"] == kind), "standard_error"].to_numpy(float)
    return root_mean_square(error)


def unexplained(posterior: Posterior, kind: str, miss: float) -> bool:
    """Whether a root mean square misfit is larger than the errors of its stations allow, by chance once in 1,000.

    Where the posterior knows how its errors hang together, its own chance of the misfit counts as well.
    """
    used = posterior.station["used"].astype(bool) & (posterior.station["kind"] == kind)
    count = max(int(used.sum()), 1)
    error, refinement = measurement_error(posterior, kind), posterior.refinement
    doubted = refinement is not None and refinement.errors == "stated" and refinement.p_misfit < SELDOM
    return miss > error * float(np.sqrt(scipy.stats.chi2.isf(SELDOM, count) / count)) or (doubted and miss > error)


def pressed_side(posterior: Posterior, name: str) -> str:
    """'upper' or 'lower', the bound of its prior a parameter presses against, or ''."""
    low, high = posterior.bound_hit[name]
    return "upper" if high else "lower" if low else ""


def with_unit(value: float, kind: str) -> str:
    """A residual or error of a kind of measurement with its unit."""
    return f"{short(value, 2)}{NARROW}{'m' if kind == 'level' else 'm/s'}"


def largest_mass_error(ensemble: Ensemble) -> float:
    """Largest |Q/Q_in - 1| of the solved members [-]."""
    return float(np.max(ensemble.mass_error[ensemble.status != FAILED]))
