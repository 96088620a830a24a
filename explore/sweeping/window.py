"""A bounded window of blocks under way on a cluster: neither the scheduler nor the memory ever sees all of a sweep."""

from __future__ import annotations

import itertools
import queue
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

from explore.errors import ClusterError

if TYPE_CHECKING:
    from distributed import Client, Future

#: Blocks under way at a time beyond one for each worker thread: enough to keep them busy while one is committed.
SPARE_BLOCKS = 2
#: How often a block is tried before it is left out. One whose workers die the scheduler tries again by itself.
TRIES = 2
#: Seconds between looks at who is working.
LOOK = 1.0


class Window:
    """Runs blocks on a cluster, a few at a time.

    Parameters
    ----------
    client
        Of the cluster.
    submit
        Starts one block by number.
    accept
        Takes a block's number and result. The next block starts after it returns, which bounds what waits.
    reject
        Takes the number of a block that failed for good, and why.
    note
        Takes an event and its facts: ``retry``, ``workers``, ``waiting``.
    """

    def __init__(
        self,
        client: Client,
        submit: Callable[[int], Future],
        accept: Callable[[int, Any], None],
        reject: Callable[[int, str], None],
        note: Callable[..., None],
    ) -> None:
        self._client, self._submit = client, submit
        self._accept, self._reject, self._note = accept, reject, note
        self._arrived: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._under_way: dict[str, int] = {}
        self._tries: Counter[int] = Counter()
        self._workers: dict[str, int] | None = None
        self._looked = -LOOK

    def run(self, numbers: Iterable[int]) -> None:
        """Run all blocks and return when each was accepted or rejected."""
        waiting = iter(numbers)
        self._fill(waiting)
        while self._under_way:
            future = self._next()
            number = self._under_way.pop(future.key)
            self._settle(number, *_outcome(future))
            future.release()
            self._fill(waiting)

    def _fill(self, waiting: Iterator[int]) -> None:
        self._look()
        room = sum((self._workers or {}).values()) + SPARE_BLOCKS - len(self._under_way)
        for number in itertools.islice(waiting, max(room, 0)):
            self._start(number)

    def _start(self, number: int) -> None:
        self._tries[number] += 1
        try:
            future = self._submit(number)
        except Exception as problem:
            raise _lost(problem) from problem
        self._under_way[future.key] = number
        future.add_done_callback(self._arrived.put)

    def _next(self) -> Future:
        while True:
            try:
                return self._arrived.get(timeout=LOOK)
            except queue.Empty:
                self._look()

    def _settle(self, number: int, result: Any, problem: Exception | None) -> None:
        if problem is None:
            del self._tries[number]
            self._accept(number, result)
        elif self._tries[number] < TRIES and not _is_deadly(problem):
            self._note("retry", block=number, problem=_in_words(problem))
            self._start(number)
        else:
            self._reject(number, _in_words(problem))

    def _look(self) -> None:
        """See now and then who is working: workers come and go, and with none at all nothing would ever happen."""
        now = time.monotonic()
        if now - self._looked < LOOK:
            return
        self._looked = now
        try:
            workers = dict(self._client.nthreads())
        except Exception as problem:
            raise _lost(problem) from problem
        if workers != self._workers:
            joined, left = workers.keys() - (self._workers or {}).keys(), (self._workers or {}).keys() - workers.keys()
            self._workers = workers
            self._note("workers", joined=sorted(joined), left=sorted(left), threads=sum(workers.values()))
            if not workers:
                self._note("waiting", reason="the cluster has no worker; waiting for one")


def _outcome(future: Future) -> tuple[Any, Exception | None]:
    """What a block gave and None, or None and why it failed. Whatever it raises must not stop the others.

    Asking for the result, not for the state: a worker may die after it reported the block done, and then the block is
    computed again while this waits.
    """
    try:
        return future.result(), None
    except Exception as problem:
        if future.status != "error":  # the block did not fail, the cluster did
            raise _lost(problem) from problem
        return None, problem


def _is_deadly(problem: Exception) -> bool:
    """Whether the block took several workers with it: no more must die for it."""
    from distributed.scheduler import KilledWorker

    return isinstance(problem, KilledWorker)


def _in_words(problem: Exception) -> str:
    if _is_deadly(problem):
        return f"KilledWorker: {problem.allowed_failures + 1} workers died while they computed it"  # type: ignore[attr-defined]
    return f"{type(problem).__name__}: {problem}"


def _lost(problem: Exception) -> ClusterError:
    # dask's own text names the task and goes on for lines.
    reason = getattr(problem, "reason", None) or str(problem).partition("\n")[0] or type(problem).__name__
    return ClusterError(f"the cluster was lost ({reason}); run the sweep again to go on")
