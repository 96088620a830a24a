"""The lock of a results file, which its single writer holds."""

import contextlib
import os
import re
import socket
import time
from pathlib import Path
from typing import Self

from explore.base.errors import ResultsError
from explore.base.files import open_regular
from explore.results.store import system_calls

#: Beginning of the text that a holder writes into the lock file, with 0 for the number of the process.
_HOLDER_TEXT = b"process 0 on host "


class LockedError(ResultsError):
    """Another process holds the lock; `holder` says which."""

    def __init__(self, message: str, holder: str) -> None:
        super().__init__(message)
        self.holder = holder


class LockFile:
    """An exclusive lock for writing ``path``, a context manager; the system releases it when the process ends.

    The lock is on ``<path>.lock``, because the results file itself may be replaced. A file of another program under
    that name is locked, but neither changed nor removed; an empty one is removed. On entering, a `LockedError` says
    that another process holds the lock, a `ResultsError` that the folder cannot be written or that the lock's name is
    that of a link, a pipe or a device.
    """

    def __init__(self, path: Path) -> None:
        self._results = path
        self.path = path.with_name(path.name + ".lock")

    def __enter__(self) -> Self:
        try:
            system_calls.make_folder(self._results.parent)
            self._descriptor = self._acquire()
        except ResultsError:
            raise
        except OSError as error:
            reason = f"{self._results} cannot be written: {error.strerror}"
            raise ResultsError(f"{reason}; choose another with `path`") from error
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):  # Windows does not remove a file that is open; it does no harm
            if self._is_removable and self._is_current(self._descriptor):  # it may have been removed and replaced
                self.path.unlink()
        os.close(self._descriptor)

    def _acquire(self) -> int:
        while True:
            descriptor = open_regular(self.path, os.O_RDWR | os.O_CREAT)
            with contextlib.ExitStack() as stack:
                stack.callback(os.close, descriptor)
                if not system_calls.lock(descriptor):
                    holder = _describe_holder(descriptor)
                    message = f"{self._results} is being written by {holder}; wait for it or stop it"
                    raise LockedError(message, holder)
                if self._is_current(descriptor):
                    is_lock_file = _is_holder_text(_read_text(descriptor))
                    self._is_removable = is_lock_file and os.fstat(descriptor).st_nlink == 1
                    if self._is_removable:
                        _write_holder(descriptor)
                    stack.pop_all()
                    return descriptor

    def _is_current(self, descriptor: int) -> bool:
        """Whether the descriptor is still of the file with that name, which its last holder may have removed."""
        try:
            return os.path.samestat(os.fstat(descriptor), self.path.stat())
        except FileNotFoundError:
            return False


def _describe_holder(descriptor: int) -> str:
    """The process and host that hold a lock; they are written a moment after it is taken."""
    for _ in range(20):
        text = _read_text(descriptor)
        if text:
            return text.decode() if text.isascii() and _is_holder_text(text) else "another process"
        time.sleep(0.01)
    return "another process"


def _write_holder(descriptor: int) -> None:
    """Write this process and host into the lock file."""
    with contextlib.suppress(OSError):  # on a full disk the lock file stays empty
        os.ftruncate(descriptor, 0)
        system_calls.write_at(descriptor, f"process {os.getpid()} on host {socket.gethostname()}".encode(), 0)


def _read_text(descriptor: int) -> bytes:
    os.lseek(descriptor, 0, os.SEEK_SET)
    return os.read(descriptor, 1000)


def _is_holder_text(text: bytes) -> bool:
    """Whether a holder of the lock wrote the text; a kill or a power cut may leave a part of it, or zeros."""
    shape = re.sub(rb"\d+", b"0", text.rstrip(b"\0"), count=1)
    is_whole = shape.startswith(_HOLDER_TEXT) and b"\n" not in shape and len(text) < 1000
    return is_whole or _HOLDER_TEXT.startswith(shape)
