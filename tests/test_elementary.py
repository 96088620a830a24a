"""Exponential, logarithm, sine, tangent, arctangent and the like without branches, against 40 digits of mpmath."""

import math

import mpmath
import numpy as np
import pytest

from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import (
    cosine,
    exponential,
    exponential_less_one,
    inverse_cosh,
    inverse_sinh,
    logarithm,
    sine,
    spacing,
    tangent,
)


def ulps(function, exact, *numbers):
    """Error of one value in units of its last place."""
    with mpmath.workdps(40):
        numbers = [float(number) for number in numbers]
        true = exact(*map(mpmath.mpf, numbers))
        return abs(float((mpmath.mpf(function(*numbers)) - true) / math.ulp(float(true))))


def test_the_exponential_is_within_one_unit_in_the_last_place():
    rng = np.random.default_rng(0)
    # over the whole range, and at the borders between multiples of ln 2
    numbers = np.concatenate(
        [rng.uniform(-700.0, 700.0, 4000), rng.normal(0.0, 1.0, 4000),
         (rng.integers(-1000, 1000, 2000) + 0.5) * math.log(2.0) + rng.normal(0.0, 1e-12, 2000)]
    )  # fmt: skip
    assert max(ulps(exponential, mpmath.exp, x) for x in numbers) <= 1.0
    assert exponential(0.0) == 1.0


def test_the_exponential_less_one_keeps_the_digits_of_small_arguments():
    rng = np.random.default_rng(6)
    numbers = np.concatenate(
        [rng.uniform(-700.0, 700.0, 2000), rng.normal(0.0, 1.0, 3000), rng.normal(0.0, 1.0, 2000) * 1e-9,
         (rng.integers(-4, 4, 1000) + 0.5) * math.log(2.0) + rng.normal(0.0, 1e-12, 1000)]
    )  # fmt: skip
    assert max(ulps(exponential_less_one, mpmath.expm1, x) for x in numbers) <= 2.0
    assert exponential_less_one(0.0) == 0.0


@pytest.mark.parametrize(("function", "exact"), [(sine, mpmath.sin), (cosine, mpmath.cos)])
def test_sine_and_cosine_and_their_zeros(function, exact):
    rng = np.random.default_rng(7)
    quarters = rng.integers(-400, 400, 1000) * (0.5 * math.pi)
    numbers = np.concatenate(
        [rng.uniform(-4.0, 4.0, 4000), rng.uniform(-700.0, 700.0, 3000), rng.normal(0.0, 1e-6, 500),
         (rng.integers(-400, 400, 1000) + 0.5) * (0.5 * math.pi) + rng.normal(0.0, 1e-12, 1000),
         quarters + rng.choice([-1.0, 1.0], 1000) * 10.0 ** rng.uniform(-9.0, -3.0, 1000)]
    )  # fmt: skip
    # next to a zero the distance from it is known to what is left of pi/2, as often as that was taken off
    for x in [*numbers, *quarters]:
        with mpmath.workdps(40):
            true = exact(mpmath.mpf(float(x)))
            assert abs(function(x) - true) <= 2.0 * math.ulp(float(true)) + 3e-27 * (1.0 + abs(x))
    assert sine(0.0) == 0.0
    assert cosine(0.0) == 1.0


def test_the_logarithm_is_within_one_unit_in_the_last_place():
    rng = np.random.default_rng(1)
    # over the whole range, near 1, and at the borders of the mantissa
    numbers = np.concatenate(
        [10.0 ** rng.uniform(-300.0, 300.0, 4000), 1.0 + rng.normal(0.0, 1e-3, 4000),
         2.0 ** (rng.integers(-40, 40, 2000) + 0.5) * (1.0 + rng.normal(0.0, 1e-13, 2000))]
    )  # fmt: skip
    assert max(ulps(logarithm, mpmath.log, x) for x in numbers) <= 1.0
    assert logarithm(1.0) == 0.0


def test_the_inverse_hyperbolic_sine_keeps_the_digits_of_small_arguments():
    rng = np.random.default_rng(2)
    signs = rng.choice([-1.0, 1.0], 6000)
    numbers = signs * np.concatenate([2.0 ** rng.uniform(-60.0, 60.0, 5000), rng.uniform(0.035, 0.045, 1000)])
    errors = np.array([ulps(inverse_sinh, mpmath.asinh, x) for x in numbers])
    # the series is cut after the term of x^11; just above 0.04 the logarithm of a number near 1 multiplies its rounding
    assert errors[np.abs(numbers) < 0.04].max() <= 2.0
    assert errors[np.abs(numbers) >= 1.0].max() <= 3.0
    assert errors.max() <= 40.0


def test_the_inverse_hyperbolic_cosine():
    rng = np.random.default_rng(3)
    numbers = 1.0 + 2.0 ** rng.uniform(-10.0, 60.0, 4000)
    for x in numbers:
        with mpmath.workdps(40):
            exact = float(mpmath.acosh(mpmath.mpf(x)))
        # the rounding of x^2 - 1 and of the sum in the logarithm, both multiplied near 1
        assert inverse_cosh(x) == pytest.approx(exact, rel=4e-16 * (1.0 + 1.0 / (x - 1.0)))
    assert inverse_cosh(1.0) == 0.0
    assert abs(inverse_cosh(1.0 - 1e-15)) <= 1e-15


def test_the_spacing_of_normal_numbers():
    rng = np.random.default_rng(4)
    numbers = np.concatenate([10.0 ** rng.uniform(-280.0, 300.0, 2000), 2.0 ** np.arange(-900.0, 1000.0, 100.0)])
    assert all(spacing(x) == np.spacing(x) == spacing(-x) for x in numbers)


def test_the_tangent_and_its_poles():
    rng = np.random.default_rng(5)
    numbers = np.concatenate(
        [rng.uniform(-2.0, 2.0, 4000), rng.choice([-1.0, 1.0], 500) * 2.0 ** rng.uniform(-40, 0, 500)]
    )
    assert max(ulps(tangent, mpmath.tan, x) for x in numbers) <= 3.0
    # next to a pole the distance from it is known to an absolute 1e-32
    near = np.pi / 2 + np.concatenate([[0.0], rng.choice([-1.0, 1.0], 500) * 2.0 ** rng.uniform(-52.0, -10.0, 500)])
    assert max(ulps(tangent, mpmath.tan, x) for x in near) <= 3.0
    assert all(tangent(-x) == -tangent(x) for x in numbers)


def test_the_arctangent_is_within_two_units_in_the_last_place():
    rng = np.random.default_rng(3)
    angles = np.concatenate(
        [rng.uniform(-np.pi, np.pi, 20_000), *(k * np.pi / 8 + rng.normal(0, 1e-9, 300) for k in range(-8, 9))]
    )
    sizes = 10.0 ** rng.uniform(-100, 100, len(angles))
    worst = max(
        ulps(arctangent, mpmath.atan2, s * np.sin(a), s * np.cos(a)) for s, a in zip(sizes, angles, strict=True)
    )
    assert worst <= 2.0


def test_small_angles_keep_their_digits():
    for exponent in range(1, 300, 7):
        assert ulps(arctangent, mpmath.atan2, 10.0**-exponent, 1.0) <= 1.0
        assert ulps(arctangent, mpmath.atan2, -(10.0**-exponent), 3.0) <= 1.0


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
