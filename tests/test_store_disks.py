"""Full disks, folders that cannot be written, and platforms without POSIX."""

import errno
import fcntl
import os
import sys

import pytest
from store_files import ATTRIBUTES, BLOCK, COLUMNS, N_BLOCKS, fill, sha256, values, writer

from explore.base.errors import ResultsError
from explore.base.files import rename_new
from explore.results.store import system_calls
from explore.results.store.creation import create_results_file
from explore.results.store.open_results import open_results


def test_disk_too_small_says_how_much_is_missing(tmp_path):
    # 1 PB: more than the disk of this machine, less than the limit of most file systems; both errors name the size
    with pytest.raises(ResultsError, match=r"needs [\d,]{15,} bytes.*free"):
        create_results_file(tmp_path / "grid.h5", COLUMNS, 10**15 // 30, 65_536, ATTRIBUTES)
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_written(unprivileged):
    folder, lower = unprivileged
    folder.chmod(0o555)
    lower()
    with pytest.raises(ResultsError, match=r"cannot be written: Permission denied; choose another with `path`"):
        fill(folder / "grid.h5")
    assert list(folder.iterdir()) == []


def test_missing_folders_are_made(tmp_path):
    assert fill(tmp_path / "a" / "b" / "grid.h5", [0]).exists()


def test_disk_error_on_commit_is_reported_and_leaves_the_block_pending(tmp_path):
    """In place of a disk error the descriptor is read-only, so the write fails."""
    path = tmp_path / "grid.h5"
    with writer(path) as store:
        store.commit(0, values(0))
        broken = os.open(path, os.O_RDONLY)
        os.dup2(broken, store._descriptor)
        os.close(broken)
        with pytest.raises(
            ResultsError, match=r"grid\.h5: block 1 cannot be written: .*run the sweep or refinement again"
        ):
            store.commit(1, values(1))
        assert list(store.pending) == list(range(1, N_BLOCKS))
    assert open_results(path).n_committed == BLOCK


def test_file_system_that_cannot_reserve(finished, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    assert sha256(fill(tmp_path / "grid.h5")) == sha256(finished)


@pytest.mark.parametrize("number", [errno.EPERM, errno.ENOTSUP, errno.EMLINK])
def test_file_system_without_hard_links(finished, tmp_path, monkeypatch, number):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "link", refuse)
    path = fill(tmp_path / "grid.h5")
    assert sha256(path) == sha256(finished)
    assert list(tmp_path.iterdir()) == [path]
    (tmp_path / "new").write_text("new")
    with pytest.raises(FileExistsError):
        rename_new(tmp_path / "new", path)
    assert sha256(path) == sha256(finished)


def test_without_posix_the_bytes_are_the_same(finished, tmp_path, monkeypatch):
    for name in ("posix_fallocate", "fdatasync", "pwrite"):
        monkeypatch.delattr(os, name)
    path = fill(tmp_path / "grid.h5")
    assert sha256(path) == sha256(finished)
    assert path.stat().st_blocks * 512 >= path.stat().st_size, "the space is reserved all the same"


class FakeMsvcrt:
    """Windows' byte lock, emulated by flock."""

    LK_NBLCK = 2

    @staticmethod
    def locking(descriptor: int, mode: int, count: int) -> None:
        assert (mode, count) == (2, 1)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise PermissionError(errno.EACCES, "Permission denied") from None  # what msvcrt raises


def test_lock_without_posix(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", FakeMsvcrt)
    path = tmp_path / "grid.h5"
    with writer(path), pytest.raises(ResultsError, match="is being written by process"):
        fill(path)
    fill(path)
    monkeypatch.setitem(sys.modules, "msvcrt", None)
    with path.open("rb") as file, pytest.raises(OSError, match="no file locks"):
        system_calls.lock(file.fileno())
