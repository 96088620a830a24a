"""One writer at a time: concurrent writers, dead holders of the lock, their children, other programs."""

import contextlib
import os
import re
import signal
import time
from pathlib import Path

import pytest
from waiting import wait_until

from faults.checker import check, sha256
from faults.content import N_BLOCKS, fill
from faults.sweeps import study, sweep_here

#: Rarely the holder has not written its process number yet; then the message has "another process".
REFUSAL = r"error: .*grid.h5 is being written by (process (\d+) on host \S+|another process); wait for it or stop it\n"


@pytest.mark.parametrize("rounds", [40, pytest.param(400, marks=pytest.mark.slow)])
def test_of_four_writers_at_once_one_writes(server, fresh, whole, figures, rounds):
    nameless = 0
    for _ in range(rounds):
        folder = fresh()
        path, release = folder / "grid.h5", folder.parent / "release"
        start = time.monotonic() + 0.02
        four = [server.start(path, start=start, hold=str(release)) for _ in range(4)]
        # The writer holds the lock until it is released, so that the others cannot start after its end.
        wait_until(lambda four=four: any("complete" in writing.lines for writing in four))
        winners = [writing for writing in four if "open" in writing.lines]
        assert len(winners) == 1
        losers = [writing for writing in four if writing is not winners[0]]
        for loser in losers:
            assert loser.code == 1
            assert loser.lines == []
            refusal = re.fullmatch(REFUSAL, loser.errors)
            assert refusal, loser.errors
            assert refusal[2] in (None, str(winners[0].process))
            nameless += refusal[2] is None
        release.touch()
        assert winners[0].code == 0
        release.unlink()
        assert winners[0].numbers("run") == list(range(N_BLOCKS))
        assert sha256(path) == whole
        figures.count(check(path, range(N_BLOCKS)))
    assert nameless <= rounds / 10


@pytest.mark.parametrize("rounds", [1, pytest.param(10, marks=pytest.mark.slow)])
def test_of_four_commands_at_once_one_sweeps(command, tmp_path, figures, rounds):
    """The holder is stopped (SIGSTOP) until the others have ended."""
    config = study(tmp_path)
    sweep_here(config, tmp_path / "alone.h5")
    for number in range(rounds):
        path = tmp_path / str(number) / "grid.h5"
        four = [command(config, path) for _ in range(4)]
        lock = path.with_name("grid.h5.lock")
        wait_until(lambda lock=lock: lock.exists() and "host" in lock.read_text())
        holder = int(lock.read_text().split()[1])
        os.kill(holder, signal.SIGSTOP)
        try:
            for one in four:
                if one.process != holder:
                    code, stderr = one.finish()
                    assert code == 1
                    refusal = re.fullmatch(REFUSAL, stderr)
                    assert refusal, stderr
                    assert int(refusal[2]) == holder
        finally:
            os.kill(holder, signal.SIGCONT)
        assert [one.finish() for one in four if one.process == holder] == [(0, "")]
        assert sha256(path) == sha256(tmp_path / "alone.h5")
        figures["trials"] += 1


@pytest.mark.parametrize("trials", [3, pytest.param(20, marks=pytest.mark.slow)])
def test_children_of_a_killed_writer_do_not_hold_its_lock(server, fresh, whole, figures, trials):
    for _ in range(trials):
        path = fresh() / "grid.h5"
        holder = server.start(path, hold="/never", children=True)
        wait_until(lambda holder=holder: any(line.startswith("children") for line in holder.lines))
        children = [int(word) for word in holder.lines[-1].split()[1:]]
        try:
            holder.kill()
            assert all(Path(f"/proc/{child}").exists() for child in children)
            fill(path)
        finally:
            for child in children:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(child, signal.SIGKILL)
        assert sha256(path) == whole
        figures.count(check(path, range(N_BLOCKS)))
