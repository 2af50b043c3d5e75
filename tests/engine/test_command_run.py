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
    CommandEnd,
    FailedRunError,
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
    ("program", "facts"),
    [
        ("import sys; print('no grid'); sys.exit(3)", ("exit code 3", "no grid")),
        ("import sys; sys.exit(4)", ("exit code 4", "command.log")),
        ("1 / 0", ("exit code 1", "ZeroDivisionError")),
        ("import os; os.kill(os.getpid(), 9)", ("signal 9", "command.log")),
        ("pass", ("predictions.csv",)),
    ],
)
def test_a_run_that_ends_badly_has_a_reason(tmp_path: Path, program: str, facts: tuple[str, ...]) -> None:
    end = ended(tmp_path, program)
    assert end.prediction is None
    assert all(fact in end.reason for fact in facts), end.reason


@pytest.mark.parametrize(
    ("content", "facts"),
    [
        (b"", "row 1|station,prediction"),
        (b"station,u\n0,1\n", "row 1|'station,u'"),
        (b"station,prediction\n0,1\n", "station 1"),
        (b"station,prediction\n", "station 0|1 more"),
        *(
            (b"station,prediction\n0,1\n" + line + b"\n", f"row 3|{line.decode()!r}")
            for line in (b"1,nan", b"1,inf", b"1,wet", b"1,", b"1", b"1,2,3")
        ),
        (b"station,prediction\n0,1\n1,-1e300\n", "row 3|-1e+300|1e+09"),
        (b"station,prediction\n0,1\n2,1\n", "row 3|got 2"),
        (b"station,prediction\n0,1\n0,1\n", "row 3|station 0"),
        (b"\xff\xfe\x00", "predictions.csv|UTF-8"),
    ],
)
def test_bad_predictions_are_refused_by_row(tmp_path: Path, content: bytes, facts: str) -> None:
    (tmp_path / "predictions.csv").write_bytes(content)
    with pytest.raises(FailedRunError) as refused:
        read_predictions(tmp_path / "predictions.csv", 2)
    assert all(fact in str(refused.value) for fact in facts.split("|")), refused.value


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
    assert "within 1 s" in end.reason
    child = int((tmp_path / "run" / "child").read_text())
    until = time.monotonic() + 5.0
    while is_alive(child) and time.monotonic() < until:
        time.sleep(0.02)
    assert not is_alive(child)


def test_a_run_that_prints_without_end_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "LONGEST_LOG", 10_000_000)
    end = ended(tmp_path, "while True: print('no end', flush=True)")
    assert "0.01 GB" in end.reason
    assert not (tmp_path / "run" / "command.log").exists()


def test_a_run_that_is_stopped_ends(tmp_path: Path) -> None:
    stop = Event()
    Timer(0.3, stop.set).start()
    end = ended(tmp_path, "import time; time.sleep(60)", stop=stop)
    assert (end.prediction, "stopped" in end.reason, end.seconds < 30.0) == (None, True, True)


def test_what_an_earlier_run_has_left_is_taken_away(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "predictions.csv").write_text("station,prediction\n0,1\n1,1\n", encoding="utf-8")
    assert ended(tmp_path, "pass").prediction is None


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
