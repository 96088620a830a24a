"""Failing and full disks: one clear line, nothing damaged, and the same command continues later."""

import errno
import random
from itertools import product

import pytest

from faults.checker import check, sha256
from faults.content import N_BLOCKS, fill
from faults.disks import take_all_but
from faults.replay import read_trace
from faults.sweeps import night, study, sweep_here

#: Calls that a disk may refuse: create, write, truncate, reserve, synchronise, give a name.
REFUSED = "cwtasdrl"
ERRORS = (errno.EIO, errno.ENOSPC)
#: Files that only people read: a sweep continues if they cannot be written.
SPARED = {"FAULT_SPARED": ".lock .log.jsonl"}


def orders(folder, at, error, sticky):
    """Orders to the recorder: the N-th of the calls that a disk may refuse fails."""
    return {
        "FAULT_FOLDER": str(folder),
        "FAULT_OPERATIONS": REFUSED,
        "FAULT_ACTION": "fail",
        "FAULT_AT": str(at),
        "FAULT_ERROR": str(error),
        "FAULT_STICKY": str(int(sticky)),
    } | SPARED


def assert_clear_error(code, stderr, path):
    """Exit code 1 and one line that names the file, without a traceback."""
    assert code == 1, (code, stderr)
    assert stderr.startswith("error: "), stderr
    assert stderr.count("\n") == 1, stderr
    assert str(path) in stderr, stderr
    assert "Traceback" not in stderr
    assert "should not have happened" not in stderr


def calls_of(server, memory, name, keep="all", arguments=()) -> int:
    """Number of calls in an undisturbed run that a disk may refuse."""
    folder = memory / name
    folder.mkdir()
    trace = memory / f"{name}.trace"
    environment = {"FAULT_FOLDER": str(folder), "FAULT_TRACE": str(trace)} | SPARED
    order = {"arguments": [word.format(folder=folder) for word in arguments]} if arguments else {"keep": keep}
    assert server.write(folder / "grid.h5", environment=environment, **order).code == 0
    return sum(call.operation in REFUSED for call in read_trace(trace))


@pytest.mark.parametrize("keep", ["all", "front"])
@pytest.mark.parametrize("trials", [30, pytest.param(None, marks=pytest.mark.slow)])
def test_failing_call_is_reported_and_nothing_is_damaged(server, memory, fresh, whole, figures, request, trials, keep):
    n_calls = calls_of(server, memory, request.node.name, keep=keep)
    cases = list(product(range(1, n_calls + 1), ERRORS, (False, True)))
    chance = random.Random(6)
    for at, error, sticky in chance.sample(cases, trials or len(cases)):
        folder = fresh()
        path = folder / "grid.h5"
        writing = server.write(path, keep=keep, environment=orders(folder, at, error, sticky))
        verdict = figures.count(check(path, writing.numbers("done"), keep))
        assert verdict.sound, (at, error, sticky, verdict)
        assert_clear_error(writing.code, writing.errors, path)
        assert not list(folder.glob("*.unfinished-*"))
        again = server.write(path, keep=keep)
        figures["redone"] += len(set(again.numbers("run")) & set(writing.numbers("done")))
        assert again.code == 0
        assert sha256(path) == whole
        assert [entry.name for entry in folder.iterdir()] == ["grid.h5"]
    assert figures["redone"] == 0


@pytest.mark.parametrize(("trials", "keep"), [(6, "all"), (3, "front"), night(60, "all"), night(30, "front")])
def test_failing_call_in_a_real_sweep(server, memory, fresh, figures, request, trials, keep):
    """The command with its cluster and study, in a forked process."""
    config = study(memory)
    arguments = ["sweep", str(config), "--quiet", "--keep", keep, "-o"]
    name = request.node.name
    n_calls = calls_of(server, memory, name, arguments=[*arguments, "{folder}/grid.h5"])
    undisturbed = sha256(memory / name / "grid.h5")
    chance = random.Random(7)
    cases = list(product(range(1, n_calls + 1), ERRORS, (False, True)))
    for at, error, sticky in chance.sample(cases, trials):
        folder = fresh()
        path = folder / "grid.h5"
        order = [*arguments, str(path)]
        writing = server.write(path, arguments=order, environment=orders(folder, at, error, sticky))
        figures["trials"] += 1
        assert_clear_error(writing.code, writing.errors, path)
        assert server.write(path, arguments=order).code == 0
        assert sha256(path) == undisturbed, (at, error, sticky)
        assert sorted(entry.name for entry in folder.iterdir()) == ["grid.h5", "grid.h5.log.jsonl"]


