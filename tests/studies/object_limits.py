"""How often a hidden object could be told at most: were the model right but for it, and all else of it unknown.

    python tests/studies/object_limits.py

As in `place_limits` everything is to first order, and a residual is the trace of what is hidden, as long as was asked
for, and errors as the noise allows, those of the model and its site among them. But nobody knows what is hidden: listed
effects, places of every term and size, and instruments compete, and it is told by the rules of a diagnosis. What is
lost here is lost in the data. Of objects and of listed effects in the small channel that data/blind/records.jsonl
holds; one line of JSON each in data/blind/object_limits.jsonl, where what stands there is not done again.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from blind import KEPT, OBJECT_LIMITS, Trial, planned_trials, records_in, values_by_key
from blind_definitions import NEAR, Record
from blind_sets import hash_of, place_number, place_of, sizing_errors
from place_limits import traces_of
from scipy.special import logsumexp

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import cause_of, instruments_of, offset_columns
from vegglue.calibration.fingerprints import Fingerprints, fingerprints_of
from vegglue.calibration.noise import Noise, noise_of
from vegglue.calibration.residual_screening import kind_of_listed, kinds_of_instruments, kinds_of_places
from vegglue.calibration.score_test import HypothesisKind
from vegglue.case.channel_geometry import half_width
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import What, chosen_hypothesis
from vegglue.diagnosis.odds import tempered_probabilities
from vegglue.engine.interface import responses
from vegglue.parallel import at_most
from vegglue.workflow.hidden_effect import candidate_of

# Draws of errors for each of what is hidden, and of errors alone for the alarm [-].
DRAWS, NULL_DRAWS = 200, 3000
GROUPS = ("unlisted", "listed6", "listed3")


@dataclass(frozen=True)
class Observer:
    """Who knows the site, its errors, and all that may be missing. noise: those errors; slopes (n, p): of predictions,
    whitened; kinds: of hypotheses, see `Screening`; alarm: ln of the sum of evidence that errors alone exceed in
    false_alarm_rate of draws [-].
    """

    noise: Noise
    slopes: Array
    fingerprints: Fingerprints
    kinds: tuple[HypothesisKind, ...]
    alarm: float

    @property
    def rows(self) -> int:
        """Rows of a residual, those of the prior among them."""
        return int(self.kinds[0].projected.residual.size)


@dataclass(frozen=True)
class Evidence:
    """ln evidence of each listed effect, place and instrument's kind, (c, draws) [-]."""

    effects: Array
    places: Array
    instruments: Array


@lru_cache(maxsize=8)
def observer_at(study: str, place: int) -> Observer:
    """The observer of a site at one true place, before anything is measured."""
    base, columns = place_of(study, place)
    noise = sizing_errors(base, noise_of(base.model.station), columns)
    fingerprints = fingerprints_of(SearchModel(base.model, noise, base.here), half_width(base.model.site))
    instruments = instruments_of(base.model.station.iloc[noise.rows])
    slopes = noise.whiten(noise.used(base.here.slope))

    def against(values: Array) -> score_test.Projected:
        return projected_on(noise, slopes, values)

    of_places = {one.term: against(noise.used(one.fingerprints)) for one in fingerprints.places}
    columns_of = {name: offset_columns(some, noise.rows.size) for name, some in instruments.items() if some}
    kinds = (
        kind_of_listed(fingerprints, against(noise.used(fingerprints.values))),
        *kinds_of_places(fingerprints, of_places),
        *kinds_of_instruments(noise, instruments, {name: against(some) for name, some in columns_of.items()}, ()),
    )
    unalarmed = Observer(noise, slopes, fingerprints, kinds, 0.0)
    alone = np.random.default_rng(1).standard_normal((unalarmed.rows, NULL_DRAWS))
    return replace(
        unalarmed, alarm=float(np.quantile(_total(_evidence(unalarmed, alone)), 1.0 - constants().false_alarm_rate))
    )


def projected_on(noise: Noise, slopes: Array, values: Array) -> score_test.Projected:
    """What calibration leaves of changes of readings (n, c), beside a residual of nothing."""
    nothing, z = np.zeros(len(slopes)), np.zeros(slopes.shape[1])
    return score_test.project(slopes, nothing, z, noise.whiten(values))


def _evidence(observer: Observer, residuals: Array) -> Evidence:
    """Of residuals (rows, draws), whitened."""
    columns = []
    for kind in observer.kinds:
        scores = (kind.projected.units.T @ residuals).T
        columns.append(kind.of_scores(np.where(kind.only_sign * scores < 0, 0.0, scores)).T)
    fingerprints = observer.fingerprints
    effects = np.stack([logsumexp(columns[0][some], axis=0) for some in fingerprints.columns])
    after = 1 + len(fingerprints.places)
    instruments = np.stack([logsumexp(one, axis=0) for one in columns[after:]])
    return Evidence(effects, np.concatenate(columns[1:after]), instruments)


