"""Cells of a column: ranges of values, so that two bytes a design answer most questions about the values."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.results.browsing.kernels import FAILS, MEETS, UNSURE
from explore.results.ranking.conditions import Condition

#: Largest number of distinct values of a column that have a cell each.
MOST_DISTINCT = 4096
#: Number of cells of equal width, a multiple of the usual 64, 120 and 160 bins, so that few edges of bins are in one.
_EQUAL_WIDTHS = 3840
#: Number of cells of equally many designs.
_EQUAL_NUMBERS = 4096


@dataclass(frozen=True)
class Cells:
    """The least and the greatest value of each cell of a column, declared, and its number of designs, (cells,).

    The first cell is that of NaN.
    """

    least: FloatArray
    greatest: FloatArray
    counts: npt.NDArray[np.int64]

    @property
    def are_exact(self) -> bool:
        """Whether all designs of each cell have one value."""
        return bool(np.all((self.least == self.greatest) | (self.counts == 0) | np.isnan(self.least)))

    def outcomes(self, conditions: tuple[Condition, ...]) -> npt.NDArray[np.uint8]:
        """For each cell whether its designs meet all of the conditions on the column, (cells,)."""
        fails = np.zeros(len(self.least), bool)
        unsure = np.zeros(len(self.least), bool)
        for condition in conditions:
            fails_this = ~condition.test(dict.fromkeys(condition.names, self.least))
            holds_number = np.zeros(len(self.least), bool)
            for number in condition.numbers:
                holds_number |= (self.least <= number) & (number <= self.greatest)
            holds_number &= self.least < self.greatest
            fails |= fails_this & ~holds_number
            unsure |= holds_number
        return np.where(fails, FAILS, np.where(unsure, UNSURE, MEETS)).astype(np.uint8)

    def bins(self, edges: FloatArray) -> npt.NDArray[np.uint16]:
        """The bin of each cell, (cells,): the number of bins for those outside, and one more for unsure ones."""
        n_bins = len(edges) - 1
        first, last = (_place(values, edges) for values in (self.least, self.greatest))
        is_sure = (first == last) | (self.counts == 0) | np.isnan(self.least)
        return np.where(is_sure, find_bins(self.least, edges), n_bins + 1).astype(np.uint16)


def cell_edges(low: float | None, high: float | None, distinct: FloatArray | None, sample: FloatArray) -> FloatArray:
    """Edges between the cells of a column, ascending; infinite values have cells of their own."""
    if low is None or high is None:
        return np.array([np.inf])
    if distinct is not None:
        return np.append(distinct, np.inf)
    crowded = np.quantile(sample, np.linspace(0.0, 1.0, _EQUAL_NUMBERS), method="nearest")
    return np.append(np.unique(np.concatenate([make_edges(low, high, _EQUAL_WIDTHS), crowded])), np.inf)


def make_edges(low: float, high: float, bins: int) -> FloatArray:
    """Edges of bins of equal width, (bins + 1,), those of NumPy's histograms, also over the whole range of floats."""
    if np.isfinite(high - low):
        return np.linspace(low, high, bins + 1)
    return 2.0 * np.linspace(low / 2.0, high / 2.0, bins + 1)


def find_bins(values: FloatArray, edges: FloatArray) -> npt.NDArray[np.int64]:
    """Number of the bin of each value, (n,), or the number of bins outside; a bin has its lower edge, the last both.

    Where all edges are equal, the first bin has them.
    """
    n_bins = len(edges) - 1
    places = _place(values, edges)
    return np.where((places < 0) | np.isnan(values), n_bins, places)


def _place(values: FloatArray, edges: FloatArray) -> npt.NDArray[np.int64]:
    """The bin of each value, -1 below the first edge and the number of bins above the last one."""
    low, high, n_bins = edges[0], edges[-1], len(edges) - 1
    if np.isnan(low):  # there are no finite values
        return np.full(len(values), -1)
    found = np.minimum(np.searchsorted(edges, values, side="right") - 1, n_bins - 1)
    inside = np.zeros_like(found) if low == high else found
    return np.where(values < low, -1, np.where(values > high, n_bins, inside))
