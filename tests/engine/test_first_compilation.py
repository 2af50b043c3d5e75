"""The second process that compiles on a fresh machine."""

import os
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from coarse_twin import coarse_twin
from numba.core.sigutils import normalize_signature

from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.engine.first_compilation import COMPILED_BESIDE, compile_beside
from vegglue.flow.kernels import rates
from vegglue.parallel import at_most

# Compiles one small loop in place of all, and states what is kept of it.
TILT = """
from vegglue.engine import first_compilation
from vegglue.flow.thin_water import tilt
first_compilation.COMPILED_BESIDE = tuple(one for one in first_compilation.COMPILED_BESIDE if one[0] is tilt)
first_compilation.compile_others()
print(sum(tilt.stats.cache_hits.values()), sum(tilt.stats.cache_misses.values()))
"""
# Ends as no process can prepare for, once the second one is there.
KILLED = """
import os, signal, time
import psutil
from vegglue.engine.first_compilation import compile_beside
from vegglue.parallel import at_most
with at_most(2):
    compile_beside()
while not (found := psutil.Process().children()):
    time.sleep(0.01)
print(found[0].pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_types_are_those_of_a_diagnosis() -> None:
    """Else the second process compiles what no command uses."""
    model, point = coarse_twin()
    diagnose_model(replace(model, station=model.station.assign(value=point.prediction)))
    assert rates.signatures
    used = [(loop, types) for loop, types in COMPILED_BESIDE if loop.signatures]
    assert len(used) > 10
    given = [normalize_signature(f"({', '.join(types)})")[0] for _, types in used]
    assert [loop.__name__ for (loop, _), types in zip(used, given, strict=True) if types not in loop.signatures] == []


@pytest.mark.slow
def test_the_next_process_finds_what_it_has_compiled(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    found = []
    for _ in range(2):
        pipe = subprocess.PIPE
        with subprocess.Popen([sys.executable, "-c", TILT], env=environment, stdin=pipe, stdout=pipe) as process:
            assert process.stdout is not None
            found.append(process.stdout.read())
    assert found == [b"0 1\n", b"1 0\n"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGKILL")
def test_it_ends_with_a_command_that_is_killed(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    killed = subprocess.run(
        [sys.executable, "-c", KILLED], env=environment, capture_output=True, text=True, check=False
    )
    child, deadline = int(killed.stdout), time.monotonic() + 60.0
    while psutil.pid_exists(child):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def test_one_core_has_no_second_process(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[threading.Thread] = []
    monkeypatch.setattr(threading.Thread, "start", lambda thread: started.append(thread))
    compile_beside.cache_clear()
    with at_most(1):
        compile_beside()
    assert started == []
    compile_beside.cache_clear()
    with at_most(2):
        compile_beside()
        compile_beside()
    assert len(started) == 1


def test_a_machine_that_starts_no_process_compiles_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError

    monkeypatch.setattr(subprocess, "Popen", refused)
    monkeypatch.setattr(threading.Thread, "start", threading.Thread.run)  # in this thread, where errors are seen
    compile_beside.cache_clear()
    with at_most(2):
        compile_beside()
