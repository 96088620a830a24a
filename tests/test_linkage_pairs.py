"""Pairs of doubles: their arithmetic, linkages near their limits by them, and when they are taken."""

import json
import math
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from linkage_cases import CASES, FOUR_BAR, columns, evaluate_graph, linkage_of, trace, values_of
from numba import njit

import explore
from explore.base.compiling import LANES
from explore.base.lanes.disturbance import DISTURBANCE, FACTORS, first_factor
from explore.base.lanes.double_double import (
    PAIR_ROUNDING,
    add_pairs,
    divide_pairs,
    multiply_pairs,
    root_of_pair,
    sine_of_pair,
)
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.linkages.graph import Graph
from explore.mechanisms.linkages.pair_operations import _larger, _magnitude
from explore.mechanisms.linkages.programs import GREATEST_ROW, LEAST_ROW
from explore.mechanisms.linkages.signals import find_quantities
from explore.model.status import Status
from explore.studies.request.requests import make_request

NEAR_LIMITS = json.loads((Path(__file__).parent / "reference" / "near_limits.json").read_text())
LINKAGES = {"four-bar": explore.Linkage(FOUR_BAR)} | {n: linkage_of(CASES[n]) for n in ("slider-crank", "watt-2")}
STATISTICS = ("mean", "variance", "peak")


def pairs(count, seed):
    """Pairs of numbers of many sizes, as doubles and their sums as fractions."""
    rng = np.random.default_rng(seed)
    high = rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-8.0, 8.0, count)
    low = high * rng.uniform(-1.0, 1.0, count) * 2.0**-53
    result = []
    for a, b in zip(high.tolist(), low.tolist(), strict=True):
        total = a + b
        result.append((total, b - (total - a)))
    return result, [Fraction(a) + Fraction(b) for a, b in result]


def error_of(pair, exact):
    """Error of a pair relative to the exact result; its first number must be their sum rounded."""
    assert pair[0] == pair[0] + pair[1]
    return abs((Fraction(pair[0]) + Fraction(pair[1])) / exact - 1)


@pytest.mark.parametrize("shape", ["any", "cancelling"])
@pytest.mark.parametrize("name", ["add", "multiply", "divide"])
def test_operations_on_pairs_are_exact_to_32_digits(name, shape):
    operation, exact = {
        "add": (add_pairs, lambda x, y: x + y),
        "multiply": (multiply_pairs, lambda x, y: x * y),
        "divide": (divide_pairs, lambda x, y: x / y),
    }[name]
    first, of_first = pairs(2000, 1)
    second, of_second = pairs(2000, 2)
    if shape == "cancelling":
        second = [(-a * (1.0 - 2.0**-30), 0.0) for a, _ in first]
        of_second = [Fraction(a) for a, _ in second]
    for x, y, fx, fy in zip(first, second, of_first, of_second, strict=True):
        assert error_of(operation(*x, *y), exact(fx, fy)) <= PAIR_ROUNDING


def test_roots_of_pairs_are_exact_to_32_digits():
    for pair, exact in zip(*pairs(2000, 3), strict=True):
        if exact > 0:
            # the square of the root has twice its relative error
            assert abs(sum(map(Fraction, root_of_pair(*pair))) ** 2 / exact - 1) <= 2 * PAIR_ROUNDING
    assert root_of_pair(0.0, 0.0) == (0.0, 0.0)
    assert math.isnan(root_of_pair(-1.0, 0.0)[0])


@pytest.mark.parametrize(
    ("operation", "exact"),
    [
        (lambda x, y, out: _magnitude(x, out), lambda x, y: abs(x)),
        (lambda x, y, out: _larger(x, y, 1.0, out), max),
        (lambda x, y, out: _larger(x, y, -1.0, out), min),
    ],
)
def test_the_magnitude_and_the_larger_of_pairs_are_those_of_their_sums(operation, exact):
    (first, sums), (second, others), out = pairs(LANES, 5), pairs(LANES, 6), np.empty((2, LANES))
    operation(np.array(first).T.ravel(), np.array(second).T.ravel(), out.ravel())
    assert [Fraction(high) + Fraction(low) for high, low in out.T.tolist()] == [*map(exact, sums, others)]


