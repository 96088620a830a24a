"""Stopped workers and schedulers (Ctrl-Z, a debugger): connected, but silent."""

import os
import random
import signal
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from distributed import Client
from waiting import wait_until

import explore
from clusters.processes import Cluster, Sweep, digest, read_log, study_file
from explore.running import clusters, watch
from explore.running.in_flight import SPARE_BLOCKS, BlocksInFlight

#: Seconds after which a process counts as silent here.
SILENCE = 4.0
WORKERS = 2


class Stoppable(Cluster):
    """A cluster with two workers whose processes can be stopped and resumed."""

    def __enter__(self):
        super().__enter__()
        self.workers = [self.add_worker().process.pid for _ in range(WORKERS)]
        self.wait_for_workers(WORKERS)
        return self

    @property
    def everyone(self) -> list[int]:
        return [self.scheduler.process.pid, *self.workers]


@pytest.fixture(scope="module")
def shared_cluster(tmp_path_factory) -> Iterator[Stoppable]:
    with Stoppable(tmp_path_factory.mktemp("stoppable")) as cluster:
        yield cluster


@pytest.fixture
def stoppable(shared_cluster) -> Iterator[Stoppable]:
    """The cluster; its processes are resumed after the test."""
    yield shared_cluster
    resume(*shared_cluster.everyone)


@pytest.fixture
def short_silence(monkeypatch):
    """A shorter limit for silence in this process."""
    monkeypatch.setattr(watch, "SILENCE", SILENCE)
    monkeypatch.setattr(clusters, "CONNECT_TIMEOUT", 1)


def stop(*pids: int) -> None:
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)


def resume(*pids: int) -> None:
    for pid in pids:
        os.kill(pid, signal.SIGCONT)


def assert_in_order(sentences: Iterable[str], lines: list[str]) -> None:
    """Some lines end with these sentences, in this order; on a busy machine further processes may be late."""
    rest = iter(lines)
    assert all(any(line.endswith(sentence) for line in rest) for sentence in sentences), lines


def run_window(client: Client, seconds: float, blocks: int) -> tuple[dict[int, int], list[str]]:
    """Run blocks of so many seconds; return the process that computed each, and the events."""
    processes: dict[int, int] = {}
    events: list[str] = []

    def submit(number, workers):
        where = {"workers": workers, "allow_other_workers": True} if workers else {}
        return client.submit(lambda _: time.sleep(seconds) or os.getpid(), number, pure=False, **where)

    def accept(number, pid):
        assert number not in processes
        processes[number] = pid

    BlocksInFlight(client, submit, accept, pytest.fail, lambda event, **_: events.append(event)).run(range(blocks))
    assert sorted(processes) == list(range(blocks))
    return processes, events


def test_a_stopped_process_is_named_and_others_compute_its_blocks(folder, expected_digest, report):
    blocks, path = 30, folder / "a.h5"
    options = ("--processes", "--workers", "2", "--quiet")
    with Sweep(study_file(folder, blocks), path, *options, seconds=0.2, silence=SILENCE) as sweep:
        wait_until(lambda: sweep.executions)
        stop(sweep.at_work())
        start = time.monotonic()
        code, lines = sweep.end()
        report(f"a stopped process: the sweep ended after {time.monotonic() - start:.1f} s: {lines}")
    blocks_elsewhere = [event["block"] for event in sweep.log() if event["event"] == "elsewhere"]
    assert code == 0
    assert_in_order([f" has been silent for {SILENCE:.0f} s; others compute its blocks"], lines)
    assert blocks_elsewhere
    assert sweep.n_repetitions <= WORKERS + SPARE_BLOCKS
    assert digest(path) == expected_digest(blocks)


def test_a_stopped_process_is_named_and_used_again_when_it_resumes(folder, stoppable: Stoppable, expected_digest):
    """One worker, then both, then the scheduler."""
    blocks, path = 60, folder / "a.h5"
    first, second = stoppable.workers
    scheduler = stoppable.scheduler.process.pid
    options, answer = ("--scheduler", stoppable.address, "--quiet"), " answers again"
    sentences = [
        f" has been silent for {SILENCE:.0f} s; {consequence}"
        for consequence in ("others compute its blocks", "waiting for it")
    ]
    fast = folder / "fast"
    with Sweep(study_file(folder, blocks), path, *options, seconds=0.3, until=str(fast), silence=SILENCE) as sweep:

        def wait_for_use(pid):
            n_executions, n_answers = len(sweep.executions), sweep.stderr.count(answer)
            resume(pid)
            wait_until(lambda: sweep.stderr.count(answer) > n_answers)
            wait_until(lambda: pid in [worker for _, worker in sweep.executions[n_executions:]])

        sweep.wait_for_blocks(2)
        stop(first)
        wait_until(lambda: "others compute its blocks" in sweep.stderr)
        wait_for_use(first)
        stop(first, second)
        wait_until(lambda: "waiting for a worker that answers" in sweep.stderr)
        n_idle = len(sweep.executions)
        time.sleep(2 * watch.LOOK_INTERVAL)
        assert len(sweep.executions) == n_idle
        wait_for_use(second)
        wait_for_use(first)
        stop(scheduler)
        wait_until(lambda: sentences[1] in sweep.stderr)
        fast.touch()
        resume(scheduler)
        code, lines = sweep.end()
    assert code == 0
    assert_in_order([sentences[0], answer, "waiting for a worker that answers", answer, answer, sentences[1]], lines)
    assert f"the scheduler {stoppable.address}{sentences[1]}" in lines
    assert digest(path) == expected_digest(blocks)


