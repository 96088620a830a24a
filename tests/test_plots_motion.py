"""Figures of one design: strokes, output and joints compared with independent computations."""

from dataclasses import replace

import numpy as np
import pytest
from studies import LOCKED, sweep_text

import explore
from explore.figures.charts.mechanism import mechanism_figure
from explore.figures.charts.motion import clutch_output, draw_panel, motion_chart, motion_figure
from explore.figures.charts.style import new_figure, save_figure, write_heading
from explore.figures.charts.turn import TURN, Span
from explore.figures.simulation import SimulatedDesign
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.mechanisms.rig.declaration import TEST_RIG
from explore.mechanisms.slider_crank.declaration import SLIDER_CRANK
from explore.model.drawing import Panel
from explore.results.labels import unit_text
from explore.running.motions import mark_angles, window_limits

LINKAGE = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
#: The slow stroke of the first passes crank angle 0, the fast stroke of the second does; each in both branches.
DESIGNS = [
    {**lengths, "branch": branch}
    for lengths in (LINKAGE, {"crank": 50.0, "coupler": 200.0, "rocker": 180.0, "ground": 300.0})
    for branch in (1.0, -1.0)
]


def simulated_design(design, **facts):
    """The motion of one design over a turn, as charts take it."""
    motion = explore.simulate("crank-rocker", design, angles=TURN.densely(0.0))
    return SimulatedDesign(CRANK_ROCKER, design, motion, **facts)


def limits_of(design, window, drive="slow"):
    return window_limits(CRANK_ROCKER, {name: np.array([value]) for name, value in design.items()}, window, drive)


def test_forces_that_friction_locks_are_left_out(tmp_path):
    """At some crank angles, and at all."""
    results = sweep_text(tmp_path, LOCKED, "locked")
    for design, is_drawn in enumerate((True, False)):
        chart = next(each for each in motion_chart(results, design=design).axes if "drive torque" in each.get_ylabel())
        values = chart.get_lines()[0].get_ydata()
        assert np.isnan(values).any()
        assert np.isfinite(values).any() == is_drawn


@pytest.mark.parametrize("anchor", [0.0, 90.0, 190.0, 275.0])
def test_curves_are_drawn_most_densely_at_the_anchor_and_its_opposite(anchor):
    """At most half a degree between angles, and down to rounding at both."""
    angles = TURN.densely(anchor)
    assert np.diff(angles).max() <= 0.5
    for centre in (anchor % 360.0, (anchor + 180.0) % 360.0):
        assert np.abs(angles - centre).min() < 1e-9


@pytest.mark.parametrize("design", DESIGNS)
def test_strokes_end_where_the_rocker_turns_back(design):
    start, stop = limits_of(design, "overlapped_to_extended")
    velocities = explore.simulate("crank-rocker", design, angles=[start, stop])["rocker_velocity"]
    assert np.abs(velocities).max() < 1e-13, "rounding of the angle times an acceleration near 1"
    slow, fast = limits_of(design, "drive"), limits_of(design, "return")
    assert slow[1] - slow[0] >= 180.0 >= fast[1] - fast[0]
    assert sum(stop - start for start, stop in (slow, fast)) == pytest.approx(360.0, rel=1e-14)
    assert limits_of(design, "drive", "fast") == fast


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("phases", [1, 3, 7])
def test_output_through_clutches_has_the_mean_of_the_clutch_window(design, phases):
    angles = np.arange(0.0, 360.0, 0.05)
    motion = explore.simulate("crank-rocker", design, angles=angles)
    simulated = SimulatedDesign(CRANK_ROCKER, design, motion)
    exact = explore.evaluate(
        "crank-rocker", {**design, "phases": phases}, metrics=["output_velocity_mean"], window="clutch"
    )
    output = CRANK_ROCKER.signal("output_velocity")
    mean = clutch_output(simulated, output, limits_of(design, "drive"), phases).mean()
    # Corners and linear interpolation cost the square of the step, 7.6e-7 rad^2.
    assert mean == pytest.approx(exact["output_velocity_mean"].iloc[0], rel=3e-6)


