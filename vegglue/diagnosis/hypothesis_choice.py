"""Which hypothesis is taken: those nearly as likely as the best are followed a step further, and what is vaguer has to
lead.

Something at a place says "none of what is known", which is vague: all places together have to lead all that is known by
known_first_odds. Which of the places is taken need not be sure: they say the same. A place that nothing rivals within
strong_odds is taken as it is: nothing is followed beside it.
"""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.candidates import InstrumentKind
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import Hypothesis, chances_of
from vegglue.diagnosis.tempered_probabilities import tempering

# Hypotheses of different kinds that are followed a step further at most: each costs a calibration and a screening.
MOST_FOLLOWED = 3

What = Literal["effect", "place", "instrument"]
# Kinds of hypotheses that are in a list.
KNOWN = ("effect", *get_args(InstrumentKind))


def nearly_as_likely(hypotheses: Sequence[Hypothesis]) -> list[int]:
    """Hypotheses of the best one's kind within same_kind_odds, of others within strong_odds; MOST_FOLLOWED at most,
    what is known among them where any of it is so likely.
    """
    chance = chances_of(hypotheses)
    odds = [
        constants().same_kind_odds if one.kind == hypotheses[0].kind else constants().strong_odds for one in hypotheses
    ]
    likely = [j for j, p in enumerate(chance) if p * odds[j] >= chance[0]]
    known = [j for j in likely if hypotheses[j].kind in KNOWN]
    last = known[0] if known and known[0] not in likely[: MOST_FOLLOWED - 1] else None
    return likely[:MOST_FOLLOWED] if last is None else [*likely[: MOST_FOLLOWED - 1], last]


def chance_of_a_place(hypotheses: Sequence[Hypothesis], chances: Sequence[float]) -> float:
    """That it is something at a place, of hypotheses with their chances (k,) [-]."""
    return sum(chance for one, chance in zip(hypotheses, chances, strict=True) if one.kind not in KNOWN)


def chosen_hypothesis(what: Sequence[What], evidence: Array, at_a_place: float) -> int | None:
    """The likeliest of those followed; where that is a place, the likeliest listed effect that it leads by less than
    known_first_odds, and None without one where places do not lead all that is known by so much.

    what, evidence (k,): what each is, and the ln of its evidence [-]; at_a_place: chance of all places together, those
    that were not followed among them.
    """
    best = int(np.argmax(evidence))
    if what[best] != "place":
        return best
    ahead = (evidence[best] - evidence) / tempering(evidence[best])
    listed = [j for j, one in enumerate(what) if one == "effect" and ahead[j] < np.log(constants().known_first_odds)]
    if listed:
        return min(listed, key=lambda j: float(ahead[j]))
    return best if at_a_place >= constants().known_first_odds * (1.0 - at_a_place) else None
