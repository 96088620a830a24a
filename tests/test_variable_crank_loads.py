"""Variable cranks with masses of rod, pin and disc: signals by free bodies with 256 bits and by MuJoCo; net work."""

import math

import numpy as np
import pytest
from exact_groove import ExactGroove
from exact_loads import assert_signals
from hypothesis import given, settings
from hypothesis import strategies as st
from mujoco_model import Body, Cut, Guided, inverse_dynamics, magnitude, rod_motion

import explore
from explore.mechanisms.registry import MECHANISMS
from explore.testing import check_mechanism

ANGLES = np.linspace(0.0, 360.0, 97)[:-1] + 1.234
MASSES = {
    "rod_mass": st.floats(0.1, 10.0),
    "rod_inertia": st.floats(1e-4, 0.1),
    "pin_mass": st.floats(0.05, 2.0),
    "disc_mass": st.floats(0.5, 20.0),
}
LOADS = {
    "mass": st.floats(0.1, 20.0),
    "constant_force": st.floats(1.0, 500.0) | st.floats(-500.0, -1.0),
    "opposing_force": st.floats(1.0, 500.0),
    "stiffness": st.floats(10.0, 1e4),
    "damping": st.floats(0.1, 500.0),
    "friction": st.floats(0.01, 0.9),
}


@st.composite
def cranks(draw):
    """A variable crank, of short and of long reversals, with a speed."""
    rod, speed = draw(st.floats(100.0, 1000.0)), draw(st.floats(1.0, 30.0))
    travel, width = rod * draw(st.floats(0.03, 0.5)), draw(st.floats(0.1, 2.2))
    return {"rod": rod, "slider_speed": travel * speed, "speed": speed, "reversal_time": width / speed,
            "blend_order": draw(st.sampled_from([1.0, 2.0, 3.0]))}  # fmt: skip


@st.composite
def loads(draw, names):
    """Some of the loads, at least one mass of a link, and centroids."""
    chosen = draw(st.lists(st.sampled_from(sorted(MASSES)), min_size=1, unique=True))
    chosen += draw(st.lists(st.sampled_from(names), unique=True))
    load = {name: draw((MASSES | LOADS)[name]) for name in chosen}
    return load | {
        "rod_centroid": draw(st.integers(-50, 150)) / 100.0,
        "disc_centroid": draw(st.integers(-200, 200)) / 2.0,
    }


@settings(derandomize=True, deadline=None, max_examples=150)
@given(cranks(), loads(sorted(LOADS)))
def test_signals_are_those_of_free_bodies(crank, load):
    motion = explore.simulate("variable-crank", crank | load, angles=ANGLES[::4])
    assert_signals(motion, ExactGroove, crank | load, "slider_velocity")


@pytest.mark.slow
def test_forces_agree_with_mujoco():
    """Without friction, which MuJoCo's inverse dynamics of given motions does not have in a guide."""
    pytest.importorskip("mujoco")
    random = np.random.default_rng(3)
    for number in range(60):
        speed, rod = random.uniform(1.0, 30.0), random.uniform(100.0, 1000.0)
        design = {"rod": rod, "speed": speed, "slider_speed": rod * speed * random.uniform(0.03, 0.5)}
        design |= {"reversal_time": random.uniform(0.3, 2.2) / speed, "blend_order": float(1 + number % 3)}
        design |= {"gravity": 9.80665 * (number % 2), "rod_inertia": random.uniform(1e-3, 0.1)}
        design |= {name: random.uniform(0.1, 10.0) for name in ("mass", "rod_mass", "pin_mass", "disc_mass")}
        design |= {"rod_centroid": random.uniform(-0.5, 1.5), "disc_centroid": random.uniform(-80.0, 80.0)}
        pin, slider, turning, spinning = rod_motion("variable-crank", design, ANGLES)
        theta, span, length = np.deg2rad(ANGLES), slider[0] - pin[0], np.linalg.norm(pin[0], axis=1)
        rate = (pin[0] * pin[1]).sum(axis=1) / length  # of the crank's length, and the second one
        second = (pin[0] * pin[2]).sum(axis=1) / length + speed**2 * length
        bodies = (
            Body("disc", design["disc_mass"], 0.01, (1e-3 * design["disc_centroid"], 0.0)),
            Body("pin", design["pin_mass"], 0.01, (0.0, 0.0), parent="disc", joint="slide"),
            Body("rod", design["rod_mass"], design["rod_inertia"], (design["rod_centroid"] * 1e-3 * rod, 0.0),
                 parent="pin"),
            Body("slider", design["mass"], 0.01, (0.0, 0.0), joint="slide"),
        )  # fmt: skip
        motion = {
            "disc": (theta, np.full_like(theta, speed), np.zeros_like(theta)),
            "pin": (length, rate, second),
            "rod": (np.arctan2(span[:, 1], span[:, 0]) - theta, turning - speed, spinning),
            "slider": slider[:, :, 0],
        }
        normal = np.stack([pin[1, :, 1], -pin[1, :, 0]], axis=-1) / np.linalg.norm(pin[1], axis=1)[:, None]
        cut = Cut("rod", (1e-3 * rod, 0.0), "slider", (0.0, 0.0))
        torque, pins = inverse_dynamics(
            bodies, cut, design["gravity"], motion, {}, "disc", Guided("pin", (0.0, 0.0), normal)
        )
        exact = explore.simulate("variable-crank", design, angles=ANGLES)
        scale = max(magnitude(force).max() for force in pins.values())
        radial = pin[0] / length[:, None]
        around = np.stack([-radial[:, 1], radial[:, 0]], axis=-1)
        found = {
            "disc_pivot_force": magnitude(pins["disc"]), "slot_force": (pins["pin"] * around).sum(axis=1),
            "groove_force": (pins["guided"] * normal).sum(axis=1), "crank_pin_force": magnitude(pins["rod"]),
            "slider_pin_force": magnitude(pins["cut"]), "guide_force": pins["slider"][:, 1],
            "drive_torque": torque / length.max(),
        }  # fmt: skip
        for name, force in found.items():
            own = exact[name] / length.max() if name == "drive_torque" else exact[name]
            assert np.abs(own - force).max() <= 1e-11 * scale, (name, design)
        assert np.abs((pins["pin"] * radial).sum(axis=1)).max() <= 1e-11 * scale  # the slot pushes across itself alone


