"""Rounding errors of linkages: bounds from disturbed samples against motions with the digits of mpmath."""

import math

import mpmath
import numpy as np
import pytest
from linkage_cases import CASES, columns, evaluate_graph, linkage_of, near_limits, scattered, trace, turns, values_of
from test_linkage_pairs import call_fill

import explore
from explore.base.lanes.disturbance import DISTURBANCE, FACTORS, PERIOD, first_factor
from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.requests import make_request


def test_factors_have_random_signs_and_sizes_and_differ_from_node_to_node():
    numbers = (FACTORS - 1.0) / DISTURBANCE
    assert np.sign(numbers).sum() == 0.0
    assert (numbers**2).mean() == pytest.approx(1.0, abs=1e-3)  # a factor is rounded at 2^-12 of the disturbance
    assert abs(numbers.mean()) < 3.0 / math.sqrt(len(numbers))
    assert len({*np.abs(numbers)}) > 0.9 * len(numbers)  # two equal amplifications seldom cancel
    assert {first_factor(node) for node in range(PERIOD)} == set(range(PERIOD))


def test_disturbed_samples_tell_the_derivatives_by_all_operations():
    """Changes of a crank pin's place, r cos and r sin, are those of two operations and of the half-tangent."""
    kernel = linkage_of(CASES["watt-2"]).mechanism.for_signals(["A_x", "A_y"])
    design = {name: np.array([value]) for name, value in values_of(CASES["watt-2"]).items()}
    count, tangents = 64, np.repeat(np.linspace(-0.9, 0.9, 64), 16)
    constants = np.repeat(kernel.constants(columns(kernel, design))[:, 0], 16)
    samples, disturbed = (np.empty(count * kernel.signal_rows * 16) for _ in range(2))
    for fill, out in ((kernel.fill, samples), (kernel.disturbed_fill, disturbed)):
        call_fill(fill, constants, tangents, 0, 0, 0, count, 1, out)
    shape = (count, kernel.signal_rows, 16)
    changes = ((disturbed - samples) / DISTURBANCE).reshape(shape)[:, :2, 0]
    u, (x, y) = np.linspace(-0.9, 0.9, count), samples.reshape(shape)[:, :2, 0].T
    by_tangent = 4.0 * u * 2.0 / (1.0 + u * u) * np.array([-y, x])
    expected = (2.0 * np.array([x, y]) ** 2 + by_tangent**2).mean(axis=1)
    assert (changes**2).mean(axis=0) == pytest.approx(expected, rel=0.5)


def test_rounding_is_not_overestimated():
    """Of Watt linkages near their limits all but a few keep 12 digits, and their bounds say so."""
    case = CASES["watt-2"]
    linkage = linkage_of(case)
    names = ("coupler_velocity", "coupler_acceleration", "rocker_velocity", "rocker_acceleration")
    metrics = [f"{name}_{statistic}" for name in names for statistic in ("mean", "variance", "max")]
    made = make_request(linkage.mechanism, metrics=metrics, window="cycle", tolerance=1e-12)
    rng = np.random.default_rng(3)
    designs = near_limits(made.kernel, scattered(case, 400, rng, 0.25), 100, rng)
    status = evaluate_columns(made, designs).columns["status"]
    assert np.count_nonzero(status == 1) >= 97


@pytest.mark.parametrize("margin", [1e-3, 1e-7, 1e-10])
def test_the_smallest_transmission_angle_is_within_its_bound_beside_the_limit(margin):
    """It follows from the square of the sine of an angle that is almost 0: half of the digits are lost."""
    case = CASES["watt-2"]
    linkage = linkage_of(case)
    kernel = linkage.mechanism.for_signals(())
    design = {name: np.array([value]) for name, value in values_of(case).items()}
    low, high = values_of(case)["fx"], 2.0 * values_of(case)["fx"]
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if turns(kernel, design | {"fx": np.array([middle])})[0] else (low, middle)
    values = {**values_of(case), "fx": low * (1.0 - margin)}
    row = explore.evaluate(linkage, values, metrics=["transmission_angle_min"], tolerance=1e-9).iloc[0]
    equations = trace(linkage)
    factor = equations.factors[-1].value
    sine, cosine = equations.transmission["E"]
    with mpmath.workdps(40):
        start = min(np.linspace(0.0, 2.0 * math.pi, 721), key=lambda t: evaluate_graph([factor.terms[0]], values, t)[0])
        at = mpmath.findroot(lambda t: evaluate_graph([factor.terms[1]], values, t)[0], (start, start + 1e-3))
        exact = 180 - mpmath.degrees(mpmath.atan2(*evaluate_graph([sine, cosine], values, at)))
        error = abs(mpmath.mpf(row["transmission_angle_min"]) - exact) / exact
    # or what the root of the margin costs: the error may be small by chance
    assert error <= row["error"] <= max(1e3 * error, 5e-12 / math.sqrt(margin))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("exponent", [-10, -20, -30, -40])
