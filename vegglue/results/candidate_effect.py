"""One effect under suspicion, as the data see it: how large, how surely, and whether they could show it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.effects.identity import EffectIdentity
from vegglue.wording.numbers import so_many

# |cosine| [-] above which an effect is said to look like a change of a parameter: that change then mimics two thirds of
# its trace (cos^2 = 0.64).
LOOKS_LIKE_FROM = 0.8
# A smallest size from which on no data show an effect, see `Detectability`.
NEVER = 1e100


@dataclass(frozen=True)
class AmplitudeEstimate:
    """How large an effect is, in the unit of its amplitude.

    value, interval95: from its own refit when there was one (refitted), else to first order, its prior taken into
    account in both. off, scale: where the amplitude does nothing, and how far from there is plausible; support: within
    which it must lie. objective: the least sum of squares with the effect, |W (y - f)|^2 + |z|^2 [-], predicted where
    it was not refitted.
    """

    value: float
    interval95: tuple[float, float]
    unit: str
    off: float
    scale: float
    refitted: bool
    objective: float
    support: tuple[float, float] = (-np.inf, np.inf)

    @property
    def relative_size(self) -> float:
        """|value - off| / scale [-]."""
        return abs(self.value - self.off) / self.scale


@dataclass(frozen=True)
class ScoreTest:
    """Score T of an effect [standard errors], and the chance that errors alone make any effect score as high [-].

    p_family: counted among bootstrap draws, never below one over their number; see `calibration/score_test`.
    """

    score: float
    p_family: float


@dataclass(frozen=True)
class Detectability:
    """Whether these data could show an effect.

    visibility: share of its fingerprint that calibration cannot mimic [-]. smallest: distance of the amplitude from off
    that is detected 19 times of 20; testable: that is less than twice a plausible one, and within its support.
    confounder: the parameter whose slope is most like the fingerprint; cosine: between both [-].
    """

    visibility: float
    smallest: float
    testable: bool
    confounder: str
    cosine: float

    @property
    def ever(self) -> bool:
        """Whether any size of it shows: a trace without length has a smallest size of some 1e300."""
        return self.smallest < NEVER

    @property
    def looks_like(self) -> str:
        """The parameter that a trace looks like a change of; '' where none is so like it."""
        return self.confounder if abs(self.cosine) > LOOKS_LIKE_FROM else ""


@dataclass(frozen=True)
class CandidateEffect:
    """One effect as the data see it, in the last model in which it was tested; shapes: at which it scores best."""

    name: str
    title: str
    shapes: dict[str, float]
    amplitude: AmplitudeEstimate
    test: ScoreTest
    detectability: Detectability


def effects_among(candidate_effects: Sequence[CandidateEffect]) -> int:
    """How many effects they are, wherever each may act."""
    return len({EffectIdentity.parse(one.name).name for one in candidate_effects})


def counted_in_words(candidate_effects: Sequence[CandidateEffect]) -> str:
    """`54 effects`; `67 candidates of 54 effects` where some of them are one effect in one experiment, section, device
    or patch each.
    """
    number = effects_among(candidate_effects)
    told = so_many(number, "effect")
    return told if number == len(candidate_effects) else f"{so_many(len(candidate_effects), 'candidate')} of {told}"
