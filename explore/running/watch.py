"""Which workers of a cluster respond. A stopped process keeps its connections, so dask does not notice it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from explore.base.errors import ClusterError

if TYPE_CHECKING:
    from distributed import Client

#: Time between looks at the cluster, s.
LOOK_INTERVAL = 1.0
#: Time without a heartbeat or an answer after which a worker or the scheduler counts as silent, s.
SILENCE = 10.0
#: Additional time for each worker, s: heartbeats come twice a second with few workers, every 6 s with 1,000.
SILENCE_PER_WORKER = 0.02


@dataclass
class _Worker:
    """A worker as the scheduler sees it.

    `heartbeat` is its last one by the scheduler's clock; `quiet` is for how many seconds no newer one was seen;
    `silent` is whether that was reported.
    """

    label: str
    threads: int
    heartbeat: float
    quiet: float = 0.0
    silent: bool = False


class Watch:
    """Looks at the workers of a cluster and reports which join, leave, fall silent or respond again.

    `note` receives an event and its details: ``workers``, ``waiting``, ``silent``, ``answers``.
    """

    def __init__(self, client: Client, note: Callable[..., None]) -> None:
        self._client, self._note = client, note
        self._scheduler = client.scheduler.address
        self._scheduler_silent = False
        self._workers: dict[str, _Worker] = {}
        self._threads: dict[str, int] | None = None
        self._last_look = -LOOK_INTERVAL

    @property
    def answering(self) -> list[str]:
        """Addresses of the workers that are not silent."""
        return [address for address, worker in self._workers.items() if not worker.silent]

    @property
    def threads(self) -> int:
        """Threads of the workers that are not silent."""
        return sum(worker.threads for worker in self._workers.values() if not worker.silent)

    def silent(self, seconds: float = 0.0) -> set[str]:
        """Addresses of the silent workers without a heartbeat for at least so many seconds."""
        return {address for address, worker in self._workers.items() if worker.silent and worker.quiet >= seconds}

    def look(self) -> bool:
        """Look at the cluster unless `LOOK_INTERVAL` has not passed; return whether the scheduler answered."""
        elapsed = time.monotonic() - self._last_look
        if elapsed < LOOK_INTERVAL:
            return False
        identity = self._ask("identity")
        self._last_look = time.monotonic()
        if identity is None:
            return False
        before, self._workers = self._workers, {}
        for address, facts in identity["workers"].items():
            worker = _Worker(_label(address, facts["name"]), facts["nthreads"], facts["last_seen"])
            previous = before.get(address, worker)
            worker.silent = previous.silent
            if previous is not worker and previous.heartbeat == worker.heartbeat:
                # While this process itself is stopped it sees no heartbeats: count that time once only.
                worker.quiet = previous.quiet + min(elapsed, 2 * LOOK_INTERVAL)
            self._workers[address] = worker
        self._report_changes()
        self._report_silence()
        return True

    def tasks(self) -> dict[str, set[str]]:
        """Keys of the tasks that each worker runs or whose results it holds, by address."""
        tasks: dict[str, set[str]] = {}
        for question in ("processing", "has_what"):
            for worker, keys in (self._ask(question, workers=None) or {}).items():
                tasks.setdefault(worker, set()).update(keys)
        return tasks

    def _ask(self, question: str, **arguments: Any) -> Mapping[str, Any] | None:
        """The scheduler's answer; None if it is silent."""
        if self._client.scheduler is None:
            raise cluster_lost(ConnectionError("the client is closed"))
        try:
            answer: Mapping[str, Any] | None = self._client.sync(
                getattr(self._client.scheduler, question), callback_timeout=SILENCE, **arguments
            )
        except TimeoutError:
            answer = None
        except Exception as problem:
            raise cluster_lost(problem) from problem
        if (answer is None) != self._scheduler_silent:
            self._scheduler_silent = answer is None
            silence = f"has been silent for {SILENCE:.0f} s; waiting for it" if answer is None else None
            self._report(f"the scheduler {self._scheduler}", {"scheduler": self._scheduler}, silence)
        return answer

    def _report_changes(self) -> None:
        threads = {address: worker.threads for address, worker in self._workers.items()}
        if threads == self._threads:
            return
        before = (self._threads or {}).keys()
        joined, left = sorted(threads.keys() - before), sorted(before - threads.keys())
        self._threads = threads
        self._note("workers", joined=joined, left=left, threads=sum(threads.values()))
        if not threads:
            self._note("waiting", reason="the cluster has no worker; waiting for one")

    def _report_silence(self) -> None:
        patience = SILENCE + SILENCE_PER_WORKER * len(self._workers)
        changed = {a: worker for a, worker in self._workers.items() if worker.silent != (worker.quiet >= patience)}
        for worker in changed.values():
            worker.silent = not worker.silent
        consequence = "others compute its blocks" if self.answering else "waiting for a worker that answers"
        for address, worker in changed.items():
            silence = f"has been silent for {patience:.0f} s; {consequence}" if worker.silent else None
            self._report(f"the worker {worker.label}", {"worker": address}, silence)

    def _report(self, name: str, address: Mapping[str, str], silence: str | None) -> None:
        if silence:
            self._note("silent", **address, reason=f"{name} {silence}")
        else:
            self._note("answers", **address, reason=f"{name} answers again")


def cluster_lost(problem: Exception) -> ClusterError:
    """The error that ends a sweep whose scheduler is gone."""
    # dask's own message has several lines and names the task.
    reason = getattr(problem, "reason", None) or str(problem).partition("\n")[0] or type(problem).__name__
    return ClusterError(f"the cluster was lost ({reason}); run the sweep or refinement again to go on")


def _label(address: str, name: object) -> str:
    """Name and address of a worker, or the address alone if it has no name."""
    return address if str(name) == address else f"{name} ({address})"
