"""Figures of one design show the constraints, drive stroke and clutches of its study, and no others."""

import json

import h5py
import numpy as np
import pytest
from store_files import unseal
from studies import TABLE, sweep_text

import explore
from explore.base.errors import ResultsError
from explore.figures.charts.bounds import SignalBound, signal_bounds, uses_drive_stroke
from explore.figures.charts.mechanism import mechanism_chart
from explore.figures.charts.motion import motion_chart
from explore.figures.charts.turn import TURN
from explore.figures.reporting.contents import collect_contents
from explore.figures.simulation import simulate_design
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.studies.config.linkage import mechanism_of
from explore.studies.request.names import find_mechanism

STUDY = """mechanism = "{mechanism}"
[parameters]
crank = [80, 100]
coupler = 1083.4236
rocker = 541.7118
ground = 780
{parameters}
[evaluate]
window = {window}
metrics = {metrics}
[constraints]
{constraints}
"""


@pytest.fixture
def sweep(tmp_path):
    """A function that sweeps a study with these sections."""

    def sweep_study(window="drive", metrics=("swing_angle",), constraints="", mechanism="crank-rocker", parameters=""):
        window = f'"{window}"' if isinstance(window, str) else "{{ from = {}, to = {} }}".format(*window)
        metrics = json.dumps(list(dict.fromkeys(["swing_angle", *metrics])))
        text = STUDY.format(
            mechanism=mechanism, parameters=parameters, window=window, metrics=metrics, constraints=constraints
        )
        text += '[rank]\nmetrics = ["swing_angle:max"]\n'
        (tmp_path / "study.toml").write_text(text)
        study = explore.load_study(tmp_path / "study.toml")
        return explore.sweep(study, tmp_path / f"{study.sha256[:8]}.h5")

    return sweep_study


def charts_of(figure):
    """The charts of a figure by the label of their y axis."""
    return {chart.get_ylabel(): chart for chart in figure.axes}


def limit_lines(chart):
    """Value and crank-angle span of each limit line."""
    return [
        (line.get_ydata()[0], tuple(map(float, line.get_xdata())))
        for line in chart.get_lines()
        if line.get_linestyle() == "-."
    ]


def test_without_constraints_there_are_no_limit_lines(sweep):
    results = sweep()
    assert all(limit_lines(chart) == [] for chart in charts_of(motion_chart(results, design=0)).values())
    assert collect_contents(results, find_mechanism("crank-rocker"), "", lambda _: None).study["bounds"] == []


def test_limit_lines_are_those_of_the_study(sweep):
    results = sweep(
        metrics=["cv", "rocker_acceleration_max", "rocker_acceleration_min_return"],
        constraints="transmission_angle_min = { min = 25 }\ntransmission_angle_max = { min = 40, max = 141 }\n"
        "rocker_acceleration_max = { max = 0.5 }\nrocker_acceleration_min_return = { min = -0.01 }\n"
        "rocker_velocity_mean = { min = 0.01 }\nswing_angle = { min = 5 }",
    )
    charts = charts_of(motion_chart(results, design=0))
    turn = (0.0, 360.0)
    assert limit_lines(charts["transmission angle [deg]"]) == [(141.0, turn), (25.0, turn)]
    assert limit_lines(charts["angular velocity [rad/s]"]) == []
    # A bound on a stroke is drawn along it: on the drive stroke and on the return stroke, which passes crank angle 0.
    simulated = simulate_design(results, 0)
    span_by_value = dict(limit_lines(charts["angular acceleration [rad/s²]"]))
    assert span_by_value.keys() == {0.5, -0.01}
    upper, lower = (bound.span for bound in simulated.bounds if bound.signal == "rocker_acceleration")
    assert upper == simulated.drive
    assert lower == pytest.approx((simulated.drive[1], simulated.drive[0] + 360.0), abs=1e-9) or lower == pytest.approx(
        (simulated.drive[1] - 360.0, simulated.drive[0]), abs=1e-9
    )
    spans = [span for _, span in limit_lines(charts["angular acceleration [rad/s²]"])]
    assert sorted(spans) == sorted([*TURN.parts(upper), *TURN.parts(lower)])


