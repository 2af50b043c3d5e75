"""One run of a command: what it is given, what it has to leave, and every way in which it may fail."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from threading import Event, Timer

import numpy as np
import pytest
from commands import commanded

from vegglue.engine import command
from vegglue.engine.command import (
    BadPredictionsError,
    CommandEnd,
    parameters_text,
    read_predictions,
    run_command_once,
    stations_text,
)
from vegglue.measurements.observations import read_observations

GOOD = "open('predictions.csv', 'w').write('station,prediction\\n1,0.5\\n0,0.25\\n')"


def ended(folder: Path, program: str, timeout: float = 20.0, stop: Event | None = None) -> CommandEnd:
    words = (sys.executable, "-I", "-S", "-c", program)
    return run_command_once(words, folder / "run", {"given.txt": "seven"}, 2, timeout, stop or Event())


def test_a_good_run_gives_its_predictions_in_the_order_of_the_stations(tmp_path: Path) -> None:
    end = ended(tmp_path, f"assert open('given.txt').read() == 'seven'; {GOOD}")
    assert end.prediction is not None
    np.testing.assert_array_equal(end.prediction, [0.25, 0.5])
    assert (end.reason, end.seconds > 0.0) == ("", True)


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("import sys; print('no grid'); sys.exit(3)", "the command ended with exit code 3, and said: no grid"),
        ("import sys; sys.exit(4)", "the command ended with exit code 4, and said nothing; see command.log"),
        ("1 / 0", "the command ended with exit code 1, and said: ZeroDivisionError: division by zero"),
        ("import os; os.kill(os.getpid(), 9)", "the command ended with signal 9, and said nothing; see command.log"),
        ("pass", "the command ended well and left no predictions.csv"),
    ],
)
def test_a_run_that_ends_badly_says_why(tmp_path: Path, program: str, reason: str) -> None:
    end = ended(tmp_path, program)
    assert end.prediction is None
    assert end.reason == reason


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "row 1: expected station,prediction, got ''"),
        ("station,u\n0,1\n", "row 1: expected station,prediction, got 'station,u'"),
        ("station,prediction\n0,1\n", "no prediction of station 1"),
        ("station,prediction\n", "no prediction of station 0 and 1 more"),
        ("station,prediction\n0,1\n1,nan\n", "row 3: expected a station and a finite number, got '1,nan'"),
        ("station,prediction\n0,1\n1,inf\n", "row 3: expected a station and a finite number, got '1,inf'"),
        ("station,prediction\n0,1\n1,-1e300\n", "row 3: expected a prediction of at most 1e+09, got -1e+300"),
        ("station,prediction\n0,1\n1,wet\n", "row 3: expected a station and a finite number, got '1,wet'"),
        ("station,prediction\n0,1\n1,\n", "row 3: expected a station and a finite number, got '1,'"),
        ("station,prediction\n0,1\n1\n", "row 3: expected a station and a finite number, got '1'"),
        ("station,prediction\n0,1\n1,2,3\n", "row 3: expected a station and a finite number, got '1,2,3'"),
        ("station,prediction\n0,1\n2,1\n", "row 3: expected a station from 0 to 1, got 2"),
        ("station,prediction\n0,1\n0,1\n", "row 3: station 0 stands there twice"),
    ],
)
def test_bad_predictions_are_told_by_row(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "predictions.csv").write_text(text, encoding="utf-8")
    with pytest.raises(BadPredictionsError) as told:
        read_predictions(tmp_path / "predictions.csv", 2)
    assert reason in str(told.value)


def test_predictions_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "predictions.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadPredictionsError, match="not text in UTF-8"):
        read_predictions(tmp_path / "predictions.csv", 2)


def is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return "(zombie)" not in Path(f"/proc/{process}/status").read_text() if Path("/proc").exists() else True


def test_a_run_that_takes_too_long_is_ended_with_all_it_has_started(tmp_path: Path) -> None:
    program = (
        "import subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        "open('child', 'w').write(str(child.pid)); time.sleep(60)\n"
    )
    end = ended(tmp_path, program, timeout=1.0)
    assert end.reason == "the command did not end within 1 s and was stopped"
    child = int((tmp_path / "run" / "child").read_text())
    until = time.monotonic() + 5.0
    while is_alive(child) and time.monotonic() < until:
        time.sleep(0.02)
    assert not is_alive(child)


def test_a_run_that_prints_without_end_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "LONGEST_LOG", 10_000_000)
    end = ended(tmp_path, "while True: print('no end', flush=True)")
    assert end.reason == "the command printed more than 0.01 GB and was stopped"
    assert not (tmp_path / "run" / "command.log").exists()


def test_a_run_that_nobody_waits_for_any_more_is_ended(tmp_path: Path) -> None:
    stop = Event()
    Timer(0.3, stop.set).start()
    assert ended(tmp_path, "import time; time.sleep(60)", stop=stop).reason == "the command was stopped"


def test_what_an_earlier_run_has_left_is_taken_away(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "predictions.csv").write_text("station,prediction\n0,1\n1,1\n", encoding="utf-8")
    assert ended(tmp_path, "pass").reason == "the command ended well and left no predictions.csv"


def test_one_that_was_left_behind_and_writes_on_is_no_obstacle(tmp_path: Path) -> None:
    """As after a kill by force; it began in the same folder and goes on in it, wherever that is now."""
    (tmp_path / "run").mkdir()
    forever = "import itertools, pathlib\nfor i in itertools.count(): pathlib.Path(f'{i % 100}.txt').write_text('')"
    left = subprocess.Popen([sys.executable, "-c", forever], cwd=tmp_path / "run")
    try:
        while not (tmp_path / "run" / "99.txt").exists():
            time.sleep(0.01)
        for _ in range(5):
            assert ended(tmp_path, GOOD).reason == ""
        assert sorted(os.listdir(tmp_path / "run")) == ["command.log", "given.txt", "predictions.csv"]
    finally:
        left.kill()
        left.wait()


def test_parameters_say_all_that_a_model_needs(tmp_path: Path) -> None:
    case = commanded(tmp_path, "", "", ("discharge: 2.0", "discharge: q"), ("parameters:  ", f"{Q}  #"))
    told = json.loads(parameters_text(case, {"n_b": 0.05, "phi": 3.0, "q": 1.5}))
    assert told["parameters"]["n_b"] == {"value": 0.05, "unit": "s m^(-1/3)"}
    assert told["experiments"] == {"June": {"discharge": {"upstream": 1.5}, "level": 0.95, "plants": ["p1"]}}


Q = "parameters:\n  q: {distribution: uniform, low: 1, high: 2, unit: m3/s}\n"


def test_stations_say_what_is_wanted_where(tmp_path: Path) -> None:
    lines = stations_text(read_observations(commanded(tmp_path)).table).splitlines()
    assert lines[0] == "station,experiment,kind,section,x,y,depth,unit"
    assert lines[1].startswith("0,June,velocity,")
    assert lines[1].endswith(",m/s")
    assert len(lines) == 16
