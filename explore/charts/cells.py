"""Designs sorted into the cells of two parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.vocabulary import FloatArray, Sense

#: Different values up to which a parameter counts as swept in steps, each with a column of cells of its own.
_STEPS = 200
#: Cells along an axis where values are drawn, at most, and how many designs one is to hold on average.
_MOST, _EACH = 90, 6


@dataclass(frozen=True)
class Axis:
    """The cells along one parameter: their edges, shape (k + 1,), and the cell of each design, shape (n,)."""

    edges: FloatArray
    cell: npt.NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.edges) - 1


def axis_of(values: FloatArray) -> Axis:
    """Cells about the values of a swept parameter, or even ones where values are drawn; values shall differ."""
    steps, cell = np.unique(values, return_inverse=True)
    if len(steps) <= _STEPS and (len(steps) < len(values) or len(values) < _EACH):
        middle = (steps[1:] + steps[:-1]) / 2.0
        edges = np.concatenate([[1.5 * steps[0] - 0.5 * steps[1]], middle, [1.5 * steps[-1] - 0.5 * steps[-2]]])
        return Axis(edges, cell.astype(np.int64))
    count = int(np.clip(np.sqrt(len(values) / _EACH), 2, _MOST))
    edges = np.linspace(steps[0], steps[-1], count + 1)
    return Axis(edges, np.clip(np.searchsorted(edges, values, side="right") - 1, 0, count - 1))


def gather(x: Axis, y: Axis, values: FloatArray, chosen: npt.NDArray[np.bool_], sense: Sense | None) -> FloatArray:
    """The best value of the chosen designs in each cell, or without a sense their mean; shape (y, x), NaN where none.

    Parameters
    ----------
    values, chosen : (n,) arrays
    """
    where = y.cell[chosen] * x.count + x.cell[chosen]
    size = x.count * y.count
    if sense is None:
        counts = np.bincount(where, minlength=size)
        sums = np.bincount(where, values[chosen], minlength=size)
        gathered: FloatArray = np.divide(sums, counts, out=np.full(size, np.nan), where=counts > 0)
    else:
        gathered = np.full(size, np.nan)
        (np.fmin if sense == "min" else np.fmax).at(gathered, where, values[chosen])
    return gathered.reshape(y.count, x.count)


def tally(x: Axis, y: Axis, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Number of chosen designs in each cell, shape (y, x)."""
    where = y.cell[chosen] * x.count + x.cell[chosen]
    return np.bincount(where, minlength=x.count * y.count).reshape(y.count, x.count)


def rectangles(x: Axis, y: Axis, mask: npt.NDArray[np.bool_]) -> FloatArray:
    """Corners of the cells of a mask, neighbours of a row joined, shape (k, 4, 2)."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=1)
    row, first = np.nonzero(change == 1)
    _, last = np.nonzero(change == -1)
    left, right, low, high = x.edges[first], x.edges[last], y.edges[row], y.edges[row + 1]
    return np.stack([np.column_stack(pair) for pair in ((left, low), (right, low), (right, high), (left, high))], 1)
