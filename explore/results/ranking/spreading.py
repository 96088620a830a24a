"""Few rows that stand for many: the Pareto set thinned evenly, and what is next to it where that is small."""

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.results.ranking.pareto import is_nondominated
from explore.results.ranking.quality import scale_to_unit_range

Rows = npt.NDArray[np.int64]


def spread_rows(values: FloatArray, count: int, traits: FloatArray | None = None) -> Rows:
    """At most `count` rows of the first front, evenly along it, then of the next ones.

    `values` (n, m) are finite, and all columns minimised. Of later fronts a row is left out that differs in `traits`
    (n, k) from one before by less than 1 in all of them.
    """
    chosen: list[int] = []
    rest = np.arange(len(values))
    while len(rest) and len(chosen) < count:
        is_best = is_nondominated(values[rest])
        front, rest = rest[is_best], rest[~is_best]
        if traits is not None:  # several of a front that are alike and equally good are one
            front = front[np.sort(np.unique(values[front], axis=0, return_index=True)[1])]
        new = front[_evenly(values[front], count - len(chosen))]
        chosen += new.tolist()
        if traits is not None:
            for row in new:
                rest = rest[(np.abs(traits[rest] - traits[row]) >= 1.0).any(axis=1)]
    return np.array(chosen, dtype=np.int64)


def _evenly(values: FloatArray, count: int) -> Rows:
    """Rows of a front: the best of each objective, then again and again the one that is farthest from all before."""
    if len(values) <= count:
        return np.arange(len(values))
    points = scale_to_unit_range(values)
    chosen = list(dict.fromkeys(points.argmin(axis=0).tolist()))[:count]
    distances = np.min([np.abs(points - points[row]).max(axis=1) for row in chosen], axis=0)
    while len(chosen) < count:
        distances[chosen] = -1.0  # equal rows are at distance 0, as a row is from itself
        chosen.append(int(distances.argmax()))
        distances = np.minimum(distances, np.abs(points - points[chosen[-1]]).max(axis=1))
    return np.array(chosen, dtype=np.int64)
