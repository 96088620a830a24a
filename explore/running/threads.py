"""Blocks on threads of this process, by dask's scheduler without an event loop.

The compiled loops release Python's lock, so that all processors compute. `dask.local.get_async` costs 0.4 ns a design
of a full block; a cluster of threads takes 4 ms of its event loop for each block, a fifth of a fast block's time.
Callbacks of dask (progress bars, profilers, caches) that are registered see the blocks, and the pool of dask's
configuration computes them where there is one.
"""

import itertools
import multiprocessing.pool
import queue
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

from explore.base.errors import RequestError
from explore.running.attempts import Attempts

#: Number of blocks under way beyond one for each thread: they keep the threads busy while a block is committed.
SPARE_BLOCKS = 2
#: Number of blocks of a graph: dask orders a graph before it starts, which takes 0.2 s for so many.
_GRAPH_SIZE = 10_000
#: Time between two calls of `wait`, s.
_WAIT = 1.0

#: Function that has another one called in a thread.
Submit = Callable[..., Future[Any]]


@dataclass(frozen=True)
class LocalThreads:
    """So many threads of this process."""

    count: int


def threads_of_block(workers: object, blocks: int) -> int:
    """How many threads each of so many blocks may take: one on a cluster, and in the pool of dask's configuration."""
    import dask

    if not isinstance(workers, LocalThreads) or dask.config.get("pool", None) is not None:
        return 1
    return max(workers.count // blocks, 1)


class BlocksOnThreads:
    """Runs blocks on threads of this process, a few at a time.

    `compute` computes a block by number, in one of the threads. `accept`, `reject` and `note` are those of `Attempts`,
    called in the thread that calls `run`; `note` receives the event ``workers`` too. The next block starts after
    `accept` returns, which bounds the memory. A thread of its own calls `wait` each second, and its error ends the run;
    after an error `stop` is called, before blocks that run are awaited.
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
        self._problem: BaseException | None = None

    def run(self, numbers: Iterable[int]) -> None:
        """Run all blocks; return when each is accepted or rejected. After an error, blocks that run are awaited."""
        remaining = iter(numbers)
        first = list(itertools.islice(remaining, self._count))  # no more threads than blocks
        remaining = itertools.chain(first, remaining)
        threads = Threads(len(first))
        self._note("workers", joined=threads.names, left=[], threads=len(first))
        with threads, _submitter(threads) as submit, self._waiting():
            try:
                while blocks := list(itertools.islice(remaining, _GRAPH_SIZE)):
                    remaining = itertools.chain(self._run_graph(submit, blocks), remaining)
            except BaseException:
                if self._stop is not None:
                    self._stop()
                raise
        if self._problem is not None:  # after the last block arrived
            raise self._problem

    @contextmanager
    def _waiting(self) -> Iterator[None]:
        """Call `wait` each second in a thread of its own; what it raises, the next block that arrives raises."""
        tell, ended = self._wait, threading.Event()
        if tell is None:
            yield
            return

        def call() -> None:
            try:
                while not ended.wait(_WAIT):
                    tell()
            except BaseException as problem:
                self._problem = problem
                if self._stop is not None:
                    self._stop()

        thread = threading.Thread(target=call, daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def _run_graph(self, submit: Submit, numbers: list[int]) -> list[int]:
        """Run blocks in the order of their numbers; return those to be tried again."""
        from dask.callbacks import Callback
        from dask.local import get_async

        again: list[int] = []

        def sort(_: object, state: dict[str, Any]) -> None:
            state["ready"].sort(reverse=True)  # the last one is the next; dask's own order follows the hashes of keys

        def settle(key: tuple[str, int], outcome: list[Any], *_: object) -> None:
            if self._problem is not None:
                raise self._problem
            if self._attempts.settle(key[1], *outcome):
                again.append(key[1])
            outcome.clear()  # dask keeps the list, whose memory the next blocks need

        graph = {("block", number): (self._attempt, number) for number in numbers}
        callbacks = [*Callback.active, (None, sort, None, settle, None)]
        get_async(submit, self._count + SPARE_BLOCKS, graph, list(graph), callbacks=callbacks)
        return again

    def _attempt(self, number: int) -> list[Any]:
        """Return [result, None], or [None, exception] if the block failed."""
        try:
            return [self._compute(number), None]
        except BaseException as problem:  # else the sweep would end without another attempt
            return [None, problem]


class Threads:
    """Threads for which Python does not wait when it ends: unlike a pool's, a second Ctrl-C ends them at once."""

    def __init__(self, count: int) -> None:
        self._calls: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._threads = [threading.Thread(target=self._work, daemon=True) for _ in range(count)]
        self.names = [thread.name for thread in self._threads]

    def __enter__(self) -> Self:
        try:
            for thread in self._threads:
                thread.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Drop the calls that wait, and wait for those that run."""
        # A thread may take the last call between a look at the queue and a wait for its next item.
        with suppress(queue.Empty):
            while True:
                self._calls.get_nowait()
        for _thread in self._threads:
            self._calls.put(None)
        for thread in self._threads:
            if thread.is_alive():
                thread.join()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Call a function in a thread."""
        future: Future[Any] = Future()
        self._calls.put(partial(_settle, future, function, *arguments))
        return future

    def _work(self) -> None:
        """Do calls until there are no more; what a thread runs."""
        while call := self._calls.get():
            call()
            del call  # holds a result, whose memory the next block needs


def _settle(future: Future[Any], function: Callable[..., Any], *arguments: Any) -> None:
    """Call a function for a future."""
    try:
        future.set_result(function(*arguments))
    except BaseException as problem:
        future.set_exception(problem)


@contextmanager
def _submitter(threads: Threads) -> Iterator[Submit]:
    """What submits to the pool of dask's configuration, whose calls end with the context, or to threads of ours."""
    import dask
    from dask.local import MultiprocessingPoolExecutor

    pool = dask.config.get("pool", None)
    if pool is None:
        yield threads.submit
        return
    if isinstance(pool, ProcessPoolExecutor) or type(pool) is multiprocessing.pool.Pool:
        raise RequestError(
            "the pool in dask's configuration is one of processes, but blocks run on threads; configure a "
            "ThreadPoolExecutor or none, or sweep with `processes=True`"
        )
    if isinstance(pool, multiprocessing.pool.Pool):
        pool = MultiprocessingPoolExecutor(pool)
    unfinished: set[Future[Any]] = set()

    def submit(*call: Any) -> Future[Any]:
        future: Future[Any] = pool.submit(*call)
        unfinished.add(future)
        future.add_done_callback(unfinished.discard)
        return future

    try:
        yield submit
    finally:
        wait([future for future in list(unfinished) if not future.cancel()])
