"""Work spread over the cores of this machine by processes and threads, or handed to whoever takes it to others.

`cluster` takes tasks to other machines. This file knows nothing of how: it only asks whether someone does, see `taken`.
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

from joblib import Parallel, cpu_count, delayed
from threadpoolctl import ThreadpoolController

from vegglue.errors import InputError, StorageError
from vegglue.progress import silent

# Threads that may be begun beside those at work, in what is done within `at_most`.
_SPARE: ContextVar[Semaphore | None] = ContextVar("spare threads", default=None)
# How many cores may be used in what is done within `at_most`.
_CORES: ContextVar[int | None] = ContextVar("cores", default=None)
# Given work and tasks, the position of each task and work(*task), in the order in which they end.
Taker = Callable[[Callable[..., Any], Iterable[tuple[Any, ...]]], Iterator[tuple[int, Any]]]
# Who takes tasks to other machines, in what is done within `taken`.
_TAKER: ContextVar[Taker | None] = ContextVar("taker of tasks", default=None)


@contextmanager
def taken(taker: Taker) -> Iterator[None]:
    """Whatever `as_finished` and `side_by_side` are asked to do within is handed to the taker."""
    token = _TAKER.set(taker)
    try:
        yield
    finally:
        _TAKER.reset(token)


def is_taken() -> bool:
    """Whether a taker takes tasks elsewhere."""
    return _TAKER.get() is not None


def cores_allowed() -> int:
    """How many cores may be used here: those of `at_most`, all without it."""
    return _CORES.get() or int(cpu_count())


def as_finished(work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], jobs: int) -> Iterator[Any]:
    """work(*task) for every task, in the order in which they end. What all tasks share is best held by `work`, as in
    functools.partial: it then travels once to each process of a cluster. Errors: StorageError when one was killed.
    """
    taker = _TAKER.get()
    if taker is not None:
        yield from (found for _, found in taker(work, tasks))
        return
    try:
        with no_ctrl_c_for_children():
            found = _pool(jobs, "generator_unordered")(delayed(_alone)(work, task) for task in tasks)
        with _closing_quietly(found):
            yield from (one for one in found)  # who leaves these closes them only, and not what is found
    except BrokenProcessPool as error:
        raise StorageError(
            "A process that solved members was killed, most likely for want of memory; what was finished is kept: run "
            "the same command again, with fewer --jobs if this repeats."
        ) from error


def side_by_side(
    work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], finished: Callable[[int], None] = silent
) -> list[Any]:
    """As `in_threads`, for work that is worth a journey: it and its tasks go to other machines where there are any.

    Work that a task begins in its turn stays on the machine of the task.
    """
    taker, waiting = _TAKER.get(), list(tasks)
    if taker is None:
        return in_threads(work, waiting, finished)
    found: list[Any] = [None] * len(waiting)
    for ended, (position, one) in enumerate(taker(work, waiting), 1):
        found[position] = one
        finished(ended)
    return found


@contextmanager
def at_most(jobs: int) -> Iterator[None]:
    """So many threads at once in all that is done within; -1 for one on every core.

    Errors: InputError for any other that is not positive.
    """
    if jobs == 0 or jobs < -1:
        raise InputError(f"jobs: expected the number of cores to use, or -1 for all of them, got {jobs}.")
    cores = int(cpu_count()) if jobs < 0 else jobs
    spare, allowed = _SPARE.set(Semaphore(cores - 1)), _CORES.set(cores)
    try:
        yield
    finally:
        _SPARE.reset(spare)
        _CORES.reset(allowed)


def in_threads(
    work: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], finished: Callable[[int], None] = silent
) -> list[Any]:
    """work(*task) for every task, in their order, by threads: for compiled work on large values that all share.

    Tasks that are split into tasks of their own share the threads that `at_most` allows, all cores without it.
    finished: is told how many are done, each time another one is.
    """
    spare = _SPARE.get()
    if spare is None:
        with at_most(-1):
            return in_threads(work, tasks, finished)
    with one_thread():
        return _shared_out(work, list(tasks), spare, finished)


def _shared_out(
    work: Callable[..., Any], tasks: list[tuple[Any, ...]], spare: Semaphore, finished: Callable[[int], None]
) -> list[Any]:
    """Tasks taken one by one, by this thread and by as many others as are spare while some wait."""
    waiting, found, ends = deque(enumerate(tasks)), [None] * len(tasks), count(1)

    def take_next() -> bool:
        try:
            position, task = waiting.popleft()
        except IndexError:
            return False
        try:
            found[position] = work(*task)
            finished(next(ends))
        except BaseException:  # Ctrl-C, too: nobody waits for the rest any more
            waiting.clear()
            raise
        return True

    def by_another() -> None:
        try:
            while take_next():
                pass
        finally:
            spare.release()

    others: list[Future[None]] = []
    with ThreadPoolExecutor(max(len(tasks), 1)) as pool:  # which begins a thread only when it is needed
        while waiting:
            for _ in range(len(waiting) - 1):
                if not spare.acquire(blocking=False):
                    break
                others.append(pool.submit(copy_context().run, by_another))
            take_next()
    for one in others:
        one.result()  # raises what a task raised
    return found


def begun(work: Callable[..., Any], *task: Any) -> Callable[[], Any]:
    """work(*task) by a thread that `at_most` has to spare, else when it is asked for; what is returned waits for it."""
    spare = _SPARE.get()
    if spare is None or not spare.acquire(blocking=False):
        return partial(work, *task)

    def by_another() -> Any:
        try:
            return work(*task)
        finally:
            spare.release()

    pool = ThreadPoolExecutor(1)
    found = pool.submit(copy_context().run, by_another)
    pool.shutdown(wait=False)
    return found.result


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """The libraries with threads of their own, looked for (5 ms) when a module was imported since."""
    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread for linear algebra in this process: its matrices are small, and the cores have tasks of their own."""
    with _libraries(len(sys.modules)).limit(limits=1):
        yield


def one_thread_for_good() -> None:
    """The same for the rest of this process: its threads may work on several tasks at once, and none may undo it."""
    _libraries(len(sys.modules)).limit(limits=1)


def import_beside(module: str) -> None:
    """Import a module in a thread beside, for who asks for it later and is then told what went wrong, if anything."""

    def quietly() -> None:
        with suppress(ImportError):
            import_module(module)

    threading.Thread(target=quietly).start()


def keep_folder_out() -> None:
    """Processes begun from here on import nothing from the folder the user stands in: it may be a stranger's, with a
    `numpy.py` of its own.
    """
    os.environ["PYTHONSAFEPATH"] = "1"


@contextmanager
def no_ctrl_c_for_children() -> Iterator[None]:
    """Processes begun within never hear Ctrl-C, from their first moment on: it is for the run that they serve."""
    keep_folder_out()  # before the first process of all, which comes next
    resource_tracker.ensure_running()  # else it begins within, and takes the mask off again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _closing_quietly(found: Any) -> Iterator[None]:
    """Results of a pool, which warns of tasks that are not done when it is left: at a Ctrl-C nobody wonders."""
    try:
        yield
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            found.close()


def _pool(jobs: int, order: str) -> Parallel:
    keep_folder_out()
    return Parallel(n_jobs=jobs, return_as=order, pre_dispatch="2*n_jobs", batch_size=1, initializer=_serve)


def _alone(work: Callable[..., Any], task: tuple[Any, ...]) -> Any:
    with one_thread():  # one task a core: threads of linear algebra would only get in each other's way
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
