"""Four-bars that carry a body through more than five poses, nearly: least squares of the achieved pose errors.

Poses are points with directions of the body, so that the search is that of paths, within all its bounds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.synthesis.poses import Poses

if TYPE_CHECKING:
    from explore.synthesis.paths.search import PathSolution

#: Least number of poses.
_FEWEST = 5
#: Number of starts of the search.
_N_STARTS = 2048
#: Shortest link over the size of the poses' points.
_SHORTEST = 1e-3


@dataclass(frozen=True)
class PoseBounds:
    """Bounds on four-bars for poses.

    The transmission angle or its supplement over the turn, rad; the longest link over the size of the poses' points,
    and over the shortest; ranges of x and y of the pivots, missing ones open; whether the crank takes the body through
    the poses in their order.
    """

    transmission_angle_min: float = float(np.radians(5.0))
    size_ratio_max: float = 100.0
    link_ratio_max: float = np.inf
    crank_pivot: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rocker_pivot: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    is_ordered: bool = True


def lever_of(poses: Poses) -> float:
    """The length at whose end the body's angle counts as a distance: half the size of the poses' points."""
    return float(np.abs(poses.points - poses.points.mean()).max()) or 1.0


def fit_poses(poses: Poses, bounds: PoseBounds | None = None, count: int = 20) -> list[PathSolution]:
    """Four-bars whose crank turns, of least errors within bounds, each a local optimum, best first.

    The sum of the squares of the distances of the points and of the body's angles times `lever_of` is least. Raises
    `RequestError` for fewer than five poses.
    """
    from explore.synthesis.paths.search import PathTask, find_paths, numbers_of_boxes

    if len(poses.points) < _FEWEST:
        raise RequestError(f"least squares need five poses or more, not {len(poses.points)}")
    within = bounds or PoseBounds()
    held, other = numbers_of_boxes(within.crank_pivot, within.rocker_pivot)
    task = PathTask(
        poses.points,
        is_closed=False,
        transmission_angle_min=within.transmission_angle_min,
        link_ratio_max=within.size_ratio_max,
        link_ratio_min=_SHORTEST,
        held=held,
        other_pivot=other,
        longest_to_shortest=within.link_ratio_max,
        angles=poses.angles,
        lever=lever_of(poses),
        is_ordered=within.is_ordered,
    )
    return find_paths(task, count, n_starts=_N_STARTS)
