"""Counts of designs by bins of one column or two, and single designs, exactly; several threads share a count."""

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.results.browsing.cells import find_bins, make_edges
from explore.results.browsing.index_files import Index, IndexedColumn
from explore.results.browsing.kernels import count_bins, count_pairs, list_selected
from explore.results.browsing.selections import Selection

Counts = npt.NDArray[np.int64]
_Part = TypeVar("_Part")
#: Number of designs that are counted at once: the fewer tiles, the less do threads wait for the interpreter's lock.
_TILE = 1 << 18
#: Largest number of threads that share a count.
_MOST_THREADS = 8


@dataclass(frozen=True)
class Range:
    """Bins of equal width of a column, from `low` to `high`, in the declared unit.

    Both are NaN where the column has no finite value, and the bins no designs.
    """

    column: str
    low: float
    high: float
    bins: int

    @property
    def edges(self) -> FloatArray:
        """The edges of the bins, (bins + 1,)."""
        return make_edges(self.low, self.high, self.bins)


@dataclass(frozen=True)
class Histograms:
    """The number of designs that meet all conditions, and counts of several columns, (bins,).

    For each column `everything` counts all designs, and `selected` those that meet the conditions on other columns.
    """

    n_selected: int
    everything: list[Counts]
    selected: list[Counts]


@dataclass(frozen=True)
class Density:
    """Counts of two columns together, (bins of y, bins of x), and the number of designs that meet all conditions."""

    n_selected: int
    counts: Counts


def count_histograms(index: Index, selection: Selection, ranges: Sequence[Range]) -> Histograms:
    """Count designs by the bins of columns; each column leaves out the conditions on itself."""
    tables = [_BinTable(index, own) for own in ranges]
    groups = [selection.group_of(own.column) for own in ranges]

    def count(rows: slice, sums: list[Counts]) -> None:
        failed = selection.failed(rows)
        for group in sorted({0, *groups}):
            chosen = _list_rows(failed, group)
            if not group:
                sums[0] += len(chosen)
            for table, number, own in zip(tables, groups, sums[1:], strict=True):
                if number == group:
                    table.count(rows, chosen, own)

    n_selected, *sums = _add_up(index, [(), *(table.shape for table in tables)], count)
    selected = [own.sum(axis=0)[:-2] for own in sums]
    return Histograms(int(n_selected), [table.count_all() for table in tables], selected)


def count_density(index: Index, selection: Selection, x: Range, y: Range) -> Density:
    """Count designs by the bins of two columns."""
    table_x, table_y = _BinTable(index, x), _BinTable(index, y)

    def count(rows: slice, sums: list[Counts]) -> None:
        chosen = _list_rows(selection.failed(rows), 0)
        unsure = _ROOM.of(len(chosen))[1]
        cells = table_x.numbers[rows], table_y.numbers[rows]
        n_unsure = count_pairs(*cells, table_x.bins, table_y.bins, chosen, len(chosen), sums[1], unsure)
        places = unsure[:n_unsure].astype(np.int64) + rows.start
        np.add.at(sums[1], (table_y.find(places), table_x.find(places)), 1)
        sums[0] += len(chosen)

    n_selected, counts = _add_up(index, [(), (y.bins + 2, x.bins + 2)], count)
    return Density(int(n_selected), counts[: y.bins, : x.bins])


def find_designs(index: Index, selection: Selection, limit: int) -> tuple[int, npt.NDArray[np.int64]]:
    """Number of the selected designs, and the places of the first ones in the index, (limit,) at most."""

    def find(tiles: Sequence[slice]) -> tuple[int, npt.NDArray[np.int64]]:
        count, first = 0, np.empty(0, np.int64)
        for rows in tiles:
            places = _list_rows(selection.failed(rows), 0)
            first = np.concatenate([first, places[: limit - len(first)].astype(np.int64) + rows.start])
            count += len(places)
        return count, first

    counts, firsts = zip(*_each_part(index, find), strict=True)
    return sum(counts), np.concatenate(firsts)[:limit]


