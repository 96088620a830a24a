"""Panels graded towards the nearest singularity of a linkage, wherever it stands, beside its limits."""

import math
import warnings

import mpmath
import norms
import numpy as np
import pytest
from bounds import SIGNALS as REFERENCE_SIGNALS
from bounds import References
from linkage_cases import CASES, columns, evaluate_graph, find_limits, linkage_of, scattered, trace, turns

import explore
from explore import Linkage
from explore.base.compiling import LANES
from explore.evaluation.quadrature.anchored import map_anchored, turn_by, turn_interval, turn_window
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    FIRST,
    LAST,
    PANEL_CAPACITY,
    PANELS_SIZE,
    RATE,
    SINGULAR,
    SPREAD,
)
from explore.evaluation.quadrature.tiles import SHAPE_SIZE, TILE_TURNED, turn_nodes
from explore.evaluation.quadrature.windows import ARC, LONGER
from explore.mechanisms.linkages import anchoring, cells
from explore.mechanisms.linkages.programs import (
    DISTANCE_ROW,
    GREATEST_ROW,
    LEAST_ROW,
    OTHERS_ROW,
    SINGULAR_ANGLE_ROW,
)
from explore.mechanisms.linkages.signals import find_quantities

#: A crank-rocker as a table, with the names of the built-in one.
FOUR_BAR = Linkage({
    "driver": "crank", "output": "rocker", "frame": {"O": [0, 0], "C": ["ground", 0]},
    "links": {"crank": {"O": 0, "A": "crank"}, "coupler": {"A": 0, "B": "coupler"}, "rocker": {"C": 0, "B": "rocker"}},
    "branch": {"B": "left of A C"},
})  # fmt: skip
ONES = np.ones(6)
LENGTHS = {"crank": 110.0 * ONES, "coupler": 950.0 * ONES, "rocker": 560.0 * ONES}
#: Margins over the coupler: of the folded position at anchor 0, and at its opposite.
MARGINS = 10.0 ** -np.arange(1.0, 7.0)
SIGNALS = ("coupler_velocity", "rocker_velocity", "rocker_acceleration")


@pytest.mark.parametrize("window", ["cycle", "drive", "return"])
@pytest.mark.parametrize("ground", [500.0 + 950.0 * MARGINS, 1400.0 - 950.0 * MARGINS])
def test_a_table_near_its_limit_equals_the_mechanism_written_by_hand(window, ground):
    metrics = [f"{signal}_{statistic}" for signal in SIGNALS for statistic in ("mean", "variance", "max", "min")]
    options = {"metrics": metrics, "window": window, "table": False}
    table, by_hand = (
        explore.evaluate(which, LENGTHS | {"ground": ground}, **options, tolerance=tolerance, **drive)
        for which, tolerance, drive in ((FOUR_BAR, 1e-9, {}), ("crank-rocker", 1e-12, {"drive": "slow"}))
    )
    assert (table["nodes"] < 250).all()  # with extremes; halved panels of a turn have 576 at least
    assert (table["error"] <= 1e-9).all()
    for signal in SIGNALS:
        mean, variance, high, low = (by_hand[f"{signal}_{name}"] for name in ("mean", "variance", "max", "min"))
        for statistic in ("mean", "variance", "max", "min"):
            error = norms.worst(statistic, table[f"{signal}_{statistic}"], mean, variance, (low, high))
            assert (error <= table["error"] + by_hand["error"]).all()


