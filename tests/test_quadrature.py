"""Gauss-Legendre rules against mpmath, panels against geometry, node counts against the logarithm of the margin."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import explore
from explore.quadrature.node_placement import map_panel, node_count, place_nodes
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
