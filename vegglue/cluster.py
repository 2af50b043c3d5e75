"""Work spread over more than one machine by Dask: tasks travel to workers, results come back as they end.

What all tasks share travels once to each worker. The scheduler keeps the bytes of whatever it has sent until its result
is here, so that a worker may leave or come at any moment: what it had in hand is done again by another, with the same
bits.
"""

import logging
import re
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib.metadata import version
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

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

# How long a scheduler is waited for [s]. Chosen, not measured: long for a network, short for someone who mistyped.
LONGEST_WAIT = 10
# Processes of local:N for each core at most. More than one only serves to try how workers come and go.
EACH_CORE = 16
# Tasks under way for each thread of a worker [-]: one at work, one that waits beside it. And in all at least, so that
# workers that come find some.
EACH_THREAD, AT_LEAST = 2, 16
# What numbers hang on beside the processor.
DECIDING = ("numpy", "scipy", "numba")
GOES_ON = "what was finished is kept, and the same command goes on from there"
GONE = f"--cluster: expected the scheduler to stay, got no answer any more; {GOES_ON}, once there is one."
Work = Callable[..., Any]
DASK_SETTINGS = {
    # What tasks share is sent with care, once, and may be large: the warning against large graphs tells nothing.
    "distributed.admin.large-graph-warning-threshold": "1 TB",
    # Workers of local:N are not looked at a hundred times a second: that took a tenth of them on a small case.
    "distributed.worker.profile.enabled": False,
    # Dask has workers give memory back at once, so that arrays of megabytes are mapped anew each time.
    "distributed.nanny.pre-spawn-environ": {"OMP_NUM_THREADS": 1, "OPENBLAS_NUM_THREADS": 1, "MKL_NUM_THREADS": 1},
}


@contextmanager
def on_cluster(where: str | None) -> Iterator[None]:
    """Members, fits and predictions within are computed by the workers of a Dask cluster, with the same bits as here.

    where: the address of its scheduler, e.g. tcp://host:8786, or local:N for N processes on this machine; None for the
    threads and processes of `jobs`, as without it.

    Errors: InputError when `distributed` is missing, nobody answers at the address, or a worker has other versions.
    """
    if where is None:
        yield
        return
    with ExitStack() as stack:
        client = stack.enter_context(_connected(where))
        refuse_other_versions(client)
        stack.enter_context(task_backend(partial(_sent, client)))
        yield


@contextmanager
def _connected(where: str) -> Iterator["Client"]:
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise InputError(
            "--cluster needs the package distributed, which is not installed: pip install 'vegglue[cluster]'."
        ) from None
    _hush()
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(DASK_SETTINGS))
        count = _local(where)
        _refuse_without_certificates(where)
        address = stack.enter_context(_processes_here(count)) if count else where
        try:
            client = Client(address, timeout=LONGEST_WAIT, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise InputError(
                f"--cluster: expected a Dask scheduler that answers within {LONGEST_WAIT} s at {where}, got "
                f"{_first_line(error)}; start one with `dask scheduler`, correct the address, or use local:N."
            ) from None
        yield stack.enter_context(client)


def _processes_here(count: int) -> "LocalCluster":
    """A cluster of processes with one thread each; no limit of memory and no page, as without a cluster."""
    from distributed import LocalCluster

    keep_folder_out()
    with no_ctrl_c_for_children():
        return LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            memory_limit=0,
            silence_logs=logging.CRITICAL,
            preload=[__name__],
        )


def _hush() -> None:
    """Dask's own log is not shown: what goes wrong is told in a sentence."""
    for name in [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]:
        logging.getLogger(name).setLevel(logging.CRITICAL)


def dask_setup(worker: object) -> None:
    """What Dask asks each process of local:N to do first: Ctrl-C is left to the command that it serves."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _local(where: str) -> int:
    """N of local:N, 0 for an address. Errors: InputError when it is neither."""
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


def _refuse_without_certificates(where: str) -> None:
    """Errors: InputError for an address of TLS where Dask's configuration names no certificate of a client."""
    from distributed.security import Security

    if where.startswith(("tls:", "wss:")) and Security().get_connection_args("client")["ssl_context"] is None:
        raise InputError(
            f"--cluster: expected certificates for {where}, got none in Dask's configuration; name them there, below "
            "distributed.comm.tls: `ca-file`, and `cert` and `key` of the `client`."
        )


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).splitlines()[0].rstrip(".")


@cache
def versions_here() -> Mapping[str, str]:
    """Of this process: Python, vegglue and the libraries that decide the last digits."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return {"Python": python, "vegglue": VERSION} | {name: version(name) for name in DECIDING}


def refuse_other_versions(client: "Client") -> None:
    """Errors: InputError when a worker that is there now has other versions than this process, or no vegglue."""
    try:
        found = client.run(versions_here)
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"--cluster: expected vegglue {VERSION} on every worker, got {_first_line(error)}; install it there."
        ) from None
    for worker, there in found.items():
        _refuse_others(versions_here(), there, worker)


def _refuse_others(wanted: Mapping[str, str], there: Mapping[str, str], worker: str) -> None:
    for name, here in wanted.items():
        if there.get(name) != here:
            raise InputError(
                f"--cluster: expected {name} {here} on every worker, as here, got {there.get(name)} at {worker}: "
                "results would depend on who computes them; install the same versions."
            )


def _sent(client: "Client", work: Work, tasks: Iterable[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
    """The position and the result of each task as they end; few are under way at once, so that memory stays bounded."""
    from distributed import as_completed
    from distributed.protocol.pickle import dumps

    # A task that anyone can do again, and no value that is lost with its holder.
    shared = client.submit(_unpacked, dumps(work), key=f"shared-{uuid4().hex}")
    waiting, under_way, ends = enumerate(tasks), dict[Any, int](), as_completed(loop=client.loop)
    try:
        while True:
            room = max(EACH_THREAD * _threads(client), AT_LEAST) - len(under_way)
            for _, (position, task) in zip(range(room), waiting, strict=False):
                one = client.submit(_at_work, versions_here(), shared, dumps(task), key=f"task-{uuid4().hex}")
                under_way[one] = position
                ends.add(one)
            if not under_way:
                return
            future = next(ends)
            yield under_way.pop(future), _result(client, future)
    finally:
        client.cancel([*under_way, shared])


def _threads(client: "Client") -> int:
    """Threads of all workers that are there now."""
    try:
        return sum(client.nthreads().values())
    except (OSError, ValueError):
        raise InputError(GONE) from None


def _result(client: "Client", future: "Future[Any]") -> Any:
    """Errors: what the task raised; InputError when workers died of it, or there is no scheduler any more."""
    from distributed import CancelledError, KilledWorker

    try:
        return future.result()
    except KilledWorker:
        raise InputError(
            "--cluster: expected workers to live, got a task that ended several, most likely for want of memory; "
            f"{GOES_ON}. Give workers more memory, or start fewer of them on a machine."
        ) from None
    except CancelledError:
        raise InputError(GONE) from None
    except Exception:
        refuse_other_versions(client)  # the likeliest reason, of a worker that came later
        raise


def _unpacked(packed: bytes) -> Work:
    from distributed.protocol.pickle import loads

    work: Work = loads(packed)
    return work


def _at_work(wanted: Mapping[str, str], work: Work, packed: bytes) -> Any:
    """What a worker does: one task a thread."""
    from distributed import get_worker
    from distributed.protocol.pickle import loads

    _refuse_others(wanted, versions_here(), get_worker().address)
    one_thread_for_good()
    with at_most(1):
        return work(*loads(packed))
