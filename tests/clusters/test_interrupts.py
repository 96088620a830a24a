"""Ctrl-C and SIGTERM, as sent by a terminal and by a batch system."""

import signal
import time

import distributed
import pytest
from waiting import wait_until

from clusters.processes import Cluster, Sweep, committed_blocks, digest, finish, study_file
from explore.running.clusters import local_cluster

BLOCKS = 12
SIGNALS = [signal.SIGINT, signal.SIGTERM]


def interrupt(sweep: Sweep, number: signal.Signals, before: int) -> list[int]:
    """Interrupt all processes of a sweep after two more blocks, and check how it ends."""
    sweep.wait_for_blocks(before + 2)
    sweep.signal_all(number)
    code, lines = sweep.end()
    assert code == 130
    assert lines == [f"interrupted; finished blocks are safe. To continue: {sweep.command_to_continue}"]
    wait_until(lambda: not sweep.members)
    results_name = "a.h5.journal" if "front" in sweep.words else "a.h5"
    assert sorted(path.name for path in sweep.results.parent.glob("a.h5*")) == [results_name, "a.h5.log.jsonl"]
    assert sweep.log()[-1]["outcome"] == "interrupted"
    saved_blocks = committed_blocks(sweep.results)
    assert before + 2 <= len(saved_blocks) < BLOCKS
    return saved_blocks


@pytest.mark.parametrize(
    ("options", "keep"),
    [
        (("--workers", "2"), "all"),
        (("--workers", "2", "--processes"), "all"),
        (("--workers", "2", "--keep", "front"), "front"),
    ],
)
def test_an_interrupted_sweep_says_how_to_continue_and_continues(folder, expected_digest, options, keep):
    config, path = study_file(folder, BLOCKS, keep), folder / "a.h5"
    saved_blocks: list[int] = []
    for number in SIGNALS:
        with Sweep(config, path, *options, "--quiet", seconds=0.2) as sweep:
            saved_blocks = interrupt(sweep, number, len(saved_blocks))
    assert finish(config, path, "--keep", keep) == BLOCKS - len(saved_blocks)
    assert digest(path) == expected_digest(BLOCKS, keep)


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("members", [2, 4])
def test_an_interrupt_while_processes_start_ends_them_without_a_traceback(folder, members, number):
    """With a resource tracker, then with two workers as well; all are interrupted repeatedly."""
    config, path = study_file(folder, BLOCKS), folder / "a.h5"
    with Sweep(config, path, "--workers", "2", "--processes", "--quiet", seconds=0.2) as sweep:
        wait_until(lambda: len(sweep.members) >= members)
        sweep.signal_all(number)
        while sweep.process.poll() is None:
            sweep.signal_all(signal.SIGINT)
            time.sleep(0.1)
        code, lines = sweep.end()
        wait_until(lambda: not sweep.members)
    assert code in (130, -signal.SIGINT), "the same to a shell"
    assert lines == [f"interrupted; finished blocks are safe. To continue: {sweep.command_to_continue}"]


def test_an_interrupt_while_the_client_connects_waits_until_it_has(monkeypatch):
    """dask prints a traceback if the moment at which it asks for the connection is interrupted."""
    connected = []

    class Interrupted(distributed.Client):
        def __init__(self, *arguments, **options):
            signal.raise_signal(signal.SIGINT)
            super().__init__(*arguments, **options)
            connected.append(self)

    monkeypatch.setattr(distributed, "Client", Interrupted)
    with pytest.raises(KeyboardInterrupt), local_cluster(1, processes=True):
        pytest.fail("nothing runs after an interrupt")
    assert [client.status for client in connected] == ["closed"]


def test_an_interrupted_sweep_leaves_the_cluster_running(folder, cluster: Cluster, expected_digest):
    config, path = study_file(folder, BLOCKS), folder / "a.h5"
    workers = [cluster.add_worker() for _ in range(2)]
    saved_blocks: list[int] = []
    for number in SIGNALS:
        with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.2) as sweep:
            saved_blocks = interrupt(sweep, number, len(saved_blocks))
    assert all(worker.process.poll() is None for worker in [*workers, cluster.scheduler])
    with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.01) as sweep:
        assert sweep.end() == (0, [])
    assert sorted(sweep.executed_blocks + saved_blocks) == list(range(BLOCKS))
    assert digest(path) == expected_digest(BLOCKS)


@pytest.mark.parametrize("options", [("--workers", "2"), ("--workers", "2", "--processes")])
def test_repeated_interrupts_do_no_harm(folder, expected_digest, options):
    """Ctrl-C every 0.1 s while the sweep ends."""
    config, path = study_file(folder, BLOCKS), folder / "a.h5"
    with Sweep(config, path, *options, "--quiet", seconds=0.2) as sweep:
        sweep.wait_for_blocks(2)
        while sweep.process.poll() is None:
            sweep.signal_all(signal.SIGINT)
            time.sleep(0.1)
        code, lines = sweep.end()
        wait_until(lambda: not sweep.members)
    assert code in (130, -signal.SIGINT), "the same to a shell"
    assert not any("Traceback" in line for line in lines), lines
    finish(config, path)
    assert digest(path) == expected_digest(BLOCKS)
