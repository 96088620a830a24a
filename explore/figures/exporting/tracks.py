"""The way of a point over the motion: a circle, an arc or a straight line, a spline elsewhere."""

from collections.abc import Callable

import numpy as np

from explore.figures.charts.turn import Span
from explore.figures.exporting.shapes import Arc, Circle, Polyline, Spline, arc_points
from explore.figures.exporting.splines import fit_curve
from explore.figures.simulation import SimulatedDesign
from explore.model.drawing import Drawing, Path, Vector
from explore.model.quantities import FloatArray

#: Number of rounds that look for an extreme of a coordinate, each in a finer grid about the one before.
_ROUNDS = 4
#: Factor by which each grid is finer: the error is the square of the last step, 0.5 deg / 32^4.
_REFINEMENT = 32
#: Arc from which on it is a circle, far above the rounding errors of a full turn, deg.
_FULL = 360.0 - 1e-9
#: Change of a distance from a pivot, as a share of it, up to which rounding explains it.
_ROUNDING = 1e-9


def track_of(simulated: SimulatedDesign, drawing: Drawing, path: Path) -> Circle | Arc | Polyline | Spline | None:
    """The way of a point over the motion, as the drawing declares the point; None for a point that rests.

    A line of two points has the smaller coordinate first.
    """
    vectors = drawing.points[path.point]
    turning = [vector for vector in vectors if isinstance(vector.angle, str)]
    changing = [vector for vector in vectors if isinstance(vector.length, str) and vector.length not in
                simulated.parameters]  # fmt: skip
    if not turning and not changing:
        return None
    if len(turning) == 1 and not changing:
        return _arc(simulated, vectors, turning[0])
    if not turning and len({vector.direction % 180.0 for vector in changing}) == 1:
        return _line(simulated, vectors, changing[0].direction)
    # The vectors of a linkage's joint are its coordinates.
    if guide := next((guide for guide in drawing.guides if guide.point == path.point), None):
        return _line(simulated, vectors, guide.angle)
    if path.role == "joint" and (arc := _about_a_pivot(simulated, drawing, vectors)):
        return arc
    return curve_of(simulated, vectors, "paths", path.long_name)


def curve_of(simulated: SimulatedDesign, vectors: tuple[Vector, ...], layer: str, name: str) -> Spline:
    """The sum of vectors over the motion."""

    def curve(angles: FloatArray) -> FloatArray:
        return simulated.pose(angles.tolist()).sum(vectors)

    breaks = [simulated.marks[name] for name in simulated.mechanism.breaks if name in simulated.marks]
    return fit_curve(curve, simulated.span, breaks, layer, name)


def _arc(simulated: SimulatedDesign, vectors: tuple[Vector, ...], turning: Vector) -> Circle | Arc:
    """The way of a point that is at a constant distance from a place at rest."""
    others = tuple(vector for vector in vectors if vector is not turning)
    centre = simulated.pose([simulated.span.first]).sum(others)[0]
    number = turning.length
    length = turning.factor * (simulated.parameters[number] if isinstance(number, str) else number)
    opposite = 180.0 if length < 0.0 else 0.0

    def direction(angles: FloatArray) -> FloatArray:
        return turning.sense * simulated.pose(angles.tolist()).angle(turning.angle) + turning.turn + opposite

    return _round(simulated, centre, abs(length), direction)


def _about_a_pivot(simulated: SimulatedDesign, drawing: Drawing, vectors: tuple[Vector, ...]) -> Circle | Arc | None:
    """The way of a point at a constant distance from a pivot; None for another."""
    turn = simulated.pose()
    for centre in (turn.sum(drawing.points[pivot])[0] for pivot in drawing.pivots):
        radii = np.hypot(*(turn.sum(vectors) - centre).T)
        if np.ptp(radii) <= _ROUNDING * radii[0]:

            def direction(angles: FloatArray, centre: FloatArray = centre) -> FloatArray:
                x, y = (simulated.pose(angles.tolist()).sum(vectors) - centre).T
                return np.asarray(np.rad2deg(np.arctan2(y, x)))

            return _round(simulated, centre, float(radii[0]), direction)
    return None


def _round(
    simulated: SimulatedDesign, centre: FloatArray, radius: float, direction: Callable[[FloatArray], FloatArray]
) -> Circle | Arc:
    """A circle, or as much of one as a direction from its centre, deg, goes over."""
    low, high = extremes(direction, simulated.span, period=360.0)
    return Circle("paths", centre, radius) if high - low > _FULL else Arc("paths", centre, radius, low, high)


def _line(simulated: SimulatedDesign, vectors: tuple[Vector, ...], direction: float) -> Polyline:
    """The way of a point to and fro along a line."""
    along = arc_points(np.zeros(2), 1.0, np.array([direction]))[0]
    origin = simulated.pose([simulated.span.first]).sum(vectors)[0]

    def place(angles: FloatArray) -> FloatArray:
        return np.asarray((simulated.pose(angles.tolist()).sum(vectors) - origin) @ along)

    return Polyline("paths", np.array([origin + value * along for value in extremes(place, simulated.span)]))


def extremes(
    values: Callable[[FloatArray], FloatArray], span: Span, period: float | None = None
) -> tuple[float, float]:
    """Smallest and largest value of a function of the input angle, deg, over the angles of a motion.

    The period is that of angles, which then go on past it.
    """
    grid = span.evenly(721)
    start = values(grid)
    start = start if period is None else np.unwrap(start, period=period)
    found = []
    for sign in (-1.0, 1.0):
        best = int(np.argmax(sign * start))
        centre, value, step = grid[best], start[best], grid[1] - grid[0]
        for _ in range(_ROUNDS):
            near = np.linspace(centre - step, centre + step, 2 * _REFINEMENT + 1)
            if not span.is_turn:
                near = np.clip(near, *span.ends)
            at = values(near)
            if period is not None:
                at = at + period * np.round((value - at) / period)
            best = int(np.argmax(sign * at))
            centre, value, step = near[best], at[best], step / _REFINEMENT
        found.append(float(value))
    return found[0], found[1]
