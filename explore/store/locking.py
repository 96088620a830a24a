"""Who may write a results file: the process that holds the lock on the file beside it."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from explore.errors import ResultsError
from explore.store import platform


class LockFile:
    """The right to write ``path``, a context manager. It ends with the process, however that ends.

    Parameters
    ----------
    path
        The results file; the lock is on ``<path>.lock``, because the results file itself may be replaced.

    Raises
    ------
    ResultsError
        On entering: another process holds the lock, or the folder cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._results = path
        self.path = path.with_name(path.name + ".lock")

    def __enter__(self) -> Self:
        try:
            platform.make_folder(self._results.parent)
            self._descriptor = self._acquire()
        except ResultsError:
            raise
        except OSError as error:
            reason = f"{self._results} cannot be written: {error.strerror}"
            raise ResultsError(f"{reason}; choose another with -o") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):  # Windows does not remove a file that is open; it does no harm
            self.path.unlink()
        os.close(self._descriptor)

    def _acquire(self) -> int:
        while True:
            descriptor = platform.open_binary(self.path, os.O_RDWR | os.O_CREAT)
            with contextlib.ExitStack() as stack:
                stack.callback(os.close, descriptor)
                if not platform.lock(descriptor):
                    holder = _holder(descriptor)
                    raise ResultsError(f"{self._results} is being written by {holder}; wait for it or stop it")
                if self._is_current(descriptor):
                    with contextlib.suppress(OSError):  # on a full disk it is a lock without a name
                        os.ftruncate(descriptor, 0)
                        holder = f"process {os.getpid()} on host {socket.gethostname()}"
                        platform.write_at(descriptor, holder.encode(), 0)
                    stack.pop_all()
                    return descriptor

    def _is_current(self, descriptor: int) -> bool:
        """Whether the file is still the one of that name: its last holder may have removed it meanwhile."""
        try:
            return os.path.samestat(os.fstat(descriptor), self.path.stat())
        except FileNotFoundError:
            return False


def _holder(descriptor: int) -> str:
    """Who holds a lock; a process that has just taken it needs a moment to say so."""
    for _ in range(20):
        os.lseek(descriptor, 0, os.SEEK_SET)
        text = os.read(descriptor, 200)
        if text:
            return text.decode(errors="replace")
        time.sleep(0.01)
    return "another process"
