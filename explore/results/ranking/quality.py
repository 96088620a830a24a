"""Measures that distinguish the designs of a front: knee, crowding distance and share of the hypervolume.

Designs that are equal in all objectives are one point and have equal measures. Each objective is scaled so that its
best value on the front is 0 and its worst 1; no measure depends on units. Functions take the points of one front,
scaled, (n, m), all different and in lexicographic order, and return n values.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.model.request import Objective
from explore.results.ranking.pareto import objectives_to_minimise

if TYPE_CHECKING:
    import pandas as pd

#: Distance of the hypervolume's reference point beyond the worst values of the front, as a fraction of their range.
REFERENCE_OFFSET = 0.1
#: Largest numbers of points for the shares in four, five and more objectives, which take a second for so many.
MAX_POINTS = (1000, 300, 100)
#: Largest distance from the plane that is a rounding error of the sum of scaled objectives.
_PLANE_TOLERANCE = 1e-12


def add_quality_columns(frame: pd.DataFrame, objectives: Sequence[Objective]) -> pd.DataFrame:
    """Add three columns to designs that are ranked by objectives, with the column ``front``.

    ``knee`` (bool), see `is_knee`; ``crowding``, see `crowding_distances`, each front by itself; and
    ``hypervolume_share``, see `hypervolume_shares`. Designs behind the first front have no knee and the share 0.
    """
    front_number = frame["front"].to_numpy()
    values = objectives_to_minimise({o.metric: frame[o.metric].to_numpy() for o in objectives}, objectives)
    knees, crowding, shares = np.zeros(len(frame), dtype=np.bool_), np.zeros(len(frame)), np.zeros(len(frame))
    for front in np.unique(front_number):
        rows = front_number == front
        unique, point_of_row = np.unique(values[rows], axis=0, return_inverse=True)
        points = scale_to_unit_range(unique)
        crowding[rows] = crowding_distances(points)[point_of_row]
        if front == 1:
            knees[rows] = is_knee(points)[point_of_row]
            shares[rows] = hypervolume_shares(points)[point_of_row]
    return frame.assign(knee=knees, crowding=crowding, hypervolume_share=shares)


def scale_to_unit_range(values: FloatArray) -> FloatArray:
    """Scale each column from 0, its best value, to 1, its worst; 0 where all values are equal."""
    # The difference of two large doubles can overflow.
    values = values * np.where(np.abs(values).max(axis=0) > 1e300, 0.5, 1.0)
    low, high = values.min(axis=0), values.max(axis=0)
    return np.asarray((values - low) / np.where(high > low, high - low, 1.0))


def is_knee(points: FloatArray) -> npt.NDArray[np.bool_]:
    """Mask of the knee: the point farthest from the plane through the extremes, towards the best values.

    The plane weighs all scaled objectives alike and passes through the centre of the extremes, the points that are
    best in one objective. In two objectives it is the line through the ends of the front and the knee is that of
    I. Das, On characterizing the "knee" of the Pareto curve based on normal-boundary intersection, Structural
    Optimization 18 (1999) 107-115; in any number of objectives the knee has the smallest sum of scaled objectives:
    W.-Y. Chiu, G. G. Yen, T.-K. Juan, Minimum Manhattan distance approach to multiple criteria decision making in
    multiobjective optimization problems, IEEE Trans. Evol. Comput. 20 (2016) 972-985. Several points may be at equal
    distance; a front with no point beyond the plane has no knee.
    """
    # The distance from the plane is the difference of the sums divided by the length of (1, …, 1).
    sums = points.sum(axis=1)
    plane = np.mean([sums[column == 0.0].min() for column in points.T])
    return np.asarray((sums <= sums.min() + _PLANE_TOLERANCE) & (sums < plane - _PLANE_TOLERANCE))


def crowding_distances(points: FloatArray) -> FloatArray:
    """Crowding distance of NSGA-II: the sum over the objectives of the gap between a point's two neighbours.

    Infinite at the ends of each objective. Points that are equal in one objective are sorted by the others. From
    K. Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evol. Comput. 6 (2002)
    182-197, section III-B.
    """
    distance = np.full(len(points), np.inf if len(points) == 1 else 0.0)
    for values in points.T[points.max(axis=0) > 0.0]:
        order = np.argsort(values, kind="stable")
        distance[order[[0, -1]]] = np.inf
        distance[order[1:-1]] += values[order[2:]] - values[order[:-2]]
    return distance


def hypervolume_shares(points: FloatArray) -> FloatArray:
    """Share of the front's hypervolume that only this point covers, computed exactly.

    The hypervolume lies between the front and the reference point, which is a tenth of each objective's range beyond
    its worst value. The shares do not sum to 1, because part of the hypervolume is covered by several points. They are
    NaN for more than `MAX_POINTS` points in four or more objectives, where the computation is slow.
    """
    import moocore

    count, objectives = points.shape
    if objectives == 1:
        return np.ones(count)  # different and nondominated in one objective: a single point
    if objectives > 3 and count > MAX_POINTS[min(objectives, 6) - 4]:
        return np.full(count, np.nan)
    points, reference = np.ascontiguousarray(points), np.full(objectives, 1.0 + REFERENCE_OFFSET)
    contributions = moocore.hv_contributions(points, ref=reference)
    return np.asarray(contributions / moocore.hypervolume(points, ref=reference), dtype=np.float64)
