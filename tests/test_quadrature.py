"""Gauss-Legendre rules against mpmath, panels against geometry, node counts against the error model and the margin."""

import importlib.util
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import float64, int64, types
from scipy.optimize import brentq

import explore
from explore.base.compiling import FILL_SIGNATURE, LANES, compiled, function_type
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.magnitudes import _turn_mean, power_means, sum_powers
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    CENTRE,
    COUNT,
    FIRST,
    FOURTH,
    HALF,
    LARGEST_SCALE,
    LAST,
    LENGTH,
    LOG_CONSTANT_2,
    LOG_CONSTANT_4,
    PANEL_CAPACITY,
    PANELS_SIZE,
    RATE,
    SCALE,
    SECOND,
    SINGULAR,
    SIXTH,
    SPREAD,
    TARGET,
    count_nodes,
    map_panels,
    model_errors,
)
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT, NODE_COUNTS, gauss_legendre_rules
from explore.evaluation.quadrature.tiles import NODE_CAPACITY, SHAPE_SIZE, gather_shapes, place_nodes
from explore.evaluation.quadrature.work_space import TILE_WORK_TYPE, Sizes, make_work_space

_PATH = Path(__file__).parent / "reference" / "make_gauss_legendre.py"
_SPEC = importlib.util.spec_from_file_location("make_gauss_legendre", _PATH)
make_gauss_legendre = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(make_gauss_legendre)


