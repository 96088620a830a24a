"""A bounded number of blocks at a time on a cluster, so that memory and scheduler load do not grow with the sweep."""

from __future__ import annotations

import asyncio
import concurrent.futures
import itertools
import queue
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from explore.running.attempts import Attempts
from explore.running.threads import SPARE_BLOCKS
from explore.running.watch import LOOK_INTERVAL, Watch, cluster_lost

if TYPE_CHECKING:
    from distributed import Client, Future

#: Number of mean block times after which the blocks of a silent worker are restarted elsewhere.
PATIENCE = 3


@dataclass(frozen=True)
class _InFlight:
    """A block in flight: its number, its task, and when it started (monotonic clock, s)."""

    number: int
    future: Future
    start: float


class BlocksInFlight:
    """Runs blocks on a cluster, a few at a time.

    `submit` starts a block by number; it prefers the workers listed, or any with None. The next block starts after
    `accept` returns, which bounds the queue. `note` receives the events of `Attempts` and of `Watch`, and
    ``elsewhere``.
    """

    def __init__(
        self,
        client: Client,
        submit: Callable[[int, list[str] | None], Future],
        accept: Callable[[int, Any], None],
        reject: Callable[[int, str], None],
        note: Callable[..., None],
    ) -> None:
        self._client, self._submit = client, submit
        self._attempts, self._reject, self._note = Attempts(accept, reject, note), reject, note
        self._arrived: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._blocks: dict[str, _InFlight] = {}
        self._stuck: set[str] = set()
        self._watch = Watch(client, note)
        self._n_arrived, self._seconds = 0, 0.0

    def run(self, numbers: Iterable[int]) -> None:
        """Run all blocks; return when each is accepted or rejected."""
        waiting = iter(numbers)
        while self._fill(waiting):
            try:
                future = self._arrived.get(timeout=LOOK_INTERVAL)
            except queue.Empty:
                continue
            if future.key not in self._blocks:  # restarted elsewhere
                continue
            result, problem = self._outcome(future)
            if block := self._blocks.pop(future.key, None):
                self._n_arrived, self._seconds = self._n_arrived + 1, self._seconds + time.monotonic() - block.start
                self._settle(block.number, result, problem)
            future.release()

    def _fill(self, waiting: Iterator[int]) -> bool:
        """Start as many blocks as there is room for; return whether any block is in flight."""
        self._look()
        room = self._watch.threads + SPARE_BLOCKS - len(self._blocks.keys() - self._stuck)
        for number in itertools.islice(waiting, max(room, 0)):
            self._start(number)
        return bool(self._blocks)

    def _start(self, number: int) -> None:
        # dask does not detect silent workers; they look idle, so it would give them the next block.
        workers = self._watch.answering if self._watch.silent() else None
        try:
            future = self._submit(number, workers)
        except Exception as problem:
            raise cluster_lost(problem) from problem
        self._blocks[future.key] = _InFlight(number, future, time.monotonic())
        future.add_done_callback(self._arrived.put)

    def _look(self) -> None:
        """Update the watch; restart the blocks of workers that are silent for too long."""
        if not self._watch.look():
            return
        silent = self._watch.silent() if self._watch.answering else set()
        tasks = self._watch.tasks() if silent else {}
        held = {worker: tasks.get(worker, set()) & self._blocks.keys() for worker in silent}
        self._stuck = set().union(*held.values())
        for worker in silent & self._watch.silent(PATIENCE * self._seconds / max(self._n_arrived, 1)):
            for key in held[worker]:
                block = self._blocks.pop(key, None)
                if block is not None:
                    self._note("elsewhere", block=block.number, worker=worker)
                    self._start(block.number)
                    block.future.release()  # so that no block arrives twice

    def _outcome(self, future: Future) -> tuple[Any, Exception | None]:
        """Return (result, None), or (None, exception) if the block failed. A failed block must not stop the others.

        Fetches the result instead of testing the task's state: a worker may die after it reported the block done, and
        dask then computes it again during this wait. The loop ends when the block of a silent worker is restarted.
        """
        gathered = self._client.gather(future, asynchronous=True)
        fetch = asyncio.run_coroutine_threadsafe(gathered, self._client.loop.asyncio_loop)
        try:
            while future.key in self._blocks and not concurrent.futures.wait([fetch], LOOK_INTERVAL).done:
                self._look()
            return fetch.result(timeout=0), None
        except Exception as problem:
            if future.key in self._blocks and future.status != "error":  # the cluster failed, not the block
                raise cluster_lost(problem) from problem
            return None, problem
        finally:
            fetch.cancel()

    def _settle(self, number: int, result: Any, problem: Exception | None) -> None:
        from distributed.scheduler import KilledWorker

        if isinstance(problem, KilledWorker):  # several workers died while they computed the block
            workers = problem.allowed_failures + 1
            self._reject(number, f"KilledWorker: {workers} workers died while they computed it")
        elif self._attempts.settle(number, result, problem):
            self._start(number)
