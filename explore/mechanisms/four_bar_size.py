"""Overall size of a four-bar: the circle of the crank, both ground pivots, and the arc of the rocker's joint."""

from __future__ import annotations

import numpy as np

from explore.mechanisms.overall_size import declare_size
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


def _width(
    crank: FloatArray, rocker: FloatArray, ground: FloatArray, middle: FloatArray, swing: FloatArray,
    transmission: FloatArray,
) -> FloatArray:  # fmt: skip
    middle, swing = _arc(middle, swing, transmission)
    forward, backward = (_reach(rocker, middle, swing, direction) for direction in (0.0, 180.0))
    # np.maximum keeps NaN
    last = np.maximum(np.maximum(crank, ground), ground + forward)
    return np.asarray(last + np.maximum(crank, backward - ground))


def _height(
    crank: FloatArray, rocker: FloatArray, _ground: FloatArray, middle: FloatArray, swing: FloatArray,
    transmission: FloatArray,
) -> FloatArray:  # fmt: skip
    middle, swing = _arc(middle, swing, transmission)
    upward, downward = (_reach(rocker, middle, swing, direction) for direction in (90.0, -90.0))
    return np.asarray(np.maximum(crank, upward) + np.maximum(crank, downward))


def declare_four_bar_size(transmission_angle: str) -> tuple[Formula, ...]:
    """Declare the overall size of a four-bar.

    Parameters
    ----------
    transmission_angle
        Name of a metric that every linkage has whose crank turns.
    """
    inputs = ("crank", "rocker", "ground", "mid_angle", "swing_angle", transmission_angle)
    return declare_size("the line of the ground pivots", inputs, _width, _height)
