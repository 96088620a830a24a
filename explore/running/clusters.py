"""The cluster of a sweep: threads of this process, processes of this machine, or an existing dask cluster."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any

from explore.base.errors import ClusterError, RequestError
from explore.mechanisms.linkages.table import PREFIX
from explore.mechanisms.registry import MECHANISMS
from explore.running.blocks import VERSIONS_THAT_MUST_AGREE, environment_of, environment_there
from explore.running.interrupts import interrupts_held
from explore.running.threads import LocalThreads

if TYPE_CHECKING:
    from collections.abc import Mapping

    from distributed import Client

#: Form of a scheduler's address.
_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+")
#: Timeout for an answer of the scheduler or of all its workers, s.
CONNECT_TIMEOUT = 10
#: Timeout longer than any sweep, s.
_NO_TIMEOUT = 1_000_000_000
#: Logging level above all others.
_LOG_NOTHING = logging.CRITICAL + 1
#: Code of each worker process for systems where it gets Ctrl-C: only the client may end the workers.
_IGNORE_CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


def local_cluster(workers: int | None, *, processes: bool) -> AbstractContextManager[Client | LocalThreads]:
    """Threads of this process, or a cluster of processes of this machine; one for each processor by default."""
    count = workers or processors()
    return _process_cluster(count) if processes else nullcontext(LocalThreads(count))


@contextmanager
def _process_cluster(count: int) -> Iterator[Client]:
    """Processes listen on the loopback address, where every user of the machine can connect; TLS keeps others out."""
    import dask
    from distributed import Client, Nanny, Security, SpecCluster

    from explore.running.local_nodes import LocalScheduler, LocalWorker

    node: dict[str, Any] = {"protocol": "tls://", "host": "127.0.0.1", "security": Security.temporary()}
    worker = {
        "cls": Nanny,
        "options": {**node, "worker_class": LocalWorker, "nthreads": 1, "silence_logs": _LOG_NOTHING},
    }
    with dask.config.set(_settings()), _quiet(), ExitStack() as started:
        # dask ends no node that is starting, and only the client may end workers; it prints a traceback if it is
        # interrupted at the moment at which the client connects.
        with interrupts_held() as release_interrupt:
            cluster = started.enter_context(
                SpecCluster(
                    scheduler={"cls": LocalScheduler, "options": {**node, "port": 0, "dashboard": False}},
                    workers=dict.fromkeys(range(count), worker),
                    security=node["security"],
                    silence_logs=_LOG_NOTHING,
                )
            )
            # Results come directly from the workers, so that each block is encrypted once, not twice.
            client = started.enter_context(Client(cluster, set_as_default=False, direct_to_workers=True))
        release_interrupt()
        yield client


def _settings() -> dict[str, Any]:
    """Dask's settings for a cluster of processes on this machine."""
    # The number of blocks in flight bounds the memory, so a worker must not pause on a small machine. A forked worker
    # would inherit the lock of the results file and keep it when this process ends. A worker with a second block
    # queued would lose both when it dies.
    limits = ("target", "spill", "pause", "terminate")
    settings: dict[str, Any] = {f"distributed.worker.memory.{limit}": False for limit in limits}
    settings |= {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
    settings |= {"distributed.worker.multiprocessing-method": "spawn", "distributed.scheduler.worker-saturation": 1.0}
    # dask abandons a worker that is still restarting this long after an earlier death; when all are abandoned, the
    # sweep would wait forever.
    settings |= {"distributed.deploy.lost-worker-timeout": _NO_TIMEOUT}
    # A result is asked for this long, by default 30 s, of a worker that died after it had reported the block done.
    settings |= {"distributed.comm.timeouts.connect": CONNECT_TIMEOUT}
    # Loading the modules takes seconds without heartbeats, so a worker loads them before it joins.
    settings |= {"distributed.worker.preload": [_IGNORE_CTRL_C, "explore.running.blocks"]}
    return settings


def remote_cluster(address: str, mechanism: str) -> AbstractContextManager[Client]:
    """The cluster of the scheduler at an address such as ``tcp://host:8786``, for a mechanism of this name."""
    check_address(address)
    return _connected(address, mechanism)


def check_address(address: str) -> None:
    """Refuse what is no address of a scheduler: dask's client waits 20 s for one and ends with a traceback."""
    if not _ADDRESS.fullmatch(address):
        raise RequestError(f"{address!r} is no address of a scheduler; write one such as tcp://host:8786")
    if address.startswith("tls:"):
        from distributed.security import Security

        if Security().get_connection_args("client").get("ssl_context") is None:
            raise RequestError(f"{address} needs certificates; name them in dask's configuration, distributed.comm.tls")


@contextmanager
def _connected(address: str, mechanism: str) -> Iterator[Client]:
    from distributed import Client

    with _quiet():
        try:
            client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, ValueError, TypeError) as problem:
            reason = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
            raise ClusterError(
                f"no dask scheduler answers at {address}: {reason}; start one with `dask scheduler`"
            ) from problem
        with client:
            _check_workers(client, mechanism)
            yield client


@contextmanager
def existing_client(client: Client, mechanism: str) -> Iterator[Client]:
    """The cluster of a client that the caller opens and closes, for a mechanism of this name."""
    if client.asynchronous:
        raise RequestError("the client is asynchronous; give a synchronous dask.distributed Client")
    if client.status != "running":
        raise ClusterError(f"the client is {client.status}; give one that is connected to a cluster")
    _check_workers(client, mechanism)
    yield client


def _check_workers(client: Client, mechanism: str) -> None:
    """Refuse workers whose versions, of the mechanism of this name too, differ from those of this process."""
    try:
        found = MECHANISMS.get(mechanism)
        table = found.table if found and found.name.startswith(PREFIX) else None
        answers = client.run(environment_there, mechanism, table, on_error="return", callback_timeout=CONNECT_TIMEOUT)
    except TimeoutError:
        return  # a worker is silent or slow; the sweep reports it and checks every block it receives
    for worker, answer in answers.items():
        if isinstance(answer, BaseException):
            raise ClusterError(
                f"the worker {worker} cannot run explore ({type(answer).__name__}: {answer}); "
                f"install linkage-explore {environment_of(mechanism)['explore']} there"
            )
        check_environment(answer, worker, mechanism)


def check_environment(theirs: Mapping[str, str], worker: str, mechanism: str) -> None:
    """Refuse results of other versions, whose values may differ."""
    ours = environment_of(mechanism)
    different = [
        f"{name} {theirs.get(name, 'unknown')} there, {ours[name]} here"
        for name in VERSIONS_THAT_MUST_AGREE
        if theirs.get(name) != ours[name]
    ]
    if different:
        raise ClusterError(f"the worker {worker} has other versions: {'; '.join(different)}; make them equal")


@contextmanager
def _quiet() -> Iterator[None]:
    """Mute dask's log: the sweep itself reports failed and lost blocks."""
    # Mutes the handlers, since dask sets the levels of its loggers itself.
    handlers = [*logging.getLogger("distributed").handlers, *logging.getLogger("distributed.client").handlers]
    levels = [handler.level for handler in handlers]
    for handler in handlers:
        handler.setLevel(_LOG_NOTHING)
    try:
        yield
    finally:
        for handler, level in zip(handlers, levels, strict=True):
            handler.setLevel(level)


def processors() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
