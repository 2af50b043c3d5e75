"""How often the place of a hidden object could be told at most, were the model right but for that object.

    python tests/studies/place_limits.py [--jobs N]

Everything is to first order: the residual is the trace of the hidden object, as long as was asked for, and errors as
the noise allows. Its kind and its size across are known; the place told is the likeliest of a grid. So what is lost
here is lost by errors and by alike traces, and not by a flow or a site that differ from the model's. Of the objects in
the small channel that data/blind/records.jsonl holds; one line of JSON each in data/blind/place_limits.jsonl, where
what stands there is not done again.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from blind import KEPT, PLACE_LIMITS, Trial, planned_trials, records_in, values_by_key
from blind_definitions import NEAR, Record
from blind_lengths import KIND
from blind_sets import hash_of, place_number, place_of, sizing_errors

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.candidates import cause_of
from vegglue.calibration.noise import noise_of
from vegglue.engine.interface import responses
from vegglue.parallel import as_finished, at_most
from vegglue.workflow.hidden_effect import Hidden, candidate_of, with_unlisted_objects

# Places that are tried lie so far apart along and across [m]: a third of what counts as near, and two rows of cells.
STEP = (0.5, 0.375)
DRAWS = 200
# Traces made at once [-]: some hundred megabytes of right-hand sides.
TOGETHER = 60


@lru_cache(maxsize=8)
def traces_at(study: str, place: int, name: str, radius: float) -> tuple[Array, Array]:
    """Places x, y (p, 2) [m] over the channel, and the trace (station, p) of an object of that kind at each."""
    base, _ = place_of(study, place)
    (low, high), (right, left) = base.model.case.grid.x, base.model.case.grid.y
    x, y = np.arange(low + STEP[0], high, STEP[0]), np.arange(right + STEP[1], left, STEP[1])
    places = np.stack([each.ravel() for each in np.meshgrid(x, y)], axis=1)
    shapes = [{"x": float(along), "y": float(across), "radius": radius} for along, across in places]
    return places, traces_of(study, place, name, shapes)


def traces_of(study: str, place: int, name: str, shapes: Sequence[dict[str, float]]) -> Array:
    base, _ = place_of(study, place)
    case = with_unlisted_objects(base.model.case, Hidden(name, 0.0, shapes[0], 0.0))
    causes = [cause_of(case, candidate_of(base.model, name), some) for some in shapes]
    parts = [causes[first : first + TOGETHER] for first in range(0, len(causes), TOGETHER)]
    return np.concatenate([responses(replace(base.model, case=case), base.here, part) for part in parts], axis=1)


def share_near(trial: Trial, hidden: dict[str, Any]) -> float:
    """Share of draws of the errors in which the likeliest place lies near the true one [-]."""
    study, place, shapes = trial.case, place_number(trial), hidden["shapes"]
    base, columns = place_of(study, place)
    places, traces = traces_at(study, place, hidden["name"], shapes["radius"])
    errors = sizing_errors(base, noise_of(base.model.station), columns)
    every = np.column_stack([traces_of(study, place, hidden["name"], [shapes]), traces])
    white, slopes = errors.whiten(errors.used(every)), errors.whiten(errors.used(base.here.slope))
    units = score_test.project(slopes, white[:, 0], np.zeros(slopes.shape[1]), white).units
    noise = np.random.default_rng(hash_of(trial.key)).standard_normal((units.shape[0], DRAWS))
    scores = units[:, 1:].T @ (trial.signal * units[:, :1] + noise)
    told = places[np.argmax(scores**2, axis=0)]
    return float(np.mean(np.hypot(told[:, 0] - shapes["x"], told[:, 1] - shapes["y"]) <= NEAR))


def limit_of(trial: Trial, record: Record) -> dict[str, Any]:
    """Key and share of draws of one data set."""
    with at_most(1):
        return {"key": trial.key, "near": share_near(trial, record["hidden"][0])}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=-1)
    given = parser.parse_args()
    done, trials = values_by_key(PLACE_LIMITS, "near"), {trial.key: trial for trial in planned_trials()}
    made = [one for one in records_in(KEPT) if one["key"].startswith(KIND) and one.get("hidden")]
    todo = [(trials[one["key"]], one) for one in made if one["key"] not in done]
    with PLACE_LIMITS.open("a", encoding="utf-8") as file:
        for found in as_finished(limit_of, todo, given.jobs):
            file.write(json.dumps(found) + "\n")
            file.flush()
            print(f"{found['key']}: {found['near']:.2f}", flush=True)


if __name__ == "__main__":
    from place_limits import main  # by its name, so that workers keep what they know between data sets

    main()
