"""Turns with equispaced nodes: where these stand, what their tails see, extremes across the seam, and who has them."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_quadrature_tiles import (
    CONSTANTS,
    HARMONICS,
    OFFSET,
    PHASE,
    double_minima,
    exact_minimum,
    fill_harmonics,
    search,
    value,
)
from toy_mechanism import PEAK, Row

from explore.base.compiling import LANES
from explore.evaluation import sampled
from explore.evaluation.evaluate import evaluate_columns
from explore.evaluation.quadrature.equispaced import (
    FEWEST_NODES,
    LOG_CONSTANT_2,
    LOG_CONSTANT_4,
    MOST_NODES,
    WORTH,
    choose_equispaced,
    model_equispaced,
    place_equispaced,
    place_equispaced_factors,
    repeat_turn,
)
from explore.evaluation.quadrature.panels import (
    COUNT,
    FOURTH,
    HALF,
    PANEL_CAPACITY,
    PANELS_SIZE,
    RATE,
    SCALE,
    SECOND,
    SINGULAR,
    SIXTH,
)
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.quadrature.tiles import SHAPE_SIZE, TILE_HALF, TILE_RESOLUTION
from explore.mechanisms.registry import MECHANISMS
from explore.model.quadrature import Graded
from explore.model.status import Status
from explore.studies.request.requests import make_request

CRANK_ROCKER = MECHANISMS["crank-rocker"]
COUNTS = (8, 10, 22, 64)


def nodes_of(count):
    """Angles of the nodes, between -pi and pi, and the half-tangents and weights of the first lane."""
    tangents, weights = np.empty((count, LANES)), np.empty((count, LANES))
    place_equispaced(count, tangents.reshape(-1), weights.reshape(-1))
    assert (tangents == tangents[:, :1]).all()
    assert (weights == weights[:, :1]).all()
    return np.pi * (2.0 * np.arange(count) + 1.0 - count) / count, tangents[:, 0], weights[:, 0]


@pytest.mark.parametrize("count", COUNTS)
def test_nodes_divide_the_turn(count):
    angles, tangents, weights = nodes_of(count)
    exact = [float(mpmath.tan(mpmath.mpf(angle) / 2)) for angle in angles]
    # the roundings of the angle, which the largest tangents multiply by their size, and of the tangent
    assert np.abs(tangents / exact - 1.0).max() <= 4e-16 * (1.0 + np.abs(tangents).max())
    assert (tangents == -tangents[::-1]).all()
    assert weights == pytest.approx(np.full(count, 2.0 * np.pi / count), rel=2e-16)


@pytest.mark.parametrize("shift", [0, 1])
@pytest.mark.parametrize("phase", [0.0, 0.5 * np.pi, 0.3])
@pytest.mark.parametrize("count", COUNTS)
def test_tails_are_components_along_the_last_two_waves(count, phase, shift):
    """Even and odd signals, of both parities of the order, have a tail; constants and slow waves have none."""
    factors = np.empty(2 * count)
    place_equispaced_factors(count, factors)
    angles, _, _ = nodes_of(count)
    order = (count - 1) // 2 - shift
    parts = factors.reshape(count, 2).T @ np.cos(order * angles - phase)
    # the wave along (cos + sin)/sqrt(2 pi); recurrences of `count` steps gather as many roundings
    expected = math.sqrt(0.5 * math.pi) * (math.cos(phase) + math.sin(phase))
    assert parts[shift] == pytest.approx(expected, rel=0.0, abs=4e-15 * count)
    assert parts[1 - shift] == pytest.approx(0.0, abs=4e-15 * count)
    for slow in range(order - 1):
        waves = factors.reshape(count, 2).T @ np.cos(slow * angles - phase)
        assert waves == pytest.approx([0.0, 0.0], abs=4e-15 * count)


@pytest.mark.parametrize("order", [2, 4, 6])
def test_the_count_is_the_smallest_that_the_error_model_allows(order):
    rng = np.random.default_rng(0)
    n = PANEL_CAPACITY // 2
    panels = np.zeros(PANELS_SIZE)
    rows = panels.reshape(-1, PANEL_CAPACITY)
    rows[SINGULAR // PANEL_CAPACITY :] = 1.0
    half = rows[SINGULAR // PANEL_CAPACITY + 1, :n] = rng.uniform(0.02, 1.0, n)
    rows[SINGULAR // PANEL_CAPACITY, :n] = np.where(np.arange(n) % 2, half, 1.0)
    of_graded = rows[COUNT // PANEL_CAPACITY, : 2 * n] = rng.integers(4, 60, 2 * n)
    rows[SCALE // PANEL_CAPACITY], target = 0.5, math.log(1e-9)
    choose_equispaced(panels, n, order, target, False)
    chosen, nodes = rows[SCALE // PANEL_CAPACITY, :n] == 0.0, rows[COUNT // PANEL_CAPACITY, :n]
    delta = 2.0 * np.arctanh(np.minimum(half, 0.99))
    constant = LOG_CONSTANT_2 if order == 2 else LOG_CONSTANT_4

    def model(counts, distances):
        return constant + (order - 1) * np.log(1.0 + counts * distances) - (counts - 2.0) * distances

    every = np.arange(FEWEST_NODES, MOST_NODES + 1)[:, None]
    least = np.where(model(every, delta) <= target, every, 10**6).min(axis=0)
    # even, and multiples of 4 beyond 32; three rounds from below may end just short of an integer
    rounded = np.where(least <= 32, (least + 1) // 2 * 2, (least + 3) // 4 * 4)
    of_both = WORTH * of_graded.reshape(2, n).sum(axis=0)
    assert (chosen == ((nodes <= of_both) & chosen)).all()
    assert np.isin((rounded - nodes)[chosen], (0, 2, 4)).all()
    assert np.mean((rounded == nodes)[chosen]) > 0.95
    assert (model(nodes, delta)[chosen] <= target + 0.1).all()
    assert (rounded > of_both)[~chosen].all()
    assert 0.2 < np.mean(chosen) < 0.8
    model_equispaced(panels, n)
    second = np.exp(LOG_CONSTANT_2 - (nodes - 2.0) * delta) * (1.0 + nodes * delta)
    higher = math.exp(LOG_CONSTANT_4 - LOG_CONSTANT_2) * second * (1.0 + nodes * delta) ** 2
    for row, expected in ((SECOND, second), (FOURTH, higher), (SIXTH, higher * (1.0 + nodes * delta) ** 2)):
        # exponents of up to 40 are rounded, and the distance of a half-tangent near 1
        assert rows[row // PANEL_CAPACITY, :n][chosen] == pytest.approx(expected[chosen], rel=1e-12)
    assert (rows[HALF // PANEL_CAPACITY, :n] == np.where(chosen, 0.5 * math.pi, 0.0)).all()
    assert rows[RATE // PANEL_CAPACITY, :n][chosen] == pytest.approx(delta[chosen], rel=1e-14)


def extremes_of_turn(constants, sign, count):
    """Smallest values over a turn in each lane for a positive sign, else the largest."""
    shape, size = np.zeros(SHAPE_SIZE), 2 * LANES
    shape[TILE_HALF : TILE_HALF + LANES] = 0.5 * math.pi
    shape[TILE_RESOLUTION : TILE_RESOLUTION + LANES] = 1.0
    tangents, weights = np.empty(count * LANES), np.empty(count * LANES)
    place_equispaced(count, tangents, weights)
    signals = np.empty((count + 2) * size)
    fill_harmonics(constants.reshape(-1), tangents, 0, 0, 0, count, 0, signals[size:])
    repeat_turn(signals, 2, count)
    _, row_of, table = gauss_legendre_rules()
    return search(constants.reshape(-1), shape, 0, sign, count, table, row_of[count], signals)[0]


@pytest.mark.parametrize("count", [12, 16, 20])
@pytest.mark.parametrize("tilt", [-1e-3, 1e-5])
def test_the_lower_of_two_minima_a_few_nodes_apart(tilt, count):
    """Wherever the nodes are about them; samples fall through a node beside one, or are least between both."""
    for turned in 2.0 * np.pi / count / 8.0 * np.arange(8):
        places = turned + 2.0 * np.pi / LANES * np.arange(LANES)
        constants = double_minima(places, tilt)
        exact = [exact_minimum(constants[:, k], p - 1.0, p + 1.0, 1.0) for k, p in enumerate(places)]
        # the arguments of the cosines, up to 3 x 6 rad, are rounded
        assert extremes_of_turn(constants, 1.0, count) == pytest.approx(exact, rel=0.0, abs=4e-15)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    count=st.sampled_from(COUNTS),
    sign=st.sampled_from([1.0, -1.0]),
    # at the seam, halfway between nodes, at nodes, or anywhere
    at=st.sampled_from([np.pi, -np.pi, 0.0, 0.5 * np.pi]) | st.floats(-np.pi, np.pi),
    offset=st.sampled_from([0.0, 1e-15, 1e-9, 1e-4]),
)
def test_extremes_are_found_anywhere(count, sign, at, offset):
    constants = np.zeros((CONSTANTS, LANES))
    constants[:HARMONICS] = -sign * np.array([1.0, 0.5, 0.25])[:, None]
    peaks = at - offset + 2.0 * np.pi / count / LANES * np.arange(LANES)
    constants[PHASE:OFFSET] = np.array([1.0, 2.0, 3.0])[:, None] * peaks
    found = extremes_of_turn(constants, sign, count)
    exact = np.array([value(constants[:, lane], peaks[lane]) for lane in range(LANES)])
    # the arguments of the cosines, up to 3 x 6 rad, are rounded, and the step that ends the search
    assert found == pytest.approx(exact, rel=0.0, abs=4e-15)


def turns(designs, names, tolerance, mechanism=CRANK_ROCKER):
    drive = "slow" if mechanism is CRANK_ROCKER else None
    request = make_request(mechanism, metrics=names, window="cycle", drive=drive, tolerance=tolerance)
    return evaluate_columns(request, designs).columns


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_a_peak_at_the_declared_distance(tolerance):
    """The mean of 1/(1 + distance - cos) is 1/sqrt(distance (2 + distance)); see the toy for its place."""
    declared = replace(PEAK, quadrature=Graded(((Row.FAR, 0),)))
    distance = np.linspace(10.0, 40.0, 50)
    columns = turns({"distance": distance}, ["height_mean", "height_variance"], tolerance, declared)
    root = np.sqrt(distance * (2.0 + distance))
    mean, square = 1.0 / root, (1.0 + distance) / root**3
    error = np.maximum(np.abs(columns["height_mean"] - mean) / np.sqrt(square),
                       np.abs(columns["height_variance"] - square + mean**2) / square)  # fmt: skip
    assert (columns["status"] == Status.OK).all()
    assert (error <= columns["error"]).all()
    assert columns["nodes"].max() <= 24


def test_tails_of_turns_are_looked_at(monkeypatch):
    """A peak that is nearer than declared makes the design be sampled adaptively, and only then."""
    declared = replace(PEAK, quadrature=Graded(((Row.FAR, 0),)))
    designs = {"distance": np.array([1e-3, 0.1, 1.0, 30.0])}
    checked = turns(designs, ["height_variance"], 1e-9, declared)["nodes"]
    monkeypatch.setattr(sampled, "LARGEST_EXCESS", np.inf)
    unchecked = turns(designs, ["height_variance"], 1e-9, declared)["nodes"]
    assert (unchecked == unchecked[0]).all()
    assert list(checked > unchecked) == [True, True, True, False]


def test_extremes_of_a_turn_take_no_nodes_at_ends():
    """A panel of a stroke has both of its ends as further nodes."""
    designs = {"crank": 100.0, "coupler": [1083.4236, 1000.0], "rocker": 541.7118, "ground": [720.0, 700.0]}
    designs = {name: np.resize(values, 2) for name, values in designs.items()}
    moments, both = (
        turns(designs, [f"coupler_acceleration_{each}" for each in names], 1e-9)["nodes"]
        for names in (["rms"], ["rms", "max"])
    )
    assert both.tolist() == moments.tolist()


def test_a_turn_takes_no_longer_than_two_graded_halves(monkeypatch):
    rng = np.random.default_rng(2)
    lengths = rng.uniform((50, 500, 200, 300), (150, 1300, 660, 830), (400, 4)).T
    designs = dict(zip(("crank", "coupler", "rocker", "ground"), lengths, strict=True))
    names = ["rocker_velocity_variance", "transmission_angle_mean"]
    columns = turns(designs, names, 1e-9)
    monkeypatch.setattr("explore.evaluation.loop_tables.specify_window", lambda *_: (4, -1, -1, 0, -1, -1, -1, 0))
    monkeypatch.setattr(sampled, "loop_arguments", _over_an_interval(sampled.loop_arguments))
    halves = turns(designs, names[::-1], 1e-9)  # what follows from the other request is remembered
    computed = columns["status"] == Status.OK
    assert np.mean(computed) > 0.3
    assert (columns["nodes"] <= WORTH * halves["nodes"])[computed].all()
    assert np.mean((columns["nodes"] < halves["nodes"])[computed]) > 0.5
    for name in names:
        # both within their bounds
        allowed = (columns["error"] + halves["error"]) * np.abs(columns[name])
        assert (np.abs(columns[name] - halves[name]) <= allowed)[computed].all()


def _over_an_interval(original):
    """The arguments of the loop with the turn as an interval, whose two panels stay graded."""

    def arguments(*given):
        sizes, tables = original(*given)
        return sizes, tables._replace(intervals=np.array([(0.0, -0.5 * np.pi, 2.0 * np.pi)]))

    return arguments
