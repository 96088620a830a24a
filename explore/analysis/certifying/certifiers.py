"""The workers on which designs are certified."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from explore.base.counts import check_count
from explore.base.errors import RequestError
from explore.running.clusters import existing_client, local_cluster, remote_cluster

if TYPE_CHECKING:
    from distributed import Client

    from explore.running.threads import LocalThreads

#: Time that this process works alone before it starts others, which takes about as long, s.
PATIENCE = 3.0


@dataclass(frozen=True)
class Certifiers:
    """Workers for the designs that this process has not certified after some seconds, the patience.

    `connect` connects them, for a mechanism of a name, from it and the number of tasks.
    """

    connect: Callable[[str, int], AbstractContextManager[Client | LocalThreads]]
    patience: float


def find_certifiers(
    client: Client | None = None, workers: int | None = None, scheduler: str | None = None
) -> Certifiers | None:
    """The workers of a client or of a scheduler, or so many processes; None for this process alone."""
    if workers is not None:
        check_count("workers", workers, 1)
        if client is not None:
            raise RequestError("workers cannot be combined with client, which has its own workers")
    if client is not None:
        return Certifiers(lambda mechanism, _: existing_client(client, mechanism), patience=0.0)
    if scheduler is not None:
        return Certifiers(lambda mechanism, _: remote_cluster(scheduler, mechanism), patience=0.0)
    if workers is None or workers == 1:
        return None
    return Certifiers(lambda _, tasks: local_cluster(min(workers, tasks), processes=True), PATIENCE)
