"""Tasks on more than one machine, by Dask: they travel to workers, and results come back as they end.

What all tasks share travels once to each worker. The scheduler keeps the bytes of what it has sent until the result has
arrived, so that a worker may leave or join at any moment: another repeats its tasks, with the same bits.
"""

import logging
import re
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib.metadata import version
from time import monotonic
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from vegglue.errors import InputError
from vegglue.parallel import (
    at_most,
    cores_allowed,
    keep_folder_out,
    no_ctrl_c_for_children,
    one_thread_for_good,
    task_backend,
)
from vegglue.version import VERSION
from vegglue.wording.remedies import GOES_ON, SCHEDULER_GONE

if TYPE_CHECKING:
    from distributed import Client

LONGEST_WAIT = 10  # [s] for a scheduler. Chosen, not measured: long for a network, short after a mistyped address.
# Time [s] without any worker, after there were some, until a command ends; and how often it looks. Chosen: one that
# takes the place of another starts in 3 to 10 s; before the first one a command waits without end.
LONGEST_ALONE, COUNT_EVERY = 30, 1.0
EACH_CORE = 16  # processes of local:N for each core at most; more than one only serves to try how workers come and go
# Tasks under way [-]: for each thread of a worker one at work and one that waits; and a least number for new workers.
EACH_THREAD, AT_LEAST = 2, 16
DECIDING = ("numpy", "scipy", "numba")  # libraries that decide the last digits
TaskWork = Callable[..., Any]
DASK_SETTINGS = {
    # What tasks share is sent once and may be large: the warning against large graphs does not apply.
    "distributed.admin.large-graph-warning-threshold": "1 TB",
    # Profiling workers of local:N a hundred times a second took a tenth of them on a small case.
    "distributed.worker.profile.enabled": False,
    # Dask has workers give memory back at once, so that arrays of megabytes are mapped anew each time.
    "distributed.nanny.pre-spawn-environ": {"OMP_NUM_THREADS": 1, "OPENBLAS_NUM_THREADS": 1, "MKL_NUM_THREADS": 1},
}


@contextmanager
def on_cluster(where: str | None) -> Iterator[None]:
    """Compute members, fits and predictions within on the workers of a Dask cluster, with the same bits as here.

    Parameters
    ----------
    where : str or None
        Address of a scheduler, e.g. tcp://host:8786, or local:N for N processes on this machine; None for the threads
        and processes of `jobs`.

    Raises
    ------
    InputError
        If `distributed` is missing, no scheduler answers at the address, or a worker has other versions.
    """
    if where is None:
        yield
        return
    try:
        import dask
        from distributed import Client, LocalCluster
        from distributed.security import Security
    except ImportError:
        raise InputError(
            "--cluster needs the package distributed, which is not installed: pip install 'vegglue[cluster]'."
        ) from None
    for name in [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in a sentence instead
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(DASK_SETTINGS))
        count, address = processes_here(where), where
        if where.startswith(("tls:", "wss:")) and Security().get_connection_args("client")["ssl_context"] is None:
            raise InputError(
                f"--cluster: expected certificates for {where}, got none in Dask's configuration; name them there, "
                "below distributed.comm.tls: `ca-file`, and `cert` and `key` of the `client`."
            )
        if count:
            keep_folder_out()
            with no_ctrl_c_for_children():  # neither a limit of memory nor a page, as without a cluster
                here = LocalCluster(
                    n_workers=count, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0",
                    memory_limit=0, silence_logs=logging.CRITICAL, preload=[__name__],
                )  # fmt: skip
            address = stack.enter_context(here)
        try:
            client = Client(address, timeout=LONGEST_WAIT, set_as_default=False)
        except (OSError, ValueError, TypeError):
            raise InputError(
                f"--cluster: expected a Dask scheduler that answers within {LONGEST_WAIT} s at {where}, got none; "
                "start one with `dask scheduler`, correct the address, or use local:N."
            ) from None
        stack.enter_context(client)
        refuse_other_versions(client)
        stack.enter_context(task_backend(partial(results_of_tasks, client)))
        yield


