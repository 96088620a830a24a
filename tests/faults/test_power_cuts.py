"""Power cuts: unsynchronised writes are lost, torn or reordered at random.

Power cuts are simulated: the states are derived from the calls of a real run (see `replay.py`). They are what POSIX
allows, which is more than most file systems do.
"""

import random
import signal

import pytest

from faults.checker import check, sha256
from faults.content import N_BLOCKS, fill
from faults.replay import COUNTED, Disk, power_cuts, put_down, read_trace

STATES = [80, pytest.param(2000, marks=pytest.mark.slow)]


@pytest.fixture
def record(server, memory, request):
    """Run the writer in a folder and return its calls; keywords are orders to the recorder."""
    folder = memory / f"{request.node.name}"
    folder.mkdir()
    number = 0

    def run(inside="grid.h5", keep="all", **orders):
        nonlocal number
        number += 1
        trace = memory / f"{request.node.name}.{number}.trace"
        environment = {"FAULT_FOLDER": str(folder), "FAULT_TRACE": str(trace)}
        environment |= {f"FAULT_{name.upper()}": str(value) for name, value in orders.items()}
        code = server.write(folder / inside, keep=keep, environment=environment).code
        assert code == (-signal.SIGKILL if orders.get("action") == "kill" else 0)
        return read_trace(trace)

    run.folder = folder
    return run


def judge(disk, state, folder, figures, inside="grid.h5", keep="all"):
    """Write a state into a folder and judge it."""
    put_down(state, disk.folder, folder)
    return figures.count(check(folder / inside, disk.acknowledged, keep))


def finish(folder, whole, inside="grid.h5", keep="all"):
    """The same command gives the undisturbed bytes and removes leftover files."""
    path = fill(folder / inside, keep=keep)
    assert sha256(path) == whole
    # A lock file with a garbled text is treated as another program's: it is locked, and kept.
    lock = path.with_name("grid.h5.lock")
    garbled = lock.exists() and not lock.read_bytes().rstrip(b"\0").startswith(b"process ")
    assert {entry.name for entry in path.parent.iterdir()} == {"grid.h5"} | ({lock.name} if garbled else set())


@pytest.mark.parametrize("keep", ["all", "front"])
@pytest.mark.parametrize("states", STATES)
def test_power_cut_loses_nothing_that_was_acknowledged(record, fresh, whole, figures, states, keep):
    calls = record(keep=keep)
    disk = Disk(record.folder)
    for state in power_cuts(disk, calls, states, random.Random(1)):
        folder = fresh()
        verdict = judge(disk, state, folder, figures, keep=keep)
        assert verdict.sound, (figures["trials"], verdict)
        finish(folder, whole, keep=keep)


@pytest.mark.parametrize("states", STATES)
def test_results_in_a_new_folder_stay(record, fresh, whole, figures, states):
    """The sweep creates the folder of results/NAME.h5, whose own name must be durable too."""
    calls = record("results/2024/grid.h5")
    disk = Disk(record.folder)
    for state in power_cuts(disk, calls, states, random.Random(2)):
        folder = fresh()
        judge(disk, state, folder, figures, "results/2024/grid.h5")
        finish(folder, whole, "results/2024/grid.h5")
    assert figures.harmless, figures


@pytest.mark.parametrize("keep", ["all", "front"])
@pytest.mark.parametrize("states", [200, pytest.param(2000, marks=pytest.mark.slow)])  # of ten kills
def test_power_cut_after_a_kill(record, fresh, whole, figures, states, keep):
    """Writes of a killed run may be in the cache of the system only, where the next run sees them."""
    calls = record(keep=keep)
    counted = [call for call in calls if call.operation in COUNTED]
    named = next(i for i, call in enumerate(counted, 1) if call.operation == "l")
    chance = random.Random(3)
    kills = [named + 1, len(counted) - 1, *(chance.randrange(1, len(counted)) for _ in range(8))]
    for kill in kills:
        for left in record.folder.iterdir():
            left.unlink()
        disk = Disk(record.folder)
        for call in record(keep=keep, action="kill", at=kill):
            disk.do(call)
        disk.new_process()
        for state in power_cuts(disk, record(keep=keep), states // len(kills), chance):
            folder = fresh()
            judge(disk, state, folder, figures, keep=keep)
            finish(folder, whole, keep=keep)
    assert figures.harmless, figures


@pytest.mark.parametrize("states", STATES)
def test_without_synchronisation_blocks_are_lost_and_the_checksum_shows_it(record, fresh, whole, figures, states):
    """A negative control: a disk that ignores requests to synchronise data."""
    calls = record(action="drop", operations="d")
    assert not any(call.operation == "d" for call in calls)
    disk = Disk(record.folder)
    for state in power_cuts(disk, calls, states, random.Random(4)):
        folder = fresh()
        verdict = judge(disk, state, folder, figures)
        assert not verdict.phantom
        if not verdict.unreadable:
            finish(folder, whole)
    assert figures["lost"] > states
    assert figures["detected"] > states / 4


@pytest.mark.parametrize("states", STATES)
def test_commit_word_before_its_data_is_noticed(record, fresh, whole, figures, states):
    """A negative control: one synchronisation for data and commit word together."""
    calls = record()
    begin = next(i for i, call in enumerate(calls) if call.path == "open")
    words = [i for i, call in enumerate(calls) if i > begin and call.operation == "w" and calls[i - 1].operation == "d"]
    assert len(words) == N_BLOCKS
    early = {i - 1 for i in words}
    assert all(calls[i].operation == "d" for i in early)
    disk = Disk(record.folder)
    calls = [call for i, call in enumerate(calls) if i not in early]
    for state in power_cuts(disk, calls, states, random.Random(5)):
        folder = fresh()
        verdict = judge(disk, state, folder, figures)
        assert not any((verdict.unreadable, verdict.lost, verdict.phantom)), verdict
        finish(folder, whole)
    assert figures["detected"] > states / 40