def test_violations_of_a_bound_are_hatched_along_its_stroke(sweep):
    results = sweep(metrics=["cv", "rocker_acceleration_max"], constraints="rocker_acceleration_max = { max = 0.01 }")
    chart = charts_of(motion_chart(results, design=0))["angular acceleration [rad/s²]"]
    simulated = simulate_design(results, 0)
    hatched = [part for part in chart.collections if part.get_hatch()]
    corners = np.vstack([path.vertices for part in hatched for path in part.get_paths()])
    assert corners[:, 1].min() >= 0.01
    assert corners[:, 1].max() == pytest.approx(simulated.motion["rocker_acceleration"].max(), rel=0.2)
    inside = [any(start <= x <= stop for start, stop in TURN.parts(simulated.drive)) for x in corners[:, 0]]
    assert len(inside) > 10
    assert all(inside)


def test_a_bound_far_from_the_curve_does_not_extend_the_axis(sweep):
    limits = charts_of(motion_chart(sweep(metrics=["rocker_acceleration_max"]), design=0))[
        "angular acceleration [rad/s²]"
    ].get_ylim()
    far = sweep(metrics=["rocker_acceleration_max", "cv"], constraints="rocker_acceleration_max = { max = 900 }")
    assert charts_of(motion_chart(far, design=0))["angular acceleration [rad/s²]"].get_ylim() == limits


@pytest.mark.parametrize(
    ("window", "metrics", "has_clutch"),
    [
        ("drive", ["cv"], True),
        ("return", ["cv"], True),
        ("clutch", ["cv"], True),
        ("cycle", ["swing_angle"], False),
        # the window of a study that names none, as of a wiper
        ("drive", ["swing_angle", "footprint"], False),
        ("overlapped_to_extended", ["cv"], False),
        ((0, 90), ["cv"], False),
        ("cycle", ["rocker_velocity_mean_drive"], True),
        ("cycle", ["output_velocity_cv_clutch"], True),
    ],
)
def test_strokes_and_clutches_are_shown_only_where_the_study_uses_them(sweep, window, metrics, has_clutch):
    results = sweep(window, metrics)
    assert uses_drive_stroke(results, CRANK_ROCKER) == has_clutch
    charts = charts_of(motion_chart(results, design=0))
    assert len(charts) == (6 if has_clutch else 4)
    assert ("output velocity [rad/s]" in charts) == has_clutch
    assert all(bool(chart.patches) == has_clutch for chart in charts.values())
    assert {text.get_text().split()[0] for text in charts["angle [deg]"].texts} == {"overlapped", "extended"}
    (linkage,) = charts_of(mechanism_chart(results, design=0)).values()
    assert ("input on the drive stroke" in {line.get_label() for line in linkage.get_lines()}) == has_clutch
    study = collect_contents(results, find_mechanism("crank-rocker"), "", lambda _: None).study
    assert study["drive"] == ("slow" if has_clutch else "none")


def test_a_mechanism_without_clutches_has_a_drive_stroke_alone(tmp_path):
    (tmp_path / "study.toml").write_text(
        'mechanism = "slider-crank"\n[parameters]\ncrank = 50\nrod = 150\noffset = 40\n[evaluate]\nwindow = "drive"\n'
    )
    results = explore.sweep(explore.load_study(tmp_path / "study.toml"), tmp_path / "slider.h5")
    simulated = simulate_design(results, 0)
    assert simulated.drive is not None
    assert simulated.phases is None


def test_a_constraint_on_a_stroke_counts_as_use(sweep):
    results = sweep("cycle", constraints="rocker_velocity_mean_drive = { min = 0.01 }")
    assert uses_drive_stroke(results, CRANK_ROCKER)


@pytest.mark.parametrize("window", [(300, 400), (-780, -680), (1020, 1120)])
def test_bounds_of_a_window_are_drawn_along_it(sweep, window):
    results = sweep(window, ["rocker_velocity_max"], "rocker_velocity_max = { max = 0.1 }")
    (bound,) = signal_bounds(results, find_mechanism("crank-rocker"))
    assert bound.span == pytest.approx((300.0, 400.0))
    np.testing.assert_allclose(TURN.parts(bound.span), [(0.0, 40.0), (300.0, 360.0)], rtol=1e-12, atol=1e-11)
    assert len(limit_lines(charts_of(motion_chart(results, design=0))["angular velocity [rad/s]"])) == 2


