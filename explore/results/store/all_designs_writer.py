"""Write a results file: create it complete, then write the blocks, each durable before its commit word is written.

The file is made under another name, read back and renamed. After that HDF5 never writes to it: the values of a block
are written at the offsets of the layout and made durable, then its commit word is written and made durable. So HDF5's
structures never change, the file can be read at any time, and a kill or a power cut costs one block at most.
"""

from __future__ import annotations

import contextlib
import io
import os
from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import ResultsError
from explore.base.files import NAME_ANOTHER_FILE, START_OVER, open_regular, sync_folder
from explore.results.store import system_calls
from explore.results.store.block_bytes import commit_word, damaged_blocks, read_words
from explore.results.store.creation import create_results_file
from explore.results.store.difference import other_study_error, study_description
from explore.results.store.layout import INDEX
from explore.results.store.layout_reader import read_layout
from explore.results.store.presence import check_present
from explore.results.store.sidecar_files import is_hdf5, journal_name
from explore.results.store.writer import SweepWriter


class AllDesignsWriter(SweepWriter):
    """The single writer of a results file with all designs: it creates the file or continues it.

    The arguments are those of `create_results_file`; `restart` moves an existing file aside, to ``<path>.old``, and
    starts over. Blocks that were `damaged` when the file was opened are pending again. A `ResultsError` says, on
    entering, that another process is writing, the file belongs to another study or is not a results file, the disk is
    full or the folder cannot be written; on committing, that the disk reports an error.
    """

    _wrote = False

    def _check_written(self) -> None:
        if self._wrote:
            self._check_present()
            # Writing changes the layout if HDF5's structures are damaged.
            if read_layout(self.path) != self._layout:
                raise ResultsError(f"{self.path} is damaged; {START_OVER}")

    def _check_present(self) -> None:
        """Raise `ResultsError` if the path no longer leads to the open file."""
        check_present(self.path, self._descriptor, f"{self.n_committed:,} designs")

    @property
    def pending(self) -> array[int]:
        """Numbers of the blocks still to compute, ascending; a new array each time."""
        return array("q", np.flatnonzero(~self._committed).astype(np.int64).tobytes())

    @property
    def n_pending(self) -> int:
        """Number of blocks still to compute."""
        return len(self._committed) - int(np.count_nonzero(self._committed))

    @property
    def n_committed(self) -> int:
        """Number of designs that are durable."""
        return self._layout.count_rows(self._committed)

    def commit(self, number: int, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Write one pending block and return when it is durable.

        `arrays` are all columns by name, each of shape (n,) and of exactly its column's dtype; "design" may be left
        out. Called by `explore.running.collectors.AllDesignsCollector.add`.
        """
        ordered = self._check_block(number, arrays)
        start, stop = self._layout.row_range(number)
        self._check_present()
        if os.fstat(self._descriptor).st_size != self._layout.size:
            # A program that opens the file by HDF5 with mode "w" truncates it before it notices the lock.
            raise ResultsError(f"{self.path} was cut short by another program; {START_OVER}")
        try:
            for column, values in zip(self._layout.columns, ordered, strict=True):
                system_calls.write_at(self._descriptor, values.data, self._layout.offset(column, start))
            if stop == self._layout.n_designs:
                self._write_padding()
            system_calls.sync_data(self._descriptor)
            self._write_word(number, commit_word(ordered))
        except OSError as error:
            text = f"{self.path}: block {number} cannot be written: {error.strerror or error}"
            raise ResultsError(f"{text}; run the sweep or refinement again to go on once the cause is gone") from error
        self._committed[number] = self._wrote = True

    def _check_block(self, number: int, arrays: Mapping[str, npt.NDArray[Any]]) -> list[npt.NDArray[Any]]:
        """The arrays of a pending block in the order of the columns; ValueError if they do not fit the columns."""
        if not 0 <= number < self._layout.n_blocks or self._committed[number]:
            raise ValueError(f"block {number} is not pending")
        start, stop = self._layout.row_range(number)
        numbers = np.arange(start, stop, dtype="<i8")
        arrays = {INDEX: numbers, **arrays}
        if arrays.keys() != {column.name for column in self._layout.columns}:
            difference = sorted(arrays.keys() ^ {column.name for column in self._layout.columns})
            raise ValueError(f"block {number}: missing or unknown columns {difference}")
        for column in self._layout.columns:
            values = arrays[column.name]
            if values.shape != (stop - start,) or values.dtype != np.dtype(column.dtype):
                expected = f"shape ({stop - start},) and dtype {column.dtype}"
                raise ValueError(
                    f"block {number}: {column.name} has {values.shape}, {values.dtype.str}, not {expected}"
                )
        if not np.array_equal(arrays[INDEX], numbers):
            raise ValueError(f"block {number}: its designs are {start} to {stop - 1}")
        return [np.ascontiguousarray(arrays[column.name]) for column in self._layout.columns]

    def _write_word(self, number: int, word: int) -> None:
        page = word.to_bytes(8, "little").ljust(self._layout.commit_step, b"\0")
        system_calls.write_at(self._descriptor, page, self._layout.word_offset(number))
        system_calls.sync_data(self._descriptor)

    def _write_padding(self) -> None:
        """Write zeros after the columns' last rows: a power cut may have garbled the rest of these pages."""
        for column in self._layout.columns:
            offset = self._layout.offset(column, self._layout.n_designs)
            system_calls.write_at(self._descriptor, bytes(self._layout.padding(column)), offset)

    def _open(self, stack: contextlib.ExitStack) -> None:
        self._prepare()
        try:
            self._layout = read_layout(self.path)
        except ResultsError as error:
            advice = START_OVER if is_hdf5(self.path) else NAME_ANOTHER_FILE
            raise ResultsError(f"{error}; {advice}") from error
        if self._layout.is_packed:
            raise ResultsError(f"{self.path} is a packed copy, which cannot be continued; {NAME_ANOTHER_FILE}")
        columns, n_designs, block_size, attributes = self._content
        old, names = self._layout, ("request_sha256", "kernel", "keep")
        is_same = all(old.attributes.get(name) == attributes.get(name) for name in names)
        if not is_same or (old.columns, old.n_designs, old.block_size) != (tuple(columns), n_designs, block_size):
            described = study_description(old.attributes, old.n_designs, old.columns)
            raise other_study_error(self.path, described, study_description(attributes, n_designs, columns))
        self._descriptor = open_regular(self.path, os.O_RDWR)
        stack.callback(os.close, self._descriptor)
        self._exclude_other_writers()
        # A killed run may have left a name or a commit word that can be read but is not durable.
        system_calls.sync_data(self._descriptor)
        sync_folder(self.path.parent)
        self._committed = self._read_committed()

    def _prepare(self) -> None:
        """Create the file unless it exists."""
        if journal_name(self.path).exists():
            raise ResultsError(
                f"{journal_name(self.path)} holds an unfinished sweep that keeps only the front; "
                f'go on with it by `keep="front"`, {NAME_ANOTHER_FILE} or start over with `restart=True`'
            )
        if not self.path.exists():
            create_results_file(self.path, *self._content)

    def _exclude_other_writers(self) -> None:
        """Take the shared lock of an HDF5 reader, so that HDF5 opens the file for reading only."""
        try:
            is_locked = system_calls.lock(self._descriptor, shared=True)
        except OSError:  # a file system without locks; this lock only guards against other programs
            return
        if not is_locked:
            raise ResultsError(f"{self.path} is open for writing in another program; close it there")

    def _read_committed(self) -> npt.NDArray[np.bool_]:
        """Whether each block is committed, shape (blocks,), after all were checked and the damaged ones reset."""
        with io.FileIO(self.path) as file:
            self.damaged = damaged_blocks(file, self._layout)
            for number in self.damaged:
                self._write_word(number, 0)
            committed: npt.NDArray[np.bool_] = read_words(file, self._layout) != 0
        return committed
