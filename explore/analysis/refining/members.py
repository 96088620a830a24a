"""Members: designs with their objectives and margins, the Pareto-optimal ones of which parents are chosen."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from explore.analysis.refining.coordinates import Choices
from explore.model.quantities import FloatArray
from explore.results.ranking.pareto import is_nondominated
from explore.results.ranking.quality import REFERENCE_OFFSET, scale_to_unit_range

Rows = npt.NDArray[np.intp] | npt.NDArray[np.bool_] | slice
#: Number of cells along one objective of the finest grid that thins a front.
_FINEST = 4096


@dataclass(frozen=True)
class Members:
    """Some designs, one in each row.

    Values are objectives, all minimised; margins distances to each constraint, negative where it is broken, (n, k);
    gradients estimates of their derivatives by the positions, (n, k, ranges).
    """

    designs: npt.NDArray[np.int64]
    positions: FloatArray
    choices: Choices
    values: FloatArray
    margins: FloatArray
    gradients: FloatArray

    def __len__(self) -> int:
        return len(self.designs)

    def take(self, rows: Rows) -> Members:
        """Some of the members, by a mask, a slice or by row."""
        return Members(*(getattr(self, field.name)[rows] for field in fields(self)))

    def join(self, others: Members) -> Members:
        """These members followed by others."""
        return Members(*(np.concatenate([getattr(m, field.name) for m in (self, others)]) for field in fields(self)))


def best_of(members: Members) -> Members:
    """The Pareto-optimal members; of several with equal objectives the first."""
    best = members.take(is_nondominated(members.values))
    order = np.lexsort((best.designs, *best.values.T))
    values = best.values[order]
    is_first = np.ones(len(order), dtype=np.bool_)
    is_first[1:] = (values[1:] != values[:-1]).any(axis=1)
    return best.take(np.sort(order[is_first]))


def thinned(members: Members, most: int) -> Members:
    """At most about so many members, evenly over the front: the best of each objective, and one in each cell of a grid.

    The grid divides the ranges of the objectives evenly; in each cell the smallest sum of scaled objectives is kept.
    """
    if len(members) <= most:
        return members
    points = scale_to_unit_range(members.values)
    low, high = 1, _FINEST
    while high - low > 1:
        middle = (low + high) // 2
        numbers = np.sort(_cells(points, middle))  # four times as fast as np.unique
        low, high = (middle, high) if np.count_nonzero(numbers[1:] != numbers[:-1]) < most else (low, middle)
    cells = _cells(points, low)
    order = np.lexsort((points.sum(axis=1), cells))
    is_first = np.ones(len(order), dtype=np.bool_)
    is_first[1:] = cells[order][1:] != cells[order][:-1]
    return members.take(np.union1d(order[is_first], points.argmin(axis=0)))


def _cells(points: FloatArray, count: int) -> npt.NDArray[np.uint64]:
    """Number of each point's cell in a grid of so many cells along each objective."""
    numbers = np.zeros(len(points), dtype=np.uint64)
    for column in points.T:
        # Beyond 64 bits, in six objectives and more, the numbers wrap around: a few cells are taken for one.
        numbers = numbers * np.uint64(count) + np.minimum(column * count, count - 1).astype(np.uint64)
    return numbers


def contributions(members: Members) -> FloatArray:
    """The share that each member alone adds to the hypervolume of the front, shape (n,).

    The reference point is a tenth of each objective's range beyond the worst value. In more than three objectives it is
    the square of the distance to a neighbour, because the hypervolume takes seconds.
    """
    points = scale_to_unit_range(members.values)
    if points.shape[1] > 3:
        from scipy.spatial import cKDTree

        distances, _ = cKDTree(points).query(points, k=[min(points.shape[1] + 2, len(points))])
        return np.asarray(distances)[:, 0] ** 2
    import moocore

    reference = np.full(points.shape[1], 1.0 + REFERENCE_OFFSET)
    return np.asarray(moocore.hv_contributions(np.ascontiguousarray(points), ref=reference), dtype=np.float64)
