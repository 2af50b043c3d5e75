"""How often measurements could say what a hidden law depends on, were the model right but for that law.

    python tests/studies/law_angles.py [--draws N]

Everything is to first order: the residual is the trace of a hidden law, as long as in the study of laws, and errors as
the noise allows. So what is lost here is lost by alike traces and by the width of the set, and not by a flow or a site
that differ from the model's. One line of JSON for each hidden law at each true place of the prior, in
data/blind/law_angles.jsonl: `laws.py --page` puts their shares into docs/discover.md.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from blind_sets import PLACES, place_of
from hidden_laws import EFFECTS, HIDDEN_LAWS, HiddenLaw
from law_answers import LISTED_SAYS, Said, is_true
from law_limits import WAYS
from law_sets import LAW_EDITION, RATIOS, STUDY, knowing_hidden

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.candidates import Candidate, cause_of
from vegglue.calibration.law_screening import LawScreening, law_fingerprints, screen_laws
from vegglue.calibration.residual_screening import GROUPS
from vegglue.calibration.score_test import log_factors
from vegglue.decision_constants import constants
from vegglue.diagnosis.law_search import HELD, MOST_QUANTITIES
from vegglue.diagnosis.odds import chances_in_set
from vegglue.engine.interface import responses
from vegglue.parallel import at_most

ANGLES = Path(__file__).parents[2] / "data" / "blind" / "law_angles.jsonl"
# A hidden law is left out where the plausible strength leaves less than this [standard errors]: the study of laws
# hides none that must be four times as strong to leave its ratio.
LEAST_SEEN = RATIOS["law"][0] / 4.0


@dataclass(frozen=True)
class Rival:
    """Something that competes: what it says, and of each of its columns the unit trace u (rows, c), the size a (c,) and
    ln prior (c,); law: whether it is of the grammar.
    """

    said: Said
    units: Array
    size: Array
    log_prior: Array
    only_sign: np.ndarray
    law: bool

    def log_evidence(self, residual: Array) -> float:
        """Of all its columns together, for a residual (rows,)."""
        score = self.units.T @ residual
        score = np.where(self.only_sign * score < 0.0, 0.0, score)
        return float(np.logaddexp.reduce(log_factors(score, self.size) + self.log_prior))


def rivals_of(screening: LawScreening) -> list[Rival]:
    """Listed effects, quantities of terms with all their laws, and places and instruments by kind."""

    def rival(kind: Any, said: Said, columns: Any, law: bool = False) -> Rival:
        parts = (kind.projected.units[:, columns], kind.size[columns], kind.log_prior[columns])
        return Rival(said, *parts, kind.only_sign[columns], law)

    listed, *others = screening.listed.kinds
    traces = screening.listed.fingerprints
    pairs = list(zip(traces.candidates, traces.columns, strict=True))
    found = [rival(listed, LISTED_SAYS.get(one.effect.name, ("", "")), columns) for one, columns in pairs]
    found += [rival(kind, ("", ""), slice(None)) for kind in others]
    for said, laws in screening.subjects.items():
        columns = np.concatenate([screening.columns[law] for law in laws])
        found.append(rival(screening.kind, said, columns, law=True))
    return found


def true_rival(base: Baseline, screening: LawScreening, law: HiddenLaw) -> Rival:
    """The hidden law itself at its middle reference, as likely before as a quantity of a term."""
    listed = screening.listed
    model = replace(listed.search.model, case=knowing_hidden(listed.search.model.case))
    effect = next(one for one in EFFECTS if one.name == law.name)
    cause = cause_of(model.case, Candidate(effect), {shape.name: shape.default for shape in effect.shapes})
    noise, values = listed.base.noise, responses(model, listed.search.point, [cause])
    residual = np.zeros(noise.rows.size)
    trace = noise.whiten(noise.used(values))
    seen = score_test.project(listed.whitened_slopes, residual, base.fitted.point.z, trace)
    prior = np.full(1, -np.log(GROUPS * constants().listed_over_laws * len(screening.subjects)))
    return Rival(
        (law.term, law.quantity), seen.units, effect.amplitude.scale * seen.length, prior, np.zeros(1, bool), True
    )


def chances_told(rivals: Sequence[Rival], residual: Array, whole: bool) -> list[tuple[Said, float]]:
    """What the set that holds HELD says, best first; whole: with all the evidence that the errors of the data leave,
    none taken back for fingerprints that differ from nature's.
    """
    evidence = np.array([one.log_evidence(residual) for one in rivals])
    laws = np.flatnonzero([one.law for one in rivals])
    kept = np.ones(evidence.size, bool)
    kept[laws[np.argsort(-evidence[laws])[MOST_QUANTITIES:]]] = False
    evidence = np.where(kept, evidence, -np.inf)
    weight = np.exp(evidence - evidence.max())
    chance = weight / weight.sum() if whole else chances_in_set(evidence)
    order = np.argsort(-chance)
    count = int(np.searchsorted(np.cumsum(chance[order]), HELD)) + 1
    return [(rivals[int(j)].said, float(chance[j])) for j in order[:count]]


def counted(
    law: HiddenLaw, truth: Rival, rivals: Sequence[Rival], draws: int, random: np.random.Generator
) -> dict[str, dict[str, float]]:
    """Shares of draws in which the right quantity is in the set, and alone in it, for three ways to weigh."""
    tried = ((rivals, False), (rivals, True), ([*rivals, truth], True))
    ways = dict(zip(WAYS, tried, strict=True))
    found: dict[str, list[tuple[bool, bool]]] = {name: [] for name in ways}
    for _ in range(draws):
        sign = float(random.choice([-1.0, 1.0]))
        residual = sign * RATIOS["law"][0] * truth.units[:, 0] + random.standard_normal(truth.units.shape[0])
        for name, (some, whole) in ways.items():
            right = [is_true(law, said) for said, _ in chances_told(some, residual, whole)]
            found[name].append((any(right), all(right)))
    shares = {name: [round(float(share), 3) for share in np.mean(of, axis=0)] for name, of in found.items()}
    return {name: dict(zip(("in set", "alone"), pair, strict=True)) for name, pair in shares.items()}


def nearest_other(law: HiddenLaw, truth: Rival, rivals: Sequence[Rival]) -> tuple[float, Said]:
    """Largest |cosine| of the trace of the hidden law with that of something that says anything else."""
    others = [one for one in rivals if not is_true(law, one.said) and one.units.size]
    cosine = [float(np.abs(one.units.T @ truth.units[:, 0]).max()) for one in others]
    best = int(np.argmax(cosine))
    return cosine[best], others[best].said


def angles_at(place: int, draws: int) -> list[dict[str, Any]]:
    """All hidden laws at one true place."""
    ground, _ = place_of(STUDY, place)
    station = ground.model.station.assign(value=ground.here.prediction)
    base = baseline(replace(ground.model, station=station), ground.here.z)
    screening = screen_laws(base, law_fingerprints(base))
    rivals, random, found = rivals_of(screening), np.random.default_rng((place, 23)), []
    for law in HIDDEN_LAWS:
        truth = true_rival(base, screening, law)
        if float(truth.size[0]) < LEAST_SEEN:
            continue
        cosine, said = nearest_other(law, truth, rivals)
        record = {"edition": LAW_EDITION, "place": place, "hide": law.name, "nearest": round(cosine, 3), "says": said}
        found.append(record | counted(law, truth, rivals, draws, random))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--draws", type=int, default=60, help="draws of errors for each hidden law at each place")
    given = parser.parse_args()
    with ANGLES.open("w", encoding="utf-8") as file, at_most(1):
        for place in range(PLACES):
            for record in angles_at(place, given.draws):
                file.write(json.dumps(record) + "\n")
                file.flush()


if __name__ == "__main__":
    main()
