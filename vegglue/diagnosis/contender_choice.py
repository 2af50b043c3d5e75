"""Which contender is taken: those nearly as likely as the best are followed a step further, and what is vaguer has to
lead.

Something at a place says "none of what is known", which is vague: it has to lead what is known by LEAST_ODDS. Another
place with another term says the same: there it is enough to lead by what the search can tell.
"""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from vegglue.arrays import Array
from vegglue.diagnosis.competition import LEAST_ODDS, Contender, chances_of
from vegglue.diagnosis.tempered_chances import tempering
from vegglue.screening.instruments import InstrumentKind

# Contenders of different kinds that are followed a step further at most: each costs a calibration and a screening.
MOST_FOLLOWED = 3
# Odds within which another of the same kind is followed: the grid that hypotheses are searched on decides no closer.
SAME_KIND_ODDS = 3.0
# Odds by which a place may lead a listed effect that is taken all the same: what is known goes before what is vague.
# Chosen after open-n, where a push far upstream of all sections led the skewed inflow by 4.7, and a scour hole of the
# blind study that led one section's probes by 7.
KNOWN_FIRST_ODDS = 5.0

What = Literal["effect", "place", "instrument"]
# Kinds of contenders that are in a list.
KNOWN = ("effect", *get_args(InstrumentKind))


def nearly_as_likely(contenders: Sequence[Contender]) -> list[int]:
    """Contenders of the best one's kind within SAME_KIND_ODDS, of others within LEAST_ODDS; MOST_FOLLOWED at most, what
    is known among them where any of it is so likely.
    """
    chance = chances_of(contenders)
    odds = [SAME_KIND_ODDS if one.kind == contenders[0].kind else LEAST_ODDS for one in contenders]
    likely = [j for j, p in enumerate(chance) if p * odds[j] >= chance[0]]
    known = [j for j in likely if contenders[j].kind in KNOWN]
    last = known[0] if known and known[0] not in likely[: MOST_FOLLOWED - 1] else None
    return likely[:MOST_FOLLOWED] if last is None else [*likely[: MOST_FOLLOWED - 1], last]


def chosen_contender(what: Sequence[What], evidence: Array) -> int | None:
    """The likeliest of those followed; where that is a place and leads what is known by less than LEAST_ODDS, or
    another place by less than SAME_KIND_ODDS, the likeliest listed effect within KNOWN_FIRST_ODDS, None without one.

    what, evidence (k,): what each is, and the ln of its evidence [-].
    """
    best = int(np.argmax(evidence))
    ahead = (evidence[best] - evidence) / tempering(evidence[best])
    enough = np.log([SAME_KIND_ODDS if one == "place" else LEAST_ODDS for one in what])
    if what[best] != "place" or np.delete(ahead > enough, best).all():
        return best
    listed = [j for j, one in enumerate(what) if one == "effect" and ahead[j] < np.log(KNOWN_FIRST_ODDS)]
    return min(listed, key=lambda j: float(ahead[j]), default=None)
