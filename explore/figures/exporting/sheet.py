"""The drawing of a design at 1:1: links, limit positions, paths, curves of bodies, dimensions and notes."""

from collections.abc import Iterator, Mapping

import numpy as np

from explore.base.units.shown import Scale
from explore.figures.exporting import symbols
from explore.figures.exporting.dimensions import dimensions, reach
from explore.figures.exporting.shapes import (
    LETTER,
    Angle,
    Circle,
    Distance,
    Polyline,
    Shape,
    Sheet,
    Spline,
    Text,
    bounds,
)
from explore.figures.exporting.texts import overlap, text_box
from explore.figures.exporting.tracks import curve_of, track_of
from explore.figures.simulation import SimulatedDesign, drawing_of
from explore.model.drawing import Drawing, Pose, Profile
from explore.model.quantities import FloatArray

#: Smallest height of texts, mm; larger ones are powers of the square root of 2 times this, as in ISO 3098.
_SMALLEST_HEIGHT = 2.5
#: Least height of texts over the extent of the drawing.
_HEIGHT_SHARE = 1.0 / 55.0
#: Input angle of a mechanism without limit positions, deg.
_ANGLE = 60.0
#: Height of a line of notes, in heights of text.
_LEADING = 1.7
#: Number of lines of a column of notes.
_LINES = 8


def draw_sheet(simulated: SimulatedDesign) -> Sheet:
    """Draw a design with its links at `shown_angle`."""
    drawing = drawing_of(simulated)
    height = text_height(simulated, drawing)
    angle = shown_angle(simulated)
    points = {name: place[0] for name, place in simulated.pose([angle]).points(drawing).items()}
    shapes: list[Shape] = [
        *static_shapes(simulated, height),
        *_limit_positions(simulated, drawing),
        *_links(drawing, points, height),
        *profiles(simulated, drawing, angle),
    ]
    shapes += dimensions(simulated, drawing, points, height)
    shapes += _labels(drawing, points, shapes, height)
    return Sheet(simulated.title, (*shapes, *_notes(simulated, angle, shapes, height)), height)


def shown_angle(simulated: SimulatedDesign) -> float:
    """Input angle, deg, midway between the limit positions, where the points are higher and clear of the pivots.

    Of bodies without links that where their curves begin.
    """
    drawing = drawing_of(simulated)
    if len(simulated.limits) != 2:
        return _ANGLE if drawing.links else 0.0
    first, second = simulated.limits.values()
    if not simulated.span.is_turn:
        return 0.5 * (first + second)
    middle = first + 0.5 * ((second - first) % 360.0)
    middles = [middle % 360.0, (middle + 180.0) % 360.0]
    heights = np.sum([place[:, 1] for place in simulated.pose(middles).points(drawing).values()], axis=0)
    return float(middles[int(np.argmax(heights))])


def text_height(simulated: SimulatedDesign, drawing: Drawing) -> float:
    """Height of texts, mm: a step of the standard that suits the extent of the mechanism."""
    extent = float(np.ptp(reach(simulated, drawing), axis=0).max())
    steps = np.ceil(2.0 * np.log2(extent * _HEIGHT_SHARE / _SMALLEST_HEIGHT))
    return float(f"{_SMALLEST_HEIGHT * 2.0 ** (0.5 * steps):.2g}")


def static_shapes(simulated: SimulatedDesign, height: float) -> Iterator[Shape]:
    """What does not move: paths, guides and pivots."""
    drawing = drawing_of(simulated)
    turn = simulated.pose()
    for path in drawing.paths:
        track = track_of(simulated, drawing, path)
        if track is not None:
            yield track
    for guide in drawing.guides:
        yield from symbols.guide(turn.sum(drawing.points[guide.point]), guide.angle, height)
    for pivot in drawing.pivots:
        yield from symbols.pivot(turn.sum(drawing.points[pivot])[0], height)


def body_curve(simulated: SimulatedDesign, profile: Profile) -> Spline:
    """The curve of a body about its centre, in its position at input angle 0."""
    return curve_of(simulated, profile.vectors, "profiles", profile.name)


def body_angle(profile: Profile, pose: Pose) -> FloatArray:
    """How far a body has turned, deg, counter-clockwise, shape (t,)."""
    return profile.sense * pose.angle(profile.angle)


def profiles(simulated: SimulatedDesign, drawing: Drawing, angle: float) -> Iterator[Spline]:
    """The curves of bodies at an input angle."""
    pose = simulated.pose([angle])
    for profile in drawing.profiles:
        centre = pose.sum(drawing.points[profile.centre])[0]
        yield body_curve(simulated, profile).moved(float(body_angle(profile, pose)[0]), centre)


