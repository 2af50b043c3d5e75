"""How long the trace of a hidden object is in the flow of the stranger that has it, in standard errors.

    python tests/studies/blind_lengths.py [--jobs N] [--runs FOLDER]

An object of the blind study is made as large as makes it six standard errors long in the model's own equations. In the
stranger's, whose mixing and friction are others, the same object leaves a longer or a shorter trace: that of the same
site with it, less that without, whitened and projected as `visible_length` does. Of the objects in the small channel;
one line of JSON each in data/blind/lengths.jsonl, where what stands there is not done again.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from blind import LENGTHS, RUNS, Trial, planned_trials, truth_of, values_by_key
from blind_sets import EDITION, hash_of, length_in_truth

from vegglue.parallel import as_finished, at_most

KIND = "second/twin/unlisted/"


def length_of(trial: Trial, runs: Path) -> dict[str, Any] | None:
    """Key, length asked for and length in truth of one data set; None where nothing could be hidden."""
    with at_most(1):
        made = truth_of(trial, runs / "truths")
        if "left_out" in made:
            return None
        (hidden,) = made["hidden"]
        length = length_in_truth(trial, hidden, hash_of(EDITION + trial.key))
        return {"key": trial.key, "model": hidden["signal"], "truth": length}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument("--runs", type=Path, default=RUNS)
    given = parser.parse_args()
    done = values_by_key(LENGTHS, "truth")
    todo = [
        one for one in planned_trials() if one.key.startswith(KIND) and one.sized == "model" and one.key not in done
    ]
    with LENGTHS.open("a", encoding="utf-8") as file:
        for found in as_finished(length_of, ((trial, given.runs) for trial in todo), given.jobs):
            if found is not None:
                file.write(json.dumps(found) + "\n")
                file.flush()
                print(f"{found['key']}: {found['model']:.2f} {found['truth']:.2f}", flush=True)


if __name__ == "__main__":
    from blind_lengths import main  # by its name, so that workers keep what they know between data sets

    main()
