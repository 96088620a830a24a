"""Gauss-Legendre rules against mpmath, panels against geometry, node counts against the logarithm of the margin."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import float64, int64, njit, types
from scipy.optimize import brentq

import explore
from explore.compiling import FILL_SIGNATURE, function_type
from explore.quadrature.magnitudes import power_means
from explore.quadrature.node_placement import LOG_CONSTANT_2, LOG_CONSTANT_4, map_panel, node_count, place_nodes
from explore.quadrature.rules import LARGEST_NODE_COUNT, NODE_COUNTS, gauss_legendre_rules

_PATH = Path(__file__).parent / "reference" / "make_gauss_legendre.py"
_SPEC = importlib.util.spec_from_file_location("make_gauss_legendre", _PATH)
make_gauss_legendre = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(make_gauss_legendre)


def stored_rule(n):
    """Non-negative nodes and weights of the stored rule of n nodes."""
    _, row_of, table = gauss_legendre_rules()
    return table[row_of[n] : row_of[n] + (n + 1) // 2]


@pytest.mark.parametrize("n", [5, 12, 40, 320])
def test_rules_are_correctly_rounded(n):
    exact = make_gauss_legendre.rule(n)
    # rounded once from 40 digits; one unit in the last place allows for a tie
    assert (np.abs(stored_rule(n) - exact) <= np.spacing(exact)).all()


@pytest.mark.parametrize("n", NODE_COUNTS)
def test_rules_integrate_polynomials(n):
    x, w = stored_rule(n).T
    double = np.where(x > 0.0, 2.0, 1.0)
    assert (np.diff(x) < 0.0).all()
    assert x[0] < 1.0
    assert (w > 0.0).all()
    for degree in {0, 2, n // 2 * 2, 2 * n - 2}:
        # x^m multiplies the half-ulp error of a node near 1 by m, and the sum is dominated by those for large m
        assert math.fsum(double * w * x**degree) == pytest.approx(2.0 / (degree + 1), rel=2e-16 * (4 + degree))


def test_rounding_up_adds_few_nodes():
    size_of, _, _ = gauss_legendre_rules()
    counts = np.arange(NODE_COUNTS[0], LARGEST_NODE_COUNT + 1)
    assert (size_of[counts] >= counts).all()
    assert (size_of[counts] <= np.maximum(counts + 1, 1.1 * counts)).all()
    assert set(size_of[counts]) == set(NODE_COUNTS)


half_tangents = st.floats(-30.0, 5.0).map(lambda e: 2.0**e)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    anchor=st.integers(0, 1),
    here=st.floats(-40.0, -0.1).map(lambda e: 2.0**e),
    there=st.floats(-40.0, -0.1).map(lambda e: 2.0**e),
    first=half_tangents,
    last=half_tangents,
    sides=st.sampled_from([(-1, 1), (-1, -1), (1, 1)]),
    ends=st.booleans(),
)
def test_panels_recover_the_length_of_their_interval(anchor, here, there, first, last, sides, ends):
    first, last = sides[0] * first, sides[1] * last
    if last < first:
        first, last = last, first
    interval = 2.0 * math.atan2(last - first, 1.0 + first * last)
    singular = np.array([[here, there, 1.0] if anchor == 0 else [there, here, 1.0]])
    shapes = np.empty((1, 4))
    map_panel(np.array([[float(anchor), first, last]]), 0, singular, 0, shapes)
    shape = shapes[0]
    if shape[1] < 1e-3:
        return  # no window of a linkage is that short in t, where such ends differ by rounding only
    size_of, row_of, table = gauss_legendre_rules()
    count = node_count(math.log(1e-15), shape[1], shape[3], 2, size_of)
    t, sine, cosine, weight = (np.zeros(count + 2) for _ in range(4))
    place_nodes(shapes, 0, anchor, count, 0, row_of, table, ends, t, sine, cosine, weight)
    total = count + 2 if ends else count
    if count < LARGEST_NODE_COUNT:
        # every weight carries a few roundings, and t = asinh(tangent/T), up to 32, carries its own into the ends
        assert weight.sum() == pytest.approx(interval, rel=1e-14 * max(1.0, 1.0 / shape[1]))
    assert (weight[:total] >= 0.0).all()
    # sine and cosine of the same angle: rounding of each, squared
    assert np.abs(sine[:total] ** 2 + cosine[:total] ** 2 - 1.0).max() < 1e-15
    assert (np.diff(t[:total]) > 0.0).all()
    if ends:
        at = sine if anchor == 0 else -cosine
        other = cosine if anchor == 0 else sine
        # exp and log of t up to 32 have a few times its absolute rounding, 32 * 1.1e-16
        assert at[0] / other[0] == pytest.approx(first, rel=3e-14)
        assert at[total - 1] / other[total - 1] == pytest.approx(last, rel=3e-14)
        assert weight[0] == weight[total - 1] == 0.0


@pytest.mark.parametrize(("order", "constant"), [(2, LOG_CONSTANT_2), (4, LOG_CONSTANT_4), (6, LOG_CONSTANT_4)])
def test_the_node_count_is_the_smallest_that_the_error_model_allows(order, constant):
    """Against the model at every node count that has a rule, where `node_count` solves an equation."""
    rng = np.random.default_rng(0)
    size_of, _, _ = gauss_legendre_rules()
    counts = np.array(NODE_COUNTS)
    for _ in range(5000):
        half, log_tolerance = 2.0 ** rng.uniform(-3.0, 5.0), math.log(10.0) * rng.uniform(-15.0, -2.0)
        rate = math.asinh(0.5 * math.pi / half) * rng.uniform(1.0, 2.0)  # the least rate is that of a singular centre
        excess = constant + order * np.log((2.0 * counts + 1.0) / half) - 2.0 * counts * rate - log_tolerance
        chosen = NODE_COUNTS.index(node_count(log_tolerance, half, rate, order, size_of))
        assert chosen == 0 or excess[chosen - 1] > 0.0
        # Three rounds from below leave an excess of up to 0.53; the loop asks for 1.5 less than its tolerance.
        assert excess[chosen] <= math.log(1.8) or counts[chosen] == LARGEST_NODE_COUNT


#: Half width in u = tan(angle/2) of a peak of the magnitude (1 + u^2)/(2 ((u - peak)^2 + width^2)). Its integral over
#: the angle is that of 1/((u - peak)^2 + width^2) over u, a difference of arctangents.
PEAK_WIDTH = 0.1


@njit(FILL_SIGNATURE)
def fill_squared_peak(kernel, sin_half, cos_half, count, needs, signals):
    """The square of the magnitude, as a mechanism fills it; the kernel holds the place of the peak."""
    for j in range(count):
        offset = sin_half[j] - kernel[0] * cos_half[j]
        signals[0, j] = (2.0 * (offset**2 + (PEAK_WIDTH * cos_half[j]) ** 2)) ** -2


_ROW, _ROWS, _INTEGERS = float64[::1], float64[:, ::1], int64[::1]


@njit(
    types.Tuple((float64, float64, int64))(
        function_type(FILL_SIGNATURE), _ROW, _ROWS, _ROWS, float64, _INTEGERS, _INTEGERS, _ROWS, _ROWS, _ROWS
    )
)
def integrate_magnitude(fill, kernel, parts, shapes, tolerance, size_of, row_of, table, node, node_signals):
    """`power_means` of power 0 of row 0, over one panel."""
    return power_means(fill, kernel, 0, 0, 0, 1, parts, shapes, tolerance, size_of, row_of, table, node, node_signals)


def clustered_rule(n, peak):
    """The integral of the peak over a half turn by n clustered nodes, with NumPy's Gauss-Legendre rule."""
    s, weight = np.polynomial.legendre.leggauss(n)
    half = math.asinh(1.0)
    t = half * (15.0 * s - 10.0 * s**3 + 3.0 * s**5) / 8.0
    slope = half * 15.0 / 8.0 * (1.0 - s**2) ** 2
    return np.sum(weight * slope * np.cosh(t) / ((np.sinh(t) - peak) ** 2 + PEAK_WIDTH**2))


