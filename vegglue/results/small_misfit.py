"""A misfit that is far smaller than its errors make it: these are too large, or readings are no separate ones."""

import math

from scipy.special import chdtr

from vegglue.wording.numbers import in_digits

# Chance of a chi2 as small under errors alone [-], below which something is said: as rare as what is called missing.
TOO_SMALL = 0.001
# What is likely then, {times} as large the errors would fit, and what to do.
TOO_LARGE = (
    "errors as stated, or as allowed for the model, are too large ({times} times as large would fit), or readings are "
    "copies, or smoothed, and count as separate ones"
)
CHECK_ERRORS = "check which, as ranges are too wide until then and an effect may hide in them"


def is_too_small(chi2: float, freedom: int) -> bool:
    """Whether P(chi2_f <= chi2) of a misfit with f degrees of freedom is below TOO_SMALL; False without any."""
    return freedom > 0 and bool(chdtr(freedom, chi2) < TOO_SMALL)


def why_too_small(chi2: float, freedom: int) -> str:
    """What is likely of a misfit that is too small, and what to do: errors (chi2 / f)^(1/2) times as large fit."""
    return f"{_likely(chi2, freedom)}; {CHECK_ERRORS}"


def _likely(chi2: float, freedom: int) -> str:
    return TOO_LARGE.format(times=in_digits(math.sqrt(chi2 / freedom), 2))


def small_misfit_in_short(chi2: float, freedom: int) -> str:
    """`chi2 is only 0.41 times its degrees of freedom: ...`, '' of a misfit that is not too small."""
    return f"{_size(chi2, freedom)}: {_likely(chi2, freedom)}." if is_too_small(chi2, freedom) else ""


def small_misfit_in_words(chi2: float, freedom: int) -> str:
    """The same with how seldom chance makes it, and what to do."""
    if not is_too_small(chi2, freedom):
        return ""
    seldom = f"less than chance makes it once in {1.0 / TOO_SMALL:,.0f} times"
    return f"{_size(chi2, freedom)}, {seldom}: {why_too_small(chi2, freedom)}."


def _size(chi2: float, freedom: int) -> str:
    return f"chi2 is only {in_digits(chi2 / freedom, 2)} times its degrees of freedom"
