"""Whether the points of a path are in an order in which a point can pass them, and a better order if there is one.

The order looks wrong where a short tour through the points is both shorter and straighter: a shuffled path jumps to and
fro, while the tour of a narrow loop or of a curve that crosses itself is shorter, but has sharper turns than the path.
"""

import math

import numpy as np
import numpy.typing as npt

from explore.base.errors import KeyPath, Problems
from explore.model.quantities import FloatArray
from explore.model.targets import PathTarget

_IntArray = npt.NDArray[np.int64]
_ComplexArray = npt.NDArray[np.complex128]
#: Smallest number of points whose order can look wrong.
_FEWEST = 5
#: Smallest length of a wrong order, over that of the tour.
_LONGER = 1.2
#: Smallest turn of a wrong order, over that of the tour.
_MORE_TURN = 1.25
#: Smallest mean turn at a point of a wrong order, rad.
_MEAN_TURN = math.radians(60.0)
#: Smallest share of the largest distance by which a change shortens a tour, beyond rounding.
_ROUNDING = 1e-12


def remark_on_order(target: PathTarget, key: KeyPath) -> Problems:
    """That the order of the points looks wrong, with a better one, at a key; none where it does not look wrong."""
    points = np.array([complex(*place) for place in target.points])
    if len(points) < _FEWEST or target.crank_angles:
        return []
    order = _short_tour(points, is_closed=target.closed)
    given, tour = (_measure(points[each], is_closed=target.closed) for each in (np.arange(len(points)), order))
    if given[0] <= _LONGER * tour[0] or given[1] <= max(_MORE_TURN * tour[1], _MEAN_TURN * len(points)):
        return []
    numbers = ", ".join(map(str, order + 1))
    lengths = f"in it the way is {given[0]:.4g} mm long, but {tour[0]:.4g} mm in the order"
    return [(key, f"the order of the points looks wrong: {lengths} {numbers}, in which to write them if you mean it")]


def _measure(points: _ComplexArray, *, is_closed: bool) -> tuple[float, float]:
    """Length of the polygon through the points, and the sum of its turns, rad."""
    steps = np.diff(np.append(points, points[:1]) if is_closed else points)
    steps = steps[steps != 0.0]
    turns = np.angle(np.append(steps[1:], steps[:1] if is_closed else []) / (steps if is_closed else steps[:-1]))
    return float(np.abs(steps).sum()), float(np.abs(turns).sum())


def _short_tour(points: _ComplexArray, *, is_closed: bool) -> _IntArray:
    """A short order of the points from the first one: the best of nearest neighbours, improved by 2-opt moves.

    An open path may begin anywhere: a point that is at distance 0 from all stands between its end and its beginning.
    """
    distances = np.abs(points[:, None] - points[None, :])
    if not is_closed:
        distances = np.pad(distances, (0, 1))
    order = _two_opt(_nearest_neighbours(distances), distances)
    if is_closed:
        first = int(np.flatnonzero(order == 0)[0])
        order = np.roll(order, -first)
        return order if order[1] <= order[-1] else np.append(order[:1], order[:0:-1])
    gap = int(np.flatnonzero(order == len(points))[0])
    order = np.roll(order, -gap)[1:]
    return order if order[0] <= order[-1] else order[::-1]


def _nearest_neighbours(distances: FloatArray) -> _IntArray:
    """The tour that goes on to the nearest point that is left, from the last one, which may be the gap."""
    left = np.ones(len(distances), dtype=bool)
    order = [len(distances) - 1]
    left[order[0]] = False
    while left.any():
        order.append(int(np.where(left, distances[order[-1]], np.inf).argmin()))
        left[order[-1]] = False
    return np.array(order)


def _two_opt(order: _IntArray, distances: FloatArray) -> _IntArray:
    """The tour after parts of it are reversed as long as that shortens it."""
    n, least = len(order), -_ROUNDING * distances.max()
    is_shorter = True
    while is_shorter:
        is_shorter = False
        for i in range(n - 2):
            after = np.roll(order, -1)
            j = np.arange(i + 2, n - (i == 0))
            change = (
                distances[order[i], order[j]] + distances[after[i], after[j]]
                - distances[order[i], after[i]] - distances[order[j], after[j]]
            )  # fmt: skip
            if len(j) and change.min() < least:
                best = int(j[change.argmin()])
                order = np.concatenate([order[: i + 1], order[best:i:-1], order[best + 1 :]])
                is_shorter = True
    return order