def stored_rule(n):
    """Non-negative nodes and weights of the stored rule of n nodes."""
    _, row_of, table = gauss_legendre_rules()
    return table[row_of[n] : row_of[n] + (n + 1) // 2, :2]


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


@pytest.mark.parametrize("n", [4, 5, 40, 320])
def test_rules_know_their_last_polynomial(n):
    _, row_of, table = gauss_legendre_rules()
    x, _, q = table[row_of[n] : row_of[n] + (n + 1) // 2].T
    last, before = (np.array([float(mpmath.legendre(order, node)) for node in x]) for order in (n - 1, n - 2))
    slope = (n - 1) * (x * last - before) / (x**2 - 1.0)
    # the table has the values at the nodes before their rounding by half an ulp, and roundings of its own
    allowed = 0.5 * np.spacing(x) * np.abs(slope) + 2e-15 * np.abs(last)
    assert (np.abs(q / math.sqrt(n - 0.5) - last) <= allowed).all()


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
    panels = np.zeros(PANELS_SIZE)
    panels[[ANCHOR, FIRST, LAST, SPREAD]] = anchor, first, last, last - first
    # the third singularity stands for none
    panels[SINGULAR::PANEL_CAPACITY] = (here, there, 1.0) if anchor == 0 else (there, here, 1.0)
    map_panels(panels, 1, np.array([0, 1, -1]))
    half = panels[HALF]
    assert panels[SCALE] == min(here, LARGEST_SCALE, max(abs(first), abs(last)))
    # two units in the last place of the arctangent, and the rounding of its arguments
    assert panels[LENGTH] == pytest.approx(interval, rel=1e-15)
    if half < 1e-3:
        return  # no window of a linkage is that short in t, where such ends differ by rounding only
    size_of, row_of, table = gauss_legendre_rules()
    panels[TARGET] = math.log(1e-15)
    count_nodes(panels, 1, 2)
    count = size_of[int(panels[COUNT])]
    shape, tangents, weights = np.zeros(SHAPE_SIZE), np.empty((NODE_CAPACITY, LANES)), np.empty((NODE_CAPACITY, LANES))
    gather_shapes(panels, np.zeros(LANES, dtype=np.int64), False, shape)
    place_nodes(shape, count, ends, row_of, table, tangents.reshape(-1), weights.reshape(-1))
    total = count + 2 if ends else count
    tangent, weight = tangents[:total, 0], weights[:total, 0]
    assert (tangents[:total] == tangents[:total, :1]).all()
    assert (weights[:total] == weights[:total, :1]).all()
    if count < LARGEST_NODE_COUNT:
        # every weight carries a few roundings, and t = asinh(tangent/T), up to 32, carries its own into the ends
        assert weight.sum() == pytest.approx(interval, rel=1e-14 * max(1.0, 1.0 / half))
    assert (weight >= 0.0).all()
    assert (np.diff(tangent) > 0.0).all()
    if ends:
        # exp and log of t up to 32 have a few times its absolute rounding, 32 * 1.1e-16; near the anchor sinh(t) is a
        # difference of two exponentials, each with the rounding of t
        assert tangent[[0, -1]] == pytest.approx([first, last], rel=3e-14, abs=1e-14 * here)
        assert weight[0] == weight[-1] == 0.0


@pytest.mark.parametrize("rate", [1e-31, 0.0])
def test_a_singularity_at_a_node_asks_for_the_most_nodes(rate):
    """No number of nodes would do; made whole, it had the smallest integer, and memory before the rules was read."""
    panels = np.ones(PANELS_SIZE)
    panels[RATE], panels[TARGET] = rate, -20.0
    count_nodes(panels, 1, 2)
    assert panels[COUNT] == LARGEST_NODE_COUNT


@pytest.mark.parametrize("anchor", [0, 1])
def test_panels_know_their_nearest_singularity(anchor):
    """The sum of semi-axes of the largest ellipse with the ends of the panel as foci that meets no singularity."""
    rng = np.random.default_rng(1)
    count, anchors = 500, np.array([0, 1, 0])
    panels = np.zeros(PANELS_SIZE)
    rows = panels.reshape(-1, PANEL_CAPACITY)[:, :count]
    rows[ANCHOR // PANEL_CAPACITY] = anchor
    ends = np.sort(np.tan(rng.uniform(-0.49, 0.49, (2, count)) * np.pi), axis=0)
    rows[FIRST // PANEL_CAPACITY], rows[LAST // PANEL_CAPACITY] = ends
    rows[SPREAD // PANEL_CAPACITY] = ends[1] - ends[0]
    distances = rows[SINGULAR // PANEL_CAPACITY :][:3]
    distances[:] = 10.0 ** rng.uniform(-6.0, -0.01, (3, count))
    distances[:, ::5] = rng.uniform(0.8, 1.0, (3, count // 5))
    map_panels(panels, count, anchors)
    reach = np.minimum(np.abs(ends).max(axis=0), LARGEST_SCALE)
    scale = np.append(distances[anchors == anchor], reach[None], axis=0).min(axis=0)
    start, stop = np.arcsinh(ends / scale)
    # half-tangents of all singularities, on the imaginary axis; those of the opposite are -1 over theirs; i is infinity
    tangents = [d if a == anchor else 1.0 / d for d, a in zip(distances, anchors, strict=True)] + [np.ones(count)]
    t = np.arcsinh(1j * np.maximum(np.array(tangents) / scale, 1.0))
    t = np.concatenate([t, -t.conj()])
    offsets = (t - 0.5 * (start + stop)) / (0.5 * (stop - start))
    # of both roots the one outside the unit circle
    rate = np.abs(np.log(np.abs(offsets + np.sqrt(offsets - 1.0) * np.sqrt(offsets + 1.0)))).min(axis=0)
    assert rows[SCALE // PANEL_CAPACITY] == pytest.approx(scale, rel=0.0)
    assert rows[CENTRE // PANEL_CAPACITY] == pytest.approx(0.5 * (start + stop), rel=1e-13, abs=1e-13)
    # arcosh of a number near 1 loses half of the digits
    assert rows[RATE // PANEL_CAPACITY] == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(
    ("order", "row", "constant"),
    [(2, SECOND, LOG_CONSTANT_2), (4, FOURTH, LOG_CONSTANT_4), (6, SIXTH, LOG_CONSTANT_4)],
)
def test_the_node_count_is_the_smallest_that_the_error_model_allows(order, row, constant):
    """Against the model at every node count that has a rule, where `count_nodes` solves an equation."""
    rng = np.random.default_rng(0)
    size_of, _, _ = gauss_legendre_rules()
    n, counts = PANEL_CAPACITY, np.array(NODE_COUNTS)[:, None]
    panels = np.zeros(PANELS_SIZE)
    half = panels[HALF : HALF + n] = 2.0 ** rng.uniform(-3.0, 5.0, n)
    # the least rate is that of a singular centre
    rate = panels[RATE : RATE + n] = np.arcsinh(0.5 * math.pi / half) * rng.uniform(1.0, 2.0, n)
    target = panels[TARGET : TARGET + n] = math.log(10.0) * rng.uniform(-15.0, -2.0, n)
    count_nodes(panels, n, order)
    model = constant + order * np.log((2.0 * counts + 1.0) / half) - 2.0 * counts * rate
    chosen = np.searchsorted(NODE_COUNTS, size_of[panels[COUNT : COUNT + n].astype(np.int64)])
    excess = model - target
    every = np.arange(n)
    assert ((chosen == 0) | (excess[chosen - 1, every] > 0.0)).all()
    # Three rounds from below leave an excess of up to 0.53; the loop asks for 1.5 less than its tolerance.
    assert ((excess[chosen, every] <= math.log(1.8)) | (chosen == len(NODE_COUNTS) - 1)).all()
    assert len(np.unique(chosen)) > 30
    panels[COUNT : COUNT + n] = counts[chosen, 0]
    model_errors(panels, n)
    # the exponent is rounded, and the exponential of a number of up to 700 multiplies its error
    expected = np.exp(np.maximum(model[chosen, every], -600.0))
    assert np.where(expected > 1e-260, panels[row : row + n], expected) == pytest.approx(expected, rel=1e-12)


def test_more_nodes_help_where_a_bound_is_not_that_of_rounding():
    """Twice the rounding, or rounding well below the tolerance; each design by its own."""
    rng, n = np.random.default_rng(3), 64
    rows = np.zeros((bounds.BOUNDS_SIZE // bounds.CHUNK, bounds.CHUNK))
    model, rounding = 10.0 ** rng.uniform(-11.0, -8.0, (2, n))
    for row, values in ((bounds.QUADRATURE, model), (bounds.ROUNDING_OF_ROW, rounding)):
        rows[row // bounds.CHUNK, :n] = values
    bounds._finish_bound(rows.reshape(-1), n, bounds.FLAG_MOMENTS, 1e-9)
    bound = model + rounding
    is_missed, helps = bound > 1e-9, (bound > 2.0 * rounding) | (rounding < 0.9e-9)
    assert {*zip(is_missed.tolist(), helps.tolist(), strict=True)} >= {(True, True), (True, False), (False, True)}
    assert rows[bounds.WORST // bounds.CHUNK, :n].tolist() == bound.tolist()
    assert rows[bounds.IMPROVABLE // bounds.CHUNK, :n].tolist() == (is_missed & helps).tolist()


#: Half width in u = tan(angle/2) of a peak of the magnitude (1 + u^2)/(2 ((u - peak)^2 + width^2)). Its integral over
#: the angle is that of 1/((u - peak)^2 + width^2) over u, a difference of arctangents.
PEAK_WIDTH = 0.1


@compiled(FILL_SIGNATURE)
def fill_squared_peak(constants, tangents, anchor, law, variant, count, needs, out):
    """The square of the magnitude, as a mechanism fills it; the constant is the place of the peak."""
    for k in range(count * LANES):
        square, offset = tangents[k] ** 2, tangents[k] - constants[k % LANES]
        out[k] = ((1.0 + square) / (2.0 * (offset**2 + PEAK_WIDTH**2))) ** 2


_F1, _F2, _I1 = float64[::1], float64[:, ::1], int64[::1]


@compiled(
    types.Tuple((float64, float64, int64))(
        function_type(FILL_SIGNATURE), _F1, float64, float64, _I1, _I1, _F2, TILE_WORK_TYPE
    )
)  # fmt: skip
def integrate_magnitude(fill, panels, highest, tolerance, size_of, row_of, table, tile):
    """`power_means` of power 0 of row 0, over one panel."""
    return power_means(fill, 0, 1, 0, 0, panels, 0, 1, 1, highest, tolerance, size_of, row_of, table, tile)


@compiled(types.void(_F1, _F1, int64, _F1))
def sum_powers_of_tile(squares, weight, power, sums):
    """`sum_powers` of one tile."""
    sums[0] = sum_powers(squares, weight, power)


@pytest.mark.parametrize(("power", "root", "exponent"), [(0, 2, 1), (1, 3, 5)])
def test_powers_of_squares_are_exact_to_rounding(power, root, exponent):
    """Of squares of all sizes, beside mpmath; what is negative by rounding counts as 0."""
    sums, weight = np.zeros(1), np.zeros(LANES)
    for lane, size in enumerate(np.linspace(-170.0, 170.0, 341)):
        squares = np.full(LANES, -1e-20)
        squares[lane % LANES] = 10.0**size
        weight[:] = 1.0
        sum_powers_of_tile(squares, weight, power, sums)
        exact = mpmath.root(mpmath.mpf(squares[lane % LANES]), root) ** exponent
        assert abs(sums[0] / exact - 1) < 2e-15


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
    panels = np.zeros(PANELS_SIZE)
    panels[[FIRST, LAST, HALF, SCALE]] = -1.0, 1.0, math.asinh(1.0), 1.0
    sizes = Sizes(n_constants=1, n_fill_constants=1, rows=1, record_rows=1, first_parameter=0, noise_row=-1,
                  variant_row=-1, is_disturbed=0)  # fmt: skip
    _, tile, _ = make_work_space(sizes, 0)
    tile.constants[:] = peak
    integral, bound, _ = integrate_magnitude(fill_squared_peak, panels, 1.0, tolerance, *gauss_legendre_rules(), tile)
    assert abs(integral / exact - 1.0) <= bound <= tolerance


@compiled(FILL_SIGNATURE)
def fill_squared_sine(constants, tangents, anchor, law, variant, count, needs, out):
    """The square of the magnitude |c - sin(angle)|; c is the constant."""
    for k in range(count * LANES):
        sine = 2.0 * tangents[k] / (1.0 + tangents[k] ** 2)
        out[k] = (constants[k % LANES] - sine) ** 2


def test_a_panel_without_minima_keeps_the_samples_of_their_search():
    """Of 3 - sin over a half turn, for which 24 nodes suffice: 24 and 48 are compared with the 96 of the search."""
    panels = np.zeros(PANELS_SIZE)
    panels[[FIRST, LAST, HALF, SCALE]] = -1.0, 1.0, math.asinh(1.0), 1.0
    sizes = Sizes(n_constants=1, n_fill_constants=1, rows=1, record_rows=1, first_parameter=0, noise_row=-1,
                  variant_row=-1, is_disturbed=0)  # fmt: skip
    _, tile, _ = make_work_space(sizes, 0)
    tile.constants[:] = 3.0
    integral, _, nodes = integrate_magnitude(
        fill_squared_sine, panels, 1.0 / 64.0, 1e-12, *gauss_legendre_rules(), tile
    )
    assert abs(integral / (3.0 * math.pi) - 1.0) < 2e-15
    assert nodes == 24 + 48 + 96


@compiled(types.Tuple((float64, float64, int64))(function_type(FILL_SIGNATURE), float64, TILE_WORK_TYPE))
def integrate_turn(fill, tolerance, tile):
    """`_turn_mean` of power 0 of row 0."""
    return _turn_mean(fill, 0, 1, 0, 0, 0, 0, 0, tolerance, tile)


@pytest.mark.parametrize("tolerance", [1e-12, 1e-9, 1e-6])
def test_equispaced_nodes_serve_magnitudes_away_from_zero_alone(tolerance):
    """Of |c - sin|, whose zeros lie anywhere between nodes and whose minima near 0 are as narrow as one likes."""
    sizes = Sizes(n_constants=1, n_fill_constants=1, rows=1, record_rows=1, first_parameter=0, noise_row=-1,
                  variant_row=-1, is_disturbed=0)  # fmt: skip
    _, tile, _ = make_work_space(sizes, 0)
    served = 0
    for c in np.concatenate([np.linspace(0.0, 1.0, 1001), 1.0 + np.geomspace(1e-9, 10.0, 1000)]):
        tile.constants[:] = c
        integral, bound, nodes = integrate_turn(fill_squared_sine, tolerance, tile)
        if bound == math.inf:
            assert c < 1.3
            continue
        served += 1
        assert c > 1.0
        assert abs(integral / (2.0 * math.pi * c) - 1.0) <= bound + 1e-15
        assert bound <= tolerance
        assert nodes <= 128
    assert served > 100


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
