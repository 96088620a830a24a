"""Buckling and whip of a rod by second methods: the beam equation and integrals of the load."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_bvp
from scipy.optimize import minimize_scalar
from test_sizing import MODULUS, STRESS, close, positive_numbers

from explore import sizing

LENGTH = 1271.5


def test_euler_force_is_the_eigenvalue_of_the_beam_equation():
    """w'' = -F/(E I) w with w = 0 at both ends, w'(0) = 1: the smallest F, by shooting with scipy's solver."""
    length, diameter, hollow_ratio = 1271.5, 40.0, 0.5
    stiffness = MODULUS * sizing.rod_second_moment(diameter, hollow_ratio)

    def equations(x, y, p):
        return np.vstack([y[1], -p[0] * y[0]])  # x and w over the length, p = F L^2/(E I)

    def ends(left, right, p):
        return np.array([left[0], right[0], left[1] - 1.0])

    x = np.linspace(0.0, 1.0, 21)
    solution = solve_bvp(
        equations, ends, x, np.vstack([np.sin(3 * x) / 3, np.cos(3 * x)]), p=[9.0], tol=1e-10, max_nodes=100_000
    )
    assert solution.success
    close(sizing.euler_force(length, diameter, MODULUS, hollow_ratio), solution.p[0] * stiffness / length**2, 1e-8)


@given(positive_numbers, st.floats(1.0, 10.0), st.floats(0.0, 0.9))
def test_a_rod_sized_for_buckling_has_the_factor(force, factor, hollow_ratio):
    diameter = sizing.rod_diameter_for_buckling(force, factor, LENGTH, MODULUS, hollow_ratio)
    close(sizing.buckling_factor(force, LENGTH, diameter, MODULUS, hollow_ratio), factor)


def test_johnson_joins_euler_smoothly_and_a_short_rod_yields():
    yield_strength, diameter = 350.0, 40.0
    limit = sizing.limiting_slenderness(MODULUS, yield_strength)
    at_limit = limit * diameter / 4.0  # solid: i = D/4
    close(sizing.slenderness(at_limit, diameter), limit)

    def force(length):
        return sizing.buckling_force(length, diameter, MODULUS, yield_strength)

    # At the limit Euler's stress is half the yield strength, and both curves and their slopes agree.
    close(force(at_limit * (1 + 1e-9)) / sizing.rod_area(diameter), yield_strength / 2, 1e-8)
    close(force(at_limit * (1 - 1e-9)), force(at_limit * (1 + 1e-9)), 1e-8)
    step = 1e-4 * at_limit
    below = (force(at_limit - step) - force(at_limit - 2 * step)) / step
    above = (force(at_limit + 2 * step) - force(at_limit + step)) / step
    assert below == pytest.approx(above, rel=1e-3)
    close(force(1e-6), yield_strength * sizing.rod_area(diameter))
    lengths = np.linspace(1.0, 3.0 * at_limit, 400)
    euler = sizing.euler_force(lengths, diameter, MODULUS)
    assert (force(lengths) <= euler * (1 + 1e-12)).all()  # never more than Euler's
    assert np.array_equal(force(lengths)[lengths > at_limit], euler[lengths > at_limit])
    assert (np.diff(force(lengths)) < 0.0).all()


def test_johnson_on_a_strength_sized_rod_of_the_reference():
    """Euler gives the stout rod (slenderness 57) a factor of 5.34, Johnson 2.6."""
    force = 159614.219125320639  # N, of the reference
    diameter = sizing.rod_diameter(force, STRESS, 0.8)
    euler = sizing.buckling_factor(force, LENGTH, diameter, MODULUS, 0.8)
    johnson = sizing.buckling_factor(force, LENGTH, diameter, MODULUS, 0.8, yield_strength=350.0)
    assert euler == pytest.approx(5.34, abs=0.01)
    # A Re (1 - (lambda/lambda_1)^2/2)/F with A = F/s: independent of the force
    ratio = 57.1018609478988 / (np.sqrt(2) * np.pi * np.sqrt(MODULUS / 350.0))
    close(johnson, 350.0 / STRESS * (1.0 - 0.5 * ratio**2))


@given(
    st.floats(0.1, 50.0), st.floats(100.0, 3000.0), st.floats(-500.0, 500.0), st.floats(-500.0, 500.0),
    st.floats(0.0, 1.0),
)  # fmt: skip
def test_whip_moment_is_that_of_the_loaded_beam(mass, length, start, end, position):
    """The reaction and the moment of d'Alembert's load by numerical integration of the load itself."""
    metres, cut = 1e-3 * length, position * 1e-3 * length

    def load(s):
        return mass * (start + (end - start) * s / metres)

    scale = mass * metres**2 * 1e3 * max(abs(start), abs(end), 1e-3)  # N mm
    reaction = quad(lambda s: load(s) * (metres - s), 0.0, metres)[0] / metres
    moment = 1e3 * (reaction * cut - quad(lambda s: load(s) * (cut - s), 0.0, cut)[0])
    assert sizing.whip_moment(mass, length, start, end, position) == pytest.approx(moment, abs=1e-13 * scale, rel=1e-10)


@given(st.floats(0.1, 50.0), st.floats(100.0, 3000.0), st.floats(-500.0, 500.0), st.floats(-500.0, 500.0))
def test_whip_peak_is_the_largest_moment(mass, length, start, end):
    positions = np.linspace(0.0, 1.0, 20_001)
    largest = np.abs(sizing.whip_moment(mass, length, start, end, positions)).max()
    peak = sizing.whip_moment_peak(mass, length, start, end)
    # between two positions 5e-5 apart a parabola of curvature <= 3 times the scale rises by less than 1e-9 of it
    scale = 1e-3 * mass * length**2 * max(abs(start), abs(end))
    assert largest * (1 - 1e-14) - 1e-300 <= peak <= largest + 1e-9 * scale  # 1e-300 is for subnormal numbers


def test_whip_peak_of_familiar_beams():
    uniform = sizing.whip_moment_peak(2.0, 1000.0, 10.0, 10.0)
    triangle = sizing.whip_moment_peak(2.0, 1000.0, 0.0, 10.0)
    close(uniform, 2.0 * 10.0 * 1.0**2 / 8.0 * 1e3)  # q L^2/8
    close(triangle, 2.0 * 10.0 * 1.0**2 / (9.0 * np.sqrt(3.0)) * 1e3)  # q L^2/(9 sqrt 3)
    assert sizing.whip_moment_peak(2.0, 1000.0, 0.0, 0.0) == 0.0


def test_whip_of_the_published_rod():
    """27.7 and 507.0 m/s^2 at the ends of the coupler: about 55 N m per kg/m and 84 MPa in the rod of 33 mm."""
    moment = sizing.whip_moment_peak(1.0, LENGTH, 27.7, 507.0)
    solution = minimize_scalar(
        lambda x: -sizing.whip_moment(1.0, LENGTH, 27.7, 507.0, x), bounds=(0, 1), method="bounded"
    )
    close(moment, -solution.fun, 1e-9)
    assert moment == pytest.approx(55.2e3, rel=0.01)  # the two peaks are not simultaneous
    mass = 7.85e-6 * sizing.rod_area(33.0, 0.5) * 1e3  # kg/m
    assert sizing.bending_stress(mass * moment, 33.0, 0.5) == pytest.approx(84.0, rel=0.01)
