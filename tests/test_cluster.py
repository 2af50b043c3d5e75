"""More than one machine: the same bits as here, nothing lost with a worker, and one sentence for what cannot be."""

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from reach import COARSE, Say, write_reach
from workers import Workers, workers_in

import vegglue
from vegglue import cluster
from vegglue.cli.main import main
from vegglue.cluster import on_cluster
from vegglue.errors import InputError
from vegglue.parallel import as_finished, parallel_map
from vegglue.progress import Progress

MEMBERS, CHUNKS = 512, 8
FEWER = 128
# With errors this small the diagnosis finds something missing, and refits.
CHANGES = (
    COARSE,
    ("members: 1024", f"members: {MEMBERS}"),
    ("experiment: June}", "experiment: June, standard_error: 0.004}"),
)
# What a member cost is no result, nor is what its chunk is sealed with, which covers that.
TIMES = {"members/seconds", "progress/digest"}


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workers]:
    with workers_in(tmp_path_factory.mktemp("two"), 2) as workers:
        yield workers


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    monkeypatch.setattr("vegglue.inference.solve_ensemble.FEWEST_CHUNKS", CHUNKS)
    return vegglue.load_case(write_reach(tmp_path, *CHANGES))


def bits(path: Path) -> dict[str, bytes]:
    """All that a file of results holds, but times."""
    found: dict[str, bytes] = {}

    def look(name: str, one: object) -> None:
        if isinstance(one, h5py.Dataset) and name not in TIMES:
            values = np.asarray(one[()])
            found[name] = repr(values.tolist()).encode() if values.dtype.kind == "O" else values.tobytes()

    with h5py.File(path) as file:
        file.visititems(look)
    return found


def the_same(one: Path, other: Path, *names: str) -> None:
    for name in names:
        expected, found = bits(one / f"{name}.h5"), bits(other / f"{name}.h5")
        assert expected.keys() == found.keys()
        assert [key for key in expected if expected[key] != found[key]] == [], name


@pytest.mark.slow
def test_jobs_and_workers_give_the_same_bits(tmp_path: Path, case, two: Workers) -> None:  # type: ignore[no-untyped-def]
    """simulate, infer and diagnose with one job, with two, and with two workers: nine commands take long."""

    def all_of(runs: Path, jobs: int = 1) -> Path:
        ensemble = vegglue.simulate(case, runs=runs, jobs=jobs, members=FEWER)
        vegglue.infer(case, ensemble, runs=runs, jobs=jobs)
        vegglue.diagnose(case, runs=runs, jobs=jobs)
        return runs / "brook"

    alone = all_of(tmp_path / "one")
    the_same(alone, all_of(tmp_path / "two", jobs=2), "ensemble", "posterior", "diagnosis")
    with on_cluster(two.address):
        the_same(alone, all_of(tmp_path / "workers"), "ensemble", "posterior", "diagnosis")


@pytest.mark.slow
def test_workers_refit_for_an_extension_to_the_same_words(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    case,  # type: ignore[no-untyped-def]
    two: Workers,
) -> None:
    said = []
    for runs, who in (("here", ["--jobs", "1"]), ("there", ["--cluster", two.address])):
        monkeypatch.setattr(
            sys, "argv", ["vegglue", "extend", "--auto", str(case.source), "--json", "--runs", runs, *who]
        )
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as ended:
            main()
        assert not ended.value.code
        said.append(capsys.readouterr().out.replace(f"{runs}/", ""))
    assert said[0] == said[1] != ""


@pytest.mark.slow
@pytest.mark.parametrize("left", [1, 0])
def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path, case, left: int) -> None:  # type: ignore[no-untyped-def]
    """One of two; and the only one, whose place another takes: with it goes all that workers knew."""
    heard = list[Progress]()
    with workers_in(tmp_path, 1 + left) as workers:

        def watch(progress: Progress) -> None:
            heard.append(progress)
            if len(heard) == 3:
                workers.kill()
                if not left:
                    workers.begin()

        with on_cluster(workers.address):
            vegglue.simulate(case, runs=tmp_path / "workers", watch=watch)
    assert [one.done for one in heard] == [64 * count for count in range(CHUNKS + 1)]
    vegglue.simulate(case, runs=tmp_path / "here", jobs=1)
    the_same(tmp_path / "here" / "brook", tmp_path / "workers" / "brook", "ensemble")


@pytest.mark.slow
def test_without_its_scheduler_a_run_stops_and_keeps_what_it_has(  # type: ignore[no-untyped-def]
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case
) -> None:
    heard, again = list[Progress](), list[Progress]()
    monkeypatch.setattr(cluster, "LONGEST_WAIT", 5)
    with workers_in(tmp_path, 1) as workers:

        def watch(progress: Progress) -> None:
            heard.append(progress)
            if len(heard) == 3:
                workers.kill_scheduler()

        expected = "--cluster: expected the scheduler to stay, got no answer any more; what was finished is kept"
        with pytest.raises(InputError, match=expected), on_cluster(workers.address):
            vegglue.simulate(case, runs=tmp_path, watch=watch)
    vegglue.simulate(case, runs=tmp_path, jobs=1, watch=again.append)
    assert again[0].resumed == heard[-1].done >= 2 * 64