@settings(derandomize=True, deadline=None, max_examples=15)
@given(cranks(), loads(sorted(LOADS)))
def test_the_net_work_is_what_the_load_dissipates(crank, load):
    names = ["drive_torque_mean", "drive_torque_rms", "net_work", "positive_work"]
    row = explore.evaluate("variable-crank", crank | load, metrics=names).iloc[0]
    assert row["status"] == 1
    # each mean is within its tolerance, 1e-9, of the rms, or of itself
    room = 2.0 * math.pi * 2e-9 * row["drive_torque_rms"]
    assert 2.0 * math.pi * row["drive_torque_mean"] == pytest.approx(row["net_work"], rel=2e-9, abs=room)
    assert row["positive_work"] >= row["net_work"] - room


def test_a_mass_at_the_slider_is_the_slider_s():
    """A rod whose centroid is at its end, without inertia of its own, is a point mass that moves with the slider."""
    design = {"rod": 500.0, "slider_speed": 800.0, "speed": 10.0, "reversal_time": 0.1, "friction": 0.1}
    one = explore.simulate(
        "variable-crank", design | {"mass": 1.0, "rod_mass": 2.0, "rod_centroid": 1.0}, angles=ANGLES
    )
    other = explore.simulate("variable-crank", design | {"mass": 3.0}, angles=ANGLES)
    for name in ("guide_force", "groove_force", "slot_force", "crank_pin_force", "drive_torque"):
        assert np.abs(one[name] - other[name]).max() <= 1e-14 * np.abs(other[name]).max(), name


def test_without_a_load_there_are_no_forces():
    design = {"rod": 500.0, "slider_speed": 800.0, "speed": 10.0, "reversal_time": 0.1, "mass": 0.0}
    table = explore.evaluate("variable-crank", design | {"pin_mass": [0.0, 0.1]}, metrics=["stroke", "pin_force_peak"])
    assert table["pin_force_peak"].isna().tolist() == [True, False]
    assert table["feasible"].tolist() == [False, True]


LOADED = """mechanism = "variable-crank"
[parameters]
rod = [400, 600]
slider_speed = 800
speed = "100 rpm"
reversal_time = [0.12, 0.18]
friction = 0.1
rod_mass = 2
rod_centroid = 0.4
rod_inertia = 0.02
pin_mass = 0.3
disc_mass = 6
disc_centroid = 20
[evaluate]
metrics = ["stroke", "drive_torque_peak", "pin_force_peak", "groove_force_peak", "positive_work", "net_work"]
[rank]
metrics = ["drive_torque_peak", "pin_force_peak"]
"""


@pytest.mark.slow
def test_loaded_designs_keep_all_promises():
    """The same for designs without masses of links is a test of all mechanisms."""
    designs = {"rod": np.array([400.0, 600.0]), "slider_speed": np.array([800.0, 600.0]), "speed": np.full(2, 10.5),
               "reversal_time": np.array([0.12, 0.18]), "friction": np.array([0.1, 0.0]), "mass": np.array([1.0, 4.0]),
               "rod_mass": np.array([2.0, 0.5]), "rod_centroid": np.array([0.4, 0.9]),
               "rod_inertia": np.array([0.02, 0.01]), "pin_mass": np.array([0.3, 0.1]),
               "disc_mass": np.array([6.0, 2.0]), "disc_centroid": np.array([20.0, -5.0])}  # fmt: skip
    check_mechanism(MECHANISMS["variable-crank"], study=LOADED, designs=designs)
