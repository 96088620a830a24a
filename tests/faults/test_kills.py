"""Kill -9 at random times and at every call, and the files that a killed writer leaves."""

import random
import re
import shutil
import signal
import time
from pathlib import Path

import pytest

from explore.results.store.packing import pack
from faults.checker import check, done_blocks, sha256
from faults.content import N_BLOCKS, fill
from faults.replay import COUNTED, Disk, boundaries, ends_at, put_down, read_trace
from faults.sweeps import night, study, sweep_here

KEEPS = ["all", "front"]


@pytest.mark.parametrize(("kills", "keep"), [(25, "all"), (10, "front"), night(500, "all"), night(200, "front")])
def test_random_kills_lose_nothing_and_cost_a_block_each(server, tmp_path, whole, figures, kills, keep):
    """On the disk, not in memory, so that commits take time."""
    chance = random.Random(20_240_601)
    path = tmp_path / "grid.h5"
    typical = min(duration(server, path, keep) for _ in range(3))
    acknowledged: set[int] = set()
    runs = [0] * N_BLOCKS
    killed = 0
    while killed < kills:
        writing = server.start(path, keep=keep)
        time.sleep(chance.random() * typical)
        killed += writing.kill() == -signal.SIGKILL
        for number in writing.numbers("run"):
            runs[number] += 1
        acknowledged |= set(writing.numbers("done"))
        verdict = figures.count(check(path, acknowledged, keep))
        assert verdict.sound, (killed, verdict)
        if len(verdict.committed) == N_BLOCKS and path.exists():
            figures["redone"] += sum(runs) - N_BLOCKS
            assert sha256(path) == whole
            for left in tmp_path.iterdir():
                left.unlink()
            acknowledged, runs = set(), [0] * N_BLOCKS
    last = server.write(path, keep=keep)
    for number in last.numbers("run"):
        runs[number] += 1
    figures["redone"] += sum(runs) - N_BLOCKS
    assert figures["redone"] <= killed
    assert sha256(path) == whole
    assert [entry.name for entry in tmp_path.iterdir()] == ["grid.h5"], "unfinished files of killed writers are removed"


def duration(server, path, keep) -> float:
    """Seconds of an undisturbed run."""
    begun = time.monotonic()
    assert server.write(path, keep=keep).code == 0
    path.unlink()
    return time.monotonic() - begun


@pytest.mark.parametrize(
    ("kills", "keep"),
    [(2, "all"), (2, "front"), (2, "atlas"), night(30, "all"), night(15, "front"), night(30, "atlas")],
)
def test_random_kills_of_the_command(command, tmp_path, figures, kills, keep):
    """The real command: blocks that a reader saw committed before the kill stay."""
    chance = random.Random(3)
    config = 3 * 65_536 if keep == "atlas" else study(tmp_path, 32)
    undisturbed, path = tmp_path / "undisturbed.h5", tmp_path / "killed.h5"
    sweep_here(config, undisturbed, keep)
    n_blocks = len(done_blocks(undisturbed))
    for _ in range(kills):
        sweep = command(config, path, keep=keep)
        n_awaited = chance.randrange(n_blocks - 1)  # wait for this number of blocks, then a random time
        while len(done_blocks(path)) < n_awaited and sweep.running:
            time.sleep(0.002)
        time.sleep(chance.random() * (1.5 if n_awaited == 0 else 0.05))
        before = done_blocks(path)
        sweep.kill()
        after = done_blocks(path)
        figures["trials"] += 1
        figures["lost"] += len(before - after)
        if len(after) == n_blocks and path.exists():
            assert sha256(path) == sha256(undisturbed)
            for file in tmp_path.glob("killed.h5*"):
                file.unlink()
    sweep_here(config, path, keep)
    assert figures["lost"] == 0
    assert sha256(path) == sha256(undisturbed)
    assert sorted(file.name for file in tmp_path.glob("killed.h5*")) == ["killed.h5", "killed.h5.log.jsonl"]


@pytest.fixture
def recorded(server, memory, keep):
    """The calls of a run in a new folder, which stays as the run left it."""
    folder = memory / f"recorded-{keep}"
    trace = memory / f"recorded-{keep}.trace"
    if not folder.exists():
        folder.mkdir()
        environment = {"FAULT_FOLDER": str(folder), "FAULT_TRACE": str(trace)}
        assert server.write(folder / "grid.h5", keep=keep, environment=environment).code == 0
    return folder, read_trace(trace)


@pytest.mark.parametrize("keep", KEEPS)
def test_the_replay_is_what_happened(recorded):
    folder, calls = recorded
    disk = Disk(folder)
    for call in calls:
        disk.do(call)
    assert disk.after_kill() == {str(path): path.read_bytes() for path in folder.iterdir()}
    assert disk.acknowledged == set(range(N_BLOCKS))
    assert {call.operation for call in calls} & COUNTED == set("cwtasdlu")


@pytest.mark.parametrize("keep", KEEPS)
@pytest.mark.parametrize("trials", [40, night(None)])
def test_kill_at_every_call(recorded, fresh, whole, figures, trials, keep):
    """Just before each call and in the middle of each write; a second run then finishes."""
    folder, calls = recorded
    disk, chosen = Disk(folder), some_of(boundaries(calls), trials)
    for state in ends_at(disk, calls, chosen | {len(calls)}):
        judge_and_finish(disk, state, fresh(), whole, figures, keep)