@pytest.mark.parametrize("window", ["drive", "return"])
@pytest.mark.parametrize(("signal", "statistic"), [
    ("coupler_acceleration", "variance"), ("coupler_acceleration", "max"), ("coupler_velocity", "variance"),
    ("rocker_velocity", "max"), ("rocker_acceleration", "mean"),
])  # fmt: skip
def test_bounds_hold_over_strokes_whose_ends_are_beside_singularities(window, signal, statistic):
    """Of crank-rockers with margins down to 1e-12: what rounding moves their ends by counts where signals are large."""
    references = References()
    is_chosen = (references.branch == 1) & (references.interval[:, 0] != references.interval[:, 1])
    chosen = np.flatnonzero(is_chosen & ~np.isin(references.family, [2, 3, 4, 7]))  # without equal and whole turns
    strokes = np.argsort(references.interval[chosen, :2], axis=1)[:, 1 if window == "drive" else 0]
    designs = {name: references.lengths[chosen, k] for k, name in enumerate(("crank", "coupler", "rocker", "ground"))}
    exact = references.statistics[chosen, strokes, REFERENCE_SIGNALS.index(signal)]
    mean, variance, low, high = exact.T
    metric = f"{signal}_{statistic}"
    found = explore.evaluate(FOUR_BAR, designs, metrics=[metric], window=window, tolerance=1e-12, table=False)
    error = norms.worst(statistic, found[metric], mean, variance, (low, high))
    assert len(chosen) > 400
    assert (error <= np.fmax(found["error"], 4e-17)).all()


@pytest.mark.parametrize(("name", "share"), [("watt-2", 0.5), ("stephenson-3", 0.5), ("crank-shaper", 0.0)])
def test_bounds_hold_near_limits(name, share):
    """Where other singularities, whose distances are estimated, may be nearly as near, as always in a crank shaper.

    Equal steps do not suffice; halved panels have 288 nodes at least, of a turn 576.
    """
    linkage = linkage_of(CASES[name])
    kernel, designs = linkage.mechanism, scattered(CASES[name], 60_000, np.random.default_rng(1), 0.2)
    distances = kernel.constants(columns(kernel, designs))[DISTANCE_ROW]
    chosen = np.flatnonzero((distances > 0.0) & (distances < 0.03))[:80]
    designs = {key: column[chosen] for key, column in designs.items()}
    output = linkage.content["output"]
    for window, signal in (("cycle", f"{output}_velocity"), ("cycle", f"{output}_acceleration"),
                           ({"from": 200, "to": 380}, f"{output}_velocity")):  # fmt: skip
        end = "" if window == "cycle" else "_interval"
        metrics = [f"{signal}_{statistic}{end}" for statistic in ("mean", "variance", "max", "min")]
        fine, coarse = (
            explore.evaluate(linkage, designs, metrics=metrics, window=window, tolerance=tolerance, table=False)
            for tolerance in (1e-12, 1e-6)
        )
        mean, variance, high, low = (fine[metric] for metric in metrics)
        moves = np.isfinite(mean)
        assert moves.sum() >= 10
        assert np.mean(coarse["nodes"][moves] < 288) >= share
        for statistic, metric in zip(("mean", "variance", "max", "min"), metrics, strict=True):
            error = norms.worst(statistic, coarse[metric], mean, variance, (low, high))[moves]
            assert (error <= (coarse["error"] + fine["error"])[moves]).all()


def test_a_cv_of_a_small_mean_over_a_stroke_has_the_bound_of_the_ends():
    """Of a point of the crank that is as high above the pivot as below it over a stroke whose ends mpmath tells."""
    content = linkage_of(CASES["stephenson-3"]).content
    crank = content["links"]["crank"] | {"Q": {"radius": 20, "angle": "phase"}}
    coupler = content["links"]["coupler"] | {"D": ["along", "across"]}
    linkage = Linkage(content | {"links": content["links"] | {"crank": crank, "coupler": coupler}})
    kernel = linkage.mechanism.for_signals(["Q_y"], needs_stroke=True)
    designs = scattered(CASES["stephenson-3"], 400, np.random.default_rng(5), 0.25) | {"phase": np.zeros(400)}
    radius, angle = designs.pop("rd"), np.deg2rad(designs.pop("ad"))
    designs |= {"along": radius * np.cos(angle), "across": radius * np.sin(angle)}
    between, last = find_limits(kernel, designs, 24, np.random.default_rng(6))
    designs = between(last * (1.0 - np.geomspace(1e-9, 1e-4, 24)))
    ends = 2.0 * np.arctan(kernel.constants(columns(kernel, designs))[[LEAST_ROW, GREATEST_ROW]])
    designs = {name: column[np.isfinite(ends[0])] for name, column in designs.items()}
    ends = ends[:, np.isfinite(ends[0])]
    ends[1] += 2.0 * math.pi * (ends[1] < ends[0])
    designs["phase"] = np.rad2deg(1e-4 - ends.mean(axis=0))
    found = explore.evaluate(linkage, designs, metrics=["Q_y_cv"], window="forward", tolerance=1e-8, table=False)
    (rate,) = (q.number for q in find_quantities(trace(linkage)) if q.signal.name == f"{content['output']}_velocity")
    errors = []
    for k, value in enumerate(found["Q_y_cv"]):
        values = {name: float(column[k]) for name, column in designs.items()}
        with mpmath.workdps(40):
            a, b = (
                mpmath.findroot(lambda t, v=values: evaluate_graph([rate], v, t)[0], (end, end + 1e-12))
                + mpmath.radians(values["phase"])
                for end in ends[:, k]
            )
            mean = (mpmath.cos(a) - mpmath.cos(b)) / (b - a)
            square = mpmath.mpf(0.5) - (mpmath.sin(2 * b) - mpmath.sin(2 * a)) / (4 * (b - a))
            errors.append(float(abs(value * mean / mpmath.sqrt(square - mean**2) - 1)))
    assert len(errors) >= 15
    assert (errors <= found["error"]).all()