@pytest.mark.parametrize("quarters", [0, 1])
def test_sines_of_pairs_are_exact_to_32_digits(quarters):
    """Of sines and cosines, also beside their zeros."""
    angles, _ = pairs(500, 4)
    angles += [(90.0 * k + small, 1e-17 * k) for k in range(-9, 10) for small in (0.0, 1e-9, 44.9999, 45.1)]
    with mpmath.workdps(60):
        for angle, rest in angles:
            x = mpmath.mpf(angle) + rest
            exact = mpmath.sinpi(x / 180) if quarters == 0 else mpmath.cospi(x / 180)
            value, value_rest = sine_of_pair(angle, rest, float(quarters))
            assert abs(mpmath.mpf(value) + value_rest - exact) <= PAIR_ROUNDING * abs(exact)


def test_constants_of_tables_keep_what_they_are_rounded_by():
    graph = Graph()
    tenth, fifth = graph.constant(0.1), graph.constant(0.2)
    total = tenth + fifth
    assert total.value == 0.1 + 0.2
    assert total.exact == Fraction(0.1) + Fraction(0.2) != Fraction(0.1 + 0.2)
    for number, exact in (
        (tenth * fifth, Fraction(0.1) * Fraction(0.2)),
        (tenth / fifth + total, Fraction(0.1) / Fraction(0.2) + total.exact),
        (-(tenth - fifth * total), Fraction(0.2) * total.exact - Fraction(0.1)),
        (graph.constant(2.0).sqrt() * graph.constant(2.0).sqrt(), Fraction(2)),
    ):
        assert abs(number.exact / exact - 1) <= 2 * PAIR_ROUNDING
    assert (total - total).value == 0.0
    # what doubles take for 0 is 0, and a constant beside 1 is not 1
    assert (graph.constant(2.0).sqrt() * graph.constant(0.5).sqrt() - 1.0).exact == 0
    beside = graph.constant(1 + Fraction(1, 2**70))
    assert (beside * graph.input("x")).node[0] == "mul"
    assert (graph.constant(1.0) * graph.input("x")).node[0] == "input"


@njit
def call_fill(fill, constants, tangents, anchor, law, variant, count, needs, out):
    fill(constants, tangents, anchor, law, variant, count, needs, out)


def samples_of(fill, mechanism, values, tangents, anchor):
    """Rows of one design, in all lanes, at half-tangents, shape (n, rows)."""
    design = {name: np.array([value]) for name, value in values.items()}
    constants = np.repeat(mechanism.constants(columns(mechanism, design))[:, 0], LANES)
    out = np.empty(len(tangents) * mechanism.signal_rows * LANES)
    call_fill(fill, constants, np.repeat(tangents, LANES), anchor, 0, 0, len(tangents), 1, out)
    lanes = out.reshape(len(tangents), mechanism.signal_rows, LANES)
    np.testing.assert_array_equal(lanes, np.broadcast_to(lanes[:, :, :1], lanes.shape))
    return lanes[:, :, 0]


