"""Blocks on threads of this process: as many threads as blocks, and an end after any error."""

import queue
import threading
import time

import pytest

from explore.running.threads import BlocksOnThreads, LocalThreads


def ignore(*_, **__):
    """Do nothing."""


class SlowlyEmptied(queue.SimpleQueue):
    """A queue that gives other threads time to take its last item after a look at it."""

    def empty(self):
        was_empty = super().empty()
        time.sleep(0.1)
        return was_empty


def test_an_error_ends_the_run_while_a_thread_takes_the_last_block():
    def accept(number, _):
        raise OSError(f"block {number} cannot be written")

    def compute(number):
        time.sleep(0.02)  # until the error is raised

    runner = BlocksOnThreads(LocalThreads(1), compute, accept, pytest.fail, ignore)
    runner._waiting = SlowlyEmptied()
    errors = []

    def run():
        try:
            runner.run(range(3))
        except OSError as error:
            errors.append(str(error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(timeout=20.0)

    assert not thread.is_alive()
    assert errors == ["block 0 cannot be written"]


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
