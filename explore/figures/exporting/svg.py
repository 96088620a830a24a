"""A drawing as SVG in millimetres at 1:1, a group for each layer."""

from html import escape
from pathlib import Path

import numpy as np

from explore.figures.exporting.shapes import (
    LAYERS,
    SMALL,
    Angle,
    Arc,
    Circle,
    Distance,
    Polyline,
    Shape,
    Sheet,
    Spline,
    Text,
    arc_points,
)
from explore.figures.exporting.texts import readable
from explore.model.quantities import FloatArray

#: Looks of layers, lengths in heights of text.
LOOKS = {
    "paths": "stroke:#0072b2;stroke-width:.08",
    "limit positions": "stroke:#8a949e;stroke-width:.08;stroke-dasharray:1.6 .3 .12 .3 .12 .3",
    "profiles": "stroke:#009e73;stroke-width:.14",
    "guides": "stroke:#222;stroke-width:.12",
    "pivots": "stroke:#222;stroke-width:.1",
    "links": "stroke:#222;stroke-width:.18;stroke-linejoin:round;stroke-linecap:round",
    "dimensions": "stroke:#d55e00;stroke-width:.06",
    "text": "fill:#222;stroke:none",
}
#: Length and half width of arrows, in heights of text.
_ARROW = (0.9, 0.17)
#: Number of digits after the point of coordinates in mm: a nanometre.
_DIGITS = 6
#: Number of digits after the point of small coordinates.
_FINE_DIGITS = 12


def write_svg(sheet: Sheet, path: Path) -> None:
    """Write a drawing."""
    groups = [
        f'<g id="{layer.replace(" ", "-")}" class="{layer.replace(" ", "-")}">\n'
        + "\n".join(element(shape, sheet.height) for shape in sheet.shapes if shape.layer == layer)
        + "\n</g>"
        for layer in LAYERS
        if any(shape.layer == layer for shape in sheet.shapes)
    ]
    low, high = sheet.bounds
    text = document(sheet.title, low - sheet.height, high + sheet.height, sheet.height, "\n".join(groups))
    path.write_text(text, encoding="utf-8")


def document(title: str, low: FloatArray, high: FloatArray, height: float, content: str) -> str:
    """An SVG of a part of the plane in millimetres, with the looks of the layers."""
    width, depth = high - low
    looks = "\n".join(f".{name.replace(' ', '-')}{{{_scaled(look, height)}}}" for name, look in LOOKS.items())
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{number(width)}mm" height="{number(depth)}mm" '
        f'viewBox="{number(low[0])} {number(-high[1])} {number(width)} {number(depth)}">\n'
        f"<title>{escape(title)}</title>\n"
        f"<style>\nsvg{{fill:none;background:#fff}}\ntext{{fill:#222;stroke:none;"
        f"font:{number(1.3 * height)}px sans-serif}}\n"
        f".white{{fill:#fff}}.arrow{{fill:#d55e00;stroke:none}}\n{looks}\n</style>\n{content}\n</svg>\n"
    )


def _scaled(look: str, height: float) -> str:
    """A look with its lengths in mm."""
    parts = dict(part.split(":") for part in look.split(";"))
    for name in ("stroke-width", "stroke-dasharray"):
        if name in parts:
            parts[name] = " ".join(number(float(length) * height) for length in parts[name].split())
    return ";".join(f"{name}:{value}" for name, value in parts.items())


def number(value: float) -> str:
    """A coordinate."""
    digits = _DIGITS if abs(value) >= SMALL else _FINE_DIGITS
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def at(point: FloatArray) -> str:
    """A point; y is down in SVG."""
    return f"{number(point[0])},{number(-point[1])}"


def element(shape: Shape, height: float) -> str:
    """The elements of a shape."""
    if isinstance(shape, Circle):
        x, y = at(shape.centre).split(",")
        fill = ' class="white"' if shape.layer in ("links", "pivots") else ""
        return f'<circle cx="{x}" cy="{y}" r="{number(shape.radius)}"{fill}/>'
    if isinstance(shape, Text):
        return _text(shape.place, shape.text)
    if isinstance(shape, Distance):
        return _distance(shape, height)
    if isinstance(shape, Angle):
        return _angle(shape, height)
    if isinstance(shape, Polyline) and shape.closed:
        return f'<polygon class="white" points="{" ".join(map(at, shape.points))}"/>'
    if isinstance(shape, Spline):
        return f'<path d="{path_data(shape)}"><title>{escape(shape.name)}</title></path>'
    return f'<path d="{path_data(shape)}"/>'