@pytest.mark.parametrize("anchor", [0, 1])
@pytest.mark.parametrize("name", LINKAGES)
def test_signals_keep_all_digits_beside_the_limit(name, anchor):
    """Against the graph with the digits of mpmath, at half-tangents that are doubles."""
    rows = [row for row in NEAR_LIMITS if row["linkage"] == name and row["margin"] == 1e-10]
    signals = list(rows[0]["statistics"])
    equations = trace(LINKAGES[name])
    numbers = {each.signal.name: each.number for each in find_quantities(equations)}
    mechanism = LINKAGES[name].mechanism.for_signals(signals)
    places = [next(each.row for each in mechanism.signals if each.name == signal) for signal in signals]
    tangents = np.array([-0.97, -0.6, -1e-5, 0.0, 1e-6, 0.3, 0.99])
    for row in rows[:3]:
        found = samples_of(mechanism.precise_fill, mechanism, row["parameters"], tangents, anchor)[:, places]
        with mpmath.workdps(40):
            for tangent, sample in zip(tangents, found, strict=True):
                angle = 2 * mpmath.atan(mpmath.mpf(tangent)) + anchor * mpmath.pi
                exact = evaluate_graph([numbers[signal] for signal in signals], row["parameters"], angle)
                for value, expected in zip(sample, exact, strict=True):
                    # rounded once, or 0 but for the digits that pairs lose beside the limit
                    assert abs(mpmath.mpf(value) - expected) <= 1.2e-16 * abs(expected) + 1e-24


@pytest.mark.parametrize("name", CASES)
def test_all_signals_are_those_of_doubles_but_for_their_rounding(name):
    """Which is told by disturbed samples: a few units times the largest change of eight nodes."""
    mechanism = linkage_of(CASES[name]).mechanism
    tangents = np.tan(np.linspace(-0.2, 0.25, 8))
    precise, disturbed, plain = (
        samples_of(fill, mechanism, values_of(CASES[name]), tangents, 0)
        for fill in (mechanism.precise_fill, mechanism.disturbed_fill, mechanism.fill)
    )
    rounding = 1e-15 * (np.abs(disturbed - plain) / DISTURBANCE + np.abs(precise)).max(axis=0)
    # angles of links that turn fully are not a number
    assert (np.isnan(rounding) == np.isnan(plain).any(axis=0)).all()
    assert np.isfinite(rounding).sum() >= 0.7 * len(rounding)
    assert not (np.abs(precise - plain) > rounding).any()


#: A boom on the frame that a driven pin in a tube on the frame lifts, and a design of it.
BOOM = {
    "driver": "cylinder", "travel": ["l", "1.6 * l"], "output": "boom", "frame": {"O": [0, 0], "C": [600, 0]},
    "links": {"tube": {"O": 0}, "boom": {"C": 0, "B": 800, "P": [2400, -150]}},
    "slots": {"cylinder": {"pin": "B", "link": "tube", "along": ["O", [1, 0]]}}, "branch": {"B": "left of O C"},
}  # fmt: skip


@pytest.mark.parametrize("name", [*CASES, "boom"])
def test_curvatures_follow_from_velocities_and_accelerations(name):
    """Points of links about the frame have a formula of their own, which a driven pin in the slot of one has not."""
    linkage, values = (
        (explore.Linkage(BOOM), {"l": 650.0}) if name == "boom" else (linkage_of(CASES[name]), values_of(CASES[name]))
    )
    mechanism = linkage.mechanism
    rows = {each.name: each.row for each in mechanism.signals}
    samples = samples_of(mechanism.fill, mechanism, values, np.tan(np.linspace(-0.35, 0.3, 16)), 0)
    points = [each.removesuffix("_curvature") for each in rows if each.endswith("_curvature")]
    assert points
    for point in points:
        words = ("velocity", "acceleration")
        vx, vy, ax, ay = (samples[:, rows[f"{point}_{word}_{axis}"]] for word in words for axis in "xy")
        speed, product = np.hypot(vx, vy), samples[:, rows[f"{point}_curvature"]] * np.hypot(vx, vy) ** 3
        # terms of this size cancel; the places have the rounding of positions, 1e-12 of them at most here
        assert (np.abs(product - (vx * ay - vy * ax)) <= 1e-11 * speed * np.hypot(ax, ay))[speed > 0.0].all()


