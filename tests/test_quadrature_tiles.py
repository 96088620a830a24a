"""Tiles: moments, extremes and the hand-over of clutches for known functions, in every lane by itself."""

import math

import numpy as np
import pytest
from numba import float64, int64, void
from scipy.optimize import brentq, minimize_scalar

from explore.base.compiling import FILL_SIGNATURE, LANES, compiled, function_type
from explore.evaluation.quadrature.candidates import _mark_end, _mark_inside
from explore.evaluation.quadrature.extremes import RESULT, find_minimum
from explore.evaluation.quadrature.hand_over import HAND_OVER_SIZE, find_hand_overs
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    FIRST,
    LAST,
    PANEL_CAPACITY,
    PANELS_SIZE,
    SINGULAR,
    SPREAD,
    map_panels,
)
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.quadrature.tiles import (
    DEVIATIONS,
    INTEGRAL,
    NODE_CAPACITY,
    SHAPE_SIZE,
    SUMS_SIZE,
    fill_moments,
    gather_shapes,
    place_nodes,
)
from explore.evaluation.quadrature.work_space import TILE_WORK_TYPE, Sizes, make_work_space

_FILL, _F1, _F2 = function_type(FILL_SIGNATURE), float64[::1], float64[:, ::1]
#: Rows of the constants: amplitudes of the first, second and third harmonic, their phases, what is added, and in its
#: first lane how often a single node was filled.
HARMONICS, PHASE, OFFSET, FILLS, CONSTANTS = 3, 3, 6, 7, 8


@compiled(FILL_SIGNATURE)
def fill_harmonics(constants, tangents, anchor, law, variant, count, needs, out):
    """A sum of harmonics of the angle, and its derivative, in two rows."""
    if count == 1:
        constants[FILLS * LANES] += 1.0
    for j in range(count):
        for lane in range(LANES):
            angle = anchor * math.pi + 2.0 * math.atan(tangents[j * LANES + lane])
            value, slope = constants[OFFSET * LANES + lane], 0.0
            for k in range(HARMONICS):
                amplitude, phase = constants[k * LANES + lane], constants[(PHASE + k) * LANES + lane]
                value += amplitude * math.cos((k + 1) * angle - phase)
                slope -= (k + 1) * amplitude * math.sin((k + 1) * angle - phase)
            out[2 * j * LANES + lane], out[(2 * j + 1) * LANES + lane] = value, slope


@compiled(void(_FILL, int64, float64, int64, _F2, int64, _F1, TILE_WORK_TYPE), allocates=True)
def find_minima(fill, anchor, sign, count, table, rule, samples, tile):
    """`find_minimum` of the first row."""
    find_minimum(fill, 2, anchor, 0, 0, 0, 0, sign, count, table, rule, samples, tile)


def search(constants, shape, anchor, sign, count, table, rule, signals):
    """Smallest values of harmonics in each lane of a tile for a positive sign, else the largest, and the fills."""
    _, tile, _ = make_work_space(Sizes(CONSTANTS, 0, CONSTANTS, CONSTANTS, 2, -1, -1, 0), 0)
    tile.constants[:], tile.shape[:] = constants, shape
    tile.constants[FILLS * LANES] = 0.0
    find_minima(fill_harmonics, anchor, sign, count, table, rule, signals, tile)
    return sign * tile.state[RESULT : RESULT + LANES], tile.constants[FILLS * LANES]


@compiled(void(_FILL, _F1, int64, _F1, _F1, _F1), allocates=True)
def hand_over(fill, constants, anchor, state, tangents, signals):
    """`find_hand_overs` of the first row."""
    find_hand_overs(fill, constants, anchor, 0, 0, 0, 2, 0, 1, state, tangents, signals)


def value(constants, angle):
    """The first row of one lane."""
    orders = np.arange(1, HARMONICS + 1)
    terms = constants[:HARMONICS] * np.cos(np.multiply.outer(angle, orders) - constants[PHASE:OFFSET])
    return terms.sum(axis=-1) + constants[OFFSET]


