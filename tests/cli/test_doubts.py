"""A wrong unit or sign is said by every command that computes with the measurements, whether or not anyone checked."""

from pathlib import Path

import pytest
from reach import COARSE, Say, write_reach

import vegglue
from vegglue.errors import InputError

COMMANDS = {
    "simulate": ["simulate"], "infer": ["infer"], "report": ["report"], "run": ["run"], "diagnose": ["diagnose"],
    "discover": ["discover"], "extend_stepwise": ["extend", "--auto"], "compare": ["compare"],
    "next_measurement": ["next"], "plan": ["plan"],
}  # fmt: skip


def stop(*arguments: object, **more: object) -> None:
    raise InputError("no further.")


def multiplied(folder: Path, times: float) -> None:
    """All velocities of the brook in another unit."""
    path = folder / "velocities.csv"
    heading, *rows = path.read_text(encoding="utf-8").splitlines()
    place = heading.split(",").index("u")
    fields = [row.split(",") for row in rows]
    changed = [[*row[:place], f"{times * float(row[place]):g}", *row[place + 1 :]] for row in fields]
    path.write_text("\n".join([heading, *(",".join(row) for row in changed)]) + "\n", encoding="utf-8")


@pytest.mark.parametrize("verb", COMMANDS)
@pytest.mark.parametrize(("times", "doubt"), [(100.0, "cm/s"), (-1.0, "run upstream"), (1.0, None)])
def test_a_command_doubts_what_no_flow_can_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, verb: str, times: float,
    doubt: str | None,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    write_reach(tmp_path, COARSE)
    multiplied(tmp_path, times)
    monkeypatch.setattr(vegglue, verb, stop, raising=False)
    code, said = say(*COMMANDS[verb], "brook.yaml", "--quiet")
    *doubts, last = said.splitlines()
    assert (code, last) == (2, "no further.")
    assert len(doubts) == (doubt is not None)
    assert all(one.startswith("Doubtful: ") and doubt in one for one in doubts if doubt)