@pytest.mark.slow
def test_a_task_that_ends_its_workers_is_told(tmp_path: Path) -> None:
    with workers_in(tmp_path, 4) as workers, on_cluster(workers.address):
        expected = "--cluster: expected workers to live, got a task that ended several, .* what was finished is kept"
        with pytest.raises(InputError, match=expected):
            parallel_map(os._exit, [(1,)])


@pytest.mark.slow
def test_a_task_that_ends_the_only_worker_ends_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dask itself waits for another one without end."""
    monkeypatch.setattr(cluster, "LONGEST_ALONE", 3)
    with workers_in(tmp_path, 1) as workers, on_cluster(workers.address):
        began = time.monotonic()
        with pytest.raises(InputError, match="--cluster: expected workers to live, got none for 3 s"):
            parallel_map(os._exit, [(1,)])
        assert time.monotonic() - began < 15.0


@pytest.mark.slow
def test_results_stream_back_and_stand_in_order(two: Workers) -> None:
    with on_cluster(two.address):
        ended = list[int]()
        assert parallel_map(abs, [(-number,) for number in range(40)], ended.append) == list(range(40))
        assert ended == list(range(1, 41))
        assert set(as_finished(abs, ((-number,) for number in range(3)), 1)) == {0, 1, 2}
        assert list(as_finished(abs, (), 1)) == []


@pytest.mark.slow
def test_what_a_task_raises_is_raised_here(two: Workers) -> None:
    with on_cluster(two.address), pytest.raises(ZeroDivisionError):
        parallel_map(divmod, [(1, 1), (1, 0)])


@pytest.mark.slow
def test_what_is_left_alone_half_way_is_taken_back(two: Workers) -> None:
    def begun() -> None:
        for _ in as_finished(time.sleep, [(0.05,)] * 50, 1):
            raise KeyError

    with pytest.raises(KeyError), on_cluster(two.address):
        begun()
    with on_cluster(two.address):
        assert parallel_map(abs, [(-1,)]) == [1]


def is_left_alone(task: int) -> bool:
    """Whether this process neither hears Ctrl-C nor is looked at all the time."""
    import dask

    masked = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    return masked and not dask.config.get("distributed.worker.profile.enabled")


@pytest.mark.slow
def test_processes_of_this_machine_need_no_scheduler() -> None:
    with on_cluster("local:2"):
        assert parallel_map(abs, [(-1,), (-2,)]) == [1, 2]
        assert parallel_map(is_left_alone, [(1,), (2,)]) == [True, True]


@pytest.mark.slow
def test_workers_of_other_versions_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, two: Workers) -> None:
    monkeypatch.setattr(cluster, "VERSION", "99.0")
    cluster.versions_here.cache_clear()
    expected = r"--cluster: expected vegglue 99\.0 on every worker, as here, got .* at tcp://127.*: results would"
    try:
        with pytest.raises(InputError, match=expected), on_cluster(two.address):
            pass
    finally:
        cluster.versions_here.cache_clear()


@pytest.mark.slow
def test_a_worker_of_another_version_that_comes_later_is_refused(tmp_path: Path) -> None:
    with workers_in(tmp_path, 0) as workers, on_cluster(workers.address):
        workers.begin("import vegglue.version; vegglue.version.VERSION = '0.0'; ")
        with pytest.raises(InputError, match=r"expected vegglue .* on every worker, as here, got 0\.0 at tcp://127"):
            parallel_map(abs, [(1,)])


NO_ADDRESSES = ("local:0", "local:", "local:two", "local:-1", "somewhere", "tcp://here", "a b:1", "http://here:80")


@pytest.mark.parametrize(
    ("where", "sentence"),
    [
        *((where, r"--cluster: expected tcp://HOST:PORT, or local:N .* got ") for where in NO_ADDRESSES),
        ("local:5000", r"--cluster: expected at most local:\d+ on the \d+ cores here, got local:5000\."),
        ("tls://here:8786", r"--cluster: expected certificates for tls://here:8786, got none in Dask's configuration"),
    ],
)
def test_what_no_cluster_can_be_is_refused_at_once(where: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence), on_cluster(where):
        pass


def test_nobody_is_waited_for_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "LONGEST_WAIT", 1)
    expected = r"--cluster: expected a Dask scheduler that answers within 1 s at tcp://127\.0\.0\.1:9, got "
    with pytest.raises(InputError, match=expected), on_cluster("tcp://127.0.0.1:9"):
        pass


@pytest.mark.parametrize("verb", ["simulate", "infer", "diagnose", "run"])
def test_commands_say_that_the_extra_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, verb: str
) -> None:
    config = write_reach(tmp_path, *CHANGES)
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.chdir(tmp_path)
    code, error = say(verb, config, "--cluster", "local:2")
    assert (code, error.count("\n")) == (2, 1)
    assert "--cluster needs the package distributed, which is not installed: pip install 'vegglue[cluster]'" in error