def test_a_sweep_that_waits_for_a_stopped_scheduler_can_be_interrupted(folder, stoppable: Stoppable, expected_digest):
    blocks, path = 12, folder / "a.h5"
    options = ("--scheduler", stoppable.address, "--quiet")
    with Sweep(study_file(folder, blocks), path, *options, seconds=0.3, silence=SILENCE) as sweep:
        sweep.wait_for_blocks(2)
        stop(stoppable.scheduler.process.pid)
        wait_until(lambda: "waiting for it" in sweep.stderr)
        sweep.signal_all(signal.SIGINT)
        code, lines = sweep.end()
    assert code == 130
    assert lines[-1].startswith("interrupted; finished blocks are safe."), lines
    explore.sweep(explore.load_study(study_file(folder, blocks)), path)
    assert digest(path) == expected_digest(blocks)


def test_a_worker_stopped_before_the_start_does_not_delay_the_blocks(
    folder, stoppable: Stoppable, expected_digest, short_silence
):
    blocks, path = 8, folder / "a.h5"
    stop(stoppable.workers[0])
    with Client(stoppable.address, set_as_default=False) as client:
        explore.sweep(explore.load_study(study_file(folder, blocks)), path, client=client)
    assert "silent" in [event["event"] for event in read_log(path)]
    assert digest(path) == expected_digest(blocks)


def test_a_slow_block_is_not_silence(stoppable: Stoppable, short_silence):
    with Client(stoppable.address, set_as_default=False) as client:
        processes, events = run_window(client, seconds=1.5 * SILENCE, blocks=2)
    assert set(processes.values()) == set(stoppable.workers)
    assert "elsewhere" not in events


def test_a_result_that_a_stopped_worker_holds_is_computed_again(stoppable: Stoppable, short_silence, monkeypatch):
    """The worker reports the block done and is stopped before the result is fetched."""
    real, stopped_pids = BlocksInFlight._outcome, []

    def outcome(window, future):
        if not stopped_pids:
            stopped_pids.append(future.result())
            stop(*stopped_pids)
        return real(window, future)

    monkeypatch.setattr(BlocksInFlight, "_outcome", outcome)
    with Client(stoppable.address, set_as_default=False) as client:
        processes, events = run_window(client, seconds=0, blocks=9)
    assert {"silent", "elsewhere"} <= set(events)
    assert set(processes.values()) == set(stoppable.workers) - set(stopped_pids)


@pytest.mark.parametrize("stops", [4, pytest.param(60, marks=pytest.mark.slow)])
def test_processes_stopped_at_random_cost_only_time(
    folder: Path, stoppable: Stoppable, expected_digest, short_silence, report, stops
):
    """Workers and the scheduler, alone or together, for shorter and longer than the limit for silence."""
    chance, blocks, path = random.Random(20_261_122), 60, folder / "a.h5"
    end = threading.Event()
    n_stops = 0

    def disturb():
        nonlocal n_stops
        while n_stops < stops and not end.is_set():
            pids = chance.sample(stoppable.everyone, chance.choice([1, 1, 2]))
            stop(*pids)
            end.wait(chance.choice([0.1, 1.0, 1.5 * SILENCE]))
            resume(*pids)
            n_stops += 1
            end.wait(chance.random())

    study = explore.load_study(study_file(folder, blocks))
    disturber = threading.Thread(target=disturb)
    disturber.start()
    try:
        with Client(stoppable.address, set_as_default=False) as client:
            while n_stops < stops:
                explore.sweep(study, path, client=client)
                assert digest(path) == expected_digest(blocks)
                path.unlink()
    finally:
        end.set()
        disturber.join()
    report(f"{n_stops} stops of workers and of the scheduler: every row once, the same bytes")
