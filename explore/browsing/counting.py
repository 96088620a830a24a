"""Counts of designs by bins of one column or two, and single designs within a window."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.browsing.index_files import Index, IndexedColumn
from explore.browsing.selections import Selection, find_bins, make_edges

Counts = npt.NDArray[np.int64]
#: Designs that are counted at once.
_TILE = 1 << 16


@dataclass(frozen=True)
class Range:
    """Bins of equal width of a column.

    Attributes
    ----------
    column
        Name of the column.
    low, high
        First and last edge, in the declared unit.
    bins
        Number of bins.
    """

    column: str
    low: float
    high: float
    bins: int

    @property
    def edges(self) -> npt.NDArray[np.float64]:
        """The edges of the bins, (bins + 1,)."""
        return make_edges(self.low, self.high, self.bins)


@dataclass(frozen=True)
class Histogram:
    """Counts of a column: of all designs, and of those that meet the conditions on other columns, each (bins,)."""

    everything: Counts
    selected: Counts


@dataclass(frozen=True)
class Histograms:
    """Counts of several columns, and the number of designs that meet all conditions."""

    n_selected: int
    columns: list[Histogram]


@dataclass(frozen=True)
class Density:
    """Counts of two columns together, each (bins of y, bins of x): of all designs, and of those that are selected."""

    n_selected: int
    everything: Counts
    selected: Counts


def count_histograms(index: Index, selection: Selection, ranges: Sequence[Range]) -> Histograms:
    """Count designs by the bins of columns; each column leaves out the conditions on itself."""
    everything = [np.zeros(own.bins, np.int64) for own in ranges]
    selected = [np.zeros(own.bins, np.int64) for own in ranges]
    n_selected = 0
    for rows in _tiles(index):
        failed = selection.failed(index, rows)
        n_selected += int(np.count_nonzero(failed == 0))
        for number, own in enumerate(ranges):
            bins = find_bins(index.columns[own.column].values[rows], own.edges)
            is_counted = (failed == 0) | (failed == (selection.group_of(own.column) or 0))
            everything[number] += np.bincount(bins[bins >= 0], minlength=own.bins)
            selected[number] += np.bincount(bins[(bins >= 0) & is_counted], minlength=own.bins)
    return Histograms(n_selected, [Histogram(*pair) for pair in zip(everything, selected, strict=True)])


def count_density(index: Index, selection: Selection, x: Range, y: Range) -> Density:
    """Count designs by the bins of two columns."""
    size = x.bins * y.bins
    everything, selected, n_selected = np.zeros(size, np.int64), np.zeros(size, np.int64), 0
    for rows in _tiles(index):
        failed = selection.failed(index, rows)
        n_selected += int(np.count_nonzero(failed == 0))
        columns, lines = (find_bins(index.columns[own.column].values[rows], own.edges) for own in (x, y))
        is_shown = (columns >= 0) & (lines >= 0)
        places = lines * x.bins + columns
        everything += np.bincount(places[is_shown], minlength=size)
        selected += np.bincount(places[is_shown & (failed == 0)], minlength=size)
    return Density(n_selected, everything.reshape(y.bins, x.bins), selected.reshape(y.bins, x.bins))


def find_points(index: Index, selection: Selection, x: Range, y: Range, limit: int) -> tuple[int, Counts]:
    """Number of the selected designs within a window, and places of the first ones in the index, (limit,) at most."""
    count, found = 0, []
    for rows in _tiles(index):
        failed = selection.failed(index, rows)
        inside = failed == 0
        for own in (x, y):
            values = index.columns[own.column].values[rows]
            inside &= (values >= own.low) & (values <= own.high)
        places = np.flatnonzero(inside)
        if count < limit:
            found.append(places[: limit - count] + rows.start)
        count += len(places)
    return count, np.concatenate(found) if found else np.empty(0, np.int64)


def whole_range(column: IndexedColumn, bins: int) -> Range:
    """Bins from the least to the largest finite value of a column."""
    facts = column.facts
    if facts.low is None or facts.high is None:
        return Range(facts.name, np.nan, np.nan, bins)  # no finite value: every bin is empty
    return Range(facts.name, facts.low, facts.high, bins)


def _tiles(index: Index) -> Iterator[slice]:
    for start in range(0, index.n_designs, _TILE):
        yield slice(start, min(start + _TILE, index.n_designs))