def test_the_curves_resolve_sharp_peaks():
    """A millionth of a millimetre from the change point the acceleration peaks within a thousandth of a degree."""
    design = {"crank": 150.0, "coupler": 1083.5, "rocker": 541.75, "ground": 691.75 + 2.0**-20}
    metrics = ["rocker_acceleration_max", "rocker_acceleration_min"]
    exact = explore.evaluate("crank-rocker", design, metrics=metrics, window="cycle").iloc[0]
    acceleration = explore.simulate("crank-rocker", design, angles=TURN.densely(0.0))["rocker_acceleration"]
    # Neighbouring angles differ by a quarter of their distance from the peak's foot.
    assert acceleration.max() == pytest.approx(exact["rocker_acceleration_max"], rel=0.02)
    assert acceleration.min() == pytest.approx(exact["rocker_acceleration_min"], rel=0.02)


@pytest.mark.parametrize("design", DESIGNS)
def test_links_keep_their_lengths_and_directions(design):
    simulated = simulated_design(design)
    points = simulated.pose().points(CRANK_ROCKER.drawing)
    for link in CRANK_ROCKER.drawing.links:
        first, last = (points[name] for name in link.points)
        assert np.abs(np.hypot(*(last - first).T) / design[link.name] - 1.0).max() < 1e-13
    angle = np.deg2rad(simulated.motion["coupler_angle"].to_numpy())
    along = design["coupler"] * np.column_stack([np.cos(angle), np.sin(angle)])
    coupler = points["rocker joint"] - points["crank joint"]
    assert np.abs(coupler - along).max() < 1e-12 * design["coupler"]


@pytest.mark.parametrize("design", DESIGNS)
def test_figures_of_one_design_show_its_limits(design):
    drive = limits_of(design, "drive")
    limits = mark_angles(CRANK_ROCKER, {name: np.array([value]) for name, value in design.items()})
    assert np.exp(1j * np.deg2rad(list(limits.values()))) == pytest.approx(
        np.exp(1j * np.deg2rad(limits_of(design, "overlapped_to_extended"))), abs=1e-15
    )
    simulated = simulated_design(design, title="title", marks=limits, drive=drive, phases=3)
    figure = motion_figure(simulated)
    for chart in figure.axes:
        shaded = sum(patch.get_width() for patch in chart.patches)
        assert shaded == pytest.approx(drive[1] - drive[0], rel=1e-12)
        assert "[" in chart.get_ylabel()
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert texts == {f"{name} {angle % 360.0:.1f}°" for name, angle in limits.items()}

    (chart,) = mechanism_figure(simulated).axes
    links = [np.array(line.get_data()).T for line in chart.get_lines() if line.get_zorder() == 4]
    assert len(links) == 2 * len(CRANK_ROCKER.drawing.links)
    for (crank, coupler, rocker), reach in ((links[:3], -design["crank"]), (links[3:], design["crank"])):
        assert np.array_equal(rocker[1], [design["ground"], 0.0])
        assert np.hypot(*(coupler[1] - crank[0])) == pytest.approx(design["coupler"] + reach, rel=1e-14)
        assert np.hypot(*(crank[1] - crank[0])) == pytest.approx(design["crank"], rel=1e-14)
    assert chart.get_aspect() == 1.0


def test_a_double_crank_has_no_strokes(tmp_path):
    design = {"crank": 500.0, "coupler": 450.0, "rocker": 480.0, "ground": 100.0}
    assert limits_of(design, "drive") is None
    simulated = simulated_design(design, phases=3)
    save_figure(motion_figure(simulated), tmp_path / "motion.png")
    save_figure(mechanism_figure(simulated), tmp_path / "mechanism.png")


