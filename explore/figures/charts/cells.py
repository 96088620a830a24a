"""Designs sorted into the cells of two parameters."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray, Sense

#: Largest number of values of a parameter that is a grid, where each value has its own cells.
_MAX_GRID_VALUES = 200
#: Largest number of cells of a parameter that is no grid.
_MAX_CELLS = 90
#: Intended number of designs in a row of cells of a parameter that is no grid.
_DESIGNS_PER_CELL = 6
#: Least number of cells along an axis, however unevenly the designs are spread.
_FEW_CELLS = 12


@dataclass(frozen=True)
class CellAxis:
    """The cells along one parameter: their ascending edges, and the number of the cell of each design."""

    edges: FloatArray
    cell: npt.NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.edges) - 1


def cell_axes(x: FloatArray, y: FloatArray) -> tuple[CellAxis, CellAxis]:
    """Lay cells along two parameters: one around each value of a grid, else cells so wide that most hold designs."""
    grids = _grid_axis(x), _grid_axis(y)
    count = int(np.clip(np.sqrt(len(x) / _DESIGNS_PER_CELL), 2, _MAX_CELLS))
    while True:
        first, second = (grid or _even_axis(values, count) for grid, values in zip(grids, (x, y), strict=True))
        n_held = len(np.unique(second.cell * first.count + first.cell))
        if 2 * n_held > first.count * second.count or count <= _FEW_CELLS or all(grids):
            return first, second
        count = max(3 * count // 4, _FEW_CELLS)


def _grid_axis(values: FloatArray) -> CellAxis | None:
    """A cell around each value of a grid; None for sampled values."""
    distinct, cell = np.unique(values, return_inverse=True)
    if len(distinct) <= _MAX_GRID_VALUES and (len(distinct) < len(values) or len(values) < _DESIGNS_PER_CELL):
        return CellAxis(edges_around(distinct), cell.astype(np.int64))
    return None


def _even_axis(values: FloatArray, count: int) -> CellAxis:
    """`count` cells of equal width."""
    edges = np.linspace(values.min(), values.max(), count + 1)
    return CellAxis(edges, np.clip(np.searchsorted(edges, values, side="right") - 1, 0, count - 1))


def edges_around(centres: FloatArray) -> FloatArray:
    """Edges of cells halfway between ascending values, shape (k + 1,); the outer cells are symmetric."""
    middle = (centres[1:] + centres[:-1]) / 2.0
    return np.concatenate([[1.5 * centres[0] - 0.5 * centres[1]], middle, [1.5 * centres[-1] - 0.5 * centres[-2]]])


def aggregate_cells(
    x: CellAxis, y: CellAxis, values: FloatArray, selected: npt.NDArray[np.bool_], sense: Sense | None
) -> FloatArray:
    """The best value of the selected designs in each cell; their mean when a value has no better side.

    NaN in cells without a selected design, shape (y.count, x.count).
    """
    flat = y.cell[selected] * x.count + x.cell[selected]
    size = x.count * y.count
    if sense is None:
        counts = np.bincount(flat, minlength=size)
        sums = np.bincount(flat, values[selected], minlength=size)
        aggregated: FloatArray = np.divide(sums, counts, out=np.full(size, np.nan), where=counts > 0)
    else:
        aggregated = np.full(size, np.nan)
        (np.fmin if sense == "min" else np.fmax).at(aggregated, flat, values[selected])
    return aggregated.reshape(y.count, x.count)


def count_designs(x: CellAxis, y: CellAxis, selected: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Number of selected designs in each cell, shape (y.count, x.count)."""
    flat = y.cell[selected] * x.count + x.cell[selected]
    return np.bincount(flat, minlength=x.count * y.count).reshape(y.count, x.count)


def cell_rectangles(x: CellAxis, y: CellAxis, mask: npt.NDArray[np.bool_]) -> FloatArray:
    """Corners of the cells of a mask, neighbours in a row joined, shape (k, 4, 2)."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=1)
    row, first = np.nonzero(change == 1)
    _, last = np.nonzero(change == -1)
    left, right, low, high = x.edges[first], x.edges[last], y.edges[row], y.edges[row + 1]
    return np.stack([np.column_stack(pair) for pair in ((left, low), (right, low), (right, high), (left, high))], 1)
