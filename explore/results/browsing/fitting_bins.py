"""Bins that fit the values of a column: each holds equally many values of a grid, so that counts tell of designs alone.

Bins of any other width hold now one value more and now one less, and a histogram of a grid becomes a comb.
"""

from dataclasses import dataclass

import numpy as np

from explore.model.quantities import FloatArray
from explore.results.browsing.cells import find_bins
from explore.results.browsing.counting import Range, whole_range
from explore.results.browsing.index_files import IndexedColumn

#: Smallest number of bins near the usual one, over it.
_LEAST = 0.75
#: Largest number of bins near the usual one, over it.
_LARGEST = 2.0
#: Largest deviation of a step of a grid from its mean, over the mean: a list of values that a person wrote is rounded.
_UNEVEN = 1e-3


@dataclass(frozen=True)
class FittingBins:
    """Bins that fit a column: on a grid from half a step below the least value to half a step above the largest.

    `values_per_bin` is the number of distinct values that each bin holds; None where they are no grid, or where some
    bins hold one more than others, of 16 or more.
    """

    range: Range
    values_per_bin: int | None


def fitting_bins(column: IndexedColumn, usual_number: int = 64, most_single: int = 1024) -> FittingBins:
    """Bins from the least to the largest finite value, or as many as the column has values on a grid.

    `usual_number` of bins where it is free to choose, on a grid from three quarters to twice of it. Where no such
    number divides the values of a grid, up to `most_single` of them have a bin each.
    """
    if column.facts.distinct == 1:
        return FittingBins(whole_range(column, 1), 1)
    usual = FittingBins(whole_range(column, usual_number), None)
    values = _grid(column)
    if values is None:
        return usual
    bins = _number_of_bins(len(values), usual_number, most_single)
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


def _number_of_bins(n_values: int, usual: int, most_single: int) -> int:
    """How many bins so many values of a grid fall into, in equal parts or in many to a bin."""
    largest = int(_LARGEST * usual)
    if n_values <= largest:
        return n_values
    divisors = [bins for bins in range(int(_LEAST * usual), largest + 1) if n_values % bins == 0]
    if divisors:
        return min(divisors, key=lambda bins: abs(bins - usual))
    return n_values if n_values <= most_single else usual
