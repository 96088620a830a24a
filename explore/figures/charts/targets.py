"""A path that a point of a linkage shall follow, as figures draw it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.errors import RequestError
from explore.figures.charts.style import RED
from explore.figures.simulation import SimulatedDesign, drawing_of
from explore.mechanisms.targets.measures import TargetMeasure
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Number of points from which on their marks shrink.
_MANY = 30


@dataclass(frozen=True)
class DrawnTarget:
    """A target with its point of the linkage: given points, mm, weights, and input angles there, deg."""

    name: str
    point: str
    points: FloatArray
    weights: FloatArray
    angles: FloatArray
    is_closed: bool

    @property
    def corners(self) -> FloatArray:
        """Corners of the line through the points, (m, 2); of a closed target it ends where it begins."""
        return np.vstack([self.points, self.points[:1]]) if self.is_closed else self.points

    def distances_along(self, simulated: SimulatedDesign) -> FloatArray:
        """Distances of the path from the line of the target at the input angles of the motion, mm, (t,)."""
        return distances_to_line(self._places(simulated, None), self.corners)

    def distances_at_points(self, simulated: SimulatedDesign) -> FloatArray:
        """Distances of the given points from where the point of the linkage is at their input angles, mm, (n,)."""
        apart = self._places(simulated, self.angles) - self.points
        return np.asarray(np.hypot(*apart.T))

    def _places(self, simulated: SimulatedDesign, angles: FloatArray | None) -> FloatArray:
        """Where the point is at input angles, deg; by default those of the motion."""
        pose = simulated.pose(None if angles is None else (angles % 360.0).tolist())
        return pose.sum(drawing_of(simulated).points[self.point])


def target_of(simulated: SimulatedDesign) -> DrawnTarget:
    """The target of a design's study, and where its crank is at the points; `RequestError` if there is none."""
    target = simulated.path
    if target is None:
        raise RequestError(
            "the study has no path in [target] to compare with; a mechanism chart draws the paths of its points"
        )
    points = np.array(target.points, dtype=np.float64)
    return DrawnTarget(
        target.point,
        simulated.mechanism.drawn_point(target.point),
        points,
        np.array(target.weights or np.ones(len(points)), dtype=np.float64),
        _crank_angles(simulated),
        target.closed,
    )


def _crank_angles(simulated: SimulatedDesign) -> FloatArray:
    """Input angles at the points of a target, deg, (n,), as its metrics measure them."""
    for formula in simulated.mechanism.formulas:
        measure = formula.function
        # An input that is no parameter tells whether the crank turns, which it does.
        columns = tuple(np.array([simulated.parameters.get(name, 0.0)]) for name in formula.inputs)
        if isinstance(measure, TargetMeasure):
            return np.asarray(np.rad2deg(measure.measures(measure.motion, measure.target, columns)[1][0]))
    raise RequestError(f"a {simulated.mechanism.name} does not say where it passes the points of a target")


def distances_to_line(places: FloatArray, corners: FloatArray) -> FloatArray:
    """Distances of places, (n, 2), from the line through corners, (m, 2), shape (n,)."""
    if len(corners) == 1:
        return np.asarray(np.hypot(*(places - corners[0]).T))
    nearest = np.full(len(places), np.inf)
    for start, stop in pairwise(corners):
        along, away = stop - start, places - start
        square = float(along @ along)
        share = np.clip(away @ along / square, 0.0, 1.0) if square > 0.0 else np.zeros(len(places))
        nearest = np.minimum(nearest, np.hypot(*(away - share[:, None] * along).T))
    return nearest


def draw_target(panel: Axes, points: FloatArray, *, is_closed: bool) -> None:
    """Draw the points of a target, shape (n, 2), joined by a line; of an open one the first is marked."""
    joined = np.vstack([points, points[:1]]) if is_closed else points
    style: dict[str, Any] = {"color": RED, "zorder": 5}
    size = 5.0 if len(points) <= _MANY else 3.0
    panel.plot(*joined.T, lw=0.9, ls="--", alpha=0.7, **style)
    panel.plot(*points.T, ls="", marker="o", ms=size, mew=0, label=f"target, {len(points):,} points", **style)
    if not is_closed:
        panel.plot(
            *points[:1].T, ls="", marker="o", ms=size + 4.0, mfc="none", mew=1.3, label="its first point", **style
        )