class Tile:
    """Panels with the same rule, one in each lane, and the nodes and samples on them."""

    def __init__(self, constants, anchor, first, last, singular, count, *, ends):
        size_of, row_of, self.table = gauss_legendre_rules()
        assert size_of[count] == count
        panels = np.zeros(PANELS_SIZE)
        rows = panels.reshape(-1, PANEL_CAPACITY)[:, :LANES]
        for row, values in ((ANCHOR, anchor), (FIRST, first), (LAST, last), (SPREAD, last - first)):
            rows[row // PANEL_CAPACITY] = values
        rows[SINGULAR // PANEL_CAPACITY :] = 1.0
        rows[SINGULAR // PANEL_CAPACITY] = singular
        map_panels(panels, LANES, np.array([anchor, -1, -1]))
        self.shape, self.constants, self.anchor = np.zeros(SHAPE_SIZE), constants.reshape(-1), anchor
        gather_shapes(panels, np.arange(LANES), False, self.shape)
        self.tangents, self.weights = np.empty(NODE_CAPACITY * LANES), np.empty(NODE_CAPACITY * LANES)
        place_nodes(self.shape, count, ends, row_of, self.table, self.tangents, self.weights)
        self.count, self.rule, self.samples = count, row_of[count], count + (2 if ends else 0)
        self.signals = np.empty(2 * NODE_CAPACITY * LANES)
        fill_harmonics(self.constants, self.tangents, anchor, 0, 0, self.samples, 0, self.signals)

    def moments(self, row):
        """Weight, mean and variance in each lane."""
        sums, weight = np.empty(2 * SUMS_SIZE), np.empty(LANES)
        roots, factors = np.zeros(NODE_CAPACITY * LANES), np.zeros(2 * NODE_CAPACITY)
        fill_moments(
            self.signals, 2, np.ones(2, dtype=np.int64), self.samples, self.weights, roots, factors, weight, sums
        )
        at = row * SUMS_SIZE
        integral, deviations = (sums[at + of : at + of + LANES] for of in (INTEGRAL, DEVIATIONS))
        return weight, integral / weight, deviations / weight

    def extreme(self, sign):
        """Smallest value in each lane for a positive sign, else the largest."""
        return self.search(sign)[0]

    def search(self, sign):
        """The extremes, and how many nodes of all lanes were filled for them."""
        return search(self.constants, self.shape, self.anchor, sign, self.count, self.table, self.rule, self.signals)


def random_tile(seed, *, count=40, ends=True, same=()):
    """Panels of different lengths about one anchor; the lanes in `same` are those of lane 0."""
    rng = np.random.default_rng(seed)
    constants = np.empty((CONSTANTS, LANES))
    constants[:HARMONICS] = rng.uniform(0.1, 1.0, (HARMONICS, LANES)) / np.arange(1, HARMONICS + 1)[:, None]
    constants[PHASE:OFFSET] = rng.uniform(-np.pi, np.pi, (HARMONICS, LANES))
    constants[OFFSET] = rng.uniform(-2.0, 2.0, LANES)
    first, last = np.sort(np.tan(0.5 * rng.uniform(-1.6, 1.6, (2, LANES))), axis=0)
    singular = rng.uniform(0.2, 0.9, LANES)
    for lane in same:
        constants[:, lane] = constants[:, 0]
        first[lane], last[lane], singular[lane] = first[0], last[0], singular[0]
    return Tile(constants, seed % 2, first, last, singular, count, ends=ends), constants, first, last


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_moments_of_harmonics(seed, ends):
    tile, constants, first, last = random_tile(seed, ends=ends)
    weight, mean, variance = tile.moments(0)
    x, w = np.polynomial.legendre.leggauss(60)
    for lane in range(LANES):
        start, stop = (tile.anchor * np.pi + 2.0 * np.arctan(end[lane]) for end in (first, last))
        values = value(constants[:, lane], 0.5 * (start + stop) + 0.5 * (stop - start) * x)
        exact = 0.5 * np.sum(w * values)
        # NumPy's rule of 60 nodes and the tile's of 40 integrate the third harmonic to rounding
        assert weight[lane] == pytest.approx(stop - start, rel=1e-13)
        assert mean[lane] == pytest.approx(exact, rel=0.0, abs=1e-13)
        assert variance[lane] == pytest.approx(0.5 * np.sum(w * (values - exact) ** 2), rel=1e-11)


def test_the_variance_of_a_small_swing_keeps_its_digits():
    """The mean is 1e8 times the swing; sums of squares would lose all digits of the variance."""
    _, constants, first, last = random_tile(0)
    constants[:HARMONICS] *= 1e-8
    plain = constants.copy()
    plain[OFFSET] = 0.0
    singular = np.full(LANES, 0.5)
    shifted = Tile(constants, 0, first, last, singular, 40, ends=True).moments(0)[2]
    alone = Tile(plain, 0, first, last, singular, 40, ends=True).moments(0)[2]
    # the values carry the rounding of the mean, 2e-16 over the swing of 1e-8
    assert shifted == pytest.approx(alone, rel=1e-6)


def exact_minimum(constants, start, stop, sign):
    """Smallest value between two angles: a fine grid, then a bounded search around its best point."""
    grid = np.linspace(start, stop, 4001)
    values = sign * value(constants, grid)
    k = int(np.argmin(values))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, 4000)]
    found = minimize_scalar(
        lambda angle: sign * value(constants, angle), bounds=(low, high), method="bounded", options={"xatol": 1e-10}
    )
    return min(float(found.fun), float(values[k]))


def check_extremes(seed, count, sign):
    """Against a search of each lane by itself."""
    tile, constants, first, last = random_tile(seed, count=count)
    found = tile.extreme(sign)
    for lane in range(LANES):
        start, stop = (tile.anchor * np.pi + 2.0 * np.arctan(end[lane]) for end in (first, last))
        exact = sign * exact_minimum(constants[:, lane], start, stop, sign)
        # a position that is accurate to 1e-8 gives the value to rounding, of terms that add up to at most 4
        assert found[lane] == pytest.approx(exact, rel=0.0, abs=4e-15)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("count", [12, 40])
@pytest.mark.parametrize("seed", range(20))
def test_extremes_of_harmonics(seed, count, sign):
    """Inside and at the ends of panels, also where two minima are nearly equal."""
    check_extremes(seed, count, sign)


@pytest.mark.parametrize("at", [-0.7, -0.5, 0.0, 0.7])
@pytest.mark.parametrize("count", [12, 24, 40])
def test_three_values_of_a_signal_lead_to_an_extreme(count, at):
    """From samples about it, also beside the ends; Brent's method takes four to six."""
    constants, peaks = np.zeros((CONSTANTS, LANES)), np.linspace(-0.3, 0.3, LANES)
    constants[:HARMONICS] = np.array([1.0, 0.5, 0.25])[:, None]
    constants[PHASE:OFFSET] = np.array([1.0, 2.0, 3.0])[:, None] * peaks
    first, last = np.tan(0.5 * (peaks - at - 0.8)), np.tan(0.5 * (peaks - at + 0.8))
    largest, fills = Tile(constants, 0, first, last, np.full(LANES, 0.9), count, ends=True).search(-1.0)
    assert largest == pytest.approx(np.full(LANES, 1.75), rel=0.0, abs=2e-15)  # sums of three cosines, rounded
    assert fills <= 3


@pytest.mark.parametrize(("seed", "sign"), [(492, -1.0), (1378, -1.0), (1387, 1.0), (1419, 1.0)])
def test_trials_do_not_come_back_to_former_ones(seed, sign):
    """By polynomials through six nodes with wrong curvatures, two trials in turn may seem to be at the extreme."""
    check_extremes(seed, 6, sign)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_extremes_between_few_nodes_need_few_values(sign):
    """Of all lanes at once, of which one that leaves its extreme to Brent's method would take six more."""
    fills = [random_tile(seed, count=8)[0].search(sign)[1] for seed in range(100)]
    assert np.mean(fills) < 11.0  # 10 for some two extremes in a lane, of which some are beside ends


def double_minima(places, tilt):
    """Constants of -cos x + 0.28 cos(2 x + tilt) - 0.0085 cos 3 x, with minima of -0.7295 at -0.31 and 0.31."""
    constants = np.zeros((CONSTANTS, LANES))
    constants[:HARMONICS] = np.array([1.0, 0.28, 0.0085])[:, None]
    constants[PHASE:OFFSET] = np.array([np.pi, -tilt, np.pi])[:, None] + np.array([1.0, 2.0, 3.0])[:, None] * places
    return constants


@pytest.mark.parametrize("count", [10, 12])
@pytest.mark.parametrize("tilt", [-1e-3, 1e-5])
def test_the_lower_of_two_minima_a_few_nodes_apart(tilt, count):
    """Wherever the nodes are about them, and where they are beside an end of the panel."""
    for before in np.linspace(0.35, 1.6, 8):
        places = np.linspace(-0.3, 0.3, LANES)
        constants, last = double_minima(places, tilt), np.tan(0.5 * (places + 1.0))
        tile = Tile(constants, 0, np.tan(0.5 * (places - before)), last, np.full(LANES, 0.9), count, ends=True)
        exact = [exact_minimum(constants[:, k], p - before, p + 1.0, 1.0) for k, p in enumerate(places)]
        # of terms that add up to at most 1.3
        assert tile.extreme(1.0) == pytest.approx(exact, rel=0.0, abs=2e-15)


@pytest.mark.parametrize("count", [8, 12, 20])
@pytest.mark.parametrize("past", [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
def test_an_extreme_close_to_the_end_of_a_panel_is_found(past, count):
    """All harmonics have their largest value just inside the last or the first end."""
    constants, peaks = np.zeros((CONSTANTS, LANES)), np.linspace(-0.7, 0.7, LANES)
    constants[:HARMONICS] = np.array([1.0, 0.5, 0.25])[:, None]
    constants[PHASE:OFFSET] = np.array([1.0, 2.0, 3.0])[:, None] * peaks
    singular = np.linspace(0.2, 0.9, LANES)
    for before, after in ((0.8, past), (past, 0.8)):
        first, last = np.tan(0.5 * (peaks - before)), np.tan(0.5 * (peaks + after))
        largest = Tile(constants, 0, first, last, singular, count, ends=True).extreme(-1.0)
        # a few units in the last place: the cosines, their arguments, and the step that ends the search; with few nodes
        # a parabola through points 2 % of the way to the next node takes a slope of 1e-7 for 0
        assert largest == pytest.approx(np.full(LANES, 1.75), rel=0.0, abs=5e-14 if count == 8 else 2e-15)


def test_an_end_where_a_cubic_falls_before_it_rises_is_a_candidate():
    """It is concave at the end, and 0 there and below 0 from 0.0011 to 0.0089; its first sample is at 0.01."""
    places = np.array([0.01, 0.05, 0.1, 0.2])
    values = [np.full(LANES, x * (1e-3 - x + 100.0 * x * x) / 0.01) for x in (0.0, *places)]
    marks = np.zeros(LANES)
    _mark_end(*values, *places, 5.0, np.full(LANES, 7.0), marks)
    assert (marks == 5.0).all()
    _mark_end(values[0], *(value + 1.0 for value in values[1:]), *places, 5.0, np.full(LANES, 7.0), marks)
    assert (marks == 7.0).all()


def test_a_sample_whose_neighbours_are_equal_may_be_beside_the_least_value():
    """Of x^2 + (x^3 - x) / 2, which falls to -0.056 beside x = 0; the least sample of all, elsewhere, is -0.05."""
    values, marks = np.repeat([1.0, 0.0, 1.0], LANES), np.zeros(LANES)
    _mark_inside(values, values, values, 5, -1.0, 0.0, 1.0, np.full(LANES, -0.05), np.full(LANES, 7.0), marks, LANES)
    assert (marks == 5.0).all()
    _mark_inside(values, values, values, 5, -1.0, 0.0, 1.0, np.full(LANES, -16.5), np.full(LANES, 7.0), marks, LANES)
    assert (marks == 7.0).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("step", "is_searched"), [(2.0**-51, False), (1e-12, True)])
def test_a_minimum_of_rounding_is_not_searched(step, is_searched, sign):
    """Samples fall to 1 + step and rise, one step each; a search evaluates the signal, which is 1."""
    tile, constants, *_ = random_tile(3)
    constants[:HARMONICS], constants[OFFSET] = 0.0, sign
    steps = 1.0 + np.abs(np.arange(NODE_CAPACITY) - 20.0)
    tile.signals.reshape(-1, 2, LANES)[:, 0] = sign * (1.0 + step * steps)[:, None]
    assert (tile.extreme(sign) == sign * (1.0 if is_searched else 1.0 + step)).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_lanes_do_not_depend_on_their_neighbours(sign):
    """Bit for bit, whatever the other lanes hold, and in whichever lane a panel is."""
    alone, *_ = random_tile(1, same=range(1, LANES))
    among, *_ = random_tile(1)
    for of_alone, of_among in zip(alone.moments(0), among.moments(0), strict=True):
        assert (of_alone == of_alone[0]).all()
        assert of_among[0] == of_alone[0]
    extremes = alone.extreme(sign)
    assert (extremes == extremes[0]).all()
    assert among.extreme(sign)[0] == extremes[0]


def test_clutches_hand_over_where_the_rates_are_equal():
    """A rate with one extreme on a stroke from 0 to 0; the ends of the part that drives are a period apart."""
    rng = np.random.default_rng(5)
    constants, singular = np.zeros((CONSTANTS, LANES)), np.full(LANES, 0.6)
    centre, skew = rng.uniform(-0.4, 0.4, LANES), rng.uniform(0.0, 0.2, LANES)
    skew[:4] = 0.0
    constants[0], constants[1] = 1.0, skew
    constants[PHASE], constants[PHASE + 1] = centre, 2.0 * centre + 0.5 * np.pi  # skew sin(2 (angle - centre))
    constants[:HARMONICS, ::2] *= -1.0
    rising = np.where(np.arange(LANES) % 2, 1.0, -1.0)
    periods = rng.uniform(0.5, 3.0, LANES)
    first, last = np.tan(0.5 * (centre - 0.5 * np.pi)), np.tan(0.5 * (centre + 0.5 * np.pi))
    strokes = first, last
    state = np.zeros((HAND_OVER_SIZE // LANES, LANES))
    state[:5] = first, last, singular, rising, periods
    hand_over(fill_harmonics, constants.reshape(-1), 0, state.reshape(-1), np.empty(2 * LANES), np.empty(4 * LANES))
    first, last = state[:2]
    for lane in range(LANES):
        c = constants[:, lane]
        exact = brentq(
            lambda angle, c=c, lane=lane: value(c, angle) - value(c, angle + periods[lane]),
            centre[lane] - 0.5 * np.pi, centre[lane] + 0.5 * np.pi - periods[lane], xtol=1e-15,
        )  # fmt: skip
        start, stop = 2.0 * np.arctan(first[lane]), 2.0 * np.arctan(last[lane])
        assert strokes[0][lane] < first[lane] < last[lane] < strokes[1][lane]
        # the root of a difference whose slope is about 1: rounding of its two terms
        assert start == pytest.approx(exact, rel=0.0, abs=4e-15)
        assert stop - start == pytest.approx(periods[lane], rel=0.0, abs=2e-15)
    symmetric = 2.0 * np.arctan(first[:4])
    assert symmetric == pytest.approx(centre[:4] - 0.5 * periods[:4], rel=0.0, abs=2e-15)
