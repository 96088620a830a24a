"""Rows of the precision tables, including those of failures, and their summaries."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from loop_cases import rockers

from explore.cli.commands import precision
from explore.comparison import timing
from explore.comparison.method_precision import (
    ROUNDING_ERROR,
    closed_form_standing,
    compare_methods,
    fastest_settings,
    measure_level_costs,
)
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, method_label
from explore.comparison.methods.registry import METHODS
from explore.comparison.reference_statistics import exact_statistics
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.comparison.strokes import coefficient_of_variation, stroke_nodes
from explore.comparison.timing import describe_machine, measure_cpu_seconds

SETTINGS = [method_label(method) for settings in METHODS.values() for method in settings]


def scene(name):
    return load_scene(bundled_scenes()[name])


def compared(name, *progress):
    """Rows of a scene, each timed once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(timing, "_MAX_RUNS", 1)
        return compare_methods(scene(name), *progress)


@pytest.fixture(scope="module")
def smooth():
    labels = []
    rows = compared("smooth", labels.append)
    assert labels == SETTINGS
    return {row["setting"]: row for row in rows}


def test_every_setting_has_a_row_with_costs_and_errors(smooth):
    assert list(smooth) == SETTINGS
    for row in smooth.values():
        assert (row["scene"], row["designs"], row["failed"]) == ("smooth", 1, 0)
        assert row["cpu_seconds"] > 0.0
        assert row["cv_cpu_seconds"] > 0.0
        assert row["evaluations"] >= 1
        assert row["position_error_rms"] <= row["position_error_max"]


def test_errors_on_the_smooth_scene(smooth):
    closed_form = smooth["closed-form"]
    # rounding of a few operations, and of a sum over 30 nodes
    assert max(closed_form[f"{name}_error_max"] for name in ("position", "velocity", "acceleration")) < 2e-15
    assert closed_form["cv_error"] < 3e-15
    assert 1e-3 < smooth["rk45(rtol=0.001)"]["velocity_error_max"] < 1e-2, "wrong in the third digit"
    errors = [smooth[f"rk4(steps={steps})"]["velocity_error_max"] for steps in (72, 180, 360, 1440)]
    assert errors == sorted(errors, reverse=True)


def test_a_scene_without_a_motion_has_rows_without_errors():
    rows = compared("change_point")
    assert [row["setting"] for row in rows] == SETTINGS
    assert all(math.isnan(row["position_error_max"]) for row in rows)
    closed_form = rows[0]
    assert (closed_form["method"], closed_form["verdict"], closed_form["failed"]) == (
        "closed-form",
        "correctly rejected",
        0,
    )
    assert any(row["silently_wrong"] for row in rows), "some method passes the change point and reports success"
    assert closed_form_standing(rows) is None


def test_a_scene_of_positions_has_no_velocity_errors():
    rows = compared("tiny_swing")
    assert not any("velocity_error_max" in row or "cv_error" in row for row in rows)
    assert rows[0]["position_error_max"] < 1e-15


def test_stroke_nodes_give_the_exact_coefficient_of_variation():
    lengths = np.array([[100.0, 1083.4236, 541.7118, 691.7118], [150.0, 1083.5, 541.75, 691.75 + 2.0**-20]])
    for sign in (1.0, -1.0):
        designs = rockers(lengths, sign)
        angles, weights = stroke_nodes(designs)
        assert (np.diff(angles) > 0.0).all()
        velocity = ClosedForm().solve(designs.task(angles, Level.VELOCITIES)).signals[3]
        exact = exact_statistics(designs)[1, 2]
        # angles near 180 degrees are rounded at 2e-16, a thousandth of the second design's margin in angle
        assert coefficient_of_variation(velocity, weights) == pytest.approx(exact, rel=1e-11)


def test_level_costs():
    row = measure_level_costs(scene("unassemblable"))
    assert row["needs"] == "geometry"
    assert row["full_cost_ratio"] == pytest.approx(row["accelerations"] / row["geometry"])


