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
