"""One writer at a time."""

import contextlib
import os
import sys
from pathlib import Path

import h5py
import pytest
from store_files import child, fill, kill, writer

from explore.base.errors import ResultsError
from explore.results.store import system_calls
from explore.results.store.locking import LockFile
from explore.results.store.open_results import open_results


def test_second_writer_is_refused_until_the_first_is_gone(tmp_path):
    path = tmp_path / "grid.h5"
    process = child(path, "none")
    try:
        assert [process.stdout.readline() for _ in range(2)] == ["ready\n", "holding\n"]
        with pytest.raises(ResultsError, match=rf"grid.h5 is being written by process {process.pid} on host \S+; wait"):
            fill(path)
        with pytest.raises(BlockingIOError):
            h5py.File(path, "r+")
        assert open_results(path).n_committed == 0, "the file can be read meanwhile"
    finally:
        kill(process)
    fill(path)  # free at once, no waiting and nothing to clean up by hand
    assert open_results(path).is_complete


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_files_of_the_writer_are_not_inherited(tmp_path):
    path = tmp_path / "grid.h5"
    with writer(path):
        descriptors = [fd for fd in open_files() if open_files()[fd].startswith(str(path))]
        assert {open_files()[fd] for fd in descriptors} == {str(path), f"{path}.lock"}
        assert not any(os.get_inheritable(fd) for fd in descriptors)
    assert not any(name.startswith(str(path)) for name in open_files().values())


def open_files() -> dict[int, str]:
    """Names of this process's open files by descriptor, from /proc."""
    names = {}
    for link in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # the one that lists the folder
            names[int(link.name)] = str(link.readlink())
    return names


def test_lock_file_removed_by_its_last_holder_is_no_lock(tmp_path, monkeypatch):
    """The last holder removes the file after we open it and before we lock it: the name is free for another writer."""
    path, lock = tmp_path / "grid.h5", system_calls.lock
    removals = iter([True])

    def remove_then_lock(descriptor: int) -> bool:
        if next(removals, False):
            path.with_name("grid.h5.lock").unlink()
        return lock(descriptor)

    monkeypatch.setattr(system_calls, "lock", remove_then_lock)
    with LockFile(path), pytest.raises(ResultsError, match="is being written by process"), LockFile(path):
        pytest.fail("two writers hold the lock")


def test_other_program_that_writes_is_noticed(copy):
    with h5py.File(copy, "r+"):
        # HDF5 would share the file within this process, so another one opens it
        process = child(copy, "all")
        out, _ = process.communicate(timeout=240)
        assert (process.returncode, out) == (1, "ready\ncopy.h5 is open for writing in another program\n")


def test_lock_file_of_another_holder_is_not_removed(tmp_path):
    """The lock file is removed while it is held, and another process creates and locks one of that name."""
    path, lock = tmp_path / "grid.h5", tmp_path / "grid.h5.lock"
    first, second = LockFile(path), LockFile(path)
    with contextlib.ExitStack() as stack:
        stack.enter_context(first)
        lock.unlink()
        with second:
            stack.close()
            assert lock.exists()
            with pytest.raises(ResultsError, match="is being written by process"), LockFile(path):
                pytest.fail("two writers hold the lock")
    assert not lock.exists()
