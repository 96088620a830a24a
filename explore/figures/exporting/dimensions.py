"""The dimensions of a drawing: lengths of links, distances of pivots and guides, and how far the output goes."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from explore.figures.exporting.shapes import Angle, Arc, Distance, Polyline
from explore.figures.exporting.symbols import PIVOT, directions
from explore.figures.exporting.texts import overlap, text_box, upright
from explore.figures.exporting.tracks import track_of
from explore.figures.simulation import SimulatedDesign
from explore.model.drawing import Drawing, Guide, Pose, Vector
from explore.model.quantities import FloatArray

#: Distance of a dimension line from what it measures, in heights of text.
_OFFSET = 2.5
#: Distance by which a dimension goes farther out while its text meets another one, in heights of text.
_STEP = 1.0
#: Largest number of such steps.
_STEPS = 50
#: Distance by which a dimension goes farther out whose text is wider than its line, in heights of text.
_ASIDE = 2.0
#: Change of a length, as a share of the largest length, up to which it is constant, or no length at all.
_ROUNDING = 1e-9


def dimensions(
    simulated: SimulatedDesign, drawing: Drawing, points: Mapping[str, FloatArray], height: float
) -> Iterator[Distance | Angle]:
    """The dimensions of a design whose points are at these places."""
    pose = simulated.pose()
    turn = pose.points(drawing)
    smallest = _ROUNDING * float(np.ptp(np.vstack(list(turn.values())), axis=0).max())
    lengths = (
        *_links(drawing, points, turn, height, smallest),
        *_pivots(simulated, drawing, points, height),
        *_offsets(drawing, points, turn, height, smallest),
    )
    shapes = (
        *(_named(shape, pose, smallest) for shape in lengths),
        *_ways(simulated, drawing, turn, height),
    )
    boxes: list[FloatArray] = []
    for shape in shapes:
        placed, box = _clear_of(boxes, shape, height)
        boxes.append(box)
        yield placed


def _clear_of(
    boxes: Iterable[FloatArray], shape: Distance | Angle, height: float
) -> tuple[Distance | Angle, FloatArray]:
    """A dimension farther out, until its text is clear of those before, and the box of its text."""
    if isinstance(shape, Distance):
        shape = upright(shape)
        if shape.offset < 0.0 and not shape.has_room(height):  # its text, above the line, reaches over what it measures
            shape = replace(shape, offset=shape.offset - _ASIDE * height)
    for step in range(_STEPS):
        farther = step * _STEP * height
        placed = (
            replace(shape, offset=shape.offset + np.copysign(farther, shape.offset))
            if isinstance(shape, Distance)
            else replace(shape, radius=shape.radius + farther)
        )
        box = text_box(placed, height)
        if not any(overlap(box, other) for other in boxes):
            break
    return placed, box


def _links(
    drawing: Drawing,
    points: Mapping[str, FloatArray],
    turn: Mapping[str, FloatArray],
    height: float,
    smallest: float,
) -> Iterator[Distance]:
    """The lengths of links, and the sides of those with more than two points, where they are constant."""
    everything = np.mean([points[name] for link in drawing.links for name in link.points] or [np.zeros(2)], axis=0)
    for link in drawing.links:
        is_bar = len(link.points) == 2
        centre = everything if is_bar else np.mean([points[name] for name in link.points], axis=0)
        for first, second in pairwise(link.points):
            lengths = np.hypot(*(turn[second] - turn[first]).T)
            if np.ptp(lengths) <= smallest < lengths[0]:
                # Sides are farther out than bars, beside which they may lie.
                offset = _away(points[first], points[second], centre) * (1.0 if is_bar else 2.0) * _OFFSET * height
                yield Distance("dimensions", points[first], points[second], offset, link.name if is_bar else "")


def _pivots(
    simulated: SimulatedDesign, drawing: Drawing, points: Mapping[str, FloatArray], height: float
) -> Iterator[Distance]:
    """The distances of pivots, below all that moves, or beside it."""
    for first, second in pairwise(sorted(drawing.pivots, key=lambda name: points[name].tolist())):
        along = (points[second] - points[first]) / np.hypot(*(points[second] - points[first]))
        downwards = np.array([along[1], -along[0]])
        lowest = _farthest_along(simulated, drawing, downwards)
        below = max(lowest - points[first] @ downwards, 1.4 * PIVOT * height) + _OFFSET * height
        vectors = [drawing.points[first], drawing.points[second]]
        name = _name(tuple(vector for own, other in (vectors, vectors[::-1]) for vector in own if vector not in other))
        yield Distance("dimensions", points[first], points[second], -below, name)


def reach(simulated: SimulatedDesign, drawing: Drawing) -> FloatArray:
    """Smallest and largest coordinates of all points and bodies over a turn, shape (2, 2)."""
    left, right, bottom, top = (
        _farthest_along(simulated, drawing, np.array(way)) for way in ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0))
    )
    return np.array([[-left, -bottom], [right, top]])


def _farthest_along(simulated: SimulatedDesign, drawing: Drawing, direction: FloatArray) -> float:
    """How far all points and bodies go in a direction over a turn, from the origin."""
    turn = simulated.pose()
    reached = [np.max(points @ direction) for points in turn.points(drawing).values()]
    for profile in drawing.profiles:  # bodies turn, so each reaches as far to all sides
        radius = np.hypot(*turn.sum(profile.vectors).T).max()
        reached.append(np.max(turn.sum(drawing.points[profile.centre]) @ direction) + radius)
    return float(max(reached))


def _away(first: FloatArray, second: FloatArray, centre: FloatArray) -> float:
    """The side of a link, 1 for the left, that is away from the centre."""
    along = second - first
    across = np.array([-along[1], along[0]])
    return 1.0 if (0.5 * (first + second) - centre) @ across >= 0.0 else -1.0


def _name(vectors: tuple[Vector, ...]) -> str:
    """The length that a place is given by; empty if there are several."""
    names = [vector.length for vector in vectors if isinstance(vector.length, str)]
    return names[0] if len(names) == 1 else ""


def _named(shape: Distance, pose: Pose, smallest: float) -> Distance:
    """A distance with its name in words, or without it where a length of that name is another one."""
    length = float(np.ravel(pose.lengths.get(shape.name, shape.value))[0])
    return replace(shape, name=shape.name.replace("_", " ") if abs(abs(length) - shape.value) <= smallest else "")


def _offsets(
    drawing: Drawing,
    points: Mapping[str, FloatArray],
    turn: Mapping[str, FloatArray],
    height: float,
    smallest: float,
) -> Iterator[Distance]:
    """The distance of each guide from the first pivot, beside all that moves."""
    for guide in drawing.guides:
        along, _ = directions(guide.angle)
        for name in drawing.pivots[:1]:
            way = points[guide.point] - points[name]
            foot = points[name] + way - (way @ along) * along
            if np.hypot(*(foot - points[name])) > smallest:
                named = next((str(v.length) for v in drawing.points[guide.point] if _is_across(v, guide)), "")
                side = -1.0 if way @ along >= 0.0 else 1.0
                beside = max(float(np.max(side * (place - points[name]) @ along)) for place in turn.values())
                offset = _away(points[name], foot, points[guide.point]) * (beside + _OFFSET * height)
                yield Distance("dimensions", points[name], foot, offset, named)


def _is_across(vector: Vector, guide: Guide) -> bool:
    """Whether a length is that of a vector across a guide."""
    constant = isinstance(vector.length, str) and not isinstance(vector.angle, str)
    return constant and vector.direction == guide.angle + 90.0


def _ways(
    simulated: SimulatedDesign, drawing: Drawing, turn: Mapping[str, FloatArray], height: float
) -> Iterator[Distance | Angle]:
    """How far each output goes: the angle of its arc, or the length of its guided line."""
    guided = {guide.point for guide in drawing.guides}
    for path in drawing.paths:
        if path.role != "output":
            continue
        track = track_of(simulated, drawing, path)
        if isinstance(track, Arc):
            yield Angle("dimensions", track, _farthest(track, turn) + 2.0 * _OFFSET * height)
        elif isinstance(track, Polyline) and path.point in guided:
            # Farther out than the sides of links, which end on the guide, too.
            yield Distance("dimensions", track.points[0], track.points[1], -3.0 * _OFFSET * height, "stroke")


def _farthest(arc: Arc, turn: Mapping[str, FloatArray]) -> float:
    """How far from the centre of an arc points go in its sector."""
    ways = np.vstack(list(turn.values())) - arc.centre
    after_start = np.mod(np.rad2deg(np.arctan2(ways[:, 1], ways[:, 0])) - arc.start, 360.0)
    distances = np.hypot(*ways.T)[after_start <= arc.stop - arc.start]
    return float(np.max(distances, initial=arc.radius))
