"""Work spread over the cores: the one place that knows joblib, so that a cluster's backend may take its place.

`joblib.parallel_config(backend="dask")` around a command spreads the same tasks over more than one machine.
"""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from joblib import Parallel, cpu_count, delayed
from threadpoolctl import threadpool_limits


def as_finished(work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], jobs: int) -> Iterator[Any]:
    """work(*task) for every task, in the order in which they end."""
    yield from _pool(jobs, "generator_unordered")(delayed(_alone)(work, task) for task in tasks)


def in_order(work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], jobs: int) -> list[Any]:
    """work(*task) for every task, in their order."""
    return list(_pool(jobs, "generator")(delayed(_alone)(work, task) for task in tasks))


def in_threads(work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], jobs: int) -> list[Any]:
    """work(*task) for every task, in their order, by threads: for compiled work on large values that all share."""
    threads = cpu_count() if jobs < 0 else jobs
    with threadpool_limits(1):
        if threads == 1:
            return [work(*task) for task in tasks]
        with ThreadPoolExecutor(threads) as pool:  # joblib's own would look for results every hundredth of a second
            return list(pool.map(lambda task: work(*task), tasks))


def alone() -> None:
    """One thread for linear algebra in this process: its matrices are small, and the cores have tasks of their own."""
    threadpool_limits(1)


def _pool(jobs: int, order: str) -> Parallel:
    return Parallel(n_jobs=jobs, return_as=order, pre_dispatch="2*n_jobs", batch_size=1, initializer=_serve)


def _alone(work: Callable[..., Any], task: tuple[Any, ...]) -> Any:
    with threadpool_limits(1):  # one task a core: threads of linear algebra would only get in each other's way
        return work(*task)


def _serve() -> None:
    """A worker is one core, leaves Ctrl-C to the run it serves, and does not outlive it."""
    os.environ["LOKY_MAX_CPU_COUNT"] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    run = os.getppid()

    def follow() -> None:
        while os.getppid() == run:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
