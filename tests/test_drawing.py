"""Drawings as data: points against hand-written coordinates, curves of bodies, and refused declarations."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.patches import Rectangle
from simple_slider import SIMPLE_SLIDER

import explore
from explore.base.errors import RequestError
from explore.figures.charts.mechanism import mechanism_figure, profile_curve
from explore.figures.charts.motion import motion_figure
from explore.figures.simulation import SimulatedDesign
from explore.mechanisms.registry import MECHANISMS
from explore.model.drawing import INPUT, Drawing, Guide, Link, Panel, Path, Pose, Profile, Vector
from explore.studies.request.names import find_mechanism
from explore.testing.drawing import broken_links
from explore.testing.subject import Subject

RIG, CRANK_ROCKER = MECHANISMS["test-rig"], MECHANISMS["crank-rocker"]
DRAWING = CRANK_ROCKER.drawing


def test_a_point_is_a_sum_of_vectors():
    angle = np.array([0.0, 90.0, 225.0])
    pose = Pose({"arm": 2.0, "shift": np.array([1.0, 2.0, 3.0])}, {"swing": np.array([90.0, 0.0, 180.0])}, angle)
    drawing = Drawing({"a": (), "b": (Vector("arm", INPUT), Vector("shift", "swing", 0.5, -1), Vector(7.0, 270.0))})
    points = pose.points(drawing)
    assert np.array_equal(points["a"], np.zeros((3, 2)))
    half = np.sqrt(2.0)
    expected = [[2.0, -0.5 - 7.0], [1.0, 2.0 - 7.0], [-half - 1.5, -half - 7.0]]
    assert points["b"] == pytest.approx(np.array(expected), abs=1e-14)  # a few roundings of numbers below 10


def test_bodies_that_roll_on_each_other_touch_on_the_line_of_centres():
    """Two circles of radii 2 and 3 as profiles: at every angle both pass the pitch point, and turn oppositely."""
    angle = np.linspace(0.0, 360.0, 361)
    drawing = Drawing({"left": (), "right": (Vector(5.0),)})
    left = Profile("left", (Vector(2.0, INPUT, sense=-1),), "left", INPUT)
    right = Profile("right", (Vector(3.0, "driven", -1.0),), "right", "driven", sense=-1)
    turn = Pose({}, {"driven": angle * 2.0 / 3.0}, angle)
    for index in (0, 40, 222):
        now = Pose({}, {"driven": turn.angles["driven"][[index]]}, angle[[index]])
        curves = [profile_curve(turn, now, profile, drawing) for profile in (left, right)]
        for curve in curves:
            assert curve[index] == pytest.approx([2.0, 0.0], abs=1e-13)
        for curve, centre, radius in zip(curves, ([0.0, 0.0], [5.0, 0.0]), (2.0, 3.0), strict=True):
            assert np.hypot(*(curve - centre).T) == pytest.approx(radius, rel=1e-14)


def test_links_that_change_their_length_are_found():
    columns = {"crank": [100.0], "coupler": [1083.4236], "rocker": [541.7118], "ground": [691.7118]}
    columns = {name: np.array(values) for name, values in columns.items()}
    assert list(broken_links(Subject(CRANK_ROCKER, columns))) == []
    shifted = replace(DRAWING, points={**DRAWING.points, "rocker pivot": (Vector("ground", 1.0),)})
    extended = replace(CRANK_ROCKER.extended, drawing=shifted)
    (sentence,) = broken_links(Subject(replace(CRANK_ROCKER, drawing=shifted, extended=extended), columns))
    assert sentence.startswith("the drawing's rocker is longer or shorter than its length by ")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"points": {"a": (Vector("cranck"),)}}, "the drawing names the length 'cranck', which is no parameter or"),
        ({"points": {"a": (Vector("rocker_angle"),)}}, "the drawing names the length 'rocker_angle', which is no"),
        ({"points": {"a": (Vector(1.0, "rocker_velocity"),)}}, "the drawing names the angle 'rocker_velocity', which"),
        ({"links": (Link("rod", ("b",)),)}, "the drawing names the point 'b', which does not exist"),
        ({"pivots": ("b",)}, "the drawing names the point 'b', which does not exist"),
        ({"guides": (Guide("b"),)}, "the drawing names the point 'b', which does not exist"),
        ({"paths": (Path("b", "path"),)}, "the drawing names the point 'b', which does not exist"),
        ({"stroke_point": "b"}, "the drawing names the point 'b', which does not exist"),
        ({"profiles": (Profile("wheel", (), "b", INPUT),)}, "the drawing names the point 'b', which does not exist"),
        ({"profiles": (Profile("wheel", (), "a", "crank"),)}, "the profile 'wheel' turns by 'crank', which is no"),
    ],
)
def test_a_drawing_names_what_exists(changes, sentence):
    drawing = Drawing(**{"points": {"a": (Vector("crank", INPUT),)}, **changes})
    with pytest.raises(ValueError, match=f"^mechanism 'crank-rocker': {sentence}"):
        replace(CRANK_ROCKER, drawing=drawing)


def test_a_panel_names_signals_of_one_unit():
    with pytest.raises(ValueError, match="the panel 'angle' names the signal 'angle', which does not exist"):
        replace(CRANK_ROCKER, panels=(Panel("angle", ("angle",)),))
    with pytest.raises(ValueError, match="the panel 'both' has signals in different units"):
        replace(CRANK_ROCKER, panels=(Panel("both", ("rocker_angle", "rocker_velocity")),))


def sliders(**changes):
    """A slider-crank over a turn, its signals in the registry for a while."""
    mechanism = replace(SIMPLE_SLIDER, **changes)
    with MECHANISMS.including(mechanism):
        design = {"crank": 50.0, "rod": 120.0, "offset": 20.0}
        yield SimulatedDesign(mechanism, design, explore.simulate(mechanism.name, design))


def test_a_mechanism_without_panels_has_one_for_each_signal():
    (figure,) = (motion_figure(simulated) for simulated in sliders())
    assert [chart.get_ylabel() for chart in figure.axes] == [
        "position of the slider [mm]", "its rate by the crank angle [mm]"
    ]  # fmt: skip


def test_a_mechanism_without_a_drawing_says_so():
    for simulated in sliders(drawing=None):
        with pytest.raises(RequestError, match="the mechanism 'simple-slider' declares no drawing"):
            mechanism_figure(simulated)


def test_a_slider_has_its_guide():
    for simulated in sliders():
        drawing = simulated.mechanism.drawing
        places = simulated.pose().points(drawing)
        assert np.hypot(*(places["slider"] - places["pin"]).T) == pytest.approx(120.0, rel=1e-14)
        (chart,) = mechanism_figure(simulated).axes
        heights = {tuple(np.unique(line.get_ydata())) for line in chart.get_lines() if len(line.get_xdata()) == 2}
        lines = [height[0] for height in heights if len(height) == 1]
        assert np.mean([height for height in lines if height > 0.0]) == pytest.approx(20.0, rel=1e-14)
        (block,) = (
            patch.get_corners() for patch in chart.patches if isinstance(patch, Rectangle) and not patch.get_hatch()
        )
        assert block.mean(axis=0) == pytest.approx([50.0 + np.sqrt(120.0**2 - 20.0**2), 20.0], rel=1e-12)
        assert np.ptp(block[:, 1]) == pytest.approx(max(lines) - min(line for line in lines if line > 0.0), rel=1e-12)


def test_forces_are_drawn_for_loaded_designs_only():
    plain = {"crank": 5.0, "coupler": 460.0, "rocker": 595.0, "ground": 751.0, "speed": 60.0}
    for load, labels in (({}, 4), ({"constant_torque": 25e3}, 8)):
        motion = explore.simulate("test-rig", {**plain, **load})
        figure = motion_figure(SimulatedDesign(RIG, {**plain, **load}, motion))
        assert len(figure.axes) == labels


@pytest.mark.parametrize("angle", [0.0, 77.0, 240.64, 300.0])
def test_pitch_curves_touch_on_the_line_of_centres(angle):
    """The pitch curves of gears in mesh touch at the pitch point and roll."""
    gears = MECHANISMS["gears"]
    design = {"growth": 1.44, "sector": 4.2, "centre_distance": 150.0}
    turn = np.append(np.linspace(0.0, 359.0, 360), angle)
    simulated = SimulatedDesign(gears, design, explore.simulate("gears", design, angles=turn))
    driver, driven = gears.drawing.profiles
    now = simulated.pose([angle])
    curves = [profile_curve(simulated.pose(), now, profile, gears.drawing) for profile in (driver, driven)]
    radius = now.lengths["driver_radius"][0]
    for curve in curves:
        assert curve[-1] == pytest.approx([radius, 0.0], abs=1e-10)  # rounding of angles in degrees
    # The curves roll: pieces of equal length have passed, so their tangents at the pitch point are one line.
    step = 1e-4
    moved = simulated.pose([angle - step, angle + step])
    chords = [profile_curve(moved, now, profile, gears.drawing) for profile in (driver, driven)]
    first, second = (np.diff(chord, axis=0)[0] for chord in chords)
    assert first == pytest.approx(second, abs=1e-7 * np.hypot(*first) + step**2)


PLACED = {
    "crank-rocker": {"crank": 100, "coupler": 300, "rocker": 250, "ground": 350, "M_along": 120, "M_across": 40},
    "slider-crank": {"crank": 50, "rod": 200, "offset": 20, "M_along": 120, "M_across": 40},
}


@pytest.mark.parametrize("name", PLACED)
def test_a_placed_drawing_is_turned_and_shifted(name):
    """All of it, as one body."""
    mechanism, parameters = find_mechanism(name, ("M",)), PLACED[name]
    motion = explore.simulate(name, parameters, points={"M": (120, 40)}, angles=np.linspace(0.0, 350.0, 36))
    signals = {str(column): motion[column].to_numpy() for column in motion}
    pose = Pose.of(mechanism.signals, parameters, signals, motion.index.to_numpy())
    plain, placed = mechanism.drawing, mechanism.drawing.placed(70.0, -30.0, 25.0)
    turn = np.exp(1j * np.radians(25.0))
    for point, places in pose.points(plain).items():
        expected = 70.0 - 30.0j + turn * (places @ [1.0, 1.0j])
        # a few roundings of angles of 500 deg
        assert np.abs(pose.points(placed)[point] @ [1.0, 1.0j] - expected).max() < 1e-11
    assert [guide.angle for guide in placed.guides] == [guide.angle + 25.0 for guide in plain.guides]
