"""Blocks on threads of this process. The compiled loops release Python's lock, so that all processors compute.

A cluster of threads by dask takes 4 ms of its event loop for each block, which is a fifth of a fast block's time.
"""

from __future__ import annotations

import itertools
import queue
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from explore.running.attempts import Attempts

#: Blocks under way beyond one for each thread: they keep the threads busy while a block is committed.
SPARE_BLOCKS = 2
#: Seconds after which a wait is begun anew, because some systems deliver Ctrl-C only between two waits.
_WAIT = 1.0

_Numbers = queue.SimpleQueue[int | None]
_Outcomes = queue.SimpleQueue[tuple[int, Any, BaseException | None]]


@dataclass(frozen=True)
class LocalThreads:
    """So many threads of this process."""

    count: int


class BlocksOnThreads:
    """Runs blocks on threads of this process, a few at a time.

    Parameters
    ----------
    threads
        How many.
    compute
        Computes a block by number, in one of the threads.
    accept, reject, note
        As in `Attempts`; called in the thread that calls `run`. The next block starts after `accept` returns, which
        bounds the memory. `note` receives the event ``workers`` too.
    wait, stop
        Called each second without an arrival, and after an error before blocks that run are awaited.
    """

    def __init__(
        self,
        threads: LocalThreads,
        compute: Callable[[int], Any],
        accept: Callable[[int, Any], None],
        reject: Callable[[int, str], None],
        note: Callable[..., None],
        *,
        wait: Callable[[], None] | None = None,
        stop: Callable[[], None] | None = None,
    ) -> None:
        self._count, self._compute, self._note = threads.count, compute, note
        self._wait, self._stop = wait, stop
        self._attempts = Attempts(accept, reject, note)
        self._waiting: _Numbers = queue.SimpleQueue()
        self._arrived: _Outcomes = queue.SimpleQueue()

    def run(self, numbers: Iterable[int]) -> None:
        """Run all blocks; return when each is accepted or rejected. After an error, blocks that run are awaited."""
        remaining = iter(numbers)
        first = list(itertools.islice(remaining, self._count))  # no more threads than blocks
        # Python does not wait for daemons when it ends, so that a second Ctrl-C ends the process at once.
        threads = [threading.Thread(target=self._compute_all, daemon=True) for _ in first]
        self._note("workers", joined=[thread.name for thread in threads], left=[], threads=len(threads))
        try:
            for thread in threads:
                thread.start()
            self._run(itertools.chain(first, remaining))
        except BaseException:
            if self._stop is not None:
                self._stop()
            raise
        finally:
            # A thread may take the last block between a look at the queue and a wait for its next item.
            with suppress(queue.Empty):
                while True:
                    self._waiting.get_nowait()
            for _ in threads:
                self._waiting.put(None)
            for thread in threads:
                if thread.is_alive():
                    thread.join()

    def _run(self, numbers: Iterator[int]) -> None:
        n_running = 0
        while True:
            while n_running < self._count + SPARE_BLOCKS and (number := next(numbers, None)) is not None:
                self._waiting.put(number)
                n_running += 1
            if not n_running:
                return
            n_running -= self._settle_next()

    def _settle_next(self) -> bool:
        """Wait for a block to arrive; return whether it is settled, not to be tried again."""
        while True:
            try:
                number, result, problem = self._arrived.get(timeout=_WAIT)
                break
            except queue.Empty:
                if self._wait is not None:
                    self._wait()
        is_settled = not self._attempts.settle(number, result, problem)
        if not is_settled:
            self._waiting.put(number)
        return is_settled

    def _compute_all(self) -> None:
        """Compute blocks until there are no more; what a thread runs."""
        while (number := self._waiting.get()) is not None:
            # No variable holds the result, whose memory the next block needs.
            self._arrived.put((number, *self._attempt(number)))

    def _attempt(self, number: int) -> tuple[Any, BaseException | None]:
        """Return (result, None), or (None, exception) if the block failed."""
        try:
            return self._compute(number), None
        except BaseException as problem:  # else the sweep would wait for this block forever
            return None, problem
