"""Writing a results file: created complete, then one block after the other, each durable before it counts.

The file is made under another name, read back and renamed. After that HDF5 never writes to it: values go straight to
the places that the layout names, are made durable, and only then the block's commit word is written and made durable.
So HDF5's own structures never change, the file can be read at any time, and a kill or a power cut costs one block.
"""

from __future__ import annotations

import contextlib
import io
import os
from array import array
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store import platform
from explore.store.creation import create
from explore.store.difference import described, other_study
from explore.store.layout import INDEX, Attribute, Layout
from explore.store.locking import LockFile
from explore.store.names import ELSEWHERE, is_hdf5, journal_name, real_path, set_aside, temporary_name
from explore.store.parsing import read_layout
from explore.store.reading import commit_word, damaged_blocks, read_words
from explore.vocabulary import Column


class Writer:
    """The single writer of a results file, a context manager. It creates the file or goes on with it.

    Attributes
    ----------
    damaged
        Numbers of the blocks that were there but damaged when the file was opened; they are pending again.

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
        self.path = real_path(path)
        self._content = (tuple(columns), n_designs, block_size, dict(attributes))
        self._restart = restart
        self._closing = contextlib.ExitStack()
        self._wrote = False

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
        with self._closing:
            if error is None and self._wrote:
                self._check_layout()

    def _check_layout(self) -> None:
        """Make sure that writing changed nothing but values: damage in HDF5's own bytes may have misled us."""
        if read_layout(self.path) != self._layout:
            raise ResultsError(f"{self.path} is damaged; use --restart to start over (the file is moved aside)")

    @property
    def pending(self) -> array[int]:
        """Numbers of the blocks still to compute, ascending; a new array each time, eight bytes for each block."""
        return array("q", np.flatnonzero(~self._committed).astype(np.int64).tobytes())

    @property
    def n_pending(self) -> int:
        """How many blocks are still to compute."""
        return len(self._committed) - int(np.count_nonzero(self._committed))

    @property
    def committed_designs(self) -> int:
        """Number of designs that are durable."""
        return self._layout.count_rows(self._committed)

    def commit(self, number: int, columns: Mapping[str, npt.NDArray[Any]]) -> None:
        """Write one pending block and return when it is durable.

        Parameters
        ----------
        columns
            All columns by name, each of shape (n,) and of exactly its column's dtype; "design" may be left out.
        """
        arrays = self._checked(number, columns)
        start, _ = self._layout.rows(number)
        if os.fstat(self._descriptor).st_size != self._layout.size:
            # HDF5 empties a file that it is told to make anew before it finds that it may not.
            raise ResultsError(f"{self.path} was cut short by another program; use --restart to start over")
        try:
            for column, values in zip(self._layout.columns, arrays, strict=True):
                platform.write_at(self._descriptor, values.data, self._layout.offset(column, start))
            platform.sync_data(self._descriptor)
            self._write_word(number, commit_word(arrays))
        except OSError as error:
            text = f"{self.path}: block {number} cannot be written: {error.strerror or error}"
            raise ResultsError(f"{text}; run the sweep again to go on once the cause is gone") from error
        self._committed[number] = self._wrote = True

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
            advice = "use --restart to start over (the file is moved aside)" if is_hdf5(self.path) else ELSEWHERE
            raise ResultsError(f"{error}; {advice}") from error
        if self._layout.packed:
            raise ResultsError(f"{self.path} is a packed copy, which cannot be continued; {ELSEWHERE}")
        _check_same_study(self.path, self._layout, *self._content)
        self._descriptor = platform.open_binary(self.path, os.O_RDWR)
        stack.callback(os.close, self._descriptor)
        self._keep_others_from_writing()
        # A killed run may have left a name or a commit word that is seen but not durable.
        platform.sync_data(self._descriptor)
        platform.sync_folder(self.path.parent)
        self._committed = self._read_committed()

    def _prepare(self) -> None:
        """Make sure that there is a file; the lock is held, so what others left behind can go."""
        temporary_name(self.path).unlink(missing_ok=True)
        if self._restart:
            set_aside(self.path)
        if journal_name(self.path).exists():
            raise ResultsError(
                f"{journal_name(self.path)} holds an unfinished sweep that keeps only the front; "
                f"go on with it by --keep front, {ELSEWHERE} or start over with --restart"
            )
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
            self.damaged = damaged_blocks(file, self._layout)
            for number in self.damaged:
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
    same = all(layout.attributes.get(name) == attributes.get(name) for name in ("request_sha256", "kernel", "keep"))
    if same and (layout.columns, layout.n_designs, layout.block_size) == (tuple(columns), n_designs, block_size):
        return
    old = described(layout.attributes, layout.n_designs, layout.columns)
    raise other_study(path, old, described(attributes, n_designs, columns))