def test_a_slider_beside_its_change_point(exponent, side):
    """The factors of its joint are sums of positive terms; what is left is the rounding of the crank angle."""
    gap, crank, offset = 2.0**exponent, 30.0, 10.0
    rod, towards = crank + offset + gap, math.copysign(90.0, side)  # exact
    linkage = linkage_of(CASES["slider-crank"])
    angles = [towards, towards + 100.0 * math.sqrt(gap / crank), towards - 20.0]
    rows = explore.simulate(linkage, {"r": crank, "l": rod, "e": -side * offset, "speed": 1.0}, angles=angles)
    with mpmath.workdps(40):
        for (_, row), angle in zip(rows.iterrows(), angles, strict=True):
            theta = mpmath.radians(mpmath.mpf(angle))
            height = side * offset + crank * mpmath.sin(theta)
            root = mpmath.sqrt(mpmath.mpf(rod) ** 2 - height**2)
            rate = -crank * mpmath.cos(theta) / root
            # a few units in the last place of the angle, of the rate and of the sum
            assert abs(row["rod_velocity"] - rate) <= 1e-15 * (crank / root + abs(rate))


def test_bounds_count_the_rounding_of_the_angle():
    """A change point at a quarter of a turn is at a half-tangent of 1, which is less exact than one of 0."""
    rng, count = np.random.default_rng(0), 2000
    links = {"r": rng.uniform(10, 50, count), "l": rng.uniform(60, 150, count), "k": rng.uniform(60, 150, count)}
    total, gaps = links["l"] + links["k"] - links["r"], 10.0 ** rng.uniform(-7, -2, count)
    least = np.abs(links["l"] - links["k"]) + links["r"]
    design = links | {"g": np.where(rng.random(count) < 0.5, total - gaps, least + gaps)}
    asked = {"metrics": ["rocker_acceleration_variance"], "window": "cycle", "tolerance": 1e-9}
    flat, upright = (explore.evaluate(four_bar_along(place), design, **asked) for place in (["g", 0], [0, "g"]))
    met = (flat["status"] == 1) & (upright["status"] == 1)
    assert np.count_nonzero(met) >= 1990
    difference = np.abs(upright["rocker_acceleration_variance"] / flat["rocker_acceleration_variance"] - 1.0)
    assert (difference <= upright["error"])[met].all()


def four_bar_along(place):
    """A four-bar whose ground has its other pivot at a place."""
    links = {"crank": {"O": 0, "A": "r"}, "coupler": {"A": 0, "B": "l"}, "rocker": {"C": 0, "B": "k"}}
    frame, branch = {"O": [0, 0], "C": place}, {"B": "left of A C"}
    table = {"driver": "crank", "output": "rocker", "frame": frame, "links": links, "branch": branch}
    return explore.Linkage({"linkage": table})


@pytest.mark.parametrize("pins", [("C", "B", "P"), ("P", "B", "C")])
@pytest.mark.parametrize("point", ["P", "B"])
def test_curvatures_of_links_about_the_frame_are_within_their_bounds(pins, point):
    """They are 1/r, also where the rocker nearly stops and its acceleration is large beside the square of its rate."""
    places = {"C": 0, "B": "r3", "P": ["p", "q"]}
    four_bar = {
        "driver": "crank",
        "frame": {"O": [0, 0], "C": ["r4", 0]},
        "links": {"crank": {"O": 0, "A": "r1"}, "coupler": {"A": 0, "B": "r2"}, "rocker": {k: places[k] for k in pins}},
        "branch": {"B": "left of A C"},
    }
    rng = np.random.default_rng(4)
    lengths = {"r1": 40.0, "r2": 120.0, "r3": 90.0, "r4": 100.0, "p": 50.0, "q": 20.0}
    designs = {name: value * (1.0 + 0.2 * rng.uniform(-1.0, 1.0, 2000)) for name, value in lengths.items()}
    name = f"{point}_curvature_max"
    found = explore.evaluate(explore.Linkage(four_bar), designs, metrics=[name], window={"from": 40, "to": 100})
    radius = np.hypot(designs["p"], designs["q"]) if point == "P" else designs["r3"]
    is_ok = (found["status"] == 1).to_numpy()
    assert np.count_nonzero(is_ok) > 1500
    rounding = 2.0**-52  # of the radius and the product here
    assert (np.abs(np.abs(found[name]) * radius - 1.0) <= found["error"] + rounding)[is_ok].all()
