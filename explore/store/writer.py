"""Writing a results file: created complete, then one block after the other, each durable before it counts.

The file is made under another name, read back and renamed. After that HDF5 never writes to it: values go straight to
the places that the layout names, are made durable, and only then the block's commit word is written and made durable.
So HDF5's own structures never change, the file can be read at any time, and a kill or a power cut costs one block.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store import platform
from explore.store.difference import changed_keys, changed_values
from explore.store.image import build
from explore.store.layout import INDEX, Attribute, Layout, commit_word, damaged_blocks, read_layout, read_words
from explore.store.locking import LockFile
from explore.vocabulary import Column

#: Values of the index written at a time.
_CHUNK = 1 << 17
#: How every HDF5 file begins.
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_ELSEWHERE = "name another file with -o"


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
    image = build(columns, n_designs, block_size, attributes)
    temporary = _temporary(path)
    try:
        temporary.unlink(missing_ok=True)
        _check_free(path.parent, image.size)
        descriptor = platform.open_binary(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL)
        try:
            platform.reserve(descriptor, image.size)
            for offset, piece in image.pieces:
                platform.write_at(descriptor, piece, offset)
            layout = read_layout(temporary)
            for start in range(0, n_designs, _CHUNK):
                numbers = np.arange(start, min(start + _CHUNK, n_designs), dtype="<i8")
                platform.write_at(descriptor, numbers.data, layout.offset(columns[0], start))
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        _read_back(layout, columns, attributes)
        temporary.replace(path)
        platform.sync_folder(path.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, ResultsError):
            raise _explained(error, path, image.size) from error
        raise


def _is_hdf5(path: Path) -> bool:
    """Whether there is an HDF5 file: nothing else is ever moved aside."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_SIGNATURE)) == _SIGNATURE


def _temporary(path: Path) -> Path:
    return path.with_name(path.name + ".tmp")


def _check_free(folder: Path, size: int) -> None:
    """Refuse at once what cannot fit: where reserving means writing zeros, the disk would be filled first."""
    if size > shutil.disk_usage(folder).free:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _read_back(layout: Layout, columns: Sequence[Column], attributes: Mapping[str, Attribute]) -> None:
    """Make sure that the new file says what it was told to say."""
    if layout.columns != tuple(columns) or any(layout.attributes[name] != value for name, value in attributes.items()):
        raise ResultsError("the new results file does not read back as written; check the disk")


def _explained(error: OSError, path: Path, size: int) -> ResultsError:
    needs = f"{path} needs {size:,} bytes"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        free = shutil.disk_usage(path.parent).free
        return ResultsError(f"{needs}, but only {free:,} are free in {path.parent}; free some space or sweep less")
    if error.errno == errno.EFBIG:
        free = shutil.disk_usage(path.parent).free
        limit = "the file system or a limit of this process (ulimit -f) forbids a file of that size"
        return ResultsError(f"{needs} ({free:,} are free), but {limit}")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return ResultsError(f"the folder {path.parent} cannot be written: {error.strerror}; choose another with -o")
    return ResultsError(f"{path} cannot be created: {error.strerror or error}")


