"""Where a posterior disagrees with its prior: it presses against a bound, or lies off its middle."""

from vegglue.pages.typography import Notation
from vegglue.results.posterior import NEAR_BOUND, Posterior
from vegglue.wording.numbers import listed, telling_digits


def pressed_bounds(posterior: Posterior, name: str) -> list[str]:
    """The bounds of its prior that a parameter presses against: 'lower', 'upper', both or none."""
    hit = posterior.marginals.bound_hit[name]
    return [side for side, pressed in zip(("lower", "upper"), hit, strict=True) if pressed]


def ends_at_bounds(posterior: Posterior, notation: Notation) -> str:
    """`phi (upper) ends at a bound of its prior, ...`, for one line of a headline; '' where none does."""
    at = {name: pressed_bounds(posterior, name) for name in posterior.parameters}
    names = [f"{notation.parameter(name)} ({' and '.join(sides)})" for name, sides in at.items() if sides]
    if not names:
        return ""
    subject = (
        f"{listed(names)} {'ends at a bound of its prior' if len(names) == 1 else 'end at bounds of their priors'}"
    )
    remedy = "widen it if it may lie further, or see what it stands in for"
    if len(names) > 1:
        remedy = "widen them if they may lie further, or see what they stand in for"
    return f"{subject}, and the bound, not the data, ends the range: {remedy}."


def off_its_prior(posterior: Posterior, name: str) -> bool:
    """Whether the median of a parameter lies outside the range that holds 95 % of its prior, and against no bound."""
    low, high = posterior.marginals.prior_quantiles[name][[0, -1]]
    inside = low <= posterior.marginals.median[name] <= high
    return posterior.claimed and not inside and not pressed_bounds(posterior, name)


def _off_in_words(posterior: Posterior, name: str, notation: Notation) -> list[str]:
    if not off_its_prior(posterior, name):
        return []
    ends = [float(value) for value in posterior.marginals.prior_quantiles[name][[0, -1]]]
    low, high = (notation.number(value, telling_digits(*ends)) for value in ends)
    return [
        f"{notation.parameter(name)} lies outside the range that its prior holds for 95 % likely, {low} to {high}: the "
        "prior or a measurement is wrong, or it stands in for something that is missing."
    ]


def _bounds(posterior: Posterior, name: str, notation: Notation) -> list[str]:
    marginals = posterior.marginals
    bound = dict(zip(("lower", "upper"), marginals.bounds[name], strict=True))
    mass = dict(zip(("lower", "upper"), marginals.bound_mass[name], strict=True))
    return [
        f"{notation.parameter(name)} presses against the {side} bound of its prior, {notation.number(bound[side], 3)}: "
        f"{notation.number(mass[side], 2)} of the posterior lies within {100 * NEAR_BOUND:g} % of the prior's range of "
        f"it ({NEAR_BOUND:g} of a flat prior to which the data say nothing)."
        for side in pressed_bounds(posterior, name)
    ]


def against_prior_in_words(posterior: Posterior, name: str, notation: Notation) -> list[str]:
    """The bounds it presses against, and that it lies off its prior; nothing where it agrees with it."""
    return [*_bounds(posterior, name, notation), *_off_in_words(posterior, name, notation)]