def test_disturbed_half_tangents_tell_what_their_rounding_does():
    """The place of a crank pin, r cos and r sin, moves by that of the half-tangent and nothing else that is seen."""
    values, tangents = values_of(CASES["watt-2"]), np.linspace(-0.9, 0.9, 64)
    mechanism = LINKAGES["watt-2"].mechanism.for_signals(["A_x", "A_y"])
    plain, disturbed = (
        samples_of(fill, mechanism, values, tangents, 0)[:, :2]
        for fill in (mechanism.precise_fill, mechanism.disturbed_precise_fill)
    )
    changes = np.hypot(*(disturbed - plain).T)
    # 4 units of a half-tangent u turn the crank by 8/(1 + u^2) of them; doubles show that to 4 digits
    units = np.array([abs(FACTORS[first_factor(node)] - 1.0) for node in range(len(tangents))])
    expected = values["r1"] * 8.0 * units / (1.0 + tangents**2)
    assert changes == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("name", LINKAGES)
def test_statistics_beside_the_limit_are_within_their_bounds(name):
    """Designs at margins of 1e-6 to 1e-12 of their limits, against mpmath: bounds hold and all but the last are met."""
    rows = [row for row in NEAR_LIMITS if row["linkage"] == name]
    signals = list(rows[0]["statistics"])
    designs = {key: np.array([row["parameters"][key] for row in rows]) for key in rows[0]["parameters"]}
    metrics = [f"{signal}_{statistic}" for signal in signals for statistic in STATISTICS]
    made = make_request(LINKAGES[name].mechanism, metrics=metrics, window="cycle", tolerance=1e-9)
    found = evaluate_columns(made, designs).columns
    margins = np.array([row["margin"] for row in rows])
    assert np.count_nonzero(found["status"][margins > 1e-11] == Status.OK) >= {"watt-2": 17}.get(name, 23)
    for k, row in enumerate(rows):
        for signal in signals:
            mean, variance, peak = map(mpmath.mpf, row["statistics"][signal])
            square = mean * mean + variance
            exact = zip(STATISTICS, (mean, variance, peak), (mpmath.sqrt(square), square, peak), strict=True)
            for statistic, value, size in exact:
                error = abs(mpmath.mpf(float(found[f"{signal}_{statistic}"][k])) - value) / size
                assert error <= found["error"][k] <= 1e-8


@pytest.mark.parametrize("name", LINKAGES)
def test_the_smallest_transmission_angle_keeps_its_digits(name):
    """Near 0 and near 180 deg an angle has the digits of doubles: what is left of 1e-15 of 180 deg."""
    rows = [row for row in NEAR_LIMITS if row["linkage"] == name and row["margin"] > 1e-11]
    designs = {key: np.array([row["parameters"][key] for row in rows]) for key in rows[0]["parameters"]}
    made = make_request(LINKAGES[name].mechanism, metrics=["transmission_angle_min"], tolerance=1e-9)
    found = evaluate_columns(made, designs).columns
    for value, error, status, row in zip(
        found["transmission_angle_min"], found["error"], found["status"], rows, strict=True
    ):
        exact = mpmath.mpf(row["transmission_angle_min"])
        assert abs(mpmath.mpf(float(value)) - exact) / exact <= error <= 1e-8
        assert status == Status.OK or row["margin"] < 1e-9


def test_formulas_of_users_have_bounds_that_hold():
    """A power has 8 times the relative error of a statistic, whatever that is beside the tolerance."""
    rows = [row for row in NEAR_LIMITS if row["linkage"] == "slider-crank" and row["margin"] == 1e-12]
    designs = {key: np.array([row["parameters"][key] for row in rows]) for key in rows[0]["parameters"]}
    formulas = {"power": {"formula": "(1e-6 * guide_acceleration_variance)**8", "unit": "1"}}
    made = make_request(
        LINKAGES["slider-crank"].mechanism, metrics=["power"], formulas=formulas, window="cycle", tolerance=1e-9
    )
    found = evaluate_columns(made, designs).columns
    for value, bound, row in zip(found["power"], found["error"], rows, strict=True):
        exact = (mpmath.mpf(row["statistics"]["guide_acceleration"][1]) / 10**6) ** 8
        assert abs(mpmath.mpf(float(value)) / exact - 1) <= bound <= 1e-7