def test_a_bound_on_a_peak_is_one_on_both_sides(sweep):
    """The largest magnitude; that it shall be at least something says nothing of the rest of a curve."""
    constraints = "rocker_velocity_peak_return = { max = 2 }\nrocker_acceleration_peak = { min = 1 }"
    bounds = signal_bounds(sweep("cycle", (), constraints), CRANK_ROCKER)
    assert bounds == [
        SignalBound("rocker_velocity", "min", -2.0, stroke="return"),
        SignalBound("rocker_velocity", "max", 2.0, stroke="return"),
    ]


def test_a_bound_on_the_transmission_angles_of_a_table_is_one_on_each_joint(tmp_path):
    links = "second = { P = 0, E = 60 }\narm = { C = 0, E = 70 }\n[linkage.sketch]\nE = [120, 70]"
    text = TABLE.replace("[linkage.sketch]", links)
    results = sweep_text(tmp_path, text + "[constraints]\ntransmission_angle_min = { min = 20 }\n")
    bounds = signal_bounds(results, mechanism_of(results))
    assert bounds == [
        SignalBound(f"{joint}_transmission_angle", side, value)
        for joint in "BE"
        for side, value in (("min", 20.0), ("max", 160.0))
    ]


def test_bounds_on_the_worst_angle_and_on_peaks_of_the_test_rig(sweep):
    constraints = (
        "transmission_angle_worst = { min = 40 }\npin_force_peak = { max = 9e4 }\ndrive_torque_peak = { max = 500 }"
    )
    results = sweep("cycle", (), constraints, "test-rig", "constant_torque = 25000")
    bounds = {(bound.signal, bound.side): bound for bound in signal_bounds(results, find_mechanism("test-rig"))}
    assert bounds["transmission_angle", "max"] == SignalBound("transmission_angle", "max", 140.0)
    assert {key: bound.value for key, bound in bounds.items()} == {
        ("transmission_angle", "min"): 40.0, ("transmission_angle", "max"): 140.0,
        **{(f"pin_force_{pin}", "max"): 9e4 for pin in "abcd"},
        ("drive_torque", "min"): -500.0, ("drive_torque", "max"): 500.0,
    }  # fmt: skip
    charts = charts_of(motion_chart(results, design=0))
    assert {height for height, _ in limit_lines(charts["transmission angle [deg]"])} == {40.0, 140.0}
    assert {height for height, _ in limit_lines(charts["pin forces [kN]"])} == {90.0}
    assert {height for height, _ in limit_lines(charts["drive torque [N m]"])} == {-500.0, 500.0}


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("drive", "fats", "is damaged: a crank-rocker has no drive stroke 'fats'"),
        ("window", {"start": "a", "stop": 1}, "attribute determines has the wrong form"),
        ("window", {}, "attribute determines has the wrong form"),
        (
            "window",
            {"start": 10**400, "stop": 1},
            "attribute determines has the wrong form",
        ),
        (
            "window",
            {"start": 1, "stop": 1e400},
            "attribute determines has the wrong form",
        ),
    ],
)
def test_a_damaged_window_is_an_error(sweep, key, value, message):
    path = sweep(constraints="transmission_angle_min = { min = 5 }").path
    with h5py.File(path, "r+") as file:
        length = file.attrs["determines"].dtype.itemsize
        facts = json.loads(file.attrs["determines"])
        unseal(file)  # else each would be refused at once
        facts["evaluate"] = {"window": "drive", "drive": "slow", key: value}
        file.attrs["determines"] = np.bytes_(json.dumps(facts).encode().ljust(length))
    with pytest.raises(ResultsError, match=message):
        simulate_design(explore.open_results(path), 0)
    with pytest.raises(ResultsError, match=message):
        collect_contents(explore.open_results(path), CRANK_ROCKER, "", lambda _: None)
