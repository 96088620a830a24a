"""Polished designs: known optima, and what happens at walls, kinks and edges."""

import json
import math

import numpy as np
import pytest
from command_line import call, succeed
from scipy.optimize import linprog, minimize
from studies import published_box, sweep_text, swept

import explore
from explore.analysis.refining.polishing import _Local, polish

STUDY = published_box(4096)
results = swept(STUDY)


def test_the_published_bounds_hold_a_cv_of_0_353912252(results):
    """From three designs; the value is that of a global search with ten digits, and SLSQP leaves 1e-9."""
    best = explore.rank(results).index[:3]
    polished = explore.polish(results, list(best))
    assert list(polished.index) == list(best)
    assert polished["cv"].to_numpy() == pytest.approx(0.353912252, abs=5e-9)
    assert (polished["feasible"] == 1).all()
    assert polished.attrs["units"]["coupler"] == "mm"
    # Both transmission angles and the ground are at their bounds; the strokes are then equal.
    design = polished.iloc[0]
    assert design["ground"] == pytest.approx(1000.0, abs=1e-5)
    assert design["transmission_angle_min_margin"] == pytest.approx(0.0, abs=1e-5)
    assert design["transmission_angle_max_margin"] == pytest.approx(0.0, abs=1e-5)


def test_the_rows_are_what_evaluate_says(results):
    polished = explore.polish(results, objective="mean_output_ratio:max")
    limits = {"transmission_angle_min": {"min": 30}, "transmission_angle_max": {"max": 150}}
    again = explore.evaluate(
        "crank-rocker",
        polished[["crank", "coupler", "rocker", "ground"]],
        metrics=["mean_output_ratio", "cv"],
        window="drive",
        drive="slow",
        constraints=limits,
    )
    assert again["mean_output_ratio"].iloc[0] == polished["mean_output_ratio"].iloc[0]
    assert again["feasible"].iloc[0]
    assert polished["mean_output_ratio"].iloc[0] >= explore.rank(results)["mean_output_ratio"].max()


def test_results_without_a_feasible_design_are_refused(tmp_path):
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={"crank": {"start": 40, "stop": 50, "num": 2}, "coupler": 250, "rocker": 250, "ground": 200},
        constraints={"swing_angle": {"min": 179}},
        objectives=["swing_angle:max"],
    )
    results = explore.sweep(study, tmp_path / "none.h5")
    with pytest.raises(explore.RequestError, match="none to polish"):
        explore.polish(results)


def test_an_infeasible_design_is_refused(results):
    frame = results.to_pandas()
    number = int(frame.index[frame["feasible"] == 0][0])
    with pytest.raises(explore.RequestError, match=f"design {number} is not feasible"):
        explore.polish(results, number)


def test_command(results):
    out, _ = succeed("polish", results.path, "--json")
    assert json.loads(out)[0]["cv"] == pytest.approx(0.353912252, abs=5e-9)
    out, _ = succeed("polish", results.path, "--metric", "cv")
    assert "0.35391225" in out
    code, _, said = call("polish", results.path, "--metric", "cvv")
    assert code == 2
    assert "did you mean" in said


def quadratic(positions):
    """Least at (0.3, 0.6) without constraints."""
    return ((positions - (0.3, 0.6)) ** 2).sum(axis=1), np.zeros((len(positions), 0))


def test_a_minimum_inside():
    assert polish(quadratic, np.array([0.9, 0.1])) == pytest.approx([0.3, 0.6], abs=1e-6)


def disc(positions):
    """As far as possible to the upper right within a circle of radius 0.5 about the centre."""
    values = -positions.sum(axis=1)
    return values, (0.25 - ((positions - 0.5) ** 2).sum(axis=1))[:, None]


def test_a_minimum_on_a_constraint():
    found = polish(disc, np.array([0.4, 0.6]))
    assert disc(found[None])[1][0, 0] >= 0.0
    # The search stays 1e-10 of a step inside, and the value is flat along the circle.
    assert found.sum() == pytest.approx(1.0 + math.sqrt(0.5), abs=1e-9)