class Writer:
    """The single writer of a results file, a context manager. It creates the file or goes on with it.

    Parameters
    ----------
    path, columns, n_designs, block_size, attributes
        As in `create`.
    restart
        Move a file that is there aside, to ``<path>.old``, and start over.

    Raises
    ------
    ResultsError
        On entering: another process is writing, the file belongs to another study or is no results file, the disk is
        full or the folder cannot be written. On committing: the disk reports an error.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[Column],
        n_designs: int,
        block_size: int,
        attributes: Mapping[str, Attribute],
        *,
        restart: bool = False,
    ) -> None:
        self.path = Path(path)
        self._content = (tuple(columns), n_designs, block_size, dict(attributes))
        self._restart = restart
        self._closing = contextlib.ExitStack()

    def __enter__(self) -> Self:
        try:
            with contextlib.ExitStack() as stack:
                stack.enter_context(LockFile(self.path))
                self._open(stack)
                self._closing = stack.pop_all()
        except ResultsError:
            raise
        except OSError as error:
            raise ResultsError(f"{self.path} cannot be written: {error.strerror or error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.close()

    @property
    def pending(self) -> list[int]:
        """Numbers of the blocks still to compute, ascending; a new list each time."""
        return np.flatnonzero(~self._committed).tolist()

    @property
    def committed_designs(self) -> int:
        """Number of designs that are durable."""
        rows = map(self._layout.rows, np.flatnonzero(self._committed).tolist())
        return sum(stop - start for start, stop in rows)

    def commit(self, number: int, columns: Mapping[str, npt.NDArray[Any]]) -> None:
        """Write one pending block and return when it is durable.

        Parameters
        ----------
        columns
            All columns by name, each of shape (n,) and of exactly its column's dtype; "design" may be left out.
        """
        arrays = self._checked(number, columns)
        start, _ = self._layout.rows(number)
        try:
            for column, values in zip(self._layout.columns, arrays, strict=True):
                platform.write_at(self._descriptor, values.data, self._layout.offset(column, start))
            platform.sync_data(self._descriptor)
            self._write_word(number, commit_word(arrays))
        except OSError as error:
            text = f"{self.path}: block {number} cannot be written: {error.strerror or error}"
            raise ResultsError(f"{text}; run the sweep again to go on once the cause is gone") from error
        self._committed[number] = True

    def _checked(self, number: int, columns: Mapping[str, npt.NDArray[Any]]) -> list[npt.NDArray[Any]]:
        if not 0 <= number < self._layout.n_blocks or self._committed[number]:
            raise ValueError(f"block {number} is not pending")
        start, stop = self._layout.rows(number)
        given = {INDEX: np.arange(start, stop, dtype="<i8"), **columns}
        if given.keys() != {column.name for column in self._layout.columns}:
            difference = sorted(given.keys() ^ {column.name for column in self._layout.columns})
            raise ValueError(f"block {number}: missing or unknown columns {difference}")
        for column in self._layout.columns:
            values = given[column.name]
            if values.shape != (stop - start,) or values.dtype != np.dtype(column.dtype):
                wanted = f"shape ({stop - start},) and dtype {column.dtype}"
                raise ValueError(f"block {number}: {column.name} has {values.shape}, {values.dtype.str}, not {wanted}")
        if given[INDEX][0] != start or np.any(np.diff(given[INDEX]) != 1):
            raise ValueError(f"block {number}: its designs are {start} to {stop - 1}")
        return [np.ascontiguousarray(given[column.name]) for column in self._layout.columns]

    def _write_word(self, number: int, word: int) -> None:
        platform.write_at(self._descriptor, word.to_bytes(8, "little"), self._layout.commit_offset + 8 * number)
        platform.sync_data(self._descriptor)

    def _open(self, stack: contextlib.ExitStack) -> None:
        self._prepare()
        try:
            self._layout = read_layout(self.path)
        except ResultsError as error:
            advice = "use --restart to start over (the file is moved aside)" if _is_hdf5(self.path) else _ELSEWHERE
            raise ResultsError(f"{error}; {advice}") from error
        _check_same_study(self.path, self._layout, *self._content)
        self._descriptor = platform.open_binary(self.path, os.O_RDWR)
        stack.callback(os.close, self._descriptor)
        self._keep_others_from_writing()
        self._committed = self._read_committed()

    def _prepare(self) -> None:
        """Make sure that there is a file; the lock is held, so what others left behind can go."""
        _temporary(self.path).unlink(missing_ok=True)
        if self._restart and self.path.exists():
            if not _is_hdf5(self.path):
                raise ResultsError(f"{self.path} is no results file, so it is left alone; {_ELSEWHERE}")
            aside = self.path.with_name(self.path.name + ".old")
            number = 1
            while aside.exists():
                number += 1
                aside = self.path.with_name(f"{self.path.name}.old{number}")
            self.path.rename(aside)
        if not self.path.exists():
            create(self.path, *self._content)

    def _keep_others_from_writing(self) -> None:
        """Hold a shared lock, as a reader would: readers may come, but HDF5 refuses to open the file for writing."""
        try:
            free = platform.lock(self._descriptor, shared=True)
        except OSError:  # a file system without locks: this one only guards against other programs
            return
        if not free:
            raise ResultsError(f"{self.path} is open for writing in another program; close it there")

    def _read_committed(self) -> npt.NDArray[np.bool_]:
        """Which blocks are there, after checking every byte of them. Those that are damaged are pending again."""
        with io.FileIO(self.path) as file:
            for number in damaged_blocks(file, self._layout):
                self._write_word(number, 0)
            committed: npt.NDArray[np.bool_] = read_words(file, self._layout) != 0
        return committed


def _check_same_study(
    path: Path,
    layout: Layout,
    columns: Sequence[Column],
    n_designs: int,
    block_size: int,
    attributes: Mapping[str, Attribute],
) -> None:
    """Refuse to go on with the file of another study: its blocks would not belong together."""
    old, new = layout.attributes, attributes
    same = all(old.get(name) == new.get(name) for name in ("request_sha256", "kernel"))
    if same and (layout.columns, layout.n_designs, layout.block_size) == (tuple(columns), n_designs, block_size):
        return
    changes = changed_keys(str(old.get("determines", "")), str(new.get("determines", "")))
    changes += changed_values(
        {"kernel": old.get("kernel"), "designs": layout.n_designs, "columns": [c.name for c in layout.columns]},
        {"kernel": new.get("kernel"), "designs": n_designs, "columns": [c.name for c in columns]},
    )
    lines = "".join(f"\n  {line}" for line in changes or ["what its columns or blocks are"])
    raise ResultsError(f"{path} holds the results of another study; what changed:{lines}\nuse --restart to start over")