def test_a_signal_that_is_0_over_a_stroke_has_the_bound_of_the_ends():
    """The slider's pin on its line, without warnings of NumPy."""
    linkage = linkage_of(CASES["slider-crank"])
    designs = {"r": [30.0], "l": [100.0], "e": [0.0]}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        row = explore.evaluate(linkage, designs, metrics=["B_y_mean", "B_y_max"], window="drive").iloc[0]
    assert (row["B_y_mean"], row["B_y_max"]) == (0.0, 0.0)
    assert row["error"] <= 1e-9


def test_the_angle_is_that_of_the_least_function():
    """Of a Watt six-bar: the transmission angle that is least, or greatest, by 100,000 samples of the motion."""
    linkage = linkage_of(CASES["watt-2"])
    kernel, designs = linkage.mechanism, scattered(CASES["watt-2"], 20_000, np.random.default_rng(2), 0.2)
    constants = kernel.constants(columns(kernel, designs))
    distances, angles = constants[DISTANCE_ROW], constants[SINGULAR_ANGLE_ROW]
    is_alone = turns(kernel, designs) & (distances < 0.05) & (constants[OTHERS_ROW] > 4.0 * distances)
    chosen = np.flatnonzero(is_alone)[:6]
    assert len(chosen) == 6
    crank = np.linspace(0.0, 360.0, 100_001)
    for design in chosen:
        values = {key: float(column[design]) for key, column in designs.items()}
        motion = explore.simulate(linkage, values, angles=crank)
        joints = [column for column in motion.columns if column.endswith("_transmission_angle")]
        sines = np.sin(np.deg2rad(motion[joints].to_numpy()))
        place = crank[np.argmin(sines.min(axis=1))]
        assert abs((place - math.degrees(angles[design]) + 180.0) % 360.0 - 180.0) < 0.02


@pytest.mark.parametrize("excess", [3e-4, 3e-3, 3e-2])
def test_the_distance_of_a_second_zero_is_told(excess):
    """Of 1 + excess - cos(theta - 0.4) and a power of such a function 0.9 rad on: both zeros are equally far."""
    place = 0.4
    nodes = np.concatenate([np.arange(cells.NODES), np.arange(cells.NODES - 1, 2 * cells.NODES - 1)])
    angles = -0.5 * math.pi + nodes * math.pi / (cells.NODES - 1)
    values = np.zeros((2 * cells.NODES, 4, LANES))
    for function, (power, shift) in enumerate(((1.0, 0.0), (1.3, 0.9))):
        base = 1.0 + excess - np.cos(angles - place - shift)
        values[:, function] = (base**power)[:, None]
        values[:, 2 + function] = (power * base ** (power - 1.0) * np.sin(angles - place - shift))[:, None]
    distances, others = np.full(LANES, math.tanh(0.5 * math.acosh(1.0 + excess))), np.ones(LANES)
    search = np.empty(anchoring.SEARCH_SIZE)
    # without factors there are two rows of values and two of slopes
    assert anchoring.begin_search(values.ravel(), 0, 2, -0.5 * math.pi, distances, others, search) == LANES
    # a cubic over 11 deg misses some thousandths of the least value
    assert others == pytest.approx(distances, rel=0.01)


