"""Kill -9 of workers, of the scheduler and of the sweep itself."""

import os
import random
import signal
import time

import dask
import pytest
from distributed import Client, LocalCluster
from waiting import wait_until

import explore
from clusters.processes import Cluster, Sweep, committed_blocks, digest, finish, is_running, study_file
from explore.running.in_flight import SPARE_BLOCKS, BlocksInFlight

WORKERS = 2


@pytest.mark.parametrize(
    ("kills", "blocks", "keep"),
    [(4, 60, "all"), (2, 40, "front"), *(pytest.param(50, 480, k, marks=pytest.mark.slow) for k in ("all", "front"))],
)
def test_killed_workers_cost_only_time(folder, expected_digest, report, kills, blocks, keep):
    chance = random.Random(20_261_121)
    path = folder / "a.h5"
    options = ("--processes", "--workers", str(WORKERS), "--quiet", "--keep", keep)
    killed = folder / "killed"  # until then blocks are slow, so that no sweep ends before the last kill
    with Sweep(study_file(folder, blocks, keep), path, *options, seconds=0.8, until=str(killed)) as sweep:
        n_executions = 0
        for _ in range(kills):
            sweep.at_work(n_executions)  # the next one has started, and after a while it is any moment of its work
            time.sleep(chance.random())
            os.kill(sweep.at_work(n_executions), signal.SIGKILL)
            n_executions = len(sweep.executions)
        killed.touch()
        code, lines = sweep.end()

    report(f"{kills} kills, {blocks} blocks, keep {keep}: {sweep.n_repetitions} extra executions")
    assert (code, [line for line in lines if "waiting for one" not in line]) == (0, [])
    assert committed_blocks(path) == sorted(set(sweep.executed_blocks)) == list(range(blocks))
    assert sweep.n_repetitions <= kills * (WORKERS + SPARE_BLOCKS)
    assert digest(path) == expected_digest(blocks, keep)
    departures = [address for event in sweep.log() if event["event"] == "workers" for address in event["left"]]
    assert len(departures) > kills / 4, "who left was logged, but for those that came and went between two looks"


def test_no_block_is_lost_when_a_worker_dies_after_reporting_it_done(monkeypatch):
    """Until it is fetched, a result is in the memory of its worker only; a lost one is computed again."""
    trials, results, failures, victims = 6, {}, {}, {}
    real = BlocksInFlight._outcome

    def outcome(window, future):
        if len(victims) < trials:
            number, _ = future.result(timeout=240)  # it may be lost already, with its neighbour
            (holder,) = client.who_has([future])[future.key]
            victims[number] = client.run(os.getpid, workers=[holder])[holder]
            os.kill(victims[number], signal.SIGKILL)
            wait_until(lambda: not is_running(victims[number]))
        return real(window, future)

    def submit(number, _):
        return client.submit(lambda n: (n, os.getpid()), number, pure=False, retries=0)

    monkeypatch.setattr(BlocksInFlight, "_outcome", outcome)
    with (
        dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}),  # comes back in a moment
        LocalCluster(WORKERS, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=60) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        BlocksInFlight(client, submit, results.__setitem__, failures.__setitem__, lambda *_, **__: None).run(
            range(2 * trials)
        )

    assert failures == {}
    assert {number: result[0] for number, result in results.items()} == {n: n for n in range(2 * trials)}
    assert len(victims) == trials
    assert all(results[number][1] != pid for number, pid in victims.items()), "computed again by another process"


@pytest.mark.parametrize("kills", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_a_killed_scheduler_ends_the_sweep_in_one_line_and_loses_nothing(folder, expected_digest, report, kills):
    blocks, path = 20, folder / "a.h5"
    config = study_file(folder, blocks)
    for trial in range(kills):
        with Cluster(folder) as cluster:
            for _ in range(WORKERS):
                cluster.add_worker()
            with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.2) as sweep:
                before = 4 * trial
                sweep.wait_for_blocks(before + 2)
                cluster.scheduler.process.kill()
                start = time.monotonic()
                code, lines = sweep.end()
        report(f"scheduler killed: the sweep ended after {time.monotonic() - start:.1f} s: {lines}")
        assert time.monotonic() - start < 120
        assert code == 1
        *waiting, error = lines  # a slow machine may notice the silence first
        assert all("has been silent for" in line for line in waiting)
        assert error.startswith("error: the cluster was lost")
        assert "run the sweep or refinement again" in error
        assert not explore.open_results(path).is_complete
        assert sweep.log()[-1]["event"] == "stop"
        assert sweep.log()[-1]["outcome"].startswith("failed: the cluster was lost")
        saved_blocks = committed_blocks(path)
        assert len(saved_blocks) >= before + 2
    assert finish(config, path) == blocks - len(saved_blocks)
    assert digest(path) == expected_digest(blocks)


def test_a_killed_sweep_frees_the_lock_at_once_and_its_workers_end(folder, expected_digest, report):
    blocks, path = 12, folder / "a.h5"
    config = study_file(folder, blocks)
    with Sweep(config, path, "--processes", "--workers", "2", "--quiet", seconds=5) as first:
        wait_until(lambda: len(first.executions) >= WORKERS)
        os.kill(first.process.pid, signal.SIGKILL)
        first.process.wait()
        start = time.monotonic()
        finish(config, path)
        wait_until(lambda: not first.members)
        report(f"all processes of the killed sweep were gone after {time.monotonic() - start:.1f} s")
    assert digest(path) == expected_digest(blocks)
