"""The index of a results file: a folder with the cells and values of each column, to be mapped into memory.

::

    facts.json    what the index is of, and facts of each column
    000.cells     of the first column, u2 (n): the cell of each committed design, in their order in the file
    000.ranges    least and greatest value of each cell and its number of designs, f8 (3, cells)
    000.values    the values, f8 (n); not there where each cell has one value only
    001.cells     and so on

It is written under another name and renamed when it is complete and durable, so that one cut short is never read.
"""

from __future__ import annotations

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

from explore.base.errors import ResultsError
from explore.base.files import sync_folder, unfinished_name
from explore.model.quantities import FloatArray
from explore.results.browsing.cells import Cells

#: Changes when the files change, so that older ones are made anew.
_FORMAT = 1
_FACTS = "facts.json"


@dataclass(frozen=True)
class ColumnFacts:
    """Facts of a column.

    Attributes
    ----------
    name
        Its name in the results.
    low, high
        The least and the largest finite value, in the declared unit; None where no value is finite.
    missing
        Number of values that are NaN or infinite.
    distinct
        Number of distinct finite values; None if there are more than are counted.
    """

    name: str
    low: float | None
    high: float | None
    missing: int
    distinct: int | None


@dataclass(frozen=True)
class IndexedColumn:
    """A column of an index.

    Attributes
    ----------
    facts
        Its facts.
    cells
        What its cells hold.
    numbers
        The cell of each design, (n,); stays on the disk.
    """

    facts: ColumnFacts
    cells: Cells
    numbers: npt.NDArray[np.uint16]
    _values: FloatArray | None

    def values(self, rows: slice | npt.NDArray[np.int64]) -> FloatArray:
        """The exact values of some designs in the declared unit."""
        return self.cells.least[self.numbers[rows]] if self._values is None else self._values[rows]


@dataclass(frozen=True)
class Index:
    """The index of a results file.

    Attributes
    ----------
    n_designs
        Number of committed designs.
    columns
        All columns by name.
    """

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
        json.dump(facts, file, indent=1)
        file.flush()
        os.fsync(file.fileno())


def open_index(folder: Path, identity: list[int]) -> Index | None:
    """The index of the results file of this identity; None if there is none, or only one of another state of the file.

    Raises
    ------
    ResultsError
        If files of the index were changed.
    """
    try:
        facts = json.loads((folder / _FACTS).read_text(encoding="utf-8"))
        if facts["format"] != _FORMAT or facts["of"] != identity:
            return None
        columns = [ColumnFacts(**entry) for entry in facts["columns"]]
        n_designs = int(facts["designs"])
        mapped = [_open_column(column, folder, number, n_designs) for number, column in enumerate(columns)]
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        raise ResultsError(
            f"the index {folder.name} is damaged; remove it from the folder, and make it again"
        ) from None
    return Index(n_designs, {column.facts.name: column for column in mapped})


def _open_column(facts: ColumnFacts, folder: Path, number: int, length: int) -> IndexedColumn:
    least, greatest, counts = np.fromfile(column_path(folder, number, "ranges"), "<f8").reshape(3, -1)
    cells = Cells(least, greatest, counts.astype(np.int64))
    values = None if cells.are_exact else _map(column_path(folder, number, "values"), "<f8", length)
    return IndexedColumn(facts, cells, _map(column_path(folder, number, "cells"), "<u2", length), values)


def _map(path: Path, dtype: str, length: int) -> npt.NDArray[Any]:
    # Compiled functions take arrays that can be written; what is written to this one would not reach the file.
    values = np.memmap(path, dtype=dtype, mode="c")
    if len(values) != length:
        raise ValueError(path)
    return np.asarray(values)
