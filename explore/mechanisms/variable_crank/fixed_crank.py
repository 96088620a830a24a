"""An ordinary crank in place of the variable one: its share of the turn near the wanted speed, as derived metrics.

The fixed crank of length r turns as fast and has the same rod l. With q = r/l its slider's speed over r times that of
the crank is

    f = sin(theta) (1 + q cos(theta)/sqrt(1 - q^2 sin(theta)^2)),

which rises from 0 at the outer dead centre to one largest value and falls to 0 at the inner one; the way back is the
mirror image. So the share of the turn above a level is the distance of two angles. They have a closed form: the rod's
line meets the perpendicular to the guide through the crank's pivot at the height f r, and the distance w of the slider
from that place, in rods, is a root of w^3 - 2 w^2 + (1 - h^2 - q^2) w + 2 h^2 with h = f q, which has a negative one,
w3, and two more, 1 + q u. Here u1 u2 = (1 - f^2)/(w3 - 1), and (w3 - 1)(u1 + u2) = -q (1 + f^2 + u1 u2).

There are two such cranks: of equal stroke, r half the stroke, and of equal length, r the longest length of the variable
crank, which is that at the inner dead centre.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from explore.model.quantities import FloatArray, Formula

#: Largest number of steps of Newton and of halvings.
_MOST_STEPS = 120
#: Excess of a cosine over 1 below which the discriminant tells whether there are angles.
_BESIDE_PEAK = 1e-12
#: Rounding of levels and speeds, relative.
_MARGIN = 16 * np.finfo(np.float64).eps


def _speed(theta: FloatArray, ratio: FloatArray) -> FloatArray:
    """Speed f at a ratio of crank to rod."""
    cosine, room = ratio * np.cos(theta), (1.0 - ratio) * (1.0 + ratio)
    root = np.sqrt(room + cosine**2)
    opposed = room / (root - cosine)  # root + cosine, without cancellation
    return np.asarray(np.sin(theta) * np.where(cosine < 0.0, opposed, root + cosine) / root)


def _slope(theta: FloatArray, ratio: FloatArray) -> FloatArray:
    """The derivative of f."""
    sine, cosine = np.sin(theta), np.cos(theta)
    root = np.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
    return np.asarray(cosine + ratio * ((cosine - sine) * (cosine + sine) + (ratio * sine * cosine / root) ** 2) / root)


def _angles_at(level: FloatArray, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two crank angles at which f is at a level, ascending; the same where it never is."""
    height = ratio * level
    linear = (1.0 - ratio) * (1.0 + ratio) - height**2
    slope, constant = linear - 4.0 / 3.0, 2.0 / 3.0 * linear + 2.0 * height**2 - 16.0 / 27.0
    cosine = 1.5 * constant / slope * np.sqrt(-3.0 / slope)
    turned = (np.arccos(np.clip(cosine, -1.0, 1.0)) - 4.0 * math.pi) / 3.0
    other = 2.0 * np.sqrt(-slope / 3.0) * np.cos(turned) - 1.0 / 3.0  # w3 - 1
    product = (1.0 - level) * (1.0 + level) / other
    half = -0.5 * ratio * (1.0 + level**2 + product) / other
    square = np.where(cosine > -1.0 - _BESIDE_PEAK, half**2 - product, 0.0)
    apart = np.sqrt(np.maximum(square, 0.0))

    def angle(root: FloatArray) -> FloatArray:
        distance = 1.0 + ratio * root
        return np.arctan2(level, root * np.sqrt(np.maximum(distance**2 - height**2, 0.0)))

    first, last = angle(half + apart), angle(half - apart)
    middle = 0.5 * (first + last)
    return (
        _sharpened(first, np.zeros_like(middle), middle, level, ratio, 1.0),
        _sharpened(last, middle, np.full_like(middle, math.pi), level, ratio, -1.0),
    )


def _sharpened(
    theta: FloatArray, low: FloatArray, high: FloatArray, level: FloatArray, ratio: FloatArray, sense: float
) -> FloatArray:
    """Angles at which f passes a level between two others, upwards or downwards, by Newton's steps or halvings.

    Almost all need two steps; a crank nearly as long as the rod, whose speed falls steeply past a right angle, more.
    """
    for _ in range(_MOST_STEPS):
        excess = sense * (_speed(theta, ratio) - level)
        low, high = np.where(excess < 0.0, theta, low), np.where(excess > 0.0, theta, high)
        step = excess / (sense * _slope(theta, ratio))
        is_open = (np.abs(excess) > _MARGIN * level) & (np.abs(step) > _MARGIN) & (high - low > _MARGIN)
        if not is_open.any():
            break
        new = theta - step
        theta = np.where(is_open, np.where((low < new) & (new < high), new, 0.5 * (low + high)), theta)
    return theta


def fixed_crank_share(
    crank: FloatArray, rod: FloatArray, wanted: FloatArray, speed: FloatArray, deviation: float
) -> FloatArray:
    """Share of the turn in which a fixed crank's slider is within a relative deviation of the wanted speed, (n,).

    The wanted speeds may have more axes before that of the designs.
    """
    ratio = crank / rod
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = np.multiply.outer(np.array([1.0 - deviation, 1.0 + deviation]), wanted / (crank * speed))
        first, last = _angles_at(levels, ratio)
        above = (last - first) / math.pi
    return np.where(np.isfinite(ratio), above[0] - above[1], np.nan)


def _share(
    deviation: float,
    crank_per_length: float,
    length: FloatArray,
    rod: FloatArray,
    wanted: FloatArray,
    speed: FloatArray,
) -> FloatArray:
    return fixed_crank_share(crank_per_length * length, rod, wanted, speed, deviation)


def _rounding(
    share: Callable[..., FloatArray], length: FloatArray, rod: FloatArray, wanted: FloatArray, speed: FloatArray
) -> FloatArray:
    """Bound of the absolute error, from levels and ratios a rounding apart.

    Where a level is the largest speed, the share is as the root of what it is above.
    """
    levels, ratios = 1.0 + _MARGIN * np.array([[0, -1, 1, 0, 0], [0, 0, 0, -1, 1]])
    value, *moved = share(length, np.multiply.outer(ratios, rod), np.multiply.outer(levels, wanted), speed)
    return np.asarray(np.abs(np.array(moved) - value).max(axis=0) + _MARGIN * (value > 0.0))


def _declare(percent: int, kind: str, length: str, crank_per_length: float) -> tuple[Formula, Formula]:
    """The share of a fixed crank, and how many times as large that of the variable crank is."""
    name = f"fixed_crank_speed_share_{percent}_equal_{kind}"
    text = f"share of the turn within {percent} % of the wanted speed"
    share = partial(_share, 0.01 * percent, crank_per_length)
    return (
        Formula(name, "1", f"{text}, of a fixed crank of equal {kind}", "max",
                (length, "rod", "slider_speed", "speed"), share, rounding=partial(_rounding, share)),
        Formula(f"speed_share_{percent}_gain_equal_{kind}", "1", f"{text}, over that of a fixed crank of equal {kind}",
                "max", (f"speed_share_{percent}", name), np.divide),
    )  # fmt: skip


FORMULAS = tuple(
    formula
    for kind, length, crank_per_length in (("stroke", "stroke", 0.5), ("length", "crank_inner", 1.0))
    for percent in (1, 2, 5)
    for formula in _declare(percent, kind, length, crank_per_length)
)