def whole_range(column: IndexedColumn, bins: int) -> Range:
    """Bins from the least to the largest finite value of a column."""
    facts = column.facts
    if facts.low is None or facts.high is None:
        return Range(facts.name, np.nan, np.nan, bins)
    return Range(facts.name, facts.low, facts.high, bins)


class _BinTable:
    """The bins of a column, and of its cells."""

    def __init__(self, index: Index, own: Range) -> None:
        self._column, self._edges, self._n_bins, self._index = index.columns[own.column], own.edges, own.bins, index
        self.numbers, self.bins = self._column.numbers, self._column.cells.bins(self._edges)
        self.shape = (4, self._n_bins + 2)

    def find(self, rows: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """The bin of some designs by their values; the number of bins outside."""
        return find_bins(self._column.values(rows), self._edges)

    def count(self, rows: slice, chosen: npt.NDArray[np.uint32], counts: Counts) -> None:
        """Add the chosen designs among some to counts of `shape`, whose lines add up to bins and two more."""
        unsure = _ROOM.of(len(chosen))[1]
        n_unsure = count_bins(self.numbers[rows], self.bins, chosen, len(chosen), counts, unsure)
        if n_unsure:
            found = self.find(unsure[:n_unsure].astype(np.int64) + rows.start)
            counts[0] += np.bincount(found, minlength=counts.shape[1])

    def count_all(self) -> Counts:
        """Counts of all designs, (bins,)."""
        counts = self._column.cells.counts
        if np.any(counts[self.bins == self._n_bins + 1]):
            (sums,) = _add_up(
                self._index, [self.shape],
                lambda rows, sums: self.count(rows, np.arange(rows.stop - rows.start, dtype=np.uint32), sums[0]),
            )  # fmt: skip
            return np.asarray(sums.sum(axis=0)[:-2])
        return np.bincount(self.bins, counts, self._n_bins + 2)[:-2].astype(np.int64)


class _Room(threading.local):
    """Room of a thread for rows of a tile: fresh memory for each would cost more than what is done with it."""

    def __init__(self) -> None:
        self._rows = np.empty((2, 0), np.uint32)

    def of(self, n_rows: int) -> npt.NDArray[np.uint32]:
        """Two lines for so many rows: those that are chosen, and those that are unsure."""
        if self._rows.shape[1] < n_rows:
            self._rows = np.empty((2, n_rows), np.uint32)
        return self._rows


_ROOM = _Room()


def _list_rows(failed: npt.NDArray[np.uint8], group: int) -> npt.NDArray[np.uint32]:
    """The rows that fail nothing but perhaps a group; they hold until the thread lists others."""
    rows: npt.NDArray[np.uint32] = _ROOM.of(len(failed))[0]
    return rows[: list_selected(failed, group, rows)]


def _add_up(
    index: Index, shapes: Sequence[tuple[int, ...]], count: Callable[[slice, list[Counts]], None]
) -> list[Counts]:
    """Sums of these shapes, to which `count` adds what it counts in each tile."""

    def count_part(tiles: Sequence[slice]) -> list[Counts]:
        sums: list[Counts] = [np.zeros(shape, np.int64) for shape in shapes]
        for rows in tiles:
            count(rows, sums)
        return sums

    return [np.sum(parts, axis=0) for parts in zip(*_each_part(index, count_part), strict=True)]


def _each_part(index: Index, work: Callable[[Sequence[slice]], _Part]) -> list[_Part]:
    """What the threads make of consecutive tiles each."""
    tiles = [slice(start, min(start + _TILE, index.n_designs)) for start in range(0, index.n_designs, _TILE)]
    size = -(-len(tiles) // _n_threads())
    return list(_threads().map(work, [tiles[start : start + size] for start in range(0, len(tiles), size)]))


def _n_threads() -> int:
    return min(os.cpu_count() or 1, _MOST_THREADS)


@lru_cache(maxsize=1)
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_n_threads(), "counts")
