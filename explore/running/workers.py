"""The workers and the progress of functions that compute results."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from explore.base.counts import check_count
from explore.base.errors import RequestError
from explore.evaluation.evaluate import compile_kernels
from explore.model.progress import ReportProgress
from explore.running.clusters import existing_client, local_cluster, remote_cluster
from explore.running.runs import Progress

if TYPE_CHECKING:
    from distributed import Client

    from explore.model.request import Request
    from explore.running.threads import LocalThreads


def find_workers(
    request: Request, client: Client | None, workers: int | None, *, processes: bool
) -> AbstractContextManager[Client | LocalThreads]:
    """The workers that compute a request, whose kernels are compiled here if they share them."""
    if workers is not None:
        check_count("workers", workers, 1)
    if client is not None and (workers is not None or processes):
        raise RequestError("workers and processes cannot be combined with client, which has its own workers")
    if client is not None:
        return existing_client(client, request.mechanism.name)
    return start_workers(request, workers, processes=processes)


def start_workers(
    request: Request, workers: int | None, *, processes: bool, scheduler: str | None = None
) -> AbstractContextManager[Client | LocalThreads]:
    """The workers of a scheduler or of this machine, after the kernels are compiled if this process needs them."""
    if scheduler is not None:
        return remote_cluster(scheduler, request.mechanism.name)
    compile_kernels(request)
    return local_cluster(workers, processes=processes)


def report_counts(report_progress: ReportProgress | None) -> Callable[[Progress], None] | None:
    """A function that reports the progress of a run as the number of committed designs and of all designs."""
    if report_progress is None:
        return None
    return lambda progress: report_progress(progress.n_done, progress.n_designs)
