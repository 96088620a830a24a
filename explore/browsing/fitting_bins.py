"""Bins that fit the values of a column: each holds equally many values of a grid, so that counts tell of designs alone.

Bins of any other width hold now one value more and now one less, and a histogram of a grid becomes a comb.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explore.browsing.cells import find_bins
from explore.browsing.counting import Range, whole_range
from explore.browsing.index_files import IndexedColumn
from explore.model.quantities import FloatArray

#: Bins where a number is free to choose, and the least and the largest number near it.
_USUAL, _LEAST, _LARGEST = 64, 48, 128
#: Values of a grid up to which each has a bin of its own where no number of bins near the usual one divides theirs.
_MOST_SINGLE = 1024
#: Largest deviation of a step of a grid from its mean, over the mean: a list of values that a person wrote is rounded.
_UNEVEN = 1e-3


@dataclass(frozen=True)
class FittingBins:
    """Bins that fit a column.

    Attributes
    ----------
    range
        The bins. On a grid they begin half a step below the least value, and end half a step above the largest one.
    values_per_bin
        Number of distinct values that each bin holds; None where they are no grid, or where some bins hold one more
        than others, of 16 or more.
    """

    range: Range
    values_per_bin: int | None


def fitting_bins(column: IndexedColumn) -> FittingBins:
    """Bins from the least to the largest finite value, about 64, or as many as the column has values on a grid."""
    if column.facts.distinct == 1:
        return FittingBins(whole_range(column, 1), 1)
    usual = FittingBins(whole_range(column, _USUAL), None)
    values = _grid(column)
    if values is None:
        return usual
    bins = _number_of_bins(len(values))
    half_step = (values[-1] - values[0]) / (len(values) - 1) / 2.0
    fitting = Range(column.facts.name, float(values[0] - half_step), float(values[-1] + half_step), bins)
    held = np.bincount(find_bins(values, fitting.edges), minlength=bins + 1)[:-1]
    each, rest = divmod(len(values), bins)
    if not rest and np.any(held != each):  # values so near each other that floats cannot part them
        return usual
    return FittingBins(fitting, None if rest else each)


def _grid(column: IndexedColumn) -> FloatArray | None:
    """The distinct finite values, two or more, ascending, if their steps are equal."""
    if not column.facts.distinct:  # unknown or none
        return None
    cells = column.cells
    values = cells.least[(cells.counts > 0) & np.isfinite(cells.least)]
    with np.errstate(over="ignore", invalid="ignore"):  # values of both ends of the floats
        steps = np.diff(values)
        mean = (values[-1] - values[0]) / len(steps)
        is_even = bool(np.all(np.abs(steps - mean) <= _UNEVEN * mean)) and bool(np.isfinite(mean))
    return values if is_even else None


def _number_of_bins(n_values: int) -> int:
    """How many bins so many values of a grid fall into, in equal parts or in many to a bin."""
    if n_values <= _LARGEST:
        return n_values
    divisors = [bins for bins in range(_LEAST, _LARGEST + 1) if n_values % bins == 0]
    if divisors:
        return min(divisors, key=lambda bins: abs(bins - _USUAL))
    return n_values if n_values <= _MOST_SINGLE else _USUAL