def test_windows_are_turned():
    start, stop, place = math.tan(0.25), math.tan(0.6), 0.3
    kind, first, last = turn_window(LONGER, start, stop, place)
    assert kind == ARC
    assert 2.0 * math.atan(first) == pytest.approx(1.2 - place, abs=1e-15)  # the longer arc is the other one
    assert 2.0 * math.atan(last) == pytest.approx(0.5 - place, abs=1e-15)
    anchor, angle = turn_interval(1.0, 0.2, 3.0)
    assert (anchor, angle) == pytest.approx((0.0, 0.2 + math.pi - 3.0), abs=1e-15)
    assert abs(turn_by(1.0, 1.0)) == 1e100  # half a turn


@pytest.mark.parametrize("place", [0.0, 0.7, math.pi, -2.9])
def test_nodes_are_turned_back(place):
    """To the angles that mpmath tells, relative to their distances from the anchor and from its opposite."""
    tangents = np.repeat(np.array([-3.0, -0.4, 1e-6, 0.2, 5.0]), LANES)
    shape, turned = np.zeros(SHAPE_SIZE), tangents.copy()
    shape[TILE_TURNED : TILE_TURNED + LANES] = math.tan(0.5 * place)
    turn_nodes(shape, 5, turned)
    for before, after in zip(tangents[::LANES], turned[::LANES], strict=True):
        with mpmath.workdps(50):
            exact = mpmath.tan(mpmath.atan(before) + mpmath.atan(mpmath.mpf(math.tan(0.5 * place))))
        assert after == pytest.approx(float(exact), rel=4e-15)


@pytest.mark.parametrize("tangent", [1e-1, 1e-3, 1e-6])
@pytest.mark.parametrize("others", [0.02, 0.05, 0.3, 1.0])
@pytest.mark.parametrize(("first", "last"), [(-1.0, 1.0), (-0.94, 422.0), (-0.002, 1.06)])
def test_no_other_singularity_is_in_the_ellipse_of_a_panel(first, last, others, tangent):
    """By 20,000 points of the line on which the others may stand."""
    panels = np.zeros(PANELS_SIZE)
    anchor = 1.0 if last > 2.0 else 0.0
    panels[[ANCHOR, FIRST, LAST, SPREAD]] = anchor, first, last, last - first
    panels[[SINGULAR, SINGULAR + PANEL_CAPACITY, SINGULAR + 2 * PANEL_CAPACITY]] = tangent, 0.3, others
    map_anchored(panels, 1, np.array([0, -1, -1]))
    scale = 0.9 if anchor == 1.0 else min(tangent, max(-first, last))
    start, stop = math.asinh(first / scale), math.asinh(last / scale)
    angles = np.linspace(-math.pi, math.pi, 20_001)[1:-1] + 2j * np.arctanh(min(others, 1.0 - 1e-12))
    images = (np.arcsinh(np.tan(0.5 * angles) / scale) - 0.5 * (start + stop)) / (0.5 * (stop - start))
    axis = 0.5 * (np.abs(images - 1.0) + np.abs(images + 1.0)).min()
    assert 0.0 < panels[RATE] <= math.acosh(axis)


def test_panels_of_an_unknown_place_are_left():
    panels = np.zeros(PANELS_SIZE)
    panels[[FIRST, LAST, SPREAD]] = -1.0, 1.0, 2.0
    panels[[SINGULAR, SINGULAR + PANEL_CAPACITY, SINGULAR + 2 * PANEL_CAPACITY]] = -0.2, math.nan, 1.0
    map_anchored(panels, 1, np.array([0, -1, -1]))
    assert panels[RATE] == 0.0
