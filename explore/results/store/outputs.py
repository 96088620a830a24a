"""Output files of commands, which no lock file guards: each run removes what killed runs left beside its own.

An unfinished file or folder is locked as long as its process lives, so that only those of dead ones are removed.
"""

import contextlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from explore.base.files import new_file, open_binary, real_path, unfinished_versions
from explore.results.store import system_calls

#: Beginning of the name of an unfinished folder.
_PREFIX = ".unfinished-"
#: Pattern of the name of an unfinished folder.
_FOLDER = re.compile(re.escape(_PREFIX) + r"[a-z0-9_]{8}")
#: Pause between attempts at a lock that another run holds while it removes a file, s.
_PAUSE = 1e-3


@contextlib.contextmanager
def new_output(path: Path) -> Iterator[Path]:
    """Yield an unfinished name to write a file under; at the end it is made durable and renamed to `path`.

    A link is followed, and an existing regular file is replaced; see `new_file`.
    """
    path = real_path(path)
    with contextlib.suppress(OSError):  # of a folder that cannot be read or written, which `new_file` reports
        for file in unfinished_versions(path):
            _remove_abandoned(file)
    with contextlib.ExitStack() as stack, new_file(path) as unfinished:  # which is locked until it has its name
        is_ours = False
        while not is_ours:
            descriptor = open_binary(unfinished, os.O_RDWR | os.O_CREAT | os.O_EXCL)
            stack.callback(os.close, descriptor)
            is_ours = _lock(descriptor, unfinished)
        yield unfinished
        with unfinished.open("rb+") as written:  # its writer may have replaced the one that was opened above
            os.fsync(written.fileno())
        if os.name == "nt":  # where an open file cannot be renamed
            stack.close()


@contextlib.contextmanager
def new_output_folder(parent: Path) -> Iterator[Path]:
    """Yield a folder of its own in another one, which is removed at the end with what is left in it."""
    for folder in parent.glob(_PREFIX + "*"):
        if _FOLDER.fullmatch(folder.name) and folder.is_dir():
            _remove_abandoned(folder)
    with contextlib.ExitStack() as stack:
        is_ours = False
        while not is_ours:
            try:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix=_PREFIX, dir=parent)))
            except OSError as error:
                raise OSError(error.errno, error.strerror, str(parent)) from None
            try:
                descriptor = os.open(folder, os.O_RDONLY)
            except FileNotFoundError:
                continue
            except OSError:  # elsewhere than on POSIX folders cannot be opened
                break
            stack.callback(os.close, descriptor)
            is_ours = _lock(descriptor, folder)
        yield folder


def _lock(descriptor: int, unfinished: Path) -> bool:
    """Lock a new file or folder; return whether it has its name still, or another run took it for abandoned before."""
    with contextlib.suppress(OSError):  # a file system without locks
        while not system_calls.lock(descriptor):
            time.sleep(_PAUSE)
    return _has_name(descriptor, unfinished)


def _has_name(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except FileNotFoundError:
        return False


def _remove_abandoned(unfinished: Path) -> None:
    """Remove an unfinished file or folder unless a living process holds its lock."""
    if unfinished.is_symlink():
        return
    with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
        flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        descriptor = open_binary(unfinished, flags)
        stack.callback(os.close, descriptor)
        if not system_calls.lock(descriptor) or not _has_name(descriptor, unfinished):
            return
        if unfinished.is_dir():
            shutil.rmtree(unfinished)
        elif unfinished.is_file():
            unfinished.unlink()
