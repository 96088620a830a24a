"""Ctrl-C and SIGTERM, as sent by a terminal and by a batch system."""

from __future__ import annotations

import signal
import time

import pytest

from clusters.processes import Cluster, Sweep, committed, digest, study_file, wait_until

BLOCKS = 12
SIGNALS = [signal.SIGINT, signal.SIGTERM]


def interrupt(sweep: Sweep, number: signal.Signals, before: int) -> list[int]:
    """Interrupt all processes of a sweep after two more blocks, and check how it ends."""
    sweep.wait_for_blocks(before + 2)
    begun = time.monotonic()
    sweep.signal_all(number)
    code, lines = sweep.end(20)
    assert time.monotonic() - begun < 10
    assert code == 130
    assert lines == [f"interrupted; finished blocks are safe. To continue: {sweep.again} --quiet"]
    wait_until(lambda: not sweep.members, 5)
    there = "a.h5.journal" if "front" in sweep.words else "a.h5"
    assert sorted(path.name for path in sweep.results.parent.glob("a.h5*")) == [there, "a.h5.log.jsonl"]
    assert sweep.log()[-1]["outcome"] == "interrupted"
    saved = committed(sweep.results)
    assert before + 2 <= len(saved) < BLOCKS
    return saved


@pytest.mark.parametrize(
    ("options", "keep"),
    [
        (("--workers", "2"), "all"),
        (("--workers", "2", "--processes"), "all"),
        (("--workers", "2", "--keep", "front"), "front"),
    ],
)
def test_an_interrupted_sweep_says_how_to_continue_and_continues(folder, undisturbed, options, keep):
    config, path = study_file(folder, BLOCKS, keep), folder / "a.h5"
    saved: list[int] = []
    for number in SIGNALS:
        with Sweep(config, path, *options, "--quiet", seconds=0.2) as sweep:
            saved = interrupt(sweep, number, len(saved))
    with Sweep(config, path, *options, "--quiet", seconds=0.01) as sweep:
        assert sweep.end() == (0, [])
    assert sorted(sweep.executed + saved) == list(range(BLOCKS))
    assert digest(path) == undisturbed(BLOCKS, keep)


def test_an_interrupted_sweep_leaves_the_cluster_running(folder, cluster: Cluster, undisturbed):
    config, path = study_file(folder, BLOCKS), folder / "a.h5"
    workers = [cluster.add_worker() for _ in range(2)]
    saved: list[int] = []
    for number in SIGNALS:
        with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.2) as sweep:
            saved = interrupt(sweep, number, len(saved))
    assert all(worker.process.poll() is None for worker in [*workers, cluster.scheduler])
    with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.01) as sweep:
        assert sweep.end() == (0, [])
    assert sorted(sweep.executed + saved) == list(range(BLOCKS))
    assert digest(path) == undisturbed(BLOCKS)


@pytest.mark.parametrize("options", [("--workers", "2"), ("--workers", "2", "--processes")])
def test_repeated_interrupts_do_no_harm(folder, undisturbed, options):
    """Ctrl-C every 0.1 s while the sweep ends."""
    config, path = study_file(folder, BLOCKS), folder / "a.h5"
    with Sweep(config, path, *options, "--quiet", seconds=0.2) as sweep:
        sweep.wait_for_blocks(2)
        while sweep.process.poll() is None:
            sweep.signal_all(signal.SIGINT)
            time.sleep(0.1)
        code, lines = sweep.end()
        wait_until(lambda: not sweep.members, 10)
    assert code in (130, -signal.SIGINT), "the same to a shell"
    assert not any("Traceback" in line for line in lines), lines
    with Sweep(config, path, "--quiet") as again:
        assert again.end() == (0, [])
    assert digest(path) == undisturbed(BLOCKS)
