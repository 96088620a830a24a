"""How figures show a linkage: its points, links, slots and paths, from the table."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from explore.mechanisms.linkages.coordinate import Coordinate, Place
from explore.mechanisms.linkages.load_signals import load_panels
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, Slide, Slot, carrier
from explore.model.drawing import Drawing, Guide, Link, Panel, Path, Vector
from explore.model.quantities import Signal

#: Quantities of points that share a panel, and their signals.
_PANELS = (("position", ("x", "y")), ("velocity", ("velocity",)), ("acceleration", ("acceleration",)))


def draw_linkage(table: LinkageTable) -> Drawing | None:
    """The drawing; None where a point of the frame is no sum of parameters times numbers."""
    frame = {point: _fixed(place) for point, place in table.frame.points}
    if None in frame.values():
        return None
    moving = [point for point in table.points if point not in frame]
    points = {point: vectors or () for point, vectors in frame.items()}
    points |= {point: (Vector(f"{point}_x"), Vector(f"{point}_y", 90.0)) for point in moving}
    yokes = {link: way for slot in table.slots for link, way in _yoke(table, slot, points)}
    points |= {link.points[1]: way for link, way in yokes.items()}
    ends, pins = free_points(table), {slot.pin for slot in table.slots}
    joints = [point for point in moving if point not in ends]
    return Drawing(
        points=points,
        links=tuple(
            Link(body.name, outer if len(outer) == 2 else (*outer, outer[0]))
            for body in table.links
            if len(outer := _ends_of_link(table, body)) > 1
        )
        + tuple(yokes),
        pivots=tuple(point for point in frame if len(table.bodies_at(point)) > 1 or point in pins),
        guides=(
            *(guide for slot in table.slots if (guide := _guide(table, slot))),
            *(guide for slide in table.slides if (guide := _guide_of_slide(table, slide))),
        ),
        paths=(
            *(Path(point, f"path of {point}") for point in joints),
            *(Path(point, f"path of {point}", "point") for point in ends),
        ),
    )


def _ends_of_link(table: LinkageTable, body: Body) -> tuple[str, ...]:
    """The points of a link; of one that turns about a single point, as a tube does, also the pins in its slots."""
    is_tube = len(body.points) == 1 and body.name not in {slide.link for slide in table.slides}
    pins = [slot.pin for slot in table.slots if slot.body == body.name] if is_tube else []
    return tuple(dict.fromkeys([*body.place_of, *pins]))


def _yoke(
    table: LinkageTable, slot: Slot, points: Mapping[str, tuple[Vector, ...]]
) -> Iterator[tuple[Link, tuple[Vector, ...]]]:
    """A link of one point that slides on another body: to an end of its slot, and on to the pin there."""
    body, end = table.body_of[slot.body], slot.along[0]
    if body.name not in {slide.link for slide in table.slides} or isinstance(end, str) or len(body.points) != 1:
        return
    ((point, place),) = body.points
    back, there = _fixed(place), _fixed(end)
    if back is not None and there is not None:
        way = (*(replace(vector, factor=-vector.factor) for vector in back), *there)
        if carrier(body.name, table.slides) != FRAME:
            way = tuple(replace(vector, angle=f"{body.name}_angle", turn=vector.direction) for vector in way)
        yield Link(body.name, (point, f"end of {slot.name}", slot.pin)), (*points[point], *way)


def _fixed(place: Place) -> tuple[Vector, ...] | None:
    """A point of the frame as a sum of vectors."""
    x, y = _terms(place[0]), _terms(place[1])
    if x is None or y is None:
        return None
    return (
        *(Vector(length, factor=factor) for length, factor in x.items()),
        *(Vector(length, 90.0, factor=factor) for length, factor in y.items()),
    )


def _terms(coordinate: Coordinate) -> dict[str | float, float] | None:
    """A coordinate as factors of parameters, and of 1; None where it is no such sum."""
    stack: list[dict[str | float, float]] = []
    for operation, operand in coordinate.steps:
        if operation == "number":
            stack.append({1.0: operand})
        elif operation == "input":
            stack.append({coordinate.names[int(operand)]: 1.0})
        elif operation == "negate":
            stack.append({key: -factor for key, factor in stack.pop().items()})
        elif operation in ("+", "-", "*", "/"):
            second, first = stack.pop(), stack.pop()
            result = _combine(operation, first, second)
            if result is None:
                return None
            stack.append(result)
        else:
            return None
    return {key: factor for key, factor in stack.pop().items() if factor}


def _combine(
    operation: str, first: dict[str | float, float], second: dict[str | float, float]
) -> dict[str | float, float] | None:
    if operation in ("+", "-"):
        sign = 1.0 if operation == "+" else -1.0
        return {key: first.get(key, 0.0) + sign * second.get(key, 0.0) for key in {**first, **second}}
    if operation == "*" and set(first) == {1.0}:
        first, second = second, first
    if set(second) != {1.0} or (operation == "/" and second[1.0] == 0.0):
        return None
    factor = second[1.0] if operation == "*" else 1.0 / second[1.0]
    return {key: value * factor for key, value in first.items()}


def _guide(table: LinkageTable, slot: Slot) -> Guide | None:
    """The guide of a pin in a slot of the frame; else None."""
    if slot.body != FRAME:
        return None
    places = [table.frame.place_of[end] if isinstance(end, str) else end for end in slot.along]
    (x0, y0), (x1, y1) = [(_terms(x), _terms(y)) for x, y in places]
    if x0 is None or y0 is None or x1 is None or y1 is None:
        return Guide(slot.pin, follows_path=True)
    return _guide_along(slot.pin, _combine("-", x1, x0), _combine("-", y1, y0))


def _guide_of_slide(table: LinkageTable, slide: Slide) -> Guide | None:
    """The guide of the first point of a link that slides on the frame; else None."""
    points = table.body_of[slide.link].points
    if slide.body != FRAME or not points:
        return None
    return _guide_along(points[0][0], _terms(slide.direction[0]), _terms(slide.direction[1]))


def _guide_along(point: str, x: dict[str | float, float] | None, y: dict[str | float, float] | None) -> Guide:
    """The guide of a point in a direction, or along its path where the direction is that of a design."""
    if x is None or y is None or any(key != 1.0 for each in (x, y) for key, factor in each.items() if factor):
        return Guide(point, follows_path=True)
    return Guide(point, math.degrees(math.atan2(y.get(1.0, 0.0), x.get(1.0, 0.0))))


def free_points(table: LinkageTable) -> list[str]:
    """The moving points that are no joints: those that a designer names for their paths."""
    pins = {slot.pin for slot in table.slots} | set(table.frame.place_of)
    return [point for point in table.points if point not in pins and len(table.bodies_at(point)) == 1]


def linkage_panels(table: LinkageTable, signals: Sequence[Signal]) -> tuple[Panel, ...]:
    """Panels of a motion: of the slots, of the links, of the points that are no joints, then under load."""
    names = {signal.name for signal in signals}
    panels = [
        Panel(f"{name} {word}", (f"{name}_{word}",))
        for name in (*(slot.name for slot in table.slots), *(link.name for link in table.links))
        for word in ("position", "angle", "velocity", "acceleration")
        if f"{name}_{word}" in names
    ]
    for point in free_points(table):
        panels += [Panel(f"{point} {label}", tuple(f"{point}_{each}" for each in parts)) for label, parts in _PANELS]
    joints = tuple(signal.name for signal in signals if signal.name.endswith("_transmission_angle"))
    return (*panels, *([Panel("transmission angle", joints)] if joints else []), *load_panels(table))
