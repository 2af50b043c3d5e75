"""Which contender is taken: those nearly as likely as the best are followed a step further, and what is vaguer has to
lead.

Something at a place says "none of what is known", which is vague: it has to lead all else by LEAST_ODDS.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from vegglue.arrays import Array
from vegglue.diagnosis.competition import LEAST_ODDS, Contender, chances_of, tempering

# Contenders of different kinds that are followed a step further at most: each costs a calibration and a screening.
MOST_FOLLOWED = 3
# Odds within which another of the same kind is followed: the grid that hypotheses are searched on decides no closer.
SAME_KIND_ODDS = 3.0
# Odds by which a place may lead a listed effect that is taken all the same: what is known goes before what is vague.
# Chosen after open-n, where a push far upstream of all sections led the skewed inflow by 4.7, and a scour hole of the
# blind study that led one section's probes by 7.
KNOWN_FIRST_ODDS = 5.0

What = Literal["effect", "place", "instrument"]


def nearly_as_likely(contenders: Sequence[Contender]) -> list[int]:
    """Contenders of the best one's kind within SAME_KIND_ODDS, of others within LEAST_ODDS; MOST_FOLLOWED at most."""
    chance = chances_of(contenders)
    odds = [SAME_KIND_ODDS if one.kind == contenders[0].kind else LEAST_ODDS for one in contenders]
    return [j for j, p in enumerate(chance) if p * odds[j] >= chance[0]][:MOST_FOLLOWED]


def chosen_contender(what: Sequence[What], evidence: Array) -> int | None:
    """The likeliest of those followed; where that is a place and leads another by less than LEAST_ODDS, the likeliest
    listed effect within KNOWN_FIRST_ODDS, None without one.

    what, evidence (k,): what each is, and the ln of its evidence [-].
    """
    best = int(np.argmax(evidence))
    ahead = (evidence[best] - evidence) / tempering(evidence[best])
    if what[best] != "place" or np.delete(ahead, best).min() > np.log(LEAST_ODDS):
        return best
    listed = [j for j, one in enumerate(what) if one == "effect" and ahead[j] < np.log(KNOWN_FIRST_ODDS)]
    return min(listed, key=lambda j: float(ahead[j]), default=None)
