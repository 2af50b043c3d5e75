"""Tasks over the cores of this machine by processes and threads, or handed to a backend on other machines.

`cluster` is such a backend; this module only knows that there may be one, see `task_backend`.
"""

import os
import signal
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from contextvars import ContextVar, copy_context
from functools import lru_cache, partial
from importlib import import_module
from itertools import count
from multiprocessing import resource_tracker
from threading import Semaphore
from typing import Any

import psutil
from joblib import Parallel, cpu_count, delayed
from threadpoolctl import ThreadpoolController

from vegglue.errors import InputError, StorageError
from vegglue.progress import silent

# Threads that may be started beside those at work, within `at_most`.
_SPARE: ContextVar[Semaphore | None] = ContextVar("spare threads", default=None)
# Number of cores that may be used, within `at_most`.
_CORES: ContextVar[int | None] = ContextVar("cores", default=None)
# Given work and tasks, yields the position of each task and work(*task), in the order in which they end.
Backend = Callable[[Callable[..., Any], Iterable[tuple[Any, ...]]], Iterator[tuple[int, Any]]]
_BACKEND: ContextVar[Backend | None] = ContextVar("backend of tasks", default=None)


@contextmanager
def task_backend(backend: Backend) -> Iterator[None]:
    """Hand the tasks of `as_finished` and `parallel_map` within to a backend."""
    token = _BACKEND.set(backend)
    try:
        yield
    finally:
        _BACKEND.reset(token)


def has_backend() -> bool:
    """Whether a backend computes tasks elsewhere."""
    return _BACKEND.get() is not None


def cores_allowed() -> int:
    """Number of cores that may be used: that of `at_most`, all without it."""
    return _CORES.get() or int(cpu_count())


def as_finished(work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], jobs: int) -> Iterator[Any]:
    """Compute work(*task) for every task in processes, and yield results in the order in which they end.

    Parameters
    ----------
    work : callable
        Best holds what all tasks share, as functools.partial does: it then travels once to each process of a cluster.
    jobs : int
        Number of processes, -1 for one on every core.

    Raises
    ------
    StorageError
        If a process was killed.
    """
    backend = _BACKEND.get()
    if backend is not None:
        yield from (found for _, found in backend(work, tasks))
        return

    try:
        keep_folder_out()
        with no_ctrl_c_for_children():
            pool = Parallel(
                n_jobs=jobs, return_as="generator_unordered", pre_dispatch="2*n_jobs", batch_size=1, initializer=_serve
            )
            found = pool(delayed(_on_one_thread)(work, task) for task in tasks)
        try:
            yield from (one for one in found)  # closing these closes the generator only, not the pool
        finally:
            with warnings.catch_warnings():  # of tasks that are not done when the pool is left at a Ctrl-C
                warnings.simplefilter("ignore", UserWarning)
                found.close()
    except BrokenProcessPool as error:
        raise StorageError(
            "A process that solved members was killed, most likely for want of memory; what was finished is kept: run "
            "the same command again, with fewer --jobs if this repeats."
        ) from error


def parallel_map(
    work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], finished: Callable[[int], None] = silent
) -> list[Any]:
    """Compute work(*task) for every task, by the backend if there is one, else by threads.

    Tasks that a task starts in its turn stay on its machine.

    Parameters
    ----------
    finished : callable
        Is called with the number of tasks that are done.

    Returns
    -------
    list
        Results in the order of the tasks.
    """
    backend, waiting = _BACKEND.get(), list(tasks)
    if backend is None:
        return in_threads(work, waiting, finished)
    found: list[Any] = [None] * len(waiting)
    for ended, (position, one) in enumerate(backend(work, waiting), 1):
        found[position] = one
        finished(ended)
    return found


@contextmanager
def at_most(jobs: int) -> Iterator[None]:
    """Limit the number of threads at once within.

    Parameters
    ----------
    jobs : int
        -1 for one on every core.

    Raises
    ------
    InputError
        For 0, and below -1.
    """
    cores = cores_of(jobs)
    spare, allowed = _SPARE.set(Semaphore(cores - 1)), _CORES.set(cores)
    try:
        yield
    finally:
        _SPARE.reset(spare)
        _CORES.reset(allowed)


