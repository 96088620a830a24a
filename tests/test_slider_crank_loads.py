"""Slider-cranks under load: forces by the equations of Newton and Euler, balances of power and work."""

import math

import newton_euler_slider
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import explore

ANGLES = np.linspace(0.0, 360.0, 97)[:-1] + 1.234
FORCES = ("crank_pivot_force", "crank_pin_force", "slider_pin_force", "thrust", "guide_force", "drive_torque")
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
CONSERVATIVE = ("constant_force", "stiffness", "mass", "crank_mass", "rod_mass", "rod_inertia")
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
def loads(draw, names=tuple(LOADS)):
    """Some of the loads, at least one, and centroids of the links."""
    chosen = draw(st.lists(st.sampled_from(names), min_size=1, unique=True))
    return {name: draw(LOADS[name]) for name in chosen} | {name: draw(share) for name, share in CENTROIDS.items()}


#: Coefficient of friction as a share of the largest with which it cannot lock the slider.
friction_shares = st.just(0.0) | st.floats(0.01, 0.9)


def with_friction(slider, share):
    """The slider-crank with a coefficient of friction, at most 1."""
    sine = (slider["crank"] + abs(slider["offset"])) / slider["rod"]
    return slider | {"friction": share * min(1.0, math.sqrt(1.0 - sine * sine) / sine)}


def magnitude(force):
    return np.hypot(*force.T) if force.ndim == 2 else force


@settings(derandomize=True, deadline=None, max_examples=150)
@given(sliders(), loads(), friction_shares)
def test_forces_agree_with_newton_and_euler(slider, load, share):
    design = with_friction(slider, share) | load
    motion = explore.simulate("slider-crank", design, angles=ANGLES)
    reference = newton_euler_slider.forces(design, np.deg2rad(ANGLES))
    for name in FORCES:
        force = magnitude(reference[name])
        assert np.abs(motion[name] - force).max() <= 1e-12 * np.abs(force).max(), name
