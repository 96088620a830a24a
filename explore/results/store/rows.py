"""Read rows of a results file: committed blocks, single designs, ranges.

A block is read as a whole, and compared with its checksum, before the first values of it are handed out.
"""

import io
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import ResultsError
from explore.base.suggest import suggestion
from explore.model.columns import Column
from explore.results.store.block_bytes import COMMITTED, is_sound, is_written, read_column_rows, read_words
from explore.results.store.layout import INDEX, KEEP_FRONT, Layout
from explore.results.store.layout_reader import read_layout

Values = npt.NDArray[Any]
#: Columns of booleans, stored as 0 and 1 because pandas reads HDF5's booleans as numbers.
_BOOLEANS = ("feasible",)
#: Largest number of rows between two wanted ones that are read too: a page takes as long to read as one of its values.
_LARGEST_GAP = 512


class RowReader:
    """Reads the rows that were committed when the reader was made. No file stays open between two calls.

    `layout` has the offsets of the data of the file; `is_committed`, shape (blocks,), says whether each block is
    committed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.layout: Layout = read_layout(path)
        self._identity = _identity(path)
        self._sound: set[int] = set()
        with self.open() as file:
            self._words = read_words(file, self.layout)
        self.is_committed: npt.NDArray[np.bool_] = self._words >> 32 == COMMITTED >> 32

    def open(self) -> io.FileIO:
        """Open the file without HDF5, which may cache old bytes; `ResultsError` if it is another file now."""
        try:
            if _identity(self.path) != self._identity:
                raise ResultsError(f"{self.path} was replaced after it was opened; open it again")
            return io.FileIO(self.path)
        except FileNotFoundError:
            raise ResultsError(f"{self.path} was removed after it was opened") from None

    def column(self, name: str) -> Column:
        """The column of this name; `ResultsError` if there is none."""
        for column in self.layout.columns:
            if column.name == name:
                return column
        advice = suggestion(name, [column.name for column in self.layout.columns])
        raise ResultsError(f"{self.path} has no column {name!r}; {advice}")

    @cached_property
    def committed_ranges(self) -> list[tuple[int, int]]:
        """The committed rows as (first, stop), neighbouring blocks joined."""
        with self.open() as file:
            self._check_words(file)
        ranges: list[tuple[int, int]] = []
        for start, stop in map(self.layout.row_range, np.flatnonzero(self.is_committed).tolist()):
            continues = ranges and ranges[-1][1] == start
            ranges.append((ranges.pop()[0] if continues else start, stop))
        return ranges

    def read_committed(self, columns: Iterable[Column]) -> list[Values]:
        """All committed rows, an array of shape (rows,) for each column."""
        return self._read_ranges(columns, self.committed_ranges)

    def read_blocks(self, columns: Sequence[Column], blocks: Sequence[int]) -> Iterator[dict[str, Values]]:
        """Committed blocks, each as arrays of shape (n,) by name."""
        with self.open() as file:
            self._check_words(file)
            for number in blocks:
                self._check_block(file, number)
                yield {column.name: self._read(file, column, *self.layout.row_range(number)) for column in columns}

    def read_rows(self, columns: Iterable[Column], rows: npt.NDArray[np.int64]) -> list[Values]:
        """Committed rows, ascending, an array of shape (rows,) for each column."""
        # A compressed block is read as a whole, so all its rows are read together.
        blocks = rows // self.layout.block_size
        is_apart = np.diff(blocks) > 0 if self.layout.is_packed else np.diff(rows) > _LARGEST_GAP
        groups = np.split(rows, np.flatnonzero(is_apart) + 1) if len(rows) else []
        with self.open() as file:
            self._check_blocks(file, np.unique(blocks).tolist())
            return [
                _join([self._read(file, c, group[0], group[-1] + 1)[group - group[0]] for group in groups], c)
                for c in columns
            ]

    def read_positions(self, column: Column, positions: int | slice | npt.NDArray[np.int64]) -> Values:
        """Values of a column at positions among the committed rows, as numpy indexes an array of them."""
        if isinstance(positions, slice):
            start, stop, step = positions.indices(self.layout.count_rows(self.is_committed))
            if step == 1:
                return self._read_ranges([column], self._clipped_ranges(start, stop))[0]
            positions = np.arange(start, stop, step)
        firsts, stops = np.array(self.committed_ranges, np.int64).reshape(-1, 2).T
        ends = np.cumsum(stops - firsts)
        indices = np.asarray(positions, np.int64)
        indices = np.where(indices < 0, indices + (ends[-1] if len(ends) else 0), indices)
        rows = indices + (stops - ends)[np.searchsorted(ends, indices, side="right")]
        unique, places = np.unique(rows, return_inverse=True)
        return self.read_rows([column], unique)[0][places].reshape(rows.shape)

    def rows_of(self, designs: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Rows of designs by number, shape (n,); `ResultsError` if one is not committed."""
        n_studied = self.n_studied
        for number in designs[(designs < 0) | (designs >= n_studied)][:1].tolist():
            raise ResultsError(f"{self.path} has no design {number}: they are numbered 0 to {n_studied - 1:,}")
        rows = designs
        if self.layout.attributes.get("keep") == KEEP_FRONT:
            rows = np.searchsorted(self.kept_designs, designs)
            is_kept = np.append(self.kept_designs, -1)[rows] == designs
            for number in designs[~is_kept][:1].tolist():
                advice = 'sweep with `keep="all"` to keep every design'
                raise ResultsError(f"{self.path}: design {number} is not Pareto-optimal and was not kept; {advice}")
        for number in designs[~self.is_committed[rows // self.layout.block_size]][:1].tolist():
            raise ResultsError(
                f"{self.path}: design {number} is not computed yet; run the sweep or refinement again to go on"
            )
        return rows

    @property
    def n_studied(self) -> int:
        """Number of designs of the study, including those that were not kept."""
        attributes = self.layout.attributes
        return int(attributes["studied_designs"]) if attributes.get("keep") == KEEP_FRONT else self.layout.n_designs

    @cached_property
    def kept_designs(self) -> npt.NDArray[np.int64]:
        """Numbers of the designs in a file that keeps the front only, ascending."""
        if not self.is_committed.all():
            raise ResultsError(f"{self.path} is damaged: not all kept designs are committed; restore it from a copy")
        (numbers,) = self.read_committed([self.column(INDEX)])
        if np.any(np.diff(numbers) <= 0):
            raise ResultsError(f"{self.path} is damaged: its design numbers do not ascend; restore it from a copy")
        return numbers

    def _clipped_ranges(self, start: int, stop: int) -> list[tuple[int, int]]:
        """Ranges (first, stop) of the rows at positions `start` to `stop` among the committed rows."""
        ranges, position = [], 0
        for first, end in self.committed_ranges:
            low, high = first + max(start - position, 0), min(first + stop - position, end)
            if low < high:
                ranges.append((low, high))
            position += end - first
        return ranges

    def _read_ranges(self, columns: Iterable[Column], ranges: Sequence[tuple[int, int]]) -> list[Values]:
        size = self.layout.block_size
        with self.open() as file:
            for first, stop in ranges:
                self._check_blocks(file, range(first // size, -(-stop // size)))
            return [_join([self._read(file, column, *rows) for rows in ranges], column) for column in columns]

    def _check_blocks(self, file: io.FileIO, blocks: Iterable[int]) -> None:
        """Raise `ResultsError` if one of these committed blocks, or any commit word, is damaged."""
        self._check_words(file)
        for number in blocks:
            self._check_block(file, number)

    def _check_words(self, file: io.FileIO) -> None:
        """Raise `ResultsError` if a commit word is garbled: the rows of its block would be left out without a word."""
        if np.any(self._words[~self.is_committed]):
            words = read_words(file, self.layout)  # again: a block may have been committed meanwhile
            for number in np.flatnonzero((words != 0) & (words >> 32 != COMMITTED >> 32))[:1].tolist():
                raise self._damage(number, "have a garbled commit word; continue the run to compute them again")

    def _check_block(self, file: io.FileIO, number: int) -> None:
        """Raise `ResultsError` if a committed block is damaged; each is checked once, all columns of it."""
        if number in self._sound:
            return
        if not is_written(file, self.layout, number):
            raise self._damage(number, "are marked as committed, but were never written")
        if not is_sound(file, self.layout, number, int(self._words[number])):
            raise self._damage(number, "do not have the checksum that they were committed with")
        self._sound.add(number)

    def _damage(self, number: int, problem: str) -> ResultsError:
        start, stop = self.layout.row_range(number)
        advice = "`explore verify` lists the damaged blocks"
        return ResultsError(f"{self.path} is damaged: rows {start} to {stop - 1} {problem}; {advice}")

    def _read(self, file: io.FileIO, column: Column, start: int, stop: int) -> Values:
        values = read_column_rows(file, self.layout, column, start, stop)
        return values != 0 if column.name in _BOOLEANS else values


def dtype_of(column: Column) -> np.dtype[Any]:
    """Type of a column's values as they are read."""
    return np.dtype(bool if column.name in _BOOLEANS else column.dtype)


def _join(pieces: list[Values], column: Column) -> Values:
    if len(pieces) == 1:  # the usual case, a complete file: no copy
        return pieces[0]
    return np.concatenate(pieces) if pieces else np.empty(0, dtype_of(column))


def _identity(path: Path) -> tuple[int, int]:
    """Device and inode of the file, which differ from those of another file of the same name."""
    status = path.stat()
    return status.st_dev, status.st_ino
