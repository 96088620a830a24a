"""Blocks that raise errors, and blocks that kill their worker."""

import time

import pytest

from clusters.processes import Sweep, committed_blocks, digest, finish, study_file

BLOCKS = 8


@pytest.fixture
def config(folder):
    return study_file(folder, BLOCKS)


@pytest.mark.parametrize("options", [(), pytest.param(("--processes", "--workers", "2"), marks=pytest.mark.slow)])
def test_a_block_that_raises_is_reported_and_the_others_finish(folder, config, expected_digest, options):
    path = folder / "a.h5"
    with Sweep(config, path, *options, "--quiet", poison={"3": "raise"}) as sweep:
        code, lines = sweep.end()

    assert code == 3
    assert len(lines) == 2
    where = "designs 196,608 to 262,143: crank 105.176 to 119.765, coupler 900 to 1300, rocker 450 to 660"
    assert lines[0].startswith(f"error: block 3 ({where}) failed")
    assert lines[0].endswith("left out: ZeroDivisionError: poison")
    assert lines[1].startswith("error: 1 block failed")
    assert "the same command" in lines[1]
    assert committed_blocks(path) == [number for number in range(BLOCKS) if number != 3]
    assert sweep.executed_blocks.count(3) == 2
    events = sweep.log()
    assert [event["event"] for event in events if event["event"] != "workers"] == ["start", "retry", "failure", "stop"]
    (retry,) = (event for event in events if event["event"] == "retry")
    assert (retry["block"], retry["problem"]) == (3, "ZeroDivisionError: poison")
    (failure,) = (event for event in events if event["event"] == "failure")
    assert failure["designs"] == [196_608, 262_143]
    assert failure["parameters"].keys() == {"crank", "coupler", "rocker"}
    assert (events[-1]["outcome"], events[-1]["failed"]) == ("incomplete", 1)
    assert finish(config, path, *options) == 1
    assert digest(path) == expected_digest(BLOCKS)


@pytest.mark.parametrize("death", ["crash", pytest.param("exit", marks=pytest.mark.slow)])
def test_a_block_that_kills_its_workers_is_left_out_and_the_others_finish(
    folder, config, expected_digest, report, death
):
    path = folder / "a.h5"
    start = time.monotonic()
    with Sweep(config, path, "--processes", "--workers", "2", "--quiet", poison={"3": death}) as sweep:
        code, lines = sweep.end()

    lines = [line for line in lines if "waiting for one" not in line]
    seconds = time.monotonic() - start
    report(f"poison block ({death}): {sweep.executed_blocks.count(3)} workers died, {seconds:.1f} s in all")
    assert code == 3
    assert len(lines) == 2
    assert lines[0].startswith("error: block 3 (designs 196,608 to 262,143: ")
    assert lines[0].endswith("left out: KilledWorker: 4 workers died while they computed it")
    assert sweep.executed_blocks.count(3) == 4
    assert committed_blocks(path) == [number for number in range(BLOCKS) if number != 3]
    assert finish(config, path) == 1
    assert digest(path) == expected_digest(BLOCKS)


@pytest.mark.parametrize(("options", "failures"), [(("--fail-fast",), 1), (("--max-failures", "2"), 3)])
def test_too_many_failures_stop_the_sweep_and_lose_nothing(folder, config, expected_digest, options, failures):
    path = folder / "a.h5"
    poison = {str(number): "raise" for number in (2, 3, 4, 5, 6)}
    with Sweep(config, path, *options, "--quiet", poison=poison, seconds=0.05) as sweep:
        code, lines = sweep.end()

    assert code == 1
    assert len(lines) == failures + 1
    assert all("left out: ZeroDivisionError" in line for line in lines[:-1])
    assert lines[-1].startswith(f"error: stopped after {failures} failed block")
    assert "run the sweep again to go on" in lines[-1]
    assert {0, 1} <= set(committed_blocks(path)) <= {0, 1, 7}
    assert sweep.log()[-1]["outcome"].startswith(f"failed: stopped after {failures} failed block")
    finish(config, path, *options)
    assert digest(path) == expected_digest(BLOCKS)
