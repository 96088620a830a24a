"""Overall size of a four-bar: the circle of the crank, both ground pivots, and the arc of the rocker's joint."""

import numpy as np

from explore.mechanisms.overall_size import declare_size
from explore.model.points import Extent
from explore.model.quantities import FloatArray, Formula


def _reach(rocker: FloatArray, middle: FloatArray, swing: FloatArray, direction: float) -> FloatArray:
    """How far the rocker's joint gets from the rocker's pivot in a direction, deg.

    That is the rocker's length if it points there at some time, else less by the cosine of the least angle between.
    """
    apart = np.abs(np.remainder(direction - middle + 180.0, 360.0) - 180.0)
    reach: FloatArray = rocker * np.cos(np.deg2rad(np.maximum(apart - 0.5 * swing, 0.0)))
    return reach


def _arc(middle: FloatArray, swing: FloatArray, transmission: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle and length of the rocker's arc, deg; a full turn where it does not swing, NaN where the crank is blocked.

    The transmission angle is NaN where the crank is blocked, the other two also where the rocker turns.
    """
    turns = np.isnan(swing) & ~np.isnan(transmission)
    return np.where(turns, 0.0, middle), np.where(turns, 360.0, swing)


def _along_x(
    crank: FloatArray, _coupler: FloatArray, rocker: FloatArray, ground: FloatArray, middle: FloatArray,
    swing: FloatArray, transmission: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    middle, swing = _arc(middle, swing, transmission)
    forward, backward = (_reach(rocker, middle, swing, direction) for direction in (0.0, 180.0))
    # np.maximum keeps NaN
    last = np.maximum(np.maximum(crank, ground), ground + forward)
    return -np.maximum(crank, backward - ground), last


def _along_y(
    crank: FloatArray, coupler: FloatArray, rocker: FloatArray, ground: FloatArray, middle: FloatArray,
    swing: FloatArray, transmission: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """The joint of a rocker that swings is always on the same side of the frame, highest at an end or at 90 deg.

    The heights of the ends are those of triangles, whose sides keep the digits that a cosine near 90 deg would lose.
    """
    ends = [_triangle_height(rocker, coupler, sign * crank, ground) for sign in (1.0, -1.0)]
    is_upright = np.abs(np.abs(middle) - 90.0) <= 0.5 * swing
    highest = np.where(is_upright, rocker, np.maximum(*ends))
    turns = np.isnan(swing) & ~np.isnan(transmission)
    highest = np.where(turns, rocker, np.where(np.isnan(swing), np.nan, highest))
    # what the joint of a rocker that swings does not reach, the crank does
    beyond, is_below = np.maximum(crank, highest), middle < 0.0
    return -np.where(turns | is_below, beyond, crank), np.where(turns | ~is_below, beyond, crank)


def _triangle_height(side: FloatArray, other: FloatArray, more: FloatArray, base: FloatArray) -> FloatArray:
    """Height over the base of a triangle of side, other + more, and base, by Heron's formula with exact sums."""
    square = (
        _sum(side, other, more, base)
        * _sum(-side, other, more, base)
        * _sum(side, -other, -more, base)
        * _sum(side, other, more, -base)
    )
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(square) / (2.0 * base))


def _sum(*terms: FloatArray) -> FloatArray:
    """The sum of terms with the rounding errors of each addition added at the end."""
    total, lost = terms[0], np.zeros_like(terms[0])
    for term in terms[1:]:
        new = total + term
        part = new - total
        lost = lost + ((total - (new - part)) + (term - part))
        total = new
    return np.asarray(total + lost)


def declare_four_bar_size(transmission_angle: str) -> tuple[Formula, ...]:
    """Declare the overall size of a four-bar; every linkage has the named transmission angle whose crank turns."""
    swing = ("mid_angle", "swing_angle")
    inputs = ("crank", "coupler", "rocker", "ground", *swing, transmission_angle)
    return declare_size("the line of the ground pivots", inputs, Extent("x", _along_x), Extent("y", _along_y), swing)