@pytest.mark.parametrize(("metric", "count"), [("E_curvature_max", 1), ("output_acceleration_variance", 2)])
def test_curvatures_are_not_evaluated_again(metric, count):
    """A point that turns back has no bounded curvature, whatever the digits."""
    made = make_request(LINKAGES["watt-2"].mechanism, metrics=[metric], window="cycle", tolerance=1e-9)
    evaluations = []
    for row in NEAR_LIMITS:
        if row["linkage"] == "watt-2" and row["margin"] == 1e-8:
            found = evaluate_columns(made, {name: np.array([value]) for name, value in row["parameters"].items()})
            evaluations.append(found.kinematic_evaluations)
    assert max(evaluations) == count


def test_a_design_does_not_depend_on_its_neighbours():
    """Those that are evaluated once more have the same rows alone, and the others keep theirs."""
    rows = [row for row in NEAR_LIMITS if row["linkage"] == "watt-2"][::3]
    ordinary = values_of(CASES["watt-2"])
    designs = {key: np.array([ordinary[key], *(row["parameters"][key] for row in rows)]) for key in ordinary}
    made = make_request(LINKAGES["watt-2"].mechanism, metrics=["output_acceleration_variance"], tolerance=1e-9)
    together = evaluate_columns(made, designs).columns
    assert together["nodes"][0] < 300  # the ordinary one
    for k in range(len(rows) + 1):
        alone = evaluate_columns(made, {key: column[k : k + 1] for key, column in designs.items()}).columns
        assert {name: column[0] for name, column in alone.items()} == {name: c[k] for name, c in together.items()}


def test_strokes_beside_the_limit_are_within_their_bounds():
    """Their ends, too, are where pairs find the reversals of the output."""
    rows = [row for row in NEAR_LIMITS if "forward" in row]
    signals = list(rows[0]["forward"])
    designs = {key: np.array([row["parameters"][key] for row in rows]) for key in rows[0]["parameters"]}
    metrics = [f"{signal}_{statistic}" for signal in signals for statistic in ("mean", "variance")]
    made = make_request(LINKAGES["slider-crank"].mechanism, metrics=metrics, window="forward", tolerance=1e-9)
    found = evaluate_columns(made, designs).columns
    margins = np.array([row["margin"] for row in rows])
    assert np.mean(found["status"][margins > 1e-11] == Status.OK) > 0.9
    for k, row in enumerate(rows):
        for signal in signals:
            mean, variance = map(mpmath.mpf, row["forward"][signal])
            square = mean * mean + variance
            for statistic, exact, size in (("mean", mean, mpmath.sqrt(square)), ("variance", variance, square)):
                error = abs(mpmath.mpf(float(found[f"{signal}_{statistic}"][k])) - exact) / size
                assert error <= found["error"][k] <= 1e-7


#: Rows of the slider-crank, one of whose reversals is beside the limit.
ROWS = [row for row in NEAR_LIMITS if row["linkage"] == "slider-crank"]


