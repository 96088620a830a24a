"""Reading a results file: whole, in part, or block by block, while a sweep still writes to it."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store.layout import INDEX, KEEP_FRONT, Attribute, Layout
from explore.store.parsing import read_layout
from explore.store.reading import COMMITTED, Progress, damaged_blocks, read_rows, read_words
from explore.suggest import suggestion
from explore.vocabulary import Column

if TYPE_CHECKING:
    import pandas as pd

#: Columns that are kept as 0 and 1, because pandas reads HDF5's booleans as numbers, and are booleans in Python.
_BOOLEANS = ("feasible",)
#: Rows that are read over rather than skipped: a page costs as much as one of its values.
_GAP = 512


class Results:
    """What was committed to a results file at the moment when it was opened.

    No file stays open in between, and a running sweep is not disturbed.

    Parameters
    ----------
    path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._layout: Layout = read_layout(path)
        self._identity = _identity(path)
        with self._open() as file:
            words = read_words(file, self._layout)
        #: Which blocks are committed, shape (blocks,).
        self._committed: npt.NDArray[np.bool_] = words >> 32 == COMMITTED >> 32

    def __repr__(self) -> str:
        if self.keep != "all":
            return f"<Results {str(self.path)!r}: {self.n_committed} kept of {self.n_studied} designs>"
        return f"<Results {str(self.path)!r}: {self.n_committed} of {self.n_designs} designs>"

    def __len__(self) -> int:
        return self.n_committed

    @property
    def attributes(self) -> Mapping[str, Attribute]:
        """Everything that is known of the study: seed, versions, hashes and so on."""
        return dict(self._layout.attributes)

    @property
    def config(self) -> str:
        """The study's config as written, TOML."""
        return str(self._layout.attributes.get("config", ""))

    @cached_property
    def constraints(self) -> dict[str, dict[str, float | None]]:
        """The bounds of each constrained metric as "min" and "max", in the metric's unit; None leaves a side open."""
        try:
            found = json.loads(str(self._layout.attributes.get("determines", "{}"))).get("constraints", {})
            return {
                str(metric): {side: None if sides[side] is None else float(sides[side]) for side in ("min", "max")}
                for metric, sides in found.items()
            }
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ResultsError(f"{self.path} is damaged: its constraints cannot be read ({error})") from error

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns in their order, the index first."""
        return self._layout.columns

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        return {column.name: column.unit for column in self.columns}

    @property
    def keep(self) -> str:
        """Which designs of the study are in the file: "all", or "front" for the Pareto-optimal ones."""
        return str(self._layout.attributes.get("keep", "all"))

    @property
    def n_designs(self) -> int:
        """Number of designs of the file, those included that are not committed yet."""
        return self._layout.n_designs

    @property
    def n_studied(self) -> int:
        """Number of designs of the study, those included that were not kept."""
        return int(self._layout.attributes["studied_designs"]) if self.keep == KEEP_FRONT else self.n_designs

    @property
    def n_committed(self) -> int:
        """Number of designs that are there."""
        return self._layout.count_rows(self._committed)

    @property
    def complete(self) -> bool:
        """Whether every design is there."""
        return bool(self._committed.all())

    @property
    def packed(self) -> bool:
        """Whether the file is a compressed copy."""
        return self._layout.packed

    @property
    def n_blocks(self) -> int:
        """Number of blocks of the file."""
        return self._layout.n_blocks

    @property
    def committed_blocks(self) -> list[int]:
        """Numbers of the committed blocks, ascending."""
        return np.flatnonzero(self._committed).tolist()

    def block_rows(self, number: int) -> tuple[int, int]:
        """First row of a block and the first row after it; rows are designs when all are kept."""
        return self._layout.rows(number)

    @cached_property
    def counts(self) -> dict[str, int]:
        """Number of committed designs by the label of their status; labels that do not occur are left out.

        Those that were studied but not kept are counted too.
        """
        if self.keep == KEEP_FRONT:
            studied = json.loads(str(self._layout.attributes["studied_counts"]))
            return {str(label): int(count) for label, count in studied.items() if count}
        return self.count_statuses(self.committed_blocks)

    def count_statuses(self, blocks: Sequence[int]) -> dict[str, int]:
        """Number of designs in some committed blocks by the label of their status."""
        found: Counter[int] = Counter()
        status = self._column("status")
        with self._open() as file:
            for number in blocks:
                codes, numbers = np.unique(self._read(file, status, *self._layout.rows(number)), return_counts=True)
                found.update(dict(zip(codes.tolist(), numbers.tolist(), strict=True)))
        return {status.labels.get(code, str(code)): found[code] for code in sorted(found)}

    def to_pandas(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """The committed designs as a table.

        Parameters
        ----------
        columns
            Names of the columns wanted; all when None.

        Returns
        -------
        pandas.DataFrame
            Index "design", one row for each committed design.
        """
        import pandas as pd  # 0.4 s, not needed by a sweep

        names = [c.name for c in self.columns] if columns is None else list(columns)
        wanted = [self._column(name) for name in names if name != INDEX]
        runs = self._runs()
        with self._open() as file:
            index, *arrays = (
                _joined([self._read(file, column, *run) for run in runs], column)
                for column in (self._column(INDEX), *wanted)
            )
        data = dict(zip((c.name for c in wanted), arrays, strict=True))
        return self._described(pd.DataFrame(data, index=pd.Index(index, name=INDEX), copy=False))

    def _described(self, frame: pd.DataFrame) -> pd.DataFrame:
        """The table with what a ranking of it needs to know."""
        for name in ("senses", "objectives"):
            frame.attrs[name] = json.loads(str(self.attributes.get(name, "null"))) or {}
        frame.attrs["constraints"] = self.constraints
        return frame

    def design(self, number: int) -> dict[str, Any]:
        """One design: the value of each column by name."""
        row = int(self._places(np.array([number]))[0])
        with self._open() as file:
            return {c.name: self._read(file, c, row, row + 1)[0].item() for c in self.columns}

    def rows(self, numbers: npt.ArrayLike) -> pd.DataFrame:
        """Whole designs by number, in the order given; of a large file only these are read.

        Parameters
        ----------
        numbers
            Design numbers, shape (n,).

        Returns
        -------
        pandas.DataFrame
            Index "design".
        """
        import pandas as pd  # 0.4 s, not needed by a sweep

        wanted, places = np.unique(np.asarray(numbers, dtype=np.int64), return_inverse=True)
        found = self._places(wanted)
        # A compressed block is read as a whole, so once is enough.
        apart = np.diff(found // self._layout.block_size) > 0 if self.packed else np.diff(found) > _GAP
        runs = np.split(found, np.flatnonzero(apart) + 1) if len(found) else []
        with self._open() as file:
            data = {
                c.name: _joined([self._read(file, c, run[0], run[-1] + 1)[run - run[0]] for run in runs], c)[places]
                for c in self.columns
            }
        return pd.DataFrame(data, copy=False).set_index(INDEX)

    def blocks(self, columns: Sequence[str] | None = None) -> Iterator[dict[str, npt.NDArray[Any]]]:
        """The committed blocks in order, each as arrays of shape (n,) by name; all columns when None."""
        wanted = self.columns if columns is None else tuple(self._column(name) for name in columns)
        with self._open() as file:
            for number in self.committed_blocks:
                yield {column.name: self._read(file, column, *self._layout.rows(number)) for column in wanted}

    def verify(self, progress: Progress | None = None) -> list[int]:
        """Numbers of the blocks whose bytes are not those that were committed; empty when all is well.

        Parameters
        ----------
        progress
            Called after each block with how many were checked and how many there are to check.
        """
        with self._open() as file:
            return damaged_blocks(file, self._layout, progress)

    def _places(self, numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Rows of committed designs by number; `ResultsError` when one is not there."""
        for number in numbers[(numbers < 0) | (numbers >= self.n_studied)][:1].tolist():
            raise ResultsError(f"{self.path} has no design {number}: they are numbered 0 to {self.n_studied - 1:,}")
        rows = numbers
        if self.keep == KEEP_FRONT:
            rows = np.searchsorted(self._kept, numbers)
            there = np.append(self._kept, -1)[rows] == numbers
            for number in numbers[~there][:1].tolist():
                advice = "sweep with --keep all to keep every design"
                raise ResultsError(f"{self.path}: design {number} is not Pareto-optimal and was not kept; {advice}")
        for number in numbers[~self._committed[rows // self._layout.block_size]][:1].tolist():
            raise ResultsError(f"{self.path}: design {number} is not computed yet; run the sweep again to go on")
        return rows

    @cached_property
    def _kept(self) -> npt.NDArray[np.int64]:
        """Numbers of the designs that were kept, ascending."""
        with self._open() as file:
            numbers: npt.NDArray[np.int64] = self._read(file, self._column(INDEX), 0, self.n_designs)
        if np.any(np.diff(numbers) <= 0):
            raise ResultsError(f"{self.path} is damaged: its design numbers do not ascend; restore it from a copy")
        return numbers

    def _column(self, name: str) -> Column:
        for column in self.columns:
            if column.name == name:
                return column
        advice = suggestion(name, [column.name for column in self.columns])
        raise ResultsError(f"{self.path} has no column {name!r}; {advice}")

    def _runs(self) -> list[tuple[int, int]]:
        """The committed rows as (first, stop), neighbouring blocks joined: fewer and longer reads."""
        runs: list[tuple[int, int]] = []
        for start, stop in map(self._layout.rows, self.committed_blocks):
            goes_on = runs and runs[-1][1] == start
            runs.append((runs.pop()[0] if goes_on else start, stop))
        return runs

    def _read(self, file: io.FileIO, column: Column, start: int, stop: int) -> npt.NDArray[Any]:
        values = read_rows(file, self._layout, column, start, stop)
        return values != 0 if column.name in _BOOLEANS else values

    def _open(self) -> io.FileIO:
        """The file's bytes: HDF5 may keep old ones in memory, and is not needed once the layout is known."""
        try:
            if _identity(self.path) != self._identity:
                raise ResultsError(f"{self.path} was replaced after it was opened; open it again")
            return io.FileIO(self.path)
        except FileNotFoundError:
            raise ResultsError(f"{self.path} was removed after it was opened") from None


def _joined(pieces: list[npt.NDArray[Any]], column: Column) -> npt.NDArray[Any]:
    if len(pieces) == 1:  # the usual case, a complete file: no copy
        return pieces[0]
    return np.concatenate(pieces) if pieces else np.empty(0, bool if column.name in _BOOLEANS else column.dtype)


def _identity(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_dev, status.st_ino