@pytest.mark.parametrize("bracket", [(0.02, 0.05), (0.08, 0.11), (0.21, 0.24)])
def test_two_rules_that_agree_by_accident_do_not_end_the_search(bracket):
    """At one place of the peak 40 and 80 nodes agree, and are both wrong by 1e-4."""
    tolerance = 1e-5
    peak = brentq(lambda at: clustered_rule(40, at) - clustered_rule(80, at), *bracket, xtol=1e-15)
    exact = (math.atan((1.0 - peak) / PEAK_WIDTH) + math.atan((1.0 + peak) / PEAK_WIDTH)) / PEAK_WIDTH
    assert clustered_rule(40, peak) == pytest.approx(clustered_rule(80, peak), rel=1e-12)
    assert abs(clustered_rule(80, peak) / exact - 1.0) > 5.0 * tolerance
    integral, bound, _ = integrate_magnitude(
        fill_squared_peak, np.array([peak]), np.array([[0.0, -1.0, 1.0]]), np.array([[0.0, math.asinh(1.0), 1.0, 0.0]]),
        tolerance, *gauss_legendre_rules(), np.empty((2, 1)), np.empty((1, 1)),
    )  # fmt: skip
    assert abs(integral / exact - 1.0) <= bound <= tolerance


def test_node_counts_grow_like_the_logarithm_of_the_distance():
    exponents = np.arange(4, 40, 4)
    ground = 691.75 + 2.0**-exponents  # dyadic: the margin is exactly 2^-k mm
    fixed = np.ones(len(ground))
    for window, most_nodes in (("cycle", 1_000), ("drive", 200), ("return", 200)):
        table = explore.evaluate(
            "crank-rocker",
            {"crank": 150.0 * fixed, "coupler": 1083.5 * fixed, "rocker": 541.75 * fixed, "ground": ground},
            metrics=["rocker_velocity_variance", "rocker_acceleration_variance"],
            window=window,
            tolerance=1e-9,
        )
        nodes = table["nodes"].to_numpy(dtype=float)
        assert nodes.max() <= most_nodes
        steps = np.diff(nodes)
        # Each step divides the distance by 16. A power of it would make the steps grow; a logarithm keeps them equal,
        # up to the coarseness of the stored sizes (10 % of a rule) on two panels.
        assert steps.max() <= 0.15 * nodes.max() + 8.0, window
        assert nodes[-1] - nodes[len(nodes) // 2] <= 1.5 * (nodes[len(nodes) // 2] - nodes[0]) + 0.1 * nodes[-1], window
