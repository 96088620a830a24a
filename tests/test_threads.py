"""Blocks on threads of this process: as many threads as blocks, and an end after any error."""

import queue
import threading
import time
import weakref
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing.pool import ThreadPool

import dask
import pytest
from dask.callbacks import Callback

from explore.base.errors import RequestError
from explore.running import threads
from explore.running.threads import SPARE_BLOCKS, BlocksOnThreads, LocalThreads


def ignore(*_, **__):
    """Do nothing."""


class SlowlyEmptied(queue.SimpleQueue):
    """A queue that gives other threads time to take its last item after a look at it."""

    def empty(self):
        was_empty = super().empty()
        time.sleep(0.1)
        return was_empty


def test_an_error_ends_the_run_while_a_thread_takes_the_last_block(monkeypatch):
    def accept(number, _):
        raise OSError(f"block {number} cannot be written")

    def compute(number):
        time.sleep(0.02)  # until the error is raised

    runner = BlocksOnThreads(LocalThreads(1), compute, accept, pytest.fail, ignore)
    monkeypatch.setattr(threads.queue, "SimpleQueue", SlowlyEmptied)
    errors = []

    def run():
        try:
            runner.run(range(3))
        except OSError as error:
            errors.append(str(error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(timeout=240.0)

    assert not thread.is_alive()
    assert errors == ["block 0 cannot be written"]


def test_after_an_error_the_blocks_that_wait_are_dropped():
    """The one that runs ends a while after the error, so the thread would take the next."""
    started, failed = [], threading.Event()

    def compute(number):
        started.append(number)
        if number:
            failed.wait(60.0)
            time.sleep(0.1)

    def accept(number, _):
        failed.set()
        raise OSError(f"block {number} cannot be written")

    with pytest.raises(OSError, match="block 0 cannot be written"):
        BlocksOnThreads(LocalThreads(1), compute, accept, pytest.fail, ignore).run(range(2 + SPARE_BLOCKS))
    assert started in ([0], [0, 1])


def test_there_are_no_more_threads_than_blocks():
    joined, accepted = [], []

    def note(_, **facts):
        joined.extend(facts["joined"])

    def accept(number, result):
        accepted.append((number, result))

    BlocksOnThreads(LocalThreads(10**6), lambda number: -number, accept, pytest.fail, note).run(iter(range(3)))

    assert sorted(accepted) == [(0, 0), (1, -1), (2, -2)]
    assert len(joined) == 3
    assert not {thread.name for thread in threading.enumerate()}.intersection(joined)


def test_threads_that_cannot_be_started_leave_none_behind(monkeypatch):
    before, started = threading.active_count(), threading.Thread.start

    def start(thread):
        if threading.active_count() > before:
            raise RuntimeError("can't start new thread")
        started(thread)

    monkeypatch.setattr(threading.Thread, "start", start)
    with pytest.raises(RuntimeError, match="can't start new thread"):
        BlocksOnThreads(LocalThreads(2), abs, ignore, pytest.fail, ignore).run(range(4))

    assert threading.active_count() == before


def test_callbacks_and_the_pool_of_dask_see_every_block_in_order():
    """As of its progress bars and profilers; a block that fails is computed again after the others."""
    seen, names, failed = [], set(), []

    class Profiler(Callback):
        def _pretask(self, key, *_):
            seen.append(key)

    def compute(number):
        names.add(threading.current_thread().name)
        if number == 3 and not failed:
            failed.append(number)
            raise ValueError("once")
        return -number

    accepted = {}
    runner = BlocksOnThreads(LocalThreads(1), compute, accepted.__setitem__, pytest.fail, ignore)
    with Profiler(), ThreadPoolExecutor(1, "of the user") as pool, dask.config.set(pool=pool):
        runner.run(range(30))
    assert seen == [("block", number) for number in [*range(30), 3]]
    assert accepted == {number: -number for number in range(30)}
    assert names == {"of the user_0"}


def test_a_pool_of_multiprocessing_computes_the_blocks_as_elsewhere_in_dask():
    accepted = {}
    with ThreadPool(2) as pool, dask.config.set(pool=pool):
        BlocksOnThreads(LocalThreads(1), abs, accepted.__setitem__, pytest.fail, ignore).run(range(-5, 5))
    assert accepted == {number: abs(number) for number in range(-5, 5)}


def test_a_pool_of_processes_in_the_configuration_of_dask_is_refused_in_words():
    runner = BlocksOnThreads(LocalThreads(1), abs, pytest.fail, pytest.fail, ignore)
    with ProcessPoolExecutor(1) as pool, dask.config.set(pool=pool), pytest.raises(RequestError, match="of processes"):
        runner.run(range(5))


def test_after_an_error_no_block_runs_in_the_pool_of_dask():
    started, ended = [], []

    def compute(number):
        started.append(number)
        time.sleep(0.02)
        ended.append(number)

    def accept(number, _):
        raise OSError(f"block {number} cannot be written")

    with ThreadPoolExecutor(1) as pool:
        runner = BlocksOnThreads(LocalThreads(2), compute, accept, pytest.fail, ignore)
        with dask.config.set(pool=pool), pytest.raises(OSError, match="block 0 cannot be written"):
            runner.run(range(9))
        at_error = list(started)
        assert ended == at_error
    assert started == at_error


def test_no_block_starts_while_as_many_results_wait():
    """The results that wait are at most as many as the spare blocks; none is kept after it is accepted."""
    started, kept = [], []

    class Result:
        pass

    def compute(number):
        started.append(number)
        return Result()

    def accept(number, result):
        kept.append(weakref.ref(result))
        time.sleep(0.01)  # until the threads have computed all that they were given
        assert len(started) <= number + 2 + SPARE_BLOCKS
        # The block before is dropped; a thread may hold the one that it computed last.
        assert sum(each() is not None for each in kept[:-1]) <= 2

    BlocksOnThreads(LocalThreads(2), compute, accept, pytest.fail, ignore).run(range(20))
    assert len(kept) == 20


def test_an_error_of_what_waits_ends_the_run(monkeypatch):
    """One that comes while the last block is computed."""
    monkeypatch.setattr(threads, "_WAIT", 0.05)
    stopped = threading.Event()

    def wait():
        raise KeyboardInterrupt

    runner = BlocksOnThreads(
        LocalThreads(1), lambda _: stopped.wait(10), ignore, pytest.fail, ignore, wait=wait, stop=stopped.set
    )
    with pytest.raises(KeyboardInterrupt):
        runner.run(range(1))
    assert stopped.is_set()
