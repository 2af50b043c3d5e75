"""The first screen of a report: one sentence and four to six numbers (HTML)."""

from dataclasses import dataclass

import numpy as np

from vegglue.describe import CLAIMED_FROM, how_known
from vegglue.posterior import Posterior
from vegglue.schema import Case
from vegglue.typography import count, percent, short
from vegglue.wording import estimate, measurement_error, pressed_side, symbol, unexplained, with_unit


@dataclass(frozen=True)
class KeyNumber:
    """One number of the summary (HTML): what it is, the number, what to think of it."""

    name: str
    value: str
    remark: str


def verdict(case: Case, posterior: Posterior) -> str:
    """The one sentence on top: what is known now, and how well the model does."""
    if posterior.effective_size < CLAIMED_FROM:
        size = max(posterior.effective_size, 1.0)
        few = f"the weights are worth {size:.0f} of {posterior.members:,} members, too few to say what is identified"
        return f"A first look only: {few}. {_how_well(posterior)}"
    known = [name for name in posterior.parameters if posterior.identified[name]]
    unknown = [name for name in posterior.parameters if not posterior.identified[name]]
    by = f"by these {count(posterior.used, 'station')}"
    sentence = f"{_listed(case, known)} {_are(known)} identified {by}" if known else f"Nothing is identified {by}"
    if unknown:
        sentence += f"; {_listed(case, unknown)} {_are(unknown)} not"
    return f"{sentence}. {_how_well(posterior)}"


def _how_well(posterior: Posterior) -> str:
    kind = next(iter(posterior.rmse))
    error, miss = measurement_error(posterior, kind), posterior.rmse[kind]
    missed = f"The model misses the {kind} measurements by {with_unit(miss, kind)} (root mean square)"
    if not np.isfinite(error):
        return f"{missed}; their own error is not known."
    if unexplained(posterior, kind, miss):
        return f"{missed}, {short(miss / error, 2)} times their own error."
    return f"{missed}, as much as their own error of {with_unit(error, kind)} explains."


def key_numbers(case: Case, posterior: Posterior) -> list[KeyNumber]:
    """Four to six numbers for the first screen."""
    parameters = [
        KeyNumber(symbol(case, name), estimate(posterior, name), _remark(posterior, name))
        for name in posterior.parameters[:4]
    ]
    kind = next(iter(posterior.sigma))
    error = measurement_error(posterior, kind)
    against = f"measurement error {with_unit(error, kind)}" if np.isfinite(error) else "measurement error unknown"
    sigma = KeyNumber(f"residual <var>σ</var> ({kind})", with_unit(posterior.sigma[kind], kind), against)
    size = KeyNumber("effective members", f"{posterior.effective_size:,.0f}", f"of {posterior.members:,}")
    return [*parameters, sigma, size]


def _remark(posterior: Posterior, name: str) -> str:
    side = pressed_side(posterior, name)
    if side:
        return f"presses against its {side} bound"
    return f"{how_known(posterior, name)}: {percent(posterior.width_ratio[name])} of the prior width"


def _listed(case: Case, names: list[str]) -> str:
    symbols = [symbol(case, name) for name in names]
    return symbols[0] if len(symbols) == 1 else f"{', '.join(symbols[:-1])} and {symbols[-1]}"


def _are(names: list[str]) -> str:
    return "is" if len(names) == 1 else "are"