def cores_of(jobs: int) -> int:
    """The number of cores, for -1 all.

    Raises
    ------
    InputError
        For other numbers below 1.
    """
    if jobs == 0 or jobs < -1:
        raise InputError(f"jobs: expected the number of cores to use, or -1 for all of them, got {jobs}.")
    return int(cpu_count()) if jobs < 0 else jobs


def memory_of_machine() -> float:
    """All of its memory [bytes]."""
    return float(psutil.virtual_memory().total)


def in_threads(
    work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], finished: Callable[[int], None] = silent
) -> list[Any]:
    """Compute work(*task) for every task by threads: for compiled work on large shared values.

    Tasks are taken one by one, by this thread and by as many others as `at_most` allows while some wait; tasks that
    start tasks of their own share these threads.

    Parameters
    ----------
    work : callable
        What it raises ends all tasks, and is raised here.
    finished : callable
        Is called with the number of tasks that are done.

    Returns
    -------
    list
        Results in the order of the tasks.
    """
    spare = _SPARE.get()
    if spare is None:
        with at_most(-1):
            return in_threads(work, tasks, finished)
    numbered = list(tasks)
    waiting, found, ends = deque(enumerate(numbered)), [None] * len(numbered), count(1)

    def take_next() -> bool:
        try:
            position, task = waiting.popleft()
        except IndexError:
            return False
        try:
            found[position] = work(*task)
            finished(next(ends))
        except BaseException:  # Ctrl-C, too: the rest is not needed any more
            waiting.clear()
            raise
        return True

    def work_through() -> None:
        try:
            while take_next():
                pass
        finally:
            spare.release()

    others: list[Future[None]] = []
    with one_thread():
        with ThreadPoolExecutor(max(len(numbered), 1)) as pool:  # starts a thread only when it is needed
            while waiting:
                for _ in range(len(waiting) - 1):
                    if not spare.acquire(blocking=False):
                        break
                    others.append(pool.submit(copy_context().run, work_through))
                take_next()
        for one in others:
            one.result()  # raises what a task raised
    return found


def submit(work: Callable[..., Any], *task: Any) -> Callable[[], Any]:
    """Start work(*task) in a thread that `at_most` can spare, else do it when the result is needed.

    Returns
    -------
    callable
        Waits for the result and returns it, or raises what the work raised.
    """
    spare = _SPARE.get()
    if spare is None or not spare.acquire(blocking=False):
        return partial(work, *task)

    def beside() -> Any:
        try:
            return work(*task)
        finally:
            spare.release()

    pool = ThreadPoolExecutor(1)
    found = pool.submit(copy_context().run, beside)
    pool.shutdown(wait=False)
    return found.result


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """The libraries with threads of their own, looked up (5 ms) after each import of a module."""
    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Use one thread for linear algebra in this process: matrices are small, and the cores have tasks of their own."""
    with _libraries(len(sys.modules)).limit(limits=1):
        yield


def one_thread_for_good() -> None:
    """The same for the rest of this process, whose threads may work on several tasks at once."""
    _libraries(len(sys.modules)).limit(limits=1)


def import_beside(module: str) -> None:
    """Import a module in a thread; a later import of it finds it, or raises what is wrong with it."""

    def quietly() -> None:
        with suppress(ImportError):
            import_module(module)

    threading.Thread(target=quietly).start()


def keep_folder_out() -> None:
    """Keep processes that are started later from importing out of the working folder, which may be a stranger's."""
    os.environ["PYTHONSAFEPATH"] = "1"


@contextmanager
def no_ctrl_c_for_children() -> Iterator[None]:
    """Processes started within never receive Ctrl-C, which is for the command that they serve."""
    keep_folder_out()  # before the first process of all, which comes next
    if not hasattr(signal, "pthread_sigmask"):  # Windows: `_serve` ignores it a moment later
        yield
        return
    resource_tracker.ensure_running()  # else it starts within, and unblocks the signal again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _on_one_thread(work: Callable[..., Any], task: tuple[Any, ...]) -> Any:
    with one_thread():  # one task a core: threads of linear algebra would only compete for it
        return work(*task)


def _serve() -> None:
    """Prepare a worker: it is one core, ignores Ctrl-C, and ends with the command that it serves."""
    os.environ["LOKY_MAX_CPU_COUNT"] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    run = psutil.Process(os.getppid())

    def follow() -> None:
        while run.is_running():
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
