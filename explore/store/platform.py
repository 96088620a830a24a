"""What POSIX gives a durable file, with weaker stand-ins from the standard library elsewhere.

Linux has all four promises. Without them: space is reserved by writing zeros (slow, same effect), data are made durable
by `os.fsync` (slower; on macOS the drive may still hold them in its cache), a lock comes from `msvcrt` (one holder, no
shared locks), and folders are not synchronised (a file's new name may be lost in a power cut, never its content).
"""

from __future__ import annotations

import errno
import importlib
import os
from pathlib import Path
from types import ModuleType

_CHUNK = 1 << 20
#: The byte that Windows locks, far beyond any content, because others must still read the file's text.
_LOCKED_BYTE = 1 << 30


def _optional(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def open_binary(path: Path, flags: int) -> int:
    """Open a file that children never inherit, without any translation of line ends; returns the descriptor."""
    return os.open(path, flags | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0), 0o666)


def reserve(descriptor: int, size: int) -> None:
    """Reserve disk space for a new, empty file of `size` bytes; OSError when there is not enough."""
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(descriptor, 0, size)
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):  # this file system cannot reserve
                raise
        else:
            return
    for start in range(0, size, _CHUNK):
        write_at(descriptor, bytes(min(_CHUNK, size - start)), start)


def write_at(descriptor: int, data: memoryview | bytes, offset: int) -> None:
    """Write all bytes at an offset: one system call may write only a part (2 GiB at most on Linux)."""
    left = memoryview(data).cast("B")
    while left:
        if hasattr(os, "pwrite"):
            written = os.pwrite(descriptor, left, offset)
        else:
            os.lseek(descriptor, offset, os.SEEK_SET)
            written = os.write(descriptor, left)
        left, offset = left[written:], offset + written


def sync_data(descriptor: int) -> None:
    """Return when the bytes written, and what is needed to find them, survive a power cut."""
    getattr(os, "fdatasync", os.fsync)(descriptor)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable, where folders can be opened."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents; a power cut could take a new folder with all durable files in it."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for made in missing:
        sync_folder(made.parent)


def lock(descriptor: int, *, shared: bool = False) -> bool:
    """Try to lock an open file until it is closed or the process ends; False when another one holds it.

    A process made by ``fork`` keeps the lock too, until it ends: start workers by ``spawn``.
    """
    fcntl, msvcrt = _optional("fcntl"), _optional("msvcrt")
    if fcntl is None and msvcrt is None:
        raise OSError(errno.ENOTSUP, "this platform has no file locks")
    try:
        if fcntl is not None:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        elif msvcrt is not None and not shared:
            os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK):
            return False
        raise
    return True