def test_the_mean_torque_of_a_load_with_corners_is_0():
    """A force that depends on the place alone does no work; its corners move the mean of the curve by 1e-5 of it."""
    curve = {"over": "to_greatest", "points": [[0, 0], [0.5, 400], [4, 300], [5, 0]]}
    press = explore.Linkage({
        "driver": "crank", "output": "ram", "frame": {"O": [0, 0]}, "branch": {"S": "far"},
        "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "S": "l"}},
        "slots": {"ram": {"pin": "S", "link": "frame", "along": [[0, "e"], [1, "e"]]}},
        "loads": {"forces": {"S": ["-2 * punch", 0]}, "curves": {"punch": curve}},
    })  # fmt: skip
    design = {"r": 29.96, "l": 97.74, "e": 6.58, "speed": 6.0}
    motion = explore.simulate(press, design, angles=TURN.densely(0.0))
    figure = motion_figure(SimulatedDesign(press.mechanism, design, motion))
    means = [line.get_label() for chart in figure.axes for line in chart.get_lines() if "mean" in line.get_label()]
    assert means == ["mean 0", "mean 0"]


def test_pin_forces_start_at_0_and_the_mean_torque_is_0():
    """The published rig at its shortest crank, where forces hardly vary; a constant load torque does no net work."""
    rig = {"crank": 5.0, "coupler": 460.0, "rocker": 595.0, "ground": 751.0, "speed": 60.0, "constant_torque": 25000.0}
    motion = explore.simulate("test-rig", rig, angles=TURN.densely(0.0))
    figure = motion_figure(SimulatedDesign(TEST_RIG, rig, motion))
    (pins,) = (chart for chart in figure.axes if "pin forces" in chart.get_ylabel())
    low, high = pins.get_ylim()
    largest = max(line.get_ydata().max() for line in pins.get_lines())
    assert low == 0.0
    assert 0.5 * high < largest < 0.9 * high
    means = [line.get_label() for chart in figure.axes for line in chart.get_lines() if "mean" in line.get_label()]
    assert means == ["mean 0", "mean 0"]


def test_a_mean_is_rounded_once():
    """16.0554 N m, of which the curve tells five digits."""
    design = {"crank": 50.0, "rod": 160.0, "offset": 20.0, "speed": 10.0, "opposing_force": 500.0, "mass": 3.0}
    exact = explore.evaluate("slider-crank", design, metrics=["drive_torque_mean"], window="cycle")
    assert exact["drive_torque_mean"].iloc[0] == pytest.approx(16.0554, abs=1e-4)
    motion = explore.simulate("slider-crank", design, angles=TURN.densely(0.0))
    figure = motion_figure(SimulatedDesign(SLIDER_CRANK, design, motion))
    means = [line.get_label() for chart in figure.axes for line in chart.get_lines() if "mean" in line.get_label()]
    assert means == ["mean 16.06", "mean 160.6"]


def test_a_heading_breaks_its_lines_at_commas():
    figure = new_figure()
    write_heading(figure, "study, design 0: crank 100 mm, rocker 541.712 mm, speed 4.2735 rad/s", 40)
    lines = figure.get_suptitle().replace("\xa0", " ").split("\n")
    assert lines == ["study, design 0: crank 100 mm,", "rocker 541.712 mm, speed 4.2735 rad/s"]


def test_units_have_superscript_powers():
    assert [unit_text(unit) for unit in ("rad^2/s^4", "mm^3", "kg m^2", "1")] == ["rad²/s⁴", "mm³", "kg m²", "1"]


def test_a_panel_draws_all_of_many_signals_and_says_where_none_has_a_value():
    simulated = simulated_design(LINKAGE)
    names = tuple(signal.name for signal in CRANK_ROCKER.signals if signal.name in simulated.motion)
    chart = new_figure().subplots()
    draw_panel(chart, simulated, Panel("all", names), "red")
    curves = [line for line in chart.get_lines() if not line.get_label().startswith("_")]
    assert [line.get_label().replace(" ", "_") for line in curves] == list(names)
    assert len({(line.get_color(), line.get_linestyle()) for line in curves}) == len(names) > 5
    assert not chart.texts
    chart = new_figure().subplots()
    draw_panel(chart, replace(simulated, motion=simulated.motion * np.nan), Panel("none", names), "red")
    assert [text.get_text() for text in chart.texts] == ["no value at any input angle"]


def test_an_angle_that_rounding_leaves_below_a_whole_turn_is_shown_as_0():
    assert [TURN.shown(angle) for angle in (-1e-14, 360.0, 359.99, -0.01)] == [0.0, 0.0, 359.99, 359.99]
    assert Span(-10.0, 25.0).shown(-1e-14) == -1e-14
