"""What would mislead every result of a case is said before each command that computes with it, on standard error.

`check` says that and more. A wrong unit is found as an effect with great certainty, by whoever did not ask it.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import vegglue

if TYPE_CHECKING:
    from vegglue.case.schema import Case


def opened_case(config: Path, trust: bool) -> "Case":
    """The case of a config, its measurements doubted aloud. Errors: InputError, as load_case and read_observations."""
    (case,) = opened_cases([config], trust)
    return case


def opened_cases(configs: Sequence[Path], trust: bool) -> "list[Case]":
    """The same of several, each sentence once."""
    cases = [vegglue.load_case(config, trust) for config in configs]
    from vegglue.workflow.check import doubts_of

    for sentence in dict.fromkeys(sentence for case in cases for sentence in doubts_of(case)):
        print(f"Doubtful: {sentence}", file=sys.stderr, flush=True)
    return cases
