"""Rows of the precision tables: complete, with failures among them, and what is said about them."""

import math

import numpy as np
import pytest

from explore.comparison.levels import level_costs
from explore.comparison.precision import compare_methods
from explore.comparison.reference import exact_statistics
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.comparison.strokes import coefficient_of_variation, stroke_nodes
from explore.comparison.summaries import ROUNDING, fastest, standing
from explore.comparison.timing import cpu_seconds, machine
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import ROCKER_VELOCITY, Level, Task, label
from explore.methods.registry import METHODS

SETTINGS = [label(method) for settings in METHODS.values() for method in settings]


def scene(name):
    return load_scene(bundled_scenes()[name])


@pytest.fixture(scope="module")
def smooth():
    told = []
    rows = compare_methods(scene("smooth"), told.append)
    assert told == SETTINGS
    return {row["setting"]: row for row in rows}


def test_every_setting_has_a_row_and_costs_something(smooth):
    assert list(smooth) == SETTINGS
    for row in smooth.values():
        assert (row["scene"], row["designs"], row["failed"]) == ("smooth", 1, 0)
        assert row["cpu_seconds"] > 0.0
        assert row["cv_cpu_seconds"] > 0.0
        assert row["evaluations"] >= 1
        assert row["angle_error_rms"] <= row["angle_error_max"]


def test_errors_on_the_smooth_scene(smooth):
    ours = smooth["closed-form"]
    # rounding of a few operations, and of a sum over 30 nodes
    assert max(ours[f"{name}_error_max"] for name in ("angle", "velocity", "acceleration")) < 2e-15
    assert ours["cv_error"] < 3e-15
    assert 1e-3 < smooth["rk45(rtol=0.001)"]["velocity_error_max"] < 1e-2, "wrong in the third digit"
    errors = [smooth[f"rk4(steps={steps})"]["velocity_error_max"] for steps in (72, 180, 360, 1440)]
    assert errors == sorted(errors, reverse=True)


def test_a_scene_without_motion_has_rows_and_no_errors():
    rows = compare_methods(scene("change_point"))
    assert [row["setting"] for row in rows] == SETTINGS
    assert all(math.isnan(row["angle_error_max"]) for row in rows)
    ours = rows[0]
    assert (ours["method"], ours["verdict"], ours["failed"]) == ("closed-form", "rightly refused", 0)
    assert any(row["silently_wrong"] for row in rows), "some method goes through the change point and says ok"
    assert standing(rows) is None


def test_a_model_of_positions_leaves_velocities_out():
    rows = compare_methods(scene("tiny_swing"))
    assert not any("velocity_error_max" in row or "cv_error" in row for row in rows)
    assert rows[0]["angle_error_max"] < 1e-15


def test_stroke_nodes_give_the_exact_coefficient_of_variation():
    lengths = np.array([[100.0, 1083.4236, 541.7118, 691.7118], [150.0, 1083.5, 541.75, 691.75 + 2.0**-20]])
    for sign in (1.0, -1.0):
        branch = np.full(2, sign)
        angles, weights = stroke_nodes(lengths, branch)
        assert (np.diff(angles) > 0.0).all()
        velocity = ClosedForm().solve(Task(lengths, branch, angles, Level.VELOCITIES)).signals[ROCKER_VELOCITY]
        exact = exact_statistics(lengths, branch)[1, 2]
        # angles near 180 degrees are rounded at 2e-16, a thousandth of the second design's margin in angle
        assert coefficient_of_variation(velocity, weights) == pytest.approx(exact, rel=1e-11)


def test_levels_are_named_and_paid_for():
    row = level_costs(scene("unassemblable"))
    assert row["needs"] == "geometry"
    assert row["spared"] == pytest.approx(row["accelerations"] / row["geometry"])


def row(method, seconds, error, failed=0):
    return {"method": method, "setting": f"{method}({seconds})", "cpu_seconds": seconds, "failed": failed,
            "velocity_error_max": error}  # fmt: skip


def test_who_is_fastest_by_hand():
    rows = [row("a", 3.0, 1e-9), row("a", 1.0, 1e-4), row("b", 2.0, 1e-9), row("c", 0.5, 1e-9, failed=1)]
    assert [found["setting"] for found in fastest(rows, 1e-3)] == ["a(1.0)", "b(2.0)"]
    assert [found["setting"] for found in fastest(rows, 1e-6)] == ["b(2.0)", "a(3.0)"]
    assert fastest(rows, 1e-12) == []


def test_standing_by_hand():
    ours = row("closed-form", 2.0, 1e-15)
    ahead = standing([ours, row("a", 8.0, ROUNDING), row("b", 1.0, 1e-3), row("c", 1.0, 1e-16, failed=1)])
    assert (ahead.ahead, ahead.rivals) == (4.0, ())
    behind = standing([ours, row("a", 1.0, 1e-14)])
    assert behind.rivals == ("a(1.0)",)
    assert standing([ours]).ahead == math.inf


def test_the_first_run_is_not_timed():
    calls = []

    def run():
        calls.append(None)
        sum(range(2_000_000 if len(calls) == 1 else 10))

    assert cpu_seconds(run) < 1e-3
    assert len(calls) == 8  # seven after the first


def test_the_machine_is_named():
    named = machine()
    assert named["processor"]
    assert named["python"].startswith("3.")
    assert named["numpy"] == np.__version__
