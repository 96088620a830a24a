"""The workers of a sweep: threads of this process, processes of this machine, or a cluster that is there already."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any

from explore.errors import ClusterError, RequestError
from explore.sweeping.blocks import MUST_AGREE, facts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from distributed import Client

#: How an address of a scheduler is written.
_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+")
#: Seconds to wait for a scheduler to answer.
CONNECT_TIMEOUT = 10
#: Seconds that last longer than a sweep.
_NEVER = 1_000_000_000
#: A level above all that is ever logged.
_SILENT = logging.CRITICAL + 1
#: Ctrl-C reaches every process of a terminal; a worker leaves it to the client, which ends all workers.
_DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


@contextmanager
def local_cluster(workers: int | None, *, processes: bool) -> Iterator[Client]:
    """A cluster on this machine: one process with threads, because the kernels release the GIL, or processes."""
    import dask
    from distributed import Client, LocalCluster

    count = workers or processors()
    # The window of blocks bounds the memory, so a worker must not pause on a small machine; and nothing is served
    # over HTTP, where the default port would collide with the next sweep's. A worker that is forked would inherit the
    # lock and keep it after this process is gone; one that holds a second block would take it down with the first.
    limits = ("target", "spill", "pause", "terminate")
    settings: dict[str, Any] = {f"distributed.worker.memory.{limit}": False for limit in limits}
    settings |= {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
    settings |= {"distributed.worker.multiprocessing-method": "spawn", "distributed.scheduler.worker-saturation": 1.0}
    # dask gives a worker up for good if it happens to be restarting this long after it died another time; when the last
    # one was given up, the sweep would wait forever.
    settings |= {"distributed.deploy.lost-worker-timeout": _NEVER}
    settings |= {"distributed.worker.preload": [_DEAF] if processes else []}
    with (
        dask.config.set(settings),
        _quiet(),
        LocalCluster(
            n_workers=count if processes else 1,
            threads_per_worker=1 if processes else count,
            processes=processes,
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
            silence_logs=_SILENT,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


def remote_cluster(address: str) -> AbstractContextManager[Client]:
    """The cluster whose scheduler listens at an address such as ``tcp://host:8786``."""
    # dask's client finds out late, waits for 20 seconds and ends with a traceback.
    if not _ADDRESS.fullmatch(address):
        raise RequestError(f"{address!r} is no address of a scheduler; write one such as tcp://host:8786")
    if address.startswith("tls:"):
        from distributed.security import Security

        if Security().get_connection_args("client").get("ssl_context") is None:
            raise RequestError(f"{address} needs certificates; name them in dask's configuration, distributed.comm.tls")
    return _connected(address)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
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
            _check_workers(client)
            yield client


@contextmanager
def given_client(client: Client) -> Iterator[Client]:
    """A cluster that the caller opened and closes."""
    if client.asynchronous:
        raise RequestError("the client is asynchronous; give a synchronous dask.distributed Client")
    if client.status != "running":
        raise ClusterError(f"the client is {client.status}; give one that is connected to a cluster")
    _check_workers(client)
    yield client


def _check_workers(client: Client) -> None:
    """Refuse workers that compute with other versions than this process."""
    for worker, answer in client.run(facts, on_error="return").items():
        if isinstance(answer, BaseException):
            raise ClusterError(
                f"the worker {worker} cannot run explore ({type(answer).__name__}: {answer}); "
                f"install linkage-explore {facts()['explore']} there"
            )
        check_facts(answer, worker)


def check_facts(theirs: Mapping[str, str], worker: str) -> None:
    """Refuse what a worker of other versions computed: its values could differ from ours."""
    ours = facts()
    different = [
        f"{name} {theirs.get(name, 'unknown')} there, {ours[name]} here"
        for name in MUST_AGREE
        if theirs.get(name) != ours[name]
    ]
    if different:
        raise ClusterError(f"the worker {worker} has other versions: {'; '.join(different)}; make them equal")


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep dask's log to itself: what a user must know of failed or lost blocks is said by the sweep."""
    # The handlers, because dask gives its loggers levels of their own.
    handlers = [*logging.getLogger("distributed").handlers, *logging.getLogger("distributed.client").handlers]
    levels = [handler.level for handler in handlers]
    for handler in handlers:
        handler.setLevel(_SILENT)
    try:
        yield
    finally:
        for handler, level in zip(handlers, levels, strict=True):
            handler.setLevel(level)


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
