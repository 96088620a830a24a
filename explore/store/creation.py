"""Creating a results file: under another name, read back, made durable and renamed; or nothing is left behind."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from explore.errors import ResultsError
from explore.store import platform
from explore.store.image import build
from explore.store.layout import Attribute, Layout
from explore.store.names import temporary_name
from explore.store.parsing import read_layout
from explore.vocabulary import Column

#: Values of the index written at a time.
_CHUNK = 1 << 17


def create(
    path: Path, columns: Sequence[Column], n_designs: int, block_size: int, attributes: Mapping[str, Attribute]
) -> None:
    """Create a complete results file without any committed block. The caller holds the lock of the path.

    Parameters
    ----------
    path
        The file; one that is there is replaced.
    columns
        The index "design" first.
    attributes
        Of the study: config, request_sha256, determines, kernel, versions, seed, sampler.

    Raises
    ------
    ResultsError
        The disk is full or the folder cannot be written. Nothing is left behind.
    """
    with laid_out(path, columns, n_designs, block_size, attributes) as (descriptor, layout):
        for start in range(0, n_designs, _CHUNK):
            numbers = np.arange(start, min(start + _CHUNK, n_designs), dtype="<i8")
            platform.write_at(descriptor, numbers.data, layout.offset(columns[0], start))


@contextlib.contextmanager
def laid_out(
    path: Path, columns: Sequence[Column], n_designs: int, block_size: int, attributes: Mapping[str, Attribute]
) -> Iterator[tuple[int, Layout]]:
    """Create a results file and give its descriptor and layout, for its values to be written; see `create`."""
    image = build(columns, n_designs, block_size, attributes)
    with new_file(path, image.size) as temporary:
        _check_free(path.parent, image.size)
        descriptor = platform.open_binary(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL)
        try:
            platform.reserve(descriptor, image.size)
            for offset, piece in image.pieces:
                platform.write_at(descriptor, piece, offset)
            layout = read_layout(temporary)
            _read_back(layout, columns, attributes)
            yield descriptor, layout
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextlib.contextmanager
def new_file(path: Path, size: int | None = None) -> Iterator[Path]:
    """Give the name to write a file under, and rename it when all went well; the caller makes it durable.

    Parameters
    ----------
    path
        The file; one that is there is replaced.
    size
        How many bytes it takes, if known.

    Raises
    ------
    ResultsError
        In place of any other OSError; nothing is left behind.
    """
    temporary = temporary_name(path)
    try:
        temporary.unlink(missing_ok=True)
        yield temporary
        temporary.replace(path)
        platform.sync_folder(path.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, ResultsError):
            raise _explained(error, path, size) from error
        raise


def _check_free(folder: Path, size: int) -> None:
    """Refuse at once what cannot fit: where reserving means writing zeros, the disk would be filled first."""
    if size > shutil.disk_usage(folder).free:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _read_back(layout: Layout, columns: Sequence[Column], attributes: Mapping[str, Attribute]) -> None:
    """Make sure that the new file says what it was told to say."""
    if layout.columns != tuple(columns) or any(layout.attributes[name] != value for name, value in attributes.items()):
        raise ResultsError("the new results file does not read back as written; check the disk")


def _explained(error: OSError, path: Path, size: int | None) -> ResultsError:
    needs = f"{path} needs {'more' if size is None else f'{size:,}'} bytes"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        free = shutil.disk_usage(path.parent).free
        advice = "name another file with -o" if size is None else "sweep less"
        return ResultsError(f"{needs}, but only {free:,} are free in {path.parent}; free some space or {advice}")
    if error.errno == errno.EFBIG:
        free = shutil.disk_usage(path.parent).free
        limit = "the file system or a limit of this process (ulimit -f) forbids a file of that size"
        return ResultsError(f"{needs} ({free:,} are free), but {limit}")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return ResultsError(f"the folder {path.parent} cannot be written: {error.strerror}; choose another with -o")
    return ResultsError(f"{path} cannot be created: {error.strerror or error}")
