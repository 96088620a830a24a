"""What a drawing consists of, mm: lines, circles, arcs, splines, texts and dimensions, each on a layer."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from explore.model.quantities import FloatArray

#: Layers of a drawing, in the order in which they are drawn.
LAYERS = ("paths", "limit positions", "profiles", "guides", "pivots", "links", "dimensions", "text")
#: Width of a letter over its height, to keep texts clear of each other.
LETTER = 0.75
#: Value, mm or deg, below which more digits after the point are needed.
SMALL = 0.1
#: Value below which there is nothing but rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Polyline:
    """Straight lines through points, shape (n, 2)."""

    layer: str
    points: FloatArray
    closed: bool = False


@dataclass(frozen=True)
class Circle:
    """A circle about a centre, shape (2,)."""

    layer: str
    centre: FloatArray
    radius: float


@dataclass(frozen=True)
class Arc:
    """An arc of a circle, counter-clockwise from `start` to `stop`, deg."""

    layer: str
    centre: FloatArray
    radius: float
    start: float
    stop: float

    @property
    def ends(self) -> FloatArray:
        """First and last point, shape (2, 2)."""
        return arc_points(self.centre, self.radius, np.array([self.start, self.stop]))


@dataclass(frozen=True)
class Spline:
    """A cubic B-spline of the curve `name`.

    The first and the last knot stand four times. Of a closed curve the first control point equals the last. The
    deviation from the exact curve is the largest that was measured between the points that it interpolates.
    """

    layer: str
    name: str
    knots: FloatArray
    controls: FloatArray
    deviation: float

    @property
    def is_closed(self) -> bool:
        """Whether the curve ends where it begins."""
        return bool((self.controls[0] == self.controls[-1]).all())

    def moved(self, degrees: float, centre: FloatArray) -> Spline:
        """The curve turned about the origin, then shifted by the vector `centre`."""
        controls = self.controls @ rotation(degrees).T + centre
        if self.is_closed:
            controls[-1] = controls[0]  # to the last bit, so that the curve stays closed
        return replace(self, controls=controls)

    def bezier_pieces(self) -> FloatArray:
        """The same curve as Bezier pieces of four control points, shape (n, 4, 2)."""
        from scipy.interpolate import BPoly, PPoly

        both = [PPoly.from_spline((self.knots, column, 3)) for column in self.controls.T]
        pieces = [BPoly.from_power_basis(each).c[:, np.diff(each.x) > 0.0].T for each in both]
        return np.stack(pieces, axis=-1)

    def points(self, n_per_piece: int = 4) -> FloatArray:
        """Points of the curve, shape (n, 2), both ends included."""
        from scipy.interpolate import BSpline

        breaks = np.unique(self.knots)
        fractions = np.arange(n_per_piece) / n_per_piece
        places = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * fractions).ravel(), breaks[-1])
        return np.asarray(BSpline(self.knots, self.controls, 3)(places))


@dataclass(frozen=True)
class Text:
    """A line of text that begins at a place."""

    layer: str
    place: FloatArray
    text: str


@dataclass(frozen=True)
class Distance:
    """A dimension: the distance of two points; `name`, which may be empty, is what is measured.

    The dimension line has the offset from the line between the points, positive to the left of the way from start to
    stop.
    """

    layer: str
    start: FloatArray
    stop: FloatArray
    offset: float
    name: str

    @property
    def value(self) -> float:
        """The distance, mm."""
        return float(np.hypot(*(self.stop - self.start)))

    @property
    def text(self) -> str:
        """The name before the number."""
        return f"{self.name} {_shown(self.value)}".strip()

    def has_room(self, height: float) -> bool:
        """Whether its line is longer than its text in letters of a height."""
        return LETTER * height * len(self.text) < self.value

    @property
    def line(self) -> FloatArray:
        """Ends of the dimension line, shape (2, 2)."""
        along = (self.stop - self.start) / self.value
        return np.array([self.start, self.stop]) + self.offset * np.array([-along[1], along[0]])


@dataclass(frozen=True)
class Angle:
    """A dimension: the angle of an arc, with the dimension line at a radius."""

    layer: str
    arc: Arc
    radius: float

    @property
    def value(self) -> float:
        """The angle, deg."""
        return self.arc.stop - self.arc.start

    @property
    def text(self) -> str:
        """The number with its sign."""
        return f"{_shown(self.value)}°"

    @property
    def line(self) -> FloatArray:
        """Points of the dimension line, shape (n, 2)."""
        return arc_points(self.arc.centre, self.radius, np.linspace(self.arc.start, self.arc.stop, 65))


def _shown(value: float) -> str:
    """A measured value, with at most four digits after the point; a small one with six figures."""
    return f"{value:.6g}" if _ROUNDING < value < SMALL else f"{value:.4f}".rstrip("0").rstrip(".")


Shape = Polyline | Circle | Arc | Spline | Text | Distance | Angle
AnyShape = TypeVar("AnyShape", bound=Shape)


@dataclass(frozen=True)
class Sheet:
    """A drawing at a scale of 1:1; the height of its texts, mm, scales all symbols."""

    title: str
    shapes: tuple[Shape, ...]
    height: float

    def select(self, kind: type[AnyShape]) -> list[AnyShape]:
        """The shapes of one kind."""
        return [shape for shape in self.shapes if isinstance(shape, kind)]

    @property
    def bounds(self) -> FloatArray:
        """Smallest and largest coordinates, shape (2, 2)."""
        return bounds(self.shapes, self.height)


def rotation(degrees: float) -> FloatArray:
    """The matrix that turns a column counter-clockwise."""
    cosine, sine = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[cosine, -sine], [sine, cosine]])


def arc_points(centre: FloatArray, radius: float, degrees: FloatArray) -> FloatArray:
    """Points of a circle, shape (n, 2)."""
    angle = np.deg2rad(degrees)
    return np.asarray(centre + radius * np.array([np.cos(angle), np.sin(angle)]).T)


def bounds(shapes: Iterable[Shape], height: float) -> FloatArray:
    """Smallest and largest coordinates of shapes with texts of a height, shape (2, 2)."""
    points = np.vstack([_extent(shape, height) for shape in shapes])
    return np.array([points.min(axis=0), points.max(axis=0)])


def _extent(shape: Shape, height: float) -> FloatArray:
    """Points whose bounding box holds a shape."""
    if isinstance(shape, Circle):
        return np.array([shape.centre - shape.radius, shape.centre + shape.radius])
    if isinstance(shape, Arc):
        return arc_points(shape.centre, shape.radius, np.linspace(shape.start, shape.stop, 65))
    if isinstance(shape, Spline):
        return shape.points()
    if isinstance(shape, Text):
        return np.array([shape.place, np.add(shape.place, (LETTER * height * len(shape.text), height))])
    if isinstance(shape, (Distance, Angle)):
        return np.vstack([shape.line - 1.5 * height, shape.line + 1.5 * height])  # room for its text
    return shape.points