def stroke_of(row):
    """Crank angles of the ends of the stroke forwards of a slider-crank, rad, in the digits of mpmath's context."""
    mechanism = LINKAGES["slider-crank"].mechanism.for_signals(["guide_velocity"], needs_stroke=True)
    design = columns(mechanism, {name: np.array([value]) for name, value in row["parameters"].items()})
    numbers = {each.signal.name: each.number for each in find_quantities(trace(LINKAGES["slider-crank"]))}
    rates = [numbers["guide_velocity"], numbers["guide_acceleration"]]
    constants, angles = mechanism.constants(design), []
    for mark in (LEAST_ROW, GREATEST_ROW):
        angle = 2 * mpmath.atan(mpmath.mpf(constants[mark, 0]))
        for _ in range(4):
            rate, slope = evaluate_graph(rates, row["parameters"], angle)
            angle -= rate / slope
        angles.append(angle)
    least, greatest = angles
    return least, greatest if greatest > least else greatest + 2 * mpmath.pi


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9, 1e-12])
def test_what_hangs_on_the_ends_of_strokes_has_their_errors(tolerance):
    """The time ratio and, over the stroke, the place of the crank pin, which is not beside any limit itself."""
    designs = {key: np.array([row["parameters"][key] for row in ROWS]) for key in ROWS[0]["parameters"]}
    formula = {"swing": {"formula": "(time_ratio - 1) / (time_ratio + 1)", "unit": "1"}}
    mechanism = LINKAGES["slider-crank"].mechanism
    found = [
        evaluate_columns(make_request(mechanism, tolerance=tolerance, **asked), designs).columns
        for asked in (
            {"metrics": ["time_ratio"]}, {"metrics": ["swing"], "formulas": formula},
            {"metrics": ["A_x_mean"], "window": "forward"}, {"metrics": ["A_x_variance"], "window": "forward"},
        )
    ]  # fmt: skip
    for k, row in enumerate(ROWS):
        with mpmath.workdps(40):
            start, stop = stroke_of(row)
            length, turn, r = stop - start, 2 * mpmath.pi, mpmath.mpf(row["parameters"]["r"])
            ratio = max(length, turn - length) / min(length, turn - length)
            mean = r * (mpmath.sin(stop) - mpmath.sin(start)) / length
            square = r * r * (1 + (mpmath.sin(2 * stop) - mpmath.sin(2 * start)) / (2 * length)) / 2
            exact = (ratio, (ratio - 1) / (ratio + 1), mean, square - mean * mean)
            sizes = (ratio, 1, mpmath.sqrt(square), square)
        names = ("time_ratio", "swing", "A_x_mean", "A_x_variance")
        for columns_, name, value, size in zip(found, names, exact, sizes, strict=True):
            error = abs(mpmath.mpf(float(columns_[name][k])) - value) / size
            # beside the limit half of the digits are lost; pairs lose none that doubles show
            # what is sampled errs by the model of its nodes besides
            largest = 1e-12 if tolerance == 1e-12 else 4e-15 / math.sqrt(row["margin"])
            largest = tolerance if name.startswith("A_x") else min(largest, tolerance)
            assert error <= columns_["error"][k] <= largest
            assert columns_["status"][k] == Status.OK


def test_the_time_ratio_keeps_its_digits():
    mechanism = LINKAGES["slider-crank"].mechanism.for_signals(["guide_velocity"], needs_stroke=True)
    place = [metric.name for metric in mechanism.metrics].index("time_ratio")
    for row in ROWS:
        design = columns(mechanism, {name: np.array([value]) for name, value in row["parameters"].items()})
        plain, precise = (each.evaluate_closed_form(design) for each in (mechanism, mechanism.precise))
        assert plain.metrics[place, 0] == pytest.approx(precise.metrics[place, 0], rel=1e-9)
        with mpmath.workdps(40):
            start, stop = stroke_of(row)
            longer, shorter = (
                max(stop - start, start - stop + 2 * mpmath.pi),
                min(stop - start, start - stop + 2 * mpmath.pi),
            )
        assert precise.metrics[place, 0] == pytest.approx(float(longer / shorter), rel=1e-15)
        ends = sorted(float(end) % (2.0 * math.pi) for end in (start, stop))
        marks = sorted(
            2.0 * math.atan(precise.constants[mark, 0]) % (2.0 * math.pi) for mark in (LEAST_ROW, GREATEST_ROW)
        )
        assert marks == pytest.approx(ends, abs=1e-15)


@pytest.mark.parametrize(
    ("length", "is_precise"),
    [("r3*cos(20)", False), ("hypot(r3, 1)", False), ("r3*exp(1)", False), ("r3*cos(180)*(0.1 - sqrt(2))", True)],
)
def test_functions_of_tables_have_no_more_digits_than_doubles(length, is_precise):
    table = {**FOUR_BAR, "links": {**FOUR_BAR["links"], "rocker": {"C": 0, "B": length}}}
    assert (explore.Linkage(table).mechanism.precise is not None) == is_precise
