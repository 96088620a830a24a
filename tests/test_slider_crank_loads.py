"""Slider-cranks under load: signals by free bodies with 256 bits, and their net work."""

import math

import numpy as np
import pytest
from exact_loads import ExactSliderCrank, assert_signals
from hypothesis import given, settings
from hypothesis import strategies as st

import explore

ANGLES = np.linspace(0.0, 360.0, 97)[:-1] + 1.234
LOADS = {
    "constant_force": st.floats(1.0, 500.0) | st.floats(-500.0, -1.0),
    "opposing_force": st.floats(1.0, 500.0),
    "stiffness": st.floats(10.0, 1e4),
    "damping": st.floats(0.1, 500.0),
    "mass": st.floats(0.1, 20.0),
    "crank_mass": st.floats(0.1, 10.0),
    "rod_mass": st.floats(0.1, 10.0),
    "rod_inertia": st.floats(1e-4, 0.1),
}
CENTROIDS = {
    f"{link}_centroid": st.integers(-50, 150).map(lambda percent: percent / 100.0) for link in ("crank", "rod")
}


@st.composite
def sliders(draw):
    """Lengths with an offset to either side, of rods from 3 % longer than they must be, and a speed."""
    crank = draw(st.floats(10.0, 200.0))
    offset = crank * draw(st.integers(-200, 200)) / 100.0
    rod = (crank + abs(offset)) * draw(st.floats(1.03, 8.0))
    return {"crank": crank, "rod": rod, "offset": offset, "speed": draw(st.floats(0.5, 50.0))}


@st.composite
def loads(draw):
    """Some of the loads, at least one, and centroids of the links."""
    chosen = draw(st.lists(st.sampled_from(sorted(LOADS)), min_size=1, unique=True))
    return {name: draw(LOADS[name]) for name in chosen} | {name: draw(share) for name, share in CENTROIDS.items()}


#: Coefficient of friction as a share of the largest with which it cannot lock the slider.
friction_shares = st.just(0.0) | st.floats(0.01, 0.9)


def with_friction(slider, share):
    """The slider-crank with a coefficient of friction, at most 1."""
    sine = (slider["crank"] + abs(slider["offset"])) / slider["rod"]
    return slider | {"friction": share * min(1.0, math.sqrt(1.0 - sine * sine) / sine)}


@settings(derandomize=True, deadline=None, max_examples=150)
@given(sliders(), loads(), friction_shares)
def test_signals_are_those_of_free_bodies(slider, load, share):
    design = with_friction(slider, share) | load
    motion = explore.simulate("slider-crank", design, angles=ANGLES[::4])
    assert_signals(motion, ExactSliderCrank, design, "slider_velocity")


def evaluate(design, metrics, tolerance=1e-10):
    row = explore.evaluate("slider-crank", design, metrics=metrics, window="cycle", tolerance=tolerance).iloc[0]
    assert row["status"] == 1
    return row


@settings(derandomize=True, deadline=None, max_examples=30)
@given(sliders(), loads(), friction_shares)
def test_the_net_work_is_what_the_load_dissipates(slider, load, share):
    design = with_friction(slider, share) | load
    row = evaluate(design, ["drive_torque_mean", "drive_torque_rms", "net_work", "positive_work", "stroke",
                            "slider_velocity_rms"])  # fmt: skip
    # each mean is within its tolerance of the rms, or of itself
    room = 2.0 * math.pi * 2e-10 * row["drive_torque_rms"]
    assert 2.0 * math.pi * row["drive_torque_mean"] == pytest.approx(row["net_work"], rel=2e-10, abs=room)
    assert row["positive_work"] >= row["net_work"] - room
    if not share:
        damping = design.get("damping", 0.0) * (1e-3 * row["slider_velocity_rms"]) ** 2 * 2.0 * math.pi
        opposing = 2e-3 * design.get("opposing_force", 0.0) * row["stroke"]
        assert row["net_work"] == pytest.approx(damping / design["speed"] + opposing, rel=3e-10)


def test_friction_that_can_lock_the_slider_is_a_status():
    """The tangent of the largest pressure angle is 1/sqrt(0.96): up to sqrt(0.96) = 0.9798 the forces are finite."""
    design = {"crank": 1.0, "rod": 1.4, "mass": 1.0}
    friction = [0.98, 0.979, 0.0]
    table = explore.evaluate(
        "slider-crank", design | {"friction": friction}, metrics=["thrust_peak", "stroke"], window="cycle"
    )
    assert table["status"].tolist() == [20, 1, 1]
    assert table["thrust_peak"].isna().tolist() == [True, False, False]
    # the motion is defined all the same
    assert table["stroke"].tolist() == [2.0, 2.0, 2.0]
    plain = explore.evaluate("slider-crank", design | {"friction": friction}, metrics=["slider_velocity_peak"])
    assert plain["status"].tolist() == [1, 1, 1]
    for coefficient, has_forces in zip(friction, (False, True, True), strict=True):
        motion = explore.simulate("slider-crank", design | {"friction": coefficient}, points={"knife": (1.0, 0.2)})
        assert ("thrust" in motion, "friction_power" in motion) == (has_forces, has_forces)
        assert {"slider_velocity", "knife_curvature"} <= set(motion)


def test_designs_without_load_have_no_forces():
    design = {"crank": 50.0, "rod": 150.0, "friction": 0.2}
    table = explore.evaluate("slider-crank", design | {"mass": [0.0, 1.0]}, metrics=["stroke", "thrust_peak"])
    assert table["thrust_peak"].isna().tolist() == [True, False]
    assert table["feasible"].tolist() == [False, True]
    assert "thrust" not in explore.simulate("slider-crank", design)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-10, 1e-12])
def test_an_extreme_at_the_opposite_of_the_anchor_keeps_its_digits(tolerance):
    """The torque is largest 1.4e-3 deg before 270 deg, where the half-tangent from 90 deg is 8e4."""
    design = {"crank": 36, "rod": 111, "offset": 9, "speed": 26, "mass": 4, "rod_mass": 0.5, "constant_force": -190}
    question = {"metrics": ["drive_torque_max"], "window": "cycle", "tolerance": tolerance}
    (value,) = explore.evaluate("slider-crank", design, **question)["drive_torque_max"]
    angles = 269.998574 + np.linspace(-1e-3, 1e-3, 2001)
    largest = explore.simulate("slider-crank", design, angles=angles)["drive_torque"].max()
    # the torque is known to some units in the last place of its terms
    assert value == pytest.approx(largest, rel=1e-14)
