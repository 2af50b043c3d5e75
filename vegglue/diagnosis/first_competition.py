"""The first competition of a diagnosis before there is a residual: how often an effect is named that is in it.

    T_k = l c_k + e_k,   c_k = U_k' S_perp / |S_perp|

T_k are the scores of all hypotheses (`score_test`) if an effect with the trace S, l standard errors long, and errors
alone make the residual; e_k are the scores of errors alone. The diagnosis is alarmed if the sum of all Bayes factors is
above its level. Of the tempered chances of `competition` it then takes what is likeliest, an effect before a place that
does not lead by known_first_odds, and reports the fewest groups of similar effects that hold set_chance
(`search_state.rivals_among`; here the group of an effect is all that are similar to it). Named means that the true
effect is among them. Refits, and what is found beside a first effect, are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array, Mask, Single
from vegglue.calibration.score_test import HypothesisKind, Projected, prior_shrinkage, with_more_rows
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import tempering
from vegglue.parallel import in_threads

# Lengths l at which the chance to be named is computed [standard errors]; between them it is linear, from 0 at 0.
NAMED_AT = np.array([0.0, 2.0, 3.0, 4.0, 4.75, 5.5, 6.5, 8.0, 11.0, 16.0, 24.0])
# Draws of errors alone for each: a chance of 90 % is known to 2 %.
NAMED_DRAWS = 192
# |cosine| with a trace below which a spot or an instrument keeps the evidence that it has under errors alone [-].
UNLIKE = 0.3


@dataclass(frozen=True)
class FirstCompetition:
    """Hypotheses, first those of listed effects, then one of each other kind; of each column k: its owner among them,
    only_sign, ln evidence = constant + factor T^2, units (rows, k), and scores T under errors alone (draws, k);
    places: which of the other kinds are places; alike (effects, effects); level: of the alarm.
    """

    effects: int
    places: Mask
    alike: Mask
    level: float
    owner: np.ndarray
    only_sign: np.ndarray
    constant: Single
    factor: Single
    units: Single
    scores: Single

    def named(self, effect: int, truths: Projected) -> Array:
        """Chance that an effect is named at each of NAMED_AT (lengths,), over its truths (rows, t) in turn."""
        draw = np.arange(len(self.scores))
        cosine = self.units.T @ truths.units.astype(np.float32)
        truth = draw % cosine.shape[1]
        own = self.only_sign[self.owner == effect]
        sign = float(own[0]) if own.any() else np.where((draw // cosine.shape[1]) % 2 == 0, 1.0, -1.0)
        near = (self.owner < self.effects) | (np.abs(cosine).max(axis=1) > UNLIKE)
        quiet = np.exp(self._evidence(self.scores[:, ~near], ~near))
        of_quiet = np.zeros((draw.size, self.effects + self.places.size))
        _add_by_owner(of_quiet, quiet, self.owner[~near])
        scores, shift = self.scores[:, near], (cosine[near][:, truth] * sign).T.astype(np.float32)
        chances = [0.0]
        for length in NAMED_AT[1:]:
            evidence = self._evidence(scores + np.float32(length) * shift, near)
            most = evidence.max(axis=1)[:, None]
            evidence -= most
            found = of_quiet * np.exp(-most.astype(float))
            _add_by_owner(found, np.exp(evidence, out=evidence), self.owner[near])
            chances.append(self._named(np.log(np.maximum(found, 1e-300)) + most, effect))
        return np.array(chances)

    def _evidence(self, scores: Single, columns: Mask) -> Single:
        """ln evidence of some columns (draws, k), in the memory of their scores."""
        sign = self.only_sign[columns]
        scores[:, sign > 0] = np.maximum(scores[:, sign > 0], 0.0)
        scores[:, sign < 0] = np.minimum(scores[:, sign < 0], 0.0)
        scores *= scores
        scores *= self.factor[columns]
        scores += self.constant[columns]
        return scores

    def _named(self, evidence: Array, effect: int) -> float:
        """Share of the draws in which an effect is named, of ln evidence (draws, hypotheses)."""
        chance = np.exp((evidence - evidence.max(axis=1)[:, None]) / tempering(evidence))
        chance /= chance.sum(axis=1)[:, None]
        listed, others = chance[:, : self.effects], evidence[:, self.effects :]
        best = evidence[:, : self.effects].max(axis=1)
        of_places = others[:, self.places].max(axis=1, initial=-np.inf)
        of_instruments = others[:, ~self.places].max(axis=1, initial=-np.inf)
        taken = (of_places - best) / tempering(of_places) < np.log(constants().known_first_odds)
        taken &= (best >= of_instruments) & (logsumexp(evidence, axis=1) >= self.level)
        # The groups that are likelier than its own hold less than set_chance.
        groups = listed @ self.alike
        likelier = (groups > groups[:, effect][:, None]) & ~self.alike[effect]
        inside = (listed * likelier).sum(axis=1) < constants().set_chance * listed.sum(axis=1)
        inside &= listed[:, effect] >= constants().rival_share * chance.max(axis=1)
        return float(np.mean(taken & inside))


def _add_by_owner(sums: Array, values: Single, owner: np.ndarray) -> None:
    """Add columns of values (draws, k) to the sums of their owners (draws, hypotheses); owners are in order."""
    if owner.size:
        some, first = np.unique(owner, return_index=True)
        sums[:, some] += np.add.reduceat(values, first, axis=1)


def first_competition(
    kinds: Sequence[HypothesisKind], columns: Sequence[np.ndarray], places: Sequence[str], errors: Array, level: float
) -> FirstCompetition:
    """Of a screening without a residual.

    Parameters
    ----------
    kinds : sequence of HypothesisKind
        That of listed effects first.
    columns : sequence of array
        Columns of each listed effect, side by side.
    places : sequence of str
        Names of the kinds that are places.
    errors : array (draws, n)
        Whitened errors alone [-], NAMED_DRAWS of them are used.
    level : float
        ln of the sum of Bayes factors at which the diagnosis is alarmed [-].

    Returns
    -------
    FirstCompetition
    """
    effects = len(columns)
    of_others = [one.size.size for one in kinds[1:]]
    size = np.concatenate([one.size for one in kinds])
    units = np.hstack([one.projected.units for one in kinds]).astype(np.float32)
    likeness = np.abs(kinds[0].projected.units.T @ kinds[0].projected.units) > constants().alike_cosine
    first = [int(one[np.argmax(kinds[0].size[one])]) for one in columns]
    return FirstCompetition(
        effects=effects,
        places=np.array([one.name in places for one in kinds[1:]], dtype=bool),
        alike=likeness[np.ix_(first, first)],
        level=level,
        owner=np.repeat(np.arange(effects + len(of_others)), [*(one.size for one in columns), *of_others]),
        only_sign=np.concatenate([one.only_sign for one in kinds]),
        constant=np.concatenate([one.of_scores(np.zeros(one.size.size)) for one in kinds]).astype(np.float32),
        factor=(0.5 * prior_shrinkage(size)).astype(np.float32),
        units=units,
        scores=with_more_rows(errors[:NAMED_DRAWS], len(units), 2) @ units,
    )


def chances_named(competition: FirstCompetition, truths: Sequence[Projected]) -> Array:
    """`FirstCompetition.named` of each listed effect (effect, lengths)."""
    return np.array(in_threads(competition.named, list(enumerate(truths))))