def some_of(moments, trials):
    """So many moments, or all: the first and the last ones, where files get their names, and some between."""
    return {*moments[:8], *moments[-8:], *random.Random(5).sample(moments, trials or len(moments))}


def judge_and_finish(disk, state, folder, whole, figures, keep) -> None:
    """The file is absent or complete; the same command then gives the undisturbed bytes."""
    put_down(state, disk.folder, folder)
    path = folder / "grid.h5"
    verdict = figures.count(check(path, disk.acknowledged, keep))
    # Half of a commit word is the only damage that a kill can cause; no reader takes it for a commit.
    assert not any((verdict.unreadable, verdict.lost, verdict.phantom)), (figures["trials"], verdict)
    assert not verdict.detected & verdict.committed, (figures["trials"], verdict)
    fill(path, keep=keep)
    assert sha256(path) == whole
    assert [entry.name for entry in folder.iterdir()] == ["grid.h5"]


@pytest.fixture
def packing(server, memory, undisturbed):
    """The calls of `explore pack` in a folder, and the files it leaves."""
    folder, trace = memory / "packing", memory / "packing.trace"
    folder.mkdir(exist_ok=True)
    packed = folder / "packed.h5"
    packed.unlink(missing_ok=True)
    trace.unlink(missing_ok=True)
    environment = {"FAULT_FOLDER": str(folder), "FAULT_TRACE": str(trace)}
    order = ["pack", str(undisturbed), "-o", str(packed)]
    assert server.write(packed, arguments=order, environment=environment).code == 0
    return folder, read_trace(trace), packed.read_bytes()


@pytest.mark.parametrize("cuts", [0, 3], ids=["kills", "power cuts"])
@pytest.mark.parametrize("trials", [25, night(None)])
def test_kill_or_power_cut_at_every_call_of_pack(packing, undisturbed, fresh, figures, trials, cuts):
    """The copy is absent or complete, and packing again gives it."""
    folder, calls, whole = packing
    disk, chance, chosen = Disk(folder), random.Random(5), some_of(boundaries(calls), trials)
    for state in ends_at(disk, calls, chosen, *[chance] * cuts):
        target = fresh() / "packed.h5"
        put_down(state, folder, target.parent)
        figures["trials"] += 1
        if not target.exists():
            pack(undisturbed, target)
            assert not list(target.parent.glob("*.unfinished-*"))
        assert target.read_bytes() == whole


@pytest.mark.parametrize(("trials", "keep"), [(25, "all"), (15, "front"), night(None, "all"), night(None, "front")])
def test_real_kills_leave_what_the_replay_says(server, recorded, fresh, whole, figures, trials, keep):
    """The process is killed by the recorder before a call, or half through a write."""
    recorded_folder, calls = recorded
    number_of = {position: number for number, position in enumerate(boundaries(calls), 1)}
    places = [(i, action) for i in list(number_of)[:-1] for action in ("kill", "tear")]
    places = [(i, action) for i, action in places if action == "kill" or calls[i].operation == "w"]
    chance = random.Random(2)
    for position, action in sorted(chance.sample(places, trials or len(places))):
        folder = fresh()
        environment = {"FAULT_FOLDER": str(folder), "FAULT_ACTION": action, "FAULT_AT": str(number_of[position])}
        writing = server.write(folder / "grid.h5", keep=keep, environment=environment)
        assert writing.code == -signal.SIGKILL
        disk = Disk(recorded_folder)
        for call in calls[:position]:
            disk.do(call)
        expected = disk.after_kill(calls[position] if action == "tear" else None)
        contents = {steady(entry.name): entry.read_bytes() for entry in folder.iterdir()}
        expected = {steady(Path(name).name): content for name, content in expected.items()}
        # the lock file names the process, and nothing else depends on the run
        assert contents.keys() == expected.keys(), (position, action)
        assert all(contents[name] == expected[name] for name in contents if name != "grid.h5.lock"), (position, action)
        assert set(writing.numbers("done")) == disk.acknowledged
        figures.count(check(folder / "grid.h5", disk.acknowledged, keep))
        assert server.write(folder / "grid.h5", keep=keep).code == 0
        assert sha256(folder / "grid.h5") == whole


def steady(name: str) -> str:
    """The name of a file without the random part of an unfinished one."""
    return re.sub("unfinished-.*", "unfinished", name)


@pytest.mark.parametrize("action", ["kill", "cut"])
def test_restart_never_loses_the_old_results(server, memory, undisturbed, figures, action):
    """`--restart` moves a file aside and makes a new one; the old blocks are always under one of two names."""
    folder = memory / f"restart-{action}"
    folder.mkdir()
    shutil.copy(undisturbed, folder / "grid.h5")
    trace = memory / f"restart-{action}.trace"
    environment = {"FAULT_FOLDER": str(folder), "FAULT_TRACE": str(trace)}
    assert server.write(folder / "grid.h5", environment=environment, restart=True).code == 0
    chance = random.Random(4)
    disk = Disk(folder, {str(folder / "grid.h5"): undisturbed.read_bytes()})
    calls = read_trace(trace)
    begin = next(i for i, call in enumerate(calls) if call.operation == "k")
    for call in calls[:begin]:
        for _ in range(1 if action == "kill" else 5):
            state = disk.after_kill() if action == "kill" else disk.after_cut(chance)
            contents = list(state.values())
            figures["trials"] += 1
            figures["lost"] += undisturbed.read_bytes() not in contents
        disk.do(call)
    assert figures["lost"] == 0