@pytest.mark.parametrize(("trials", "keep"), [(2, "all"), (1, "front"), night(20, "all"), night(10, "front")])
def test_failing_call_in_the_command(command, recorder, tmp_path, figures, trials, keep):
    """A separate process from start to exit, including the shutdown of the interpreter and of HDF5."""
    config, path, trace = study(tmp_path), tmp_path / "out" / "grid.h5", tmp_path / "trace"
    environment = {"LD_PRELOAD": str(recorder), "FAULT_FOLDER": str(path.parent)} | SPARED
    assert command(config, path, environment | {"FAULT_TRACE": str(trace)}, keep).finish() == (0, "")
    undisturbed = sha256(path)
    n_calls = sum(call.operation in REFUSED for call in read_trace(trace))
    chance = random.Random(8)
    for _ in range(trials):
        path.unlink()
        at, error, sticky = (
            chance.randrange(1, n_calls),
            chance.choice([errno.EIO, errno.ENOSPC]),
            chance.random() < 0.5,
        )
        failing = environment | orders(path.parent, at, error, sticky)
        code, stderr = command(config, path, failing, keep).finish()
        figures["trials"] += 1
        assert_clear_error(code, stderr, path)
        sweep_here(config, path, keep)
        assert sha256(path) == undisturbed, (at, error, sticky)


def test_short_writes_are_finished(server, memory, fresh, whole, figures):
    """A write may write only half of its bytes without an error."""
    for at in range(1, 200, 9):
        folder = fresh()
        short = {"FAULT_FOLDER": str(folder), "FAULT_ACTION": "short", "FAULT_OPERATIONS": "w", "FAULT_AT": str(at)}
        writing = server.write(folder / "grid.h5", environment=short)
        figures.count(check(folder / "grid.h5", writing.numbers("done")))
        assert (writing.code, sha256(folder / "grid.h5")) == (0, whole)


# --- full disks ------------------------------------------------------------------------------------------------------


NO_RESERVING = {"FAULT_ACTION": "fail", "FAULT_OPERATIONS": "a", "FAULT_AT": "1", "FAULT_ERROR": str(errno.EOPNOTSUPP)}


@pytest.mark.parametrize("free", [0, 4096, 100_000])
@pytest.mark.parametrize("reserving", [True, False])
def test_full_disk_at_the_start(server, small_disk, whole, figures, free, reserving):
    other = take_all_but(small_disk, free)
    path = small_disk / "grid.h5"
    environment = {"FAULT_FOLDER": str(small_disk)} | ({} if reserving else NO_RESERVING)
    writing = server.write(path, environment=environment)
    figures.count(check(path))
    assert_clear_error(writing.code, writing.errors, path)
    assert "No space left" in writing.errors or "free" in writing.errors
    assert writing.numbers("run") == [], "found out before anything is computed"
    assert [entry.name for entry in small_disk.iterdir()] == ["other"]
    other.unlink()
    assert server.write(path, environment=environment).code == 0
    assert sha256(path) == whole


def test_disk_that_fills_up_after_the_start_does_no_harm(server, small_disk, whole, figures):
    """The space of the results file is reserved at the start."""
    path = fill(small_disk / "grid.h5", [])
    take_all_but(small_disk, 4096)  # for the lock
    writing = server.write(path)
    figures.count(check(path, writing.numbers("done")))
    assert (writing.code, writing.errors) == (0, "")
    assert sha256(path) == whole


@pytest.mark.parametrize("free", [8192, 40_000, 90_000, 150_000, 200_000])
def test_disk_full_in_the_middle(server, small_disk, undisturbed, whole, figures, free):
    """On file systems that copy on write, reserved space is not guaranteed: the file has holes."""
    path = small_disk / "grid.h5"
    fill(path, [])
    content = path.read_bytes()
    path.unlink()
    with path.open("wb") as file:
        file.truncate(len(content))
        for start in range(0, len(content), 4096):
            page = content[start : start + 4096]
            if any(page):
                file.seek(start)
                file.write(page)
    other = take_all_but(small_disk, free)
    writing = server.write(path)
    verdict = figures.count(check(path, writing.numbers("done")))
    assert verdict.sound, verdict
    assert 0 <= len(verdict.committed) < N_BLOCKS
    assert_clear_error(writing.code, writing.errors, path)
    other.unlink()
    again = server.write(path)
    assert again.code == 0
    assert not set(again.numbers("run")) & verdict.committed
    assert sha256(path) == whole


@pytest.mark.parametrize("limit", [5_000, 100_000])
@pytest.mark.parametrize("reserving", [True, False])
def test_limit_on_the_length_at_the_start(server, fresh, whole, figures, limit, reserving):
    """The kernel also sends a signal, which must not end the process."""
    folder = fresh()
    path = folder / "grid.h5"
    environment = {"FAULT_FOLDER": str(folder)} | ({} if reserving else NO_RESERVING)
    writing = server.write(path, limit=limit, environment=environment)
    figures.count(check(path))
    assert_clear_error(writing.code, writing.errors, path)
    assert "ulimit" in writing.errors
    assert writing.numbers("run") == []
    assert list(folder.iterdir()) == []
    assert server.write(path).code == 0
    assert sha256(path) == whole


@pytest.mark.parametrize("after", [0, 1, 13, 27, 39])
def test_limit_on_the_length_in_the_middle(server, fresh, whole, figures, after):
    path = fresh() / "grid.h5"
    writing = server.write(path, limit=5000, limit_after=after)
    verdict = figures.count(check(path, writing.numbers("done")))
    assert verdict.sound, verdict
    assert verdict.committed == set(range(after))
    assert_clear_error(writing.code, writing.errors, path)
    again = server.write(path)
    assert (again.code, again.numbers("run")) == (0, list(range(after, N_BLOCKS)))
    assert sha256(path) == whole