def _limit_positions(simulated: SimulatedDesign, drawing: Drawing) -> Iterator[Shape]:
    """The links in their limit positions."""
    if simulated.limits:
        points = simulated.pose(list(simulated.limits.values())).points(drawing)
        for k in range(len(simulated.limits)):
            for link in drawing.links:
                yield Polyline("limit positions", np.array([points[name][k] for name in link.points]))


def _links(drawing: Drawing, points: Mapping[str, FloatArray], height: float) -> Iterator[Shape]:
    """The links, with a circle for each joint and a block for each slider."""
    for link in drawing.links:
        yield Polyline("links", np.array([points[name] for name in link.points]))
    for guide in drawing.guides:
        yield Polyline("links", symbols.slider(points[guide.point][None], guide.angle, height)[0], closed=True)
    for name in dict.fromkeys(name for link in drawing.links for name in link.points):
        if name not in drawing.pivots:
            yield Circle("links", points[name], symbols.JOINT * height)


def _labels(drawing: Drawing, points: Mapping[str, FloatArray], shapes: list[Shape], height: float) -> Iterator[Text]:
    """The names of bodies above their centres, and those of free paths beside them, away from the links."""
    for profile in drawing.profiles:
        shift = (-0.5 * _width(profile.name, height), height)
        yield Text("text", np.add(points[profile.centre], shift), profile.name)
    links = [link for shape in shapes if isinstance(shape, Polyline) and shape.layer in ("links", "limit positions")
             for link in _along(shape.points)]  # fmt: skip
    boxes = [text_box(shape, height) for shape in shapes if isinstance(shape, (Distance, Angle))]
    for shape in shapes:
        if isinstance(shape, Spline) and shape.layer == "paths":
            curve, half = shape.points(), np.array([0.5 * _width(shape.name, height), 0.5 * height])
            sides = np.array([[0.0, -1.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]])
            centres = [curve[np.argmax(curve @ side)] + side * (half + 0.6 * height) for side in sides]
            texts = [Text("text", centre - half, shape.name) for centre in centres]
            gaps = [np.min(np.hypot(*(np.array(links) - centre).T), initial=np.inf) for centre in centres]
            are_clear = [not any(overlap(text_box(text, height), box) for box in boxes) for text in texts]
            chosen = texts[max(range(len(texts)), key=lambda k: (are_clear[k], gaps[k]))]
            boxes.append(text_box(chosen, height))
            yield chosen


def _width(text: str, height: float) -> float:
    return LETTER * height * len(text)


def _along(points: FloatArray) -> FloatArray:
    """Points close together on the lines through points, shape (n, 2)."""
    places = np.linspace(0.0, len(points) - 1.0, 50 * (len(points) - 1))
    return np.column_stack([np.interp(places, np.arange(len(points)), column) for column in points.T])


def _notes(simulated: SimulatedDesign, angle: float, shapes: list[Shape], height: float) -> Iterator[Text]:
    """Title, parameters that are not the defaults, angles, scale and deviation, in columns below the drawing."""
    low, _ = bounds(shapes, height)
    mechanism = simulated.mechanism
    about = ["scale 1:1, lengths in mm", f"drawn at {mechanism.input_angle} {angle:.6g} deg"]
    about += [f"{name} position at {mechanism.input_angle} {simulated.span.shown(at):.6g} deg" for name, at in
              simulated.limits.items()]  # fmt: skip
    if simulated.slider is not None:
        first, last = (angle % 360.0 for angle in simulated.slider.dwell)
        about.append(f"slider at rest from {first:.6g} to {last:.6g} deg")
    deviations = [shape.deviation for shape in shapes if isinstance(shape, Spline)]
    if deviations:
        about.append(f"splines within {max(deviations):.1g} mm of the exact curves")
    # At 1:1 lengths are mm in the notes as in the drawing.
    own = {p.name: Scale(p.unit, p.unit) for p in mechanism.parameters}
    scales = own | simulated.units.scales({p.name: p.unit for p in mechanism.parameters if p.unit != "mm"})
    items = [
        _parameter(p.name, simulated.parameters[p.name], scales[p.name])
        for p in mechanism.parameters
        if p.name in simulated.parameters and simulated.parameters[p.name] != p.default
    ]
    left, top = float(low[0]), float(low[1]) - 3.0 * height
    yield Text("text", np.array([left, top]), simulated.title.partition(": ")[0])
    for column in [items[k : k + _LINES] for k in range(0, len(items), _LINES)] + [about]:
        for line, text in enumerate(column):
            yield Text("text", np.array([left, top - (line + 1.3) * _LEADING * height]), text)
        left += max(_width(f"{text}   ", height) for text in column)


def _parameter(name: str, value: float, scale: Scale) -> str:
    """A parameter with its value in the shown unit."""
    return f"{name.replace('_', ' ')} {scale.show(value):.10g} {'' if scale.shown == '1' else scale.shown}".rstrip()
