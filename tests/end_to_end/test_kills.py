"""A share of what `make faults` does: commands killed at random moments, which then finish with the same bits."""

from pathlib import Path

import numpy as np
import pytest
from kills import COMMANDS, Step, disturbed, load_all, steps

KILLS = 10
# Quick ones of each kind: configs among files of a user, a picture, an ensemble that grows, a result of two files.
SOME = [command for command in COMMANDS if command[0] in ("import", "check", "twin", "simulate", "infer")]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> list[Step]:
    folder = tmp_path_factory.mktemp("kills")
    load_all(folder / "loaded", SOME)
    return steps(folder / "work", folder, SOME)


@pytest.mark.slow
def test_a_killed_command_finishes_with_the_same_bits(undisturbed: list[Step], tmp_path: Path) -> None:
    work = undisturbed[0].before.parent / "work"
    shares = np.random.default_rng(7).uniform(0.0, 1.0, KILLS)
    in_time = [disturbed(undisturbed[number % len(SOME)], work, share) for number, share in enumerate(shares)]
    assert any(in_time)  # how many come before the end is a matter of the machine's other work