def _total(evidence: Evidence) -> Array:
    return np.asarray(logsumexp(np.concatenate([evidence.effects, evidence.places, evidence.instruments]), axis=0))


def shares(trial: Trial, hidden: dict[str, Any]) -> dict[str, float]:
    """Shares of draws [-]. told: none of what is known is told; evenly: it would be told wherever it is likelier than
    not; near: it is told, and the likeliest place lies near; guessed: the circle of NEAR that most likely holds the
    object does so, told or not: nobody comes near more often.
    """
    observer = observer_at(trial.case, place_number(trial))
    errors = np.random.default_rng(hash_of(trial.key)).standard_normal((observer.rows, DRAWS))
    evidence = _evidence(observer, trial.signal * _unit_trace(trial, hidden, observer) + errors)
    alarmed = _total(evidence) > observer.alarm
    terms = _of_terms(observer.fingerprints, evidence.places)
    told = alarmed & [_is_told(evidence.effects[:, d], terms[:, d], evidence.instruments[:, d]) for d in range(DRAWS)]
    evenly = alarmed & (logsumexp(terms, axis=0) > _total(evidence) - np.log(2.0))
    found = {"told": told, "evenly": evenly}
    if hidden["x"] is not None:
        likeliest, guess = _places_told(observer.fingerprints, evidence.places)
        object_at = np.array([hidden["x"], hidden["y"]])
        near, guessed = (np.linalg.norm(one - object_at, axis=1) <= NEAR for one in (likeliest, guess))
        found |= {"near": told & near, "guessed": guessed}
    return {name: float(np.mean(one)) for name, one in found.items()}


def _unit_trace(trial: Trial, hidden: dict[str, Any], observer: Observer) -> Array:
    """What calibration leaves of the trace of what is hidden, of length one (rows, 1)."""
    base, _ = place_of(trial.case, place_number(trial))
    name, shapes = hidden["name"], hidden["shapes"]
    if hidden["x"] is None:
        trace = responses(base.model, base.here, [cause_of(base.model.case, candidate_of(base.model, name), shapes)])
    else:
        trace = traces_of(trial.case, place_number(trial), name, [shapes])
    return projected_on(observer.noise, observer.slopes, observer.noise.used(trace)).units


def _of_terms(fingerprints: Fingerprints, places: Array) -> Array:
    """ln evidence of each term anywhere (term, draws), of that of all places (c, draws)."""
    ends = np.cumsum([one.x.size for one in fingerprints.places])
    return np.stack([logsumexp(one, axis=0) for one in np.split(places, ends[:-1])])


def _is_told(effects: Array, terms: Array, instruments: Array) -> bool:
    """Whether none of what is known is told, as a diagnosis decides it, see `hypothesis_choice`."""
    what: Sequence[What] = ["effect"] * effects.size + ["place"] * terms.size + ["instrument"] * instruments.size
    evidence = np.concatenate([effects, terms, instruments])
    chances = tempered_probabilities(evidence)
    best = int(np.argmax(evidence))
    alone = np.sum(chances * constants().strong_odds >= chances[best]) == 1
    at_a_place = float(chances[effects.size : effects.size + terms.size].sum())
    taken = best if alone else chosen_hypothesis(what, evidence, at_a_place)
    return taken is not None and what[taken] == "place"


def _places_told(fingerprints: Fingerprints, places: Array) -> tuple[Array, Array]:
    """The likeliest place, and the middle of the circle of NEAR that holds most of the chance, (draws, 2) [m]."""
    spots = np.concatenate([np.stack([one.x, one.y], axis=1) for one in fingerprints.places])
    middles = np.unique(spots, axis=0)
    within = np.linalg.norm(middles[:, None] - spots[None], axis=2) <= NEAR
    chance = np.exp(places - places.max(axis=0))
    return spots[np.argmax(places, axis=0)], middles[np.argmax(within @ chance, axis=0)]


def looked_into(trial: Trial, record: Record) -> bool:
    """Whether one effect or object is hidden in the small channel, and nothing else."""
    alike = trial.truth == "second" and trial.case == "twin" and trial.group in GROUPS
    return alike and len(record.get("hidden", [])) == 1


def main() -> None:
    done, trials = values_by_key(OBJECT_LIMITS, "told"), {trial.key: trial for trial in planned_trials()}
    records = [one for one in records_in(KEPT) if one["key"] in trials and one["key"] not in done]
    with OBJECT_LIMITS.open("a", encoding="utf-8") as file, at_most(-1):
        for record in records:
            trial = trials[record["key"]]
            if not looked_into(trial, record):
                continue
            found = {"key": trial.key} | shares(trial, record["hidden"][0])
            file.write(json.dumps(found) + "\n")
            file.flush()
            print(found, flush=True)


if __name__ == "__main__":
    main()