def dask_setup(worker: object) -> None:
    """Ignore Ctrl-C, which is for the command: Dask calls this in each process of local:N."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def processes_here(where: str) -> int:
    """N of local:N, 0 for an address.

    Raises
    ------
    InputError
        If it is neither.
    """
    if re.fullmatch(r"((tcp|tls|ucx|wss?)://)?[^\s/]+:\d{1,5}", where) and not where.startswith("local:"):
        return 0
    found = re.fullmatch(r"local:([1-9]\d{0,3})", where)
    if found is None:
        raise InputError(
            f"--cluster: expected tcp://HOST:PORT, or local:N with N processes, got {where!r}; e.g. local:2."
        )
    count, most = int(found[1]), EACH_CORE * cores_allowed()
    if count > most:
        raise InputError(f"--cluster: expected at most local:{most} on the {cores_allowed()} cores here, got {where}.")
    return count


@cache
def versions_here() -> Mapping[str, str]:
    """Versions of this process: Python, vegglue and the libraries that decide the last digits."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return {"Python": python, "vegglue": VERSION} | {name: version(name) for name in DECIDING}


def refuse_other_versions(client: "Client") -> None:
    """Raise InputError if a present worker has other versions than this process, or no vegglue."""
    try:
        found = client.run(versions_here)
    except (ImportError, AttributeError) as error:
        got = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
        raise InputError(
            f"--cluster: expected vegglue {VERSION} on every worker, got {got}; install it there."
        ) from None
    for worker, there in found.items():
        refuse_version(versions_here(), there, worker)


def refuse_version(wanted: Mapping[str, str], there: Mapping[str, str], worker: str) -> None:
    """Raise InputError if one worker has other versions."""
    for name, here in wanted.items():
        if there.get(name) != here:
            raise InputError(
                f"--cluster: expected {name} {here} on every worker, as here, got {there.get(name)} at {worker}: "
                "results would depend on the worker; install the same versions."
            )


def results_of_tasks(client: "Client", work: TaskWork, tasks: Iterable[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
    """Yield the position and the result of each task as they end; few are under way at once, to bound the memory.

    Raises
    ------
    InputError
        If workers died of a task, or the scheduler is gone. What a task raises comes through.
    """
    from distributed import CancelledError, KilledWorker, as_completed
    from distributed.protocol.pickle import dumps, loads

    # A task that any worker can repeat, and no value that is lost with its holder.
    shared = client.submit(loads, dumps(work), key=f"shared-{uuid4().hex}")
    looked, had_workers = monotonic(), False
    waiting, under_way, ends = enumerate(tasks), dict[Any, int](), as_completed(loop=client.loop)
    try:
        while True:
            try:
                threads = sum(client.nthreads().values())
            except (OSError, ValueError):
                raise InputError(SCHEDULER_GONE) from None
            had_workers |= threads > 0
            room = max(EACH_THREAD * threads, AT_LEAST) - len(under_way)
            for _, (position, task) in zip(range(room), waiting, strict=False):
                one = client.submit(_at_work, versions_here(), shared, dumps(task), key=f"task-{uuid4().hex}")
                under_way[one] = position
                ends.add(one)
            if not under_way:
                return
            alone_since = None  # [s] when the last worker left
            while not ends.has_ready():
                with ends.thread_condition:
                    ends.thread_condition.wait(0.1)
                if monotonic() < looked + COUNT_EVERY:
                    continue
                looked = monotonic()
                try:
                    there = len(client.nthreads())
                except (OSError, ValueError):
                    raise InputError(SCHEDULER_GONE) from None
                had_workers |= there > 0
                alone_since = None if there or not had_workers else alone_since or looked
                if alone_since is not None and looked > alone_since + LONGEST_ALONE:
                    raise InputError(
                        f"--cluster: expected workers to live, got none for {LONGEST_ALONE} s, most likely for want of "
                        f"memory; {GOES_ON}. Start workers with more memory."
                    )
            future = next(ends)
            try:
                result = future.result()
            except KilledWorker:
                raise InputError(
                    "--cluster: expected workers to live, got a task that ended several, most likely for want of "
                    f"memory; {GOES_ON}. Give workers more memory, or start fewer of them on a machine."
                ) from None
            except CancelledError:
                raise InputError(SCHEDULER_GONE) from None
            except Exception:
                refuse_other_versions(client)  # the likeliest reason, of a worker that came later
                raise
            yield under_way.pop(future), result
    finally:
        client.cancel([*under_way, shared])


def _at_work(wanted: Mapping[str, str], work: TaskWork, packed: bytes) -> Any:
    """Compute one task on a worker, with one thread."""
    from distributed import get_worker
    from distributed.protocol.pickle import loads

    refuse_version(wanted, versions_here(), get_worker().address)
    one_thread_for_good()
    with at_most(1):
        return work(*loads(packed))
