"""What would mislead every result of a case is said before each command that computes with it, on standard error.

`check` says that and more. A wrong unit is found as an effect with great certainty, by whoever did not ask it.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import vegglue
from vegglue.wording.sentences import sentence

if TYPE_CHECKING:
    from vegglue.workflow.case_run import CaseRun


def opened_run(config: Path, trust: bool) -> "CaseRun":
    """The run of a config, after warnings about its measurements. Raises InputError."""
    (run,) = opened_runs([config], trust)
    return run


def opened_runs(configs: Sequence[Path], trust: bool) -> "list[CaseRun]":
    """The same of several configs, each warning once."""
    cases = [vegglue.load_case(config, trust) for config in configs]
    from vegglue.workflow.case_run import CaseRun
    from vegglue.workflow.check import critical_warnings

    first, *others = [CaseRun(case) for case in cases]
    several = [first, *(replace(one, beside=first) for one in others)]
    for text in dict.fromkeys(sentence(one) for run in several for one in critical_warnings(run)):
        print(f"Doubtful: {text}", file=sys.stderr, flush=True)
    return several


def print_doubts_of_ensemble(run: "CaseRun") -> None:
    """Warn that the members of a command, if they are kept, do not follow their parameters."""
    if run.case.engine is None or not (run.folder / "ensemble.h5").exists():
        return
    from vegglue.case.resolved_config import simulation_hash
    from vegglue.inference.command_ensemble import doubts_of_predictions
    from vegglue.results.result_files import read_ensemble, stored_hash
    from vegglue.workflow.case_run import as_solved

    path = run.folder / "ensemble.h5"
    if stored_hash(path) == simulation_hash(as_solved(run.case, run.folder)):
        for doubt in doubts_of_predictions(read_ensemble(path)):
            print(f"Doubtful: {sentence(doubt)}", file=sys.stderr, flush=True)
