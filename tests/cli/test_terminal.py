"""How long commands are heard: few lines in a file, one moving line on a terminal, nothing where quiet."""

import io
import sys

import pytest
from rich.console import Console

from vegglue.cli.terminal import moving_line, progress_reporter
from vegglue.progress import Progress, Watch, counted, now_and_then, pace_in_words


def at_seconds() -> tuple[list[str], Watch, list[float]]:
    """Lines said, who watches, and the time on the clock, to be moved."""
    lines, now = list[str](), [0.0]
    return lines, now_and_then(lines.append, lambda: now[0]), now


def test_a_file_gets_a_line_for_each_phase_and_few_within_it() -> None:
    lines, watch, now = at_seconds()
    watch(Progress("calibrating"))
    finished = counted(watch, "solving brook", 600, "members")
    for done in range(1, 601):
        now[0] += 0.05
        finished(done)
    watch(Progress("summing up"))
    assert lines == [
        "... calibrating",
        "... solving brook: 0 of 600 members",
        "... solving brook: 200 of 600 members, 20 a second, 20 s left",
        "... solving brook: 400 of 600 members, 20 a second, 10 s left",
        "... solving brook: 600 of 600 members, 20 a second",
        "... summing up",
    ]


def test_a_progress_says_what_failed_and_what_was_there() -> None:
    told = Progress("solving brook", 1200, 5000, "members", failed=3, resumed=1000)
    assert str(told) == "solving brook: 1,200 of 5,000 members (1,000 from before), 3 failed"


@pytest.mark.parametrize(
    ("done", "seconds", "expected"),
    [
        (0, 5.0, ""),
        (50, 1.0, ", 50 a second, 2 s left"),
        (20, 600.0, ", 2.0 a minute, 40 min left"),
        (1, 3600.0, ", 1.0 an hour, 80.0 h left"),
        (3, 2.0, ", 1.5 a second, 53 s left"),
        (1, 12.0, ", 5.0 a minute"),  # too early to tell
    ],
)
def test_rate_and_time_left(done: int, seconds: float, expected: str) -> None:
    assert pace_in_words(Progress("x", 20, 100), done, seconds) == expected


def test_a_terminal_gets_one_line_that_is_gone_in_the_end() -> None:
    screen = Console(file=io.StringIO(), force_terminal=True, width=100, markup=False)
    with moving_line(screen) as watch:
        watch(Progress("calibrating with discharge_error[high]"))
        counted(watch, "solving brook", 64, "members")(32)
        screen.file.flush()
    said = screen.file.getvalue()
    assert "32 of 64 members" in said
    assert said.count("\n") <= 2, "it is one line"
    assert said.rstrip("\x1b[?25h").endswith("\x1b[2K"), "and is wiped out"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("quiet", [True, False])
def test_an_object_has_standard_output_for_itself(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quiet: bool
) -> None:
    with progress_reporter(quiet, as_object=True) as watch:
        watch(Progress("calibrating"))
    assert capsys.readouterr() == ("", "")
    with progress_reporter(quiet, as_object=False) as watch:
        watch(Progress("calibrating"))
    assert capsys.readouterr() == ("" if quiet else "... calibrating\n", "")


def test_a_terminal_that_takes_no_line_back_gets_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stdout", screen)
    monkeypatch.setenv("TERM", "dumb")
    with progress_reporter(quiet=False, as_object=False) as watch:
        watch(Progress("calibrating"))
    assert screen.getvalue() == "... calibrating\n"