def row(method, seconds, error, failed=0, silently_wrong=0):
    return {"method": method, "setting": f"{method}({seconds})", "cpu_seconds": seconds, "failed": failed,
            "velocity_error_max": error, "silently_wrong": silently_wrong}  # fmt: skip


def test_fastest_settings_of_constructed_rows():
    rows = [row("a", 3.0, 1e-9), row("a", 1.0, 1e-4), row("b", 2.0, 1e-9), row("c", 0.5, 1e-9, failed=1)]
    assert [row["setting"] for row in fastest_settings(rows, 1e-3)] == ["a(1.0)", "b(2.0)"]
    assert [row["setting"] for row in fastest_settings(rows, 1e-6)] == ["b(2.0)", "a(3.0)"]
    assert [row["setting"] for row in fastest_settings(rows, 1e-9)] == ["b(2.0)", "a(3.0)"]
    assert fastest_settings(rows, 1e-12) == []


def test_standing_of_constructed_rows():
    closed_form = row("closed-form", 2.0, 1e-15)
    fastest = closed_form_standing(
        [closed_form, row("a", 8.0, ROUNDING_ERROR), row("b", 1.0, 1e-3), row("c", 1.0, 1e-16, failed=1)]
    )
    assert (fastest.next_cost_ratio, fastest.cheaper_settings) == (4.0, ())
    slower = closed_form_standing([closed_form, row("a", 1.0, 1e-14)])
    assert slower.cheaper_settings == ("a(1.0)",)
    assert closed_form_standing([closed_form]).next_cost_ratio == math.inf


def test_the_command_prints_constructed_rows(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "150")
    still = [row(name, seconds, math.nan, failed=1) for name, seconds in (("closed-form", 1.0), ("a", 2.0))]
    of_scenes = {
        "still": still,
        "first": [row("closed-form", 3e-9, 0.0), row("a", 2.5e-6, 1e-4, silently_wrong=2), row("b", 0.04, 1e-14)],
        "slow": [row("closed-form", 2.0, 1e-15), row("a", 0.5, 1e-13), row("b", 1e-3, 1e-5)],
    }
    motions = [each | {"scene": name} for name, rows in of_scenes.items() for each in rows]
    times = {"geometry": 1e-9, "positions": 0.999e-6, "velocities": 0.996, "accelerations": 1.0}
    scenes = [SimpleNamespace(name=name) for name in of_scenes]
    precision._print_standings(scenes, motions)
    precision._print_fastest(scenes, motions)
    precision._print_levels([times | {"scene": "first", "needs": "velocities", "full_cost_ratio": 2.0}])
    lines = [re.split(r"  +", line.strip()) for line in capsys.readouterr().out.splitlines()]
    assert [cells for cells in lines if cells[0] in {*of_scenes, "1e-06 to 1e-12"}] == [
        ["still", "–", "–", "no motion exists", "0 of 2"],
        ["first", "3 ns", "0", "×1.33e+07", "1 of 3"],
        ["slow", "2 s", "1e-15", "faster: a(0.5)", "0 of 3"],
        ["first", "1e-03", "closed-form", "3 ns", "a ×833"],
        ["1e-06 to 1e-12", "closed-form", "3 ns", "b ×13333300"],
        ["slow", "1e-03", "b", "1 ms", "a ×500"],
        ["1e-06 to 1e-12", "a", "500 ms", "closed-form ×4"],
        ["first", "velocities", "1 ns", "999 ns", "996 ms", "1 s", "×2"],
    ]


def test_the_first_run_is_not_timed():
    calls = []

    def run():
        calls.append(None)
        sum(range(2_000_000 if len(calls) == 1 else 10))

    assert measure_cpu_seconds(run) < 1e-3
    assert len(calls) == 8  # seven after the first


def test_the_machine_is_described():
    machine = describe_machine()
    assert machine["processor"]
    assert machine["python"].startswith("3.")
    assert machine["numpy"] == np.__version__
