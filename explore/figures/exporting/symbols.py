"""Symbols of a drawing: pivots, guides, sliders and joints, sized by the height of its texts."""

from collections.abc import Iterator

import numpy as np

from explore.figures.exporting.shapes import Circle, Polyline, arc_points
from explore.model.quantities import FloatArray

#: Radius of a joint, in heights of text.
JOINT = 0.45
#: Half the width of a pivot's ground line, in heights of text.
PIVOT = 1.5
#: Half the length and half the height of a slider, in heights of text.
SLIDER = (1.3, 0.7)
#: Number of hatches of a pivot's ground.
_HATCHES = 6


def pivot(place: FloatArray, height: float) -> Iterator[Polyline | Circle]:
    """A pivot on the ground: a triangle on a hatched line."""
    size = PIVOT * height
    foot = place[1] - size
    yield Polyline("pivots", np.array([place, [place[0] - 0.6 * size, foot], [place[0] + 0.6 * size, foot]]), True)
    yield Polyline("pivots", np.array([[place[0] - size, foot], [place[0] + size, foot]]))
    for k in range(_HATCHES):
        x = place[0] - size + (k + 1) * 2.0 * size / (_HATCHES + 0.5)
        yield Polyline("pivots", np.array([[x, foot], [x - 0.35 * size, foot - 0.35 * size]]))
    yield Circle("pivots", place, JOINT * height)


def guide(track: FloatArray, degrees: float, height: float) -> Iterator[Polyline]:
    """A pair of rails along the way of a sliding point, shape (t, 2), which are a little longer."""
    along, across = directions(degrees)
    places = (track - track[0]) @ along
    reach = np.array([places.min() - 2.5 * height, places.max() + 2.5 * height])
    for side in (-SLIDER[1], SLIDER[1]):
        yield Polyline("guides", track[0] + reach[:, None] * along + side * height * across)


def slider(places: FloatArray, degrees: float, height: float) -> FloatArray:
    """Corners of the block that slides, at places of shape (t, 2), shape (t, 4, 2)."""
    along, across = directions(degrees)
    corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    offsets = np.array([x * SLIDER[0] * along + y * SLIDER[1] * across for x, y in corners]) * height
    return np.asarray(places[:, None] + offsets)


def directions(degrees: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors along and across a direction."""
    along, across = arc_points(np.zeros(2), 1.0, np.array([degrees, degrees + 90.0]))
    return along, across
