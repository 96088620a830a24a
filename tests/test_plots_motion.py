"""Figures of one design: strokes, output and joints against other roads to the same numbers."""

import numpy as np
import pytest

import explore
from explore.charts.load import load_chart
from explore.charts.mechanism import joint_paths, mechanism_chart
from explore.charts.motion import clutch_output, crank_angles, motion_chart
from explore.charts.style import heading, new_figure, save
from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.motions import window_limits

LINKAGE = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
#: One whose slow stroke passes the crank angle 0, one whose other does, and the mirror image of each.
DESIGNS = [
    {**lengths, "branch": branch}
    for lengths in (LINKAGE, {"crank": 50.0, "coupler": 200.0, "rocker": 180.0, "ground": 300.0})
    for branch in (1.0, -1.0)
]


def limits_of(design, window, drive="slow"):
    return window_limits(CRANK_ROCKER, {name: np.array([value]) for name, value in design.items()}, window, drive)


@pytest.mark.parametrize("design", DESIGNS)
def test_strokes_end_where_the_rocker_turns_back(design):
    start, stop = limits_of(design, "overlapped_to_extended")
    velocities = explore.simulate("crank-rocker", angles=[start, stop], **design)["rocker_velocity"]
    assert np.abs(velocities).max() < 1e-13, "rounding of the angle times an acceleration near 1"
    slow, back = limits_of(design, "drive"), limits_of(design, "return")
    assert slow[1] - slow[0] >= 180.0 >= back[1] - back[0]
    assert sum(stop - start for start, stop in (slow, back)) == pytest.approx(360.0, rel=1e-14)
    assert limits_of(design, "drive", "fast") == back


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("phases", [1, 3, 7])
def test_output_through_clutches_has_the_mean_of_the_clutch_window(design, phases):
    angles = np.arange(0.0, 360.0, 0.05)
    motion = explore.simulate("crank-rocker", angles=angles, **design)
    exact = explore.evaluate("crank-rocker", {**design, "phases": phases}, ["output_velocity_mean"], window="clutch")
    mean = clutch_output(motion, limits_of(design, "drive"), phases).mean()
    # Corners and linear interpolation cost the square of the step, 7.6e-7 rad^2.
    assert mean == pytest.approx(exact["output_velocity_mean"].iloc[0], rel=3e-6)


def test_the_curves_reach_sharp_peaks():
    """A millionth of a millimetre from the change point the acceleration peaks within a thousandth of a degree."""
    design = {"crank": 150.0, "coupler": 1083.5, "rocker": 541.75, "ground": 691.75 + 2.0**-20}
    metrics = ["rocker_acceleration_max", "rocker_acceleration_min"]
    exact = explore.evaluate("crank-rocker", design, metrics, window="cycle").iloc[0]
    drawn = explore.simulate("crank-rocker", angles=crank_angles(), **design)["rocker_acceleration"]
    # Neighbouring angles differ by a quarter of their distance from the peak's foot.
    assert drawn.max() == pytest.approx(exact["rocker_acceleration_max"], rel=0.02)
    assert drawn.min() == pytest.approx(exact["rocker_acceleration_min"], rel=0.02)


@pytest.mark.parametrize("design", DESIGNS)
def test_joints_keep_the_coupler_long(design):
    motion = explore.simulate("crank-rocker", angles=crank_angles(), **design)
    pin, joint = joint_paths(motion, design)
    assert np.abs(np.hypot(*(joint - pin).T) / design["coupler"] - 1.0).max() < 1e-13
    angle = np.deg2rad(motion["coupler_angle"].to_numpy())
    along = design["coupler"] * np.column_stack([np.cos(angle), np.sin(angle)])
    assert np.abs(joint - pin - along).max() < 1e-12 * design["coupler"]


@pytest.mark.parametrize("design", DESIGNS)
def test_figures_of_one_design_show_its_limits(design):
    motion = explore.simulate("crank-rocker", angles=crank_angles(), **design)
    drive = limits_of(design, "drive")
    limits = dict(zip(("overlapped", "extended"), limits_of(design, "overlapped_to_extended"), strict=True))
    figure = motion_chart(motion, "title", drive, limits, 3)
    for chart in figure.axes:
        shaded = sum(patch.get_width() for patch in chart.patches)
        assert shaded == pytest.approx(drive[1] - drive[0], rel=1e-12)
        assert "[" in chart.get_ylabel()
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert texts == {f"{name} {angle % 360.0:.1f}°" for name, angle in limits.items()}

    (chart,) = mechanism_chart(motion, design, "title", drive, limits).axes
    chains = {line.get_label().split(" ")[0]: np.array(line.get_data()) for line in chart.get_lines()}
    for name, reach in (("overlapped", -design["crank"]), ("extended", design["crank"])):
        a, b, c, d = chains[name].T
        assert np.array_equal(d, [design["ground"], 0.0])
        # Interpolated within half a degree: the square of it, over 8, of the crank.
        assert np.hypot(*(c - a)) == pytest.approx(design["coupler"] + reach, rel=1e-5)
        assert np.hypot(*(b - a)) == pytest.approx(design["crank"], rel=1e-5)
    assert chart.get_aspect() == 1.0


def test_a_double_crank_has_no_strokes(tmp_path):
    design = {"crank": 500.0, "coupler": 450.0, "rocker": 480.0, "ground": 100.0}
    assert limits_of(design, "drive") is None
    motion = explore.simulate("crank-rocker", angles=crank_angles(), **design)
    save(motion_chart(motion, "title"), tmp_path / "motion.png")
    save(mechanism_chart(motion, design, "title"), tmp_path / "mechanism.png")


def test_forces_that_hardly_vary_are_in_sight_and_no_work_has_the_mean_0():
    """The published rig at its shortest crank; what a constant torque takes on the way there it gives back."""
    rig = {"crank": 5.0, "coupler": 460.0, "rocker": 595.0, "ground": 751.0, "speed": 60.0, "constant_torque": 25000.0}
    motion = explore.simulate("test-rig", angles=crank_angles(), **rig)
    figure = load_chart(motion, "title")
    (pins,) = (chart for chart in figure.axes if "pin forces" in chart.get_ylabel())
    low, high = pins.get_ylim()
    largest = max(line.get_ydata().max() for line in pins.get_lines())
    assert low == 0.0
    assert 0.5 * high < largest < 0.9 * high
    means = [line.get_label() for chart in figure.axes for line in chart.get_lines() if "mean" in line.get_label()]
    assert means == ["mean 0", "mean 0"]


def test_a_heading_ends_its_lines_at_commas():
    figure = new_figure()
    heading(figure, "study, design 0: crank 100 mm, rocker 541.712 mm, speed 4.2735 rad/s", 40)
    lines = figure.get_suptitle().replace("\xa0", " ").split("\n")
    assert lines == ["study, design 0: crank 100 mm,", "rocker 541.712 mm, speed 4.2735 rad/s"]