def path_data(shape: Polyline | Arc | Spline) -> str:
    """The data of a path: straight lines, an arc, or the pieces of a spline."""
    if isinstance(shape, Polyline):
        return "M" + " L".join(map(at, shape.points))
    if isinstance(shape, Arc):
        first, last = shape.ends
        radius, is_large = number(shape.radius), int(shape.stop - shape.start > 180.0)
        return f"M{at(first)} A{radius},{radius} 0 {is_large} 0 {at(last)}"
    pieces, end = shape.bezier_pieces(), " Z" if shape.is_closed else ""
    return f"M{at(pieces[0, 0])} " + " ".join("C" + " ".join(map(at, piece[1:])) for piece in pieces) + end


def _text(place: FloatArray, text: str, degrees: float = 0.0, anchor: str = "start") -> str:
    x, y = at(place).split(",")
    turned = f' transform="rotate({number(-degrees)} {x} {y})"' if degrees else ""
    anchored = f' text-anchor="{anchor}"' if anchor != "start" else ""
    return f'<text x="{x}" y="{y}"{anchored}{turned}>{escape(text)}</text>'


def _arrow(tip: FloatArray, direction: FloatArray, height: float) -> str:
    """An arrow that points in a direction."""
    length, half_width = _ARROW
    across = np.array([-direction[1], direction[0]])
    corners = [tip, *(tip - height * (length * direction + side * half_width * across) for side in (1.0, -1.0))]
    return f'<polygon class="arrow" points="{" ".join(map(at, corners))}"/>'


def _distance(shape: Distance, height: float) -> str:
    """A dimension line with arrows, extension lines and its text along it."""
    first, last = shape.line
    along = (last - first) / shape.value
    outward = np.sign(shape.offset) * np.array([-along[1], along[0]])
    lines = [
        Polyline("dimensions", np.array([end + 0.3 * height * outward, reached + 0.5 * height * outward]))
        for end, reached in ((shape.start, first), (shape.stop, last))
    ]
    degrees = float(np.rad2deg(np.arctan2(along[1], along[0])))
    above = arc_points(np.zeros(2), (0.4 if shape.has_room(height) else 0.7) * height, np.array([degrees + 90.0]))[0]
    parts = [element(line, height) for line in (*lines, Polyline("dimensions", shape.line))]
    arrows = [_arrow(first, -along, height), _arrow(last, along, height)]
    text = _text((first + last) / 2.0 + above, shape.text, degrees, "middle")
    return "\n".join([*parts, *arrows, text])


def _angle(shape: Angle, height: float) -> str:
    """A dimension line along an arc with arrows, extension lines and its text."""
    arc, line = shape.arc, shape.line
    outer = Arc("dimensions", arc.centre, shape.radius, arc.start, arc.stop)
    parts = [element(outer, height)]
    for end, reached in zip(arc.ends, outer.ends, strict=True):
        outward = (reached - end) / np.hypot(*(reached - end)) * 0.5 * height
        parts.append(element(Polyline("dimensions", np.array([end + outward, reached + outward])), height))
    for tip, before in ((line[0], line[1]), (line[-1], line[-2])):
        parts.append(_arrow(tip, (tip - before) / np.hypot(*(tip - before)), height))
    middle = arc_points(arc.centre, shape.radius + 0.6 * height, np.array([0.5 * (arc.start + arc.stop)]))[0]
    degrees = (0.5 * (arc.start + arc.stop)) % 360.0  # of the direction outwards, across which the text runs
    is_lower = 180.0 < degrees < 360.0
    if is_lower:
        middle = middle + arc_points(np.zeros(2), 0.8 * height, np.array([degrees]))[0]
    text = _text(middle, shape.text, readable(degrees - 90.0), "middle")
    return "\n".join([*parts, text])
