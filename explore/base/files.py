"""Write files under an unfinished name and rename them when complete, never over a link, a pipe or a device."""

import contextlib
import errno
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

from explore.base.errors import ResultsError

# The command line puts its options where messages have arguments of Python functions in backticks.
#: End of messages about a file that must not be touched.
NAME_ANOTHER_FILE = "name another file with `path`"
#: Advice on a results file that cannot be continued.
START_OVER = "use `restart=True` to start over (the file is moved aside)"
#: Ending that `unfinished_name` appends; no other program uses it.
_UNFINISHED = re.compile(r"\.unfinished-[0-9a-f]{8}")
#: Errors of file systems without hard links: FAT and exFAT, network drives, macOS (which has both of "not supported").
_NO_HARD_LINKS = (errno.EPERM, errno.EACCES, errno.EMLINK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)


@contextlib.contextmanager
def new_file(path: Path, size: int | None = None, *, replace: bool = True) -> Iterator[Path]:
    """Yield an unfinished name to write a file under, and rename it to `path` when the block ends without an error.

    The file will have `size` bytes, if known. An existing regular file is replaced if `replace`; a pipe, a device or a
    folder never is. The caller makes the content durable. `ResultsError` stands for any OSError; the unfinished file is
    then removed.
    """
    check_regular(path)
    temporary = unfinished_name(path)
    try:
        yield temporary
        check_regular(path)  # another program may have made a link or a pipe meanwhile
        if replace:
            temporary.replace(path)
        else:
            rename_new(temporary, path)
        sync_folder(path.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, ResultsError):
            raise explained(error, path, size) from error
        raise


def real_path(path: Path) -> Path:
    """Target of a link, or the path itself: the target is what is locked, written and replaced."""
    try:
        return path.resolve() if path.is_symlink() else path
    except (OSError, RuntimeError):  # which of the two depends on Python's version
        raise ResultsError(f"{path} is a link that leads back to itself; {NAME_ANOTHER_FILE}") from None


def unfinished_name(path: Path) -> Path:
    """A name for a file until it is complete, different in each call."""
    return path.with_name(f"{path.name}.unfinished-{secrets.token_hex(4)}")


def remove_unfinished(path: Path) -> None:
    """Remove the unfinished versions of a file that killed processes left; the caller holds the file's lock."""
    for file in unfinished_versions(path):
        file.unlink()


def unfinished_versions(path: Path) -> list[Path]:
    """The unfinished versions of a file."""
    names = ((file, file.name) for file in path.parent.iterdir())
    return [file for file, name in names if name.startswith(path.name) and _UNFINISHED.fullmatch(name, len(path.name))]


def check_regular(path: Path) -> None:
    """Raise `ResultsError` if the path is a link, a folder, a pipe or a device; a missing file is allowed."""
    try:
        mode = path.lstat().st_mode
    except OSError:  # missing or unreachable: creating the file reports the reason
        return
    if not stat.S_ISREG(mode):
        kind = "a link" if stat.S_ISLNK(mode) else "a folder" if stat.S_ISDIR(mode) else "a pipe or a device"
        raise ResultsError(
            f"{path} is {kind}, not a regular file, so it is left alone; remove it, or {NAME_ANOTHER_FILE}"
        )


def open_regular(path: Path, flags: int) -> int:
    """Open a regular file and return its descriptor; `ResultsError` if the path is anything else."""
    check_regular(path)
    # The file may be replaced after the check: do not follow a link, do not wait for a pipe.
    descriptor = open_binary(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise ResultsError(f"{path} is not a regular file, so it is left alone; remove it, or {NAME_ANOTHER_FILE}")
    return descriptor


def open_binary(path: Path, flags: int) -> int:
    """Open a file in binary mode, not inherited by child processes, and return its descriptor."""
    return os.open(path, flags | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0), 0o666)


def rename_new(source: Path, target: Path) -> None:
    """Rename a file within its folder; `FileExistsError` if the target exists, which is left alone."""
    if os.name != "posix":
        source.rename(target)  # never replaces there
        return
    try:
        os.link(source, target)
    except OSError as error:
        if error.errno not in _NO_HARD_LINKS:
            raise
        # Without hard links there is no atomic rename that fails if the target exists: check, then rename.
        if os.path.lexists(target):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target)) from None
        source.rename(target)
    else:
        source.unlink()


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable, on systems where folders can be opened."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def explained(error: OSError, path: Path, size: int | None = None) -> ResultsError:
    """An error for users from an OSError: the bytes needed, the bytes free, the remedy."""
    needs = f"{path} needs {'more' if size is None else f'{size:,}'} bytes"
    if isinstance(error, FileExistsError):
        return ResultsError(
            f"{path} was made by another program meanwhile, so it is left alone; move it away and try again"
        )
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        free = shutil.disk_usage(path.parent).free
        advice = f"free some space or {NAME_ANOTHER_FILE if size is None else 'sweep less'}"
        if error.errno == errno.EDQUOT:
            return ResultsError(f"{needs}, more than your disk quota leaves in {path.parent}; {advice}")
        if size is not None and free >= size:  # reserved for the superuser, or taken and freed since
            return ResultsError(f"{needs}, which the file system refuses: {error.strerror}; {advice}")
        return ResultsError(f"{needs}, but only {free:,} are free in {path.parent}; {advice}")
    if error.errno == errno.EFBIG:
        free = shutil.disk_usage(path.parent).free
        limit = "the file system or a limit of this process (ulimit -f) forbids a file of that size"
        return ResultsError(f"{needs} ({free:,} are free), but {limit}")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return ResultsError(f"the folder {path.parent} cannot be written: {error.strerror}; choose another with `path`")
    return ResultsError(f"{path} cannot be created: {error.strerror or error}")