def test_a_minimum_at_a_jump():
    """The value jumps up across a line that no constraint declares: the search stays on the lower side."""

    def jump(positions):
        return positions[:, 0] - positions[:, 1] + 2.0 * (positions[:, 1] > 0.7), np.zeros((len(positions), 0))

    found = polish(jump, np.array([0.5, 0.2]))
    assert jump(found[None])[0][0] < 0.5 - 0.2
    assert found[1] <= 0.7


def test_the_border_of_a_jump_is_followed():
    def jump(positions):
        values = np.where(positions[:, 0] > 0.3, 1.0, 5.0) + positions.sum(axis=1)
        return values, np.zeros((len(positions), 0))

    found = polish(jump, np.array([0.5, 0.5]))
    assert found == pytest.approx([0.3, 0.0], abs=1e-9)


@pytest.mark.parametrize("margin", [5.0, math.inf])
def test_a_margin_that_nothing_changes_says_nothing(margin):
    """Warnings are errors."""

    def kink(positions):
        return np.abs(positions - 0.3).max(axis=1), np.full((len(positions), 1), margin)

    assert kink(polish(kink, np.array([0.5, 0.5]))[None])[0][0] <= 0.2


def test_undefined_neighbours_end_nothing():
    def half(positions):
        return np.where(positions[:, 0] < 0.5, positions[:, 0], np.nan), np.zeros((len(positions), 0))

    assert polish(half, np.array([0.49999999]))[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("start", [(0.3, 0.3), (0.1, 0.05), (0.8, 0.1), (0.2, 0.7)])
def test_a_curved_border_of_what_is_defined_is_followed(start):
    calls = []

    def inside(positions):
        values = -positions @ (1.0, 2.0)
        calls.append(len(positions))
        return np.where((positions**2).sum(axis=1) < 0.81, values, np.nan), np.zeros((len(positions), 0))

    # Each search follows the border's tangent, has left it by the square of its step, and comes back.
    assert inside(polish(inside, np.array(start))[None])[0][0] == pytest.approx(-0.9 * math.sqrt(5.0), rel=1e-6)
    assert len(calls) < 10_000


LOCKING = """\
mechanism = "slider-crank"
[parameters]
crank = { min = 20, max = 60 }
rod = { min = 60, max = 400 }
offset = { min = -20, max = 20 }
opposing_force = [20, 40]
friction = 0.2
[sampling]
method = "sobol"
count = 64
[evaluate]
metrics = ["stroke", "drive_torque_peak"]
[constraints]
drive_torque_peak = { max = 3 }
[rank]
metrics = ["stroke:max"]
"""


def test_a_search_that_steps_to_where_friction_locks_comes_back(tmp_path):
    """With the longest crank and the largest offset, and a rod whose angle has the tangent 1 / 0.2 at the return."""
    rod = (60.0 + 20.0) * math.hypot(1.0, 0.2)
    longest = math.sqrt((rod + 60.0) ** 2 - 400.0) - math.sqrt((rod - 60.0) ** 2 - 400.0)
    results = sweep_text(tmp_path, LOCKING)
    frame = results.to_pandas()
    polished = explore.polish(results, list(frame.index[frame["feasible"] == 1][:5]))
    # The stroke rises steeply towards the border: of 40 searches the last to come to it ends 1.4e-6 below.
    assert polished["stroke"].to_numpy() == pytest.approx(longest, rel=3e-6)


NEARLY_FOLDED = """
mechanism = "linkage"
[linkage]
driver = "crank"
output = "rocker"
frame = { O = [0, 0], C = ["g", 0] }
links = { crank = { O = 0, A = "r" }, coupler = { A = 0, B = "b" }, rocker = { C = 0, B = "c" } }
branch = { B = "left of A C" }
[parameters]
r = 30
g = { min = 35, max = 100 }
b = 70
c = 60
[sampling]
method = "sobol"
count = 256
[evaluate]
window = "cycle"
metrics = ["swing_angle", "rocker_acceleration_mean", "rocker_velocity_variance"]
tolerance = 1e-12
[rank]
metrics = ["swing_angle:max"]
"""


def test_a_search_ends_at_the_best_design_that_meets_the_tolerance(tmp_path):
    """The swing grows up to g = r + 10, where the links fold into one line; right beside it the tolerance is missed."""
    results = sweep_text(tmp_path, NEARLY_FOLDED)
    polished = explore.polish(results).iloc[0]
    assert polished["feasible"] == 1
    # The best design of the sweep has 125.1 deg; at 1e-1 mm from the border at r = 30 the swing is 133.3 deg.
    assert polished["swing_angle"] > 133.0


def test_a_design_whose_crank_hardly_turns_is_not_the_end(tmp_path):
    """Transmission angles grow to where crank and ground are as long as coupler and rocker: no neighbour is better."""
    metrics = '"transmission_angle_min"]\n[rank]\nmetrics = ["transmission_angle_min:max"]\n'
    text = published_box(512).partition('"mean_output_ratio"')[0] + metrics
    results = sweep_text(tmp_path, text)
    polished = explore.polish(results).iloc[0]
    names, rng = ["crank", "coupler", "rocker", "ground"], np.random.default_rng(1)
    lengths = polished[names].to_numpy(dtype=float)
    near = lengths + rng.normal(size=(2000, 4)) * 10.0 ** rng.uniform(-4, 0, (2000, 1))
    near = np.clip(near, [50, 50, 50, 50], [50, 1000, 500, 1000])
    others = explore.evaluate("crank-rocker", dict(zip(names, near.T, strict=True)), metrics=["transmission_angle_min"])
    best = others.loc[others["feasible"], "transmission_angle_min"].max()
    assert polished["transmission_angle_min"] >= best * (1.0 - 1e-6)


def test_the_way_to_an_infeasible_end_is_divided_three_times_beside_the_border():
    border = 0.6180339887

    def within(positions):
        return -positions[:, 0], border - positions

    local = _Local(within, np.array([0.2]), 0.0, {})
    local.approach(np.array([1.0]))
    assert 0.0 <= border - local.best[0] <= 0.8 / 63**3


def test_the_distance_of_a_border_is_measured_once_and_only_towards_it():
    counts = []

    def half(positions):
        counts.append(len(positions))
        return np.where(positions[:, 0] < 0.5, 0.0, np.nan), np.zeros((len(positions), 0))

    # Nothing is better, so that all three searches begin at the start: one looks both ways along each axis.
    polish(half, np.array([0.49999, 0.5]))
    assert counts.count(4) == 1
    assert 0 < counts.count(1) <= 54


def test_a_search_follows_a_kink_to_its_least_place():
    """The largest of three paraboloids within four planes, against SciPy's solver of the smooth problem."""
    rng = np.random.default_rng(3)
    for d in (1, 2, 3, 5):
        for _ in range(5):
            centres, sizes = rng.uniform(0.2, 0.8, (3, d)), rng.uniform(0.5, 5.0, 3)
            normals, limits = rng.normal(size=(4, d)), rng.uniform(0.05, 0.3, 4)

            def pieces(positions, centres=centres, sizes=sizes):
                return sizes * ((positions[:, None] - centres) ** 2).sum(axis=2) + np.arange(3) * 0.05

            def margins(positions, normals=normals, limits=limits):
                return limits - (positions - 0.5) @ normals.T

            def largest(positions, pieces=pieces, margins=margins):
                return pieces(positions).max(axis=1), margins(positions).min(axis=1, keepdims=True)

            rooms = {
                "type": "ineq",
                "fun": lambda z: np.append(z[-1] - pieces(z[None, :-1])[0], margins(z[None, :-1])[0]),
            }
            start, bounds = np.append(np.full(d, 0.5), 9.0), [(0, 1)] * d + [(None, None)]
            options = {"ftol": 1e-15, "maxiter": 500}
            smooth = minimize(lambda z: z[-1], start, method="SLSQP", bounds=bounds, constraints=rooms, options=options)
            found, own = largest(polish(largest, np.full(d, 0.5))[None])
            assert own[0, 0] >= 0.0
            assert found[0] == pytest.approx(smooth.fun, rel=1e-8)


LEAST_PEAK = """
mechanism = "crank-rocker"
[parameters]
crank = { min = 20, max = 100 }
coupler = { min = 100, max = 400 }
rocker = { min = 60, max = 400 }
ground = { min = 100, max = 400 }
speed = 10
[sampling]
method = "sobol"
count = 1024
[evaluate]
metrics = ["swing_angle", "rocker_acceleration_peak", "transmission_angle_min"]
[constraints]
swing_angle = { min = 40 }
transmission_angle_min = { min = 30 }
[rank]
metrics = ["rocker_acceleration_peak"]
"""


def test_the_least_peak_is_found_from_anywhere(tmp_path):
    """Both accelerations of a rocker, forth and back, are as large there; design 1 has a least peak of its own."""
    results = sweep_text(tmp_path, LEAST_PEAK)
    frame = results.to_pandas()
    polished = explore.polish(results, list(frame.index[frame["feasible"] == 1][::20]))
    assert list(polished.index) == [1, 206, 375, 626, 757, 913]
    peaks = polished["rocker_acceleration_peak"].to_numpy()
    assert peaks[1:] == pytest.approx(peaks[1], rel=1e-11)
    assert peaks[0] > peaks[1]
    names, rng = ["crank", "coupler", "rocker", "ground"], np.random.default_rng(1)
    for lengths, least in zip(polished[names].to_numpy(dtype=float)[:2], peaks[:2], strict=True):
        steps = rng.normal(size=(20_000, 4)) * 10.0 ** rng.uniform(-5, 0, (20_000, 1))
        near = np.clip(lengths + steps, [20, 100, 60, 100], [100, 400, 400, 400])
        metrics = ["swing_angle", "rocker_acceleration_peak", "transmission_angle_min"]
        columns = dict(zip(names, near.T, strict=True)) | {"speed": 10.0}
        others = explore.evaluate("crank-rocker", columns, metrics=metrics)
        allowed = others["feasible"] & (others["swing_angle"] >= 40) & (others["transmission_angle_min"] >= 30)
        assert allowed.sum() > 100
        assert others.loc[allowed, "rocker_acceleration_peak"].min() >= least * (1.0 - 1e-12)


def test_the_start_is_kept_where_nothing_is_better():
    start = np.array([0.3, 0.6])
    assert quadratic(polish(quadratic, start)[None])[0][0] <= quadratic(start[None])[0][0]


def test_a_search_from_a_border_within_roundings_goes_along_it():
    """The distances from such a start are roundings and tell no direction; the optimum is that of linprog."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        normal, gradient = rng.uniform(0.2, 1.0, (2, 3)) * [[-1, -1, 1]]
        limit = float(normal @ rng.uniform(0.3, 0.7, 3))

        def evaluate(positions, normal=normal, limit=limit, gradient=gradient):
            # sums that do not depend on the number of positions
            exists = (positions * normal).sum(axis=1) <= limit
            return np.where(exists, -(positions * gradient).sum(axis=1), np.nan), np.zeros((len(positions), 0))

        inside, outside = np.array([0.6, 0.6, 0.0]), np.array([0.4, 0.4, 1.0])
        assert np.isfinite(evaluate(inside[None])[0][0])
        assert np.isnan(evaluate(outside[None])[0][0])
        for _ in range(100):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if np.isfinite(evaluate(middle[None])[0][0]) else (inside, middle)
        expected = linprog(-gradient, A_ub=normal[None], b_ub=[limit], bounds=(0, 1)).fun
        assert evaluate(polish(evaluate, inside)[None])[0][0] == pytest.approx(expected, abs=1e-9)
