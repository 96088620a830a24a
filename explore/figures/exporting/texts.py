"""Where texts of a drawing stand: their boxes, and their direction, readable from below or from the right."""

import numpy as np

from explore.figures.exporting.shapes import LETTER, Angle, Distance, Text, arc_points, rotation
from explore.model.quantities import FloatArray

#: Lower and upper edge of the text of a dimension above its line, in heights of text; higher if it is wider.
_EDGES = (0.35, 1.85)
#: Rounding of a direction, deg.
_ROUNDING = 1e-6


def readable(degrees: float) -> float:
    """The direction of a text along a line: above -90 and up to 90 deg."""
    return 90.0 + _ROUNDING - (90.0 + _ROUNDING - degrees) % 180.0


def upright(shape: Distance) -> Distance:
    """The same dimension from the end where its text begins."""
    along = shape.stop - shape.start
    degrees = float(np.rad2deg(np.arctan2(along[1], along[0])))
    if abs(readable(degrees) - degrees) < 90.0:
        return shape
    return Distance(shape.layer, shape.stop, shape.start, -shape.offset, shape.name)


def text_box(shape: Text | Distance | Angle, height: float) -> FloatArray:
    """Corners of the box of a shape's text, shape (4, 2)."""
    if isinstance(shape, Text):
        width = LETTER * height * len(shape.text)
        corners = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
        return np.asarray(shape.place + corners)
    if isinstance(shape, Distance):
        along = shape.stop - shape.start
        degrees = float(np.rad2deg(np.arctan2(along[1], along[0])))
        middle, above = shape.line.mean(axis=0), _EDGES
    else:
        outward = 0.5 * (shape.arc.start + shape.arc.stop)
        middle, degrees = arc_points(shape.arc.centre, shape.radius, np.array([outward]))[0], readable(outward - 90.0)
        is_above = rotation(degrees)[:, 1] @ (middle - shape.arc.centre) > 0.0
        above = _EDGES if is_above else (-_EDGES[1], -_EDGES[0])
    half = 0.5 * LETTER * height * len(shape.text)
    low, high = height * above[0], height * above[1]
    corners = np.array([(-half, low), (half, low), (half, high), (-half, high)])
    return np.asarray(middle + corners @ rotation(degrees).T)


def overlap(first: FloatArray, second: FloatArray) -> bool:
    """Whether two boxes do, by their corners: no side of either has the other beyond it."""
    sides = np.vstack([np.diff(box[:3], axis=0) for box in (first, second)])
    along, other = first @ sides.T, second @ sides.T
    return bool(np.all((along.max(axis=0) > other.min(axis=0)) & (other.max(axis=0) > along.min(axis=0))))
