"""What all tests share, and the order in which their files are begun."""

import gc
import os
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from joblib import cpu_count
from reach import Say, said_to
from threadpoolctl import threadpool_limits

import vegglue.parallel
from vegglue.__main__ import OBJECTS_BETWEEN_COLLECTIONS

TESTS = Path(__file__).parent
# Files that take minutes, or a third of one: begun last, one of them would keep a process at work while others wait.
LONGEST = [
    TESTS / name
    for name in (
        "test_documents.py",
        "end_to_end/test_open_effects.py",
        "end_to_end/test_open_pair.py",
        "diagnosis/test_diagnose_statistics.py",
        "diagnosis/test_search.py",
        "engine/test_engines.py",
        "end_to_end/test_open_instruments.py",
        "end_to_end/test_open_places.py",
        "workflow/test_run.py",
        "end_to_end/test_own_engine_faults.py",
        "end_to_end/test_faults.py",
        "inference/test_solve_ensemble.py",
        "diagnosis/test_effect_contract.py",
        "end_to_end/test_kills.py",
        "studies/test_ranks_of_twins.py",
        "test_cluster.py",
        "cli/test_cli.py",
        "studies/test_second_engine.py",
        "cli/test_every_command.py",
        "verification/test_independent_code.py",
        "cli/test_effect_commands.py",
        "verification/test_operator.py",
    )
]
assert all(path.is_file() for path in LONGEST)


def pytest_configure(config: pytest.Config) -> None:
    """Files are handed out in the order below, not by their number of tests."""
    config.option.loadscopereorder = False
    gc.disable()


def pytest_collection_finish() -> None:
    """Half a million objects of modules and tests live to the end and are not searched for garbage; others are searched
    as seldom as in a command.
    """
    gc.freeze()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    place = {path: position for position, path in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path, len(place)))


@pytest.fixture(scope="session", autouse=True)
def _one_thread_of_linear_algebra() -> Iterator[None]:
    """Blocks are small: threads of linear algebra would only wait for each other, here as in `simulate`."""
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session", autouse=True)
def _own_share_of_the_cores() -> Iterator[None]:
    """Side by side, each process of the tests has its share of the cores: threads beyond would wait for those of others
    and spend a sixth more of a core. Commands in processes of their own, and tests that ask for so many, have them.
    """
    cores = max(cpu_count() // int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")), 1)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(vegglue.parallel, "cpu_count", lambda: cores)
        yield


@pytest.fixture
def say(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Say:
    """How `vegglue ...` ends in this process, and its standard error."""
    return partial(said_to, monkeypatch, capsys)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """What is started heeds Ctrl-C even where a shell in the background has the tests ignore it, and all they start."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
