"""What tells the designs of a front apart: the knee, how alone a design is, and what the front owes to it.

Designs that are equal in all objectives count as one point, and share its figures. All objectives are scaled so that
the best value on the front is 0 and the worst 1; none of the figures depends on units.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.ranking.pareto import signed
from explore.vocabulary import FloatArray, Objective

if TYPE_CHECKING:
    import pandas as pd

#: The reference point of the hypervolume lies beyond the worst values of the front by this share of their range.
BEYOND = 0.1
#: Points for which the shares in four, five and more objectives take no more than a second; fewer cost next to nothing.
MOST_POINTS = (1000, 300, 100)
#: How far from the plane counts as off it: above the rounding errors of a sum of scaled objectives.
_FLAT = 1e-12


def with_quality(frame: pd.DataFrame, objectives: Sequence[Objective]) -> pd.DataFrame:
    """Ranked designs with three more columns.

    Parameters
    ----------
    frame
        With the objectives and the column ``front``.
    objectives
        Of the ranking.

    Returns
    -------
    DataFrame
        With ``knee`` (bool), see `knee`; ``crowding``, see `crowding`, each front by itself; and
        ``hypervolume_share``, see `hypervolume_shares`. What lies behind the first front has no knee and adds nothing
        to its hypervolume.
    """
    number = frame["front"].to_numpy()
    values = signed({o.metric: frame[o.metric].to_numpy() for o in objectives}, objectives)
    knees, alone, shares = np.zeros(len(frame), dtype=np.bool_), np.zeros(len(frame)), np.zeros(len(frame))
    for front in np.unique(number):
        rows = number == front
        unique, places = np.unique(values[rows], axis=0, return_inverse=True)
        points = scaled(unique)
        alone[rows] = crowding(points)[places]
        if front == 1:
            knees[rows] = knee(points)[places]
            shares[rows] = hypervolume_shares(points)[places]
    return frame.assign(knee=knees, crowding=alone, hypervolume_share=shares)


def scaled(values: FloatArray) -> FloatArray:
    """Each column from 0, its best, to 1, its worst; 0 where all are equal."""
    # The range of two huge doubles may be too large for one.
    values = values * np.where(np.abs(values).max(axis=0) > 1e300, 0.5, 1.0)
    low, high = values.min(axis=0), values.max(axis=0)
    return np.asarray((values - low) / np.where(high > low, high - low, 1.0))


def knee(points: FloatArray) -> npt.NDArray[np.bool_]:
    """Which points are the knee: the farthest from the plane through the extremes, towards the best values.

    The plane weighs all scaled objectives alike and passes through the centre of the extremes, the points that are
    best in one objective. With two objectives it is the line through the ends of the front, and the knee is that of
    Das [1]_; with any number it is the point with the smallest sum of scaled objectives [2]_. A front that nowhere
    bulges beyond the plane has no knee.

    Parameters
    ----------
    points
        Of one front, scaled, shape (n, m), all different.

    Returns
    -------
    (n,) array
        True for one point, or for several that are equally far.

    References
    ----------
    .. [1] I. Das, On characterizing the "knee" of the Pareto curve based on normal-boundary intersection, Structural
       Optimization 18 (1999) 107-115.
    .. [2] W.-Y. Chiu, G. G. Yen, T.-K. Juan, Minimum Manhattan distance approach to multiple criteria decision making
       in multiobjective optimization problems, IEEE Trans. Evol. Comput. 20 (2016) 972-985.
    """
    # The distance is that of the sums but for a factor, the length of (1, …, 1).
    sums = points.sum(axis=1)
    plane = np.mean([sums[column == 0.0].min() for column in points.T])
    return np.asarray((sums <= sums.min() + _FLAT) & (sums < plane - _FLAT))


def crowding(points: FloatArray) -> FloatArray:
    """Crowding distance of NSGA-II: the sum over the objectives of the gap between a point's two neighbours.

    Infinite at the ends of each objective. Points that are equal in one objective stand in the order of the others.

    Parameters
    ----------
    points
        Of one front, scaled, shape (n, m), all different and in lexicographic order.

    Returns
    -------
    (n,) array

    References
    ----------
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
    """The share of the front's hypervolume that is lost without each point, computed exactly.

    The hypervolume is that between the front and the reference point, which lies beyond the worst value of each
    objective by a tenth of its range. The shares do not sum to 1: what several points cover is lost with none of them.

    Parameters
    ----------
    points
        Of one front, scaled, shape (n, m), all different.

    Returns
    -------
    (n,) array
        NaN for more than `MOST_POINTS` points in four or more objectives, which would take long.
    """
    import moocore

    count, objectives = points.shape
    if objectives == 1:
        return np.ones(count)  # all different and none beaten: one point
    if objectives > 3 and count > MOST_POINTS[min(objectives, 6) - 4]:
        return np.full(count, np.nan)
    points, reference = np.ascontiguousarray(points), np.full(objectives, 1.0 + BEYOND)
    lost = moocore.hv_contributions(points, ref=reference)
    return np.asarray(lost / moocore.hypervolume(points, ref=reference), dtype=np.float64)
