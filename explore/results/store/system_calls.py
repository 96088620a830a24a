"""System calls for durable files: those of POSIX, with weaker replacements elsewhere.

Linux has all of them. Elsewhere space is reserved by writing zeros (slow, same effect), data are made durable by
`os.fsync` (slower; on macOS the drive may still hold them in its cache), locks are those of `msvcrt` (one
holder, no shared locks), and folders are not synchronised (a power cut may undo a rename, but loses no content).
"""

import errno
import importlib
import os
from pathlib import Path
from types import ModuleType

from explore.base.files import sync_folder

_CHUNK = 1 << 20
#: Offset of the byte that Windows locks, far beyond any content, because others must still read the file's text.
_LOCKED_BYTE = 1 << 30


def _import_optional(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


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
    remaining = memoryview(data).cast("B")
    while remaining:
        if hasattr(os, "pwrite"):
            n_written = os.pwrite(descriptor, remaining, offset)
        else:
            os.lseek(descriptor, offset, os.SEEK_SET)
            n_written = os.write(descriptor, remaining)
        remaining, offset = remaining[n_written:], offset + n_written


def sync_data(descriptor: int) -> None:
    """Return when the bytes written, and what is needed to find them, survive a power cut."""
    getattr(os, "fdatasync", os.fsync)(descriptor)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents, durably: a folder lost in a power cut would take its files with it."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for path in missing:
        sync_folder(path.parent)


def lock(descriptor: int, *, shared: bool = False) -> bool:
    """Try to lock an open file until it is closed or the process ends; False if another process holds the lock.

    A process made by ``fork`` keeps the lock too, until it ends: start workers by ``spawn``.
    """
    fcntl, msvcrt = _import_optional("fcntl"), _import_optional("msvcrt")
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
