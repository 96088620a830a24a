"""The arctangent of the package, accurate to two units in the last place by 40 digits of mpmath."""

import math

import mpmath
import numpy as np
import pytest

from explore.base.lanes.arctangent import arctangent

#: Largest error in units in the last place.
ULPS = 2.0


def ulps(y, x):
    """Error in units of the last place of the exact angle."""
    with mpmath.workdps(40):
        exact = mpmath.atan2(mpmath.mpf(y), mpmath.mpf(x))
        return abs(float((mpmath.mpf(arctangent(y, x)) - exact) / math.ulp(float(exact))))


def test_everywhere():
    rng = np.random.default_rng(3)
    angles = np.concatenate(
        [rng.uniform(-np.pi, np.pi, 20_000), *(k * np.pi / 8 + rng.normal(0, 1e-9, 300) for k in range(-8, 9))]
    )
    sizes = 10.0 ** rng.uniform(-100, 100, len(angles))
    worst = max(ulps(float(s * np.sin(a)), float(s * np.cos(a))) for s, a in zip(sizes, angles, strict=True))
    assert worst <= ULPS


def test_small_angles_keep_their_digits():
    for exponent in range(1, 300, 7):
        assert ulps(10.0**-exponent, 1.0) <= 1.0
        assert ulps(-(10.0**-exponent), 3.0) <= 1.0


@pytest.mark.parametrize(
    ("y", "x", "angle"),
    [
        (0.0, 1.0, 0.0), (1.0, 0.0, np.pi / 2), (0.0, -1.0, np.pi), (-1.0, 0.0, -np.pi / 2),
        (1.0, 1.0, np.pi / 4), (1.0, -1.0, 3 * np.pi / 4), (-1.0, -1.0, -3 * np.pi / 4), (-1.0, 1.0, -np.pi / 4),
    ],
)  # fmt: skip
def test_axes_and_diagonals_are_exact(y, x, angle):
    assert arctangent(y, x) == angle


@pytest.mark.parametrize(("y", "x"), [(0.0, 0.0), (np.nan, 1.0), (1.0, np.nan), (np.inf, np.inf)])
def test_vectors_without_an_angle_give_nan(y, x):
    assert math.isnan(arctangent(y, x))
