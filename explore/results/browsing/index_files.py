"""The index of a results file: a folder with the cells and values of each column, to be mapped into memory.

::

    facts.json    what the index is of, facts of each column, and checksums of its files and of itself
    000.cells     of the first column, u2 (n): the cell of each committed design, in their order in the file
    000.ranges    least and greatest value of each cell and its number of designs, f8 (3, cells)
    000.values    the values, f8 (n); not there where each cell has one value only
    001.cells     and so on

It is written under another name and renamed when it is complete and durable, so that one cut short is never read.
A block of 2^18 values is checked when it is first read. Its checksum goes on from that of the block before, so that the
last one is that of the whole file.
"""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.checksums import crc32
from explore.base.errors import ResultsError
from explore.base.files import sync_folder, unfinished_name
from explore.model.quantities import FloatArray
from explore.results.browsing.cells import Cells

#: Version of the files; older ones are made anew.
_FORMAT = 2
#: Number of values of a file that have one checksum.
BLOCK = 1 << 18

_FACTS = "facts.json"


class DamagedIndexError(ResultsError):
    """Files of an index are not what was written."""

    def __init__(self, folder: Path) -> None:
        super().__init__(f"the index {folder.name} is damaged; remove it from the folder, and make it again")


@dataclass(frozen=True)
class ColumnFacts:
    """Facts of a column of the results: the least and the largest finite value, in the declared unit, None without any.

    `missing` values are NaN or infinite; `distinct` finite ones are counted up to a limit, None beyond it. The
    checksums are those of the blocks of its files, by their kind.
    """

    name: str
    low: float | None
    high: float | None
    missing: int
    distinct: int | None
    checksums: dict[str, list[int]]


class CheckedValues:
    """Values of a file that stay on the disk; each block is checked when one of its values is first read."""

    def __init__(self, path: Path, dtype: str, length: int, checksums: list[int]) -> None:
        # Compiled functions take arrays that can be written; what is written to this one would not reach the file.
        self._values = np.asarray(np.memmap(path, dtype=dtype, mode="c"))
        if len(self._values) != length or len(checksums) != -(-length // BLOCK):
            raise ValueError(path)
        self._folder, self._checksums, self._is_sound = path.parent, checksums, np.zeros(len(checksums), bool)

    def __getitem__(self, rows: slice | npt.NDArray[np.int64]) -> npt.NDArray[Any]:
        if isinstance(rows, slice):
            first, stop, _ = rows.indices(len(self._values))
            blocks = np.arange(first // BLOCK, -(-stop // BLOCK))
        else:
            blocks = np.unique(rows // BLOCK)
        for block in blocks[~self._is_sound[blocks]].tolist():
            before = self._checksums[block - 1] if block else 0
            if crc32(self._values[block * BLOCK : (block + 1) * BLOCK], before) != self._checksums[block]:
                raise DamagedIndexError(self._folder)
            self._is_sound[block] = True
        return self._values[rows]


@dataclass(frozen=True)
class IndexedColumn:
    """A column of an index: its facts, its cells, and the cell of each design, (n,), which stays on the disk."""

    facts: ColumnFacts
    cells: Cells
    numbers: CheckedValues
    _values: CheckedValues | None

    def values(self, rows: slice | npt.NDArray[np.int64]) -> FloatArray:
        """The exact values of some designs in the declared unit."""
        return self.cells.least[self.numbers[rows]] if self._values is None else self._values[rows]


@dataclass(frozen=True)
class Index:
    """The index of a results file: the number of committed designs, and all columns by name."""

    n_designs: int
    columns: dict[str, IndexedColumn]


def identify(path: Path) -> list[int]:
    """What changes when a results file is replaced, continued or restored: device, inode, size and time of change."""
    status = path.stat()
    return [status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns]


@contextmanager
def new_index(folder: Path) -> Iterator[Path]:
    """A new folder to write an index in, which replaces `folder` when the block ends without an error."""
    unfinished = unfinished_name(folder)
    unfinished.mkdir(parents=True)
    try:
        yield unfinished
        sync_folder(unfinished)
        remove_index(folder)
        unfinished.rename(folder)
        sync_folder(folder.parent)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def remove_index(folder: Path) -> None:
    """Remove an index if there is one; what is left of it after a kill is no index any more."""
    if folder.exists():
        (folder / _FACTS).unlink(missing_ok=True)
        shutil.rmtree(folder)


def column_path(folder: Path, number: int, kind: str) -> Path:
    """A file of a column: of its "cells", "ranges" or "values"."""
    return folder / f"{number:03}.{kind}"


def write_facts(folder: Path, identity: list[int], n_designs: int, columns: list[ColumnFacts]) -> None:
    """Write what makes the files of a folder an index, durably."""
    facts = {"format": _FORMAT, "of": identity, "designs": n_designs, "columns": [asdict(column) for column in columns]}
    with (folder / _FACTS).open("w", encoding="utf-8") as file:
        json.dump({**facts, "checksum": _checksum(facts)}, file, indent=1)
        file.flush()
        os.fsync(file.fileno())


def open_index(folder: Path, identity: list[int]) -> Index | None:
    """The index of the results file of this identity; None if there is none, or only one of another state of the file.

    Files of the index that were changed raise a `DamagedIndexError`, also when values are read.
    """
    try:
        facts = json.loads((folder / _FACTS).read_text(encoding="utf-8"))
        if facts["format"] < _FORMAT:
            return None
        if facts.pop("checksum") != _checksum(facts):
            raise DamagedIndexError(folder)
        if facts["format"] != _FORMAT or facts["of"] != identity:
            return None
        columns = [ColumnFacts(**entry) for entry in facts["columns"]]
        n_designs = int(facts["designs"])
        mapped = [_open_column(column, folder, number, n_designs) for number, column in enumerate(columns)]
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise DamagedIndexError(folder) from None
    return Index(n_designs, {column.facts.name: column for column in mapped})


def _checksum(facts: dict[str, Any]) -> int:
    return crc32(json.dumps(facts, sort_keys=True).encode())


def _open_column(facts: ColumnFacts, folder: Path, number: int, length: int) -> IndexedColumn:
    ranges = np.fromfile(column_path(folder, number, "ranges"), "<f8")
    if [crc32(ranges)] != facts.checksums["ranges"]:
        raise DamagedIndexError(folder)
    least, greatest, counts = ranges.reshape(3, -1)
    cells = Cells(least, greatest, counts.astype(np.int64))

    def checked(kind: str, dtype: str) -> CheckedValues:
        return CheckedValues(column_path(folder, number, kind), dtype, length, facts.checksums[kind])

    return IndexedColumn(facts, cells, checked("cells", "<u2"), None if cells.are_exact else checked("values", "<f8"))
