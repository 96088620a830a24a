"""Slider-cranks under load: forces by the equations of Newton and Euler, balances of power and work."""

import math

import newton_euler_slider
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mujoco_model import Body, Cut, inverse_dynamics

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


@pytest.mark.slow
def test_forces_agree_with_mujoco():
    """Without friction, which MuJoCo's inverse dynamics of given motions does not have in a guide."""
    pytest.importorskip("mujoco")
    random = np.random.default_rng(3)
    for number in range(100):
        crank, share = random.uniform(10.0, 200.0), random.uniform(-2.0, 2.0)
        rod = crank * (1.0 + abs(share)) * random.uniform(1.03, 6.0)
        design = newton_euler_slider.DEFAULTS | {"crank": crank, "rod": rod, "offset": share * crank}
        design |= {"speed": random.uniform(0.5, 50.0), "gravity": 9.80665 * (number % 2)}
        design |= {"constant_force": random.uniform(-500.0, 500.0), "opposing_force": random.uniform(0.0, 500.0)}
        design |= {"stiffness": random.uniform(0.0, 1e4), "damping": random.uniform(0.0, 500.0)}
        design |= {name: random.uniform(0.1, 10.0) for name in ("mass", "crank_mass", "rod_mass")}
        design |= {name: random.uniform(-0.5, 1.5) for name in ("crank_centroid", "rod_centroid")}
        design["rod_inertia"] = random.uniform(1e-3, 0.1)
        theta, speed = np.deg2rad(ANGLES), design["speed"]
        pin, slider, turning, spinning = newton_euler_slider.kinematics(design, theta)
        span = slider[0] - pin[0]
        crank, rod, offset = (1e-3 * design[name] for name in ("crank", "rod", "offset"))
        bodies = (
            Body("crank", design["crank_mass"], 0.01, (design["crank_centroid"] * crank, 0.0)),
            Body("rod", design["rod_mass"], design["rod_inertia"], (design["rod_centroid"] * rod, 0.0), (crank, 0.0),
                 "crank"),
            Body("slider", design["mass"], 0.01, (0.0, 0.0), (0.0, offset), joint="slide",
                 stiffness=design["stiffness"], rest=newton_euler_slider.middle(design), damping=design["damping"]),
        )  # fmt: skip
        motion = {
            "crank": (theta, np.full_like(theta, speed), np.zeros_like(theta)),
            "rod": (np.arctan2(span[:, 1], span[:, 0]) - theta, turning - speed, spinning),  # the angle to the crank
            "slider": slider[:, :, 0],
        }
        load = {"slider": design["constant_force"] - design["opposing_force"] * np.sign(slider[1, :, 0])}
        cut = Cut("rod", (rod, 0.0), "slider", (0.0, 0.0))
        torque, pins = inverse_dynamics(bodies, cut, design["gravity"], motion, load, "crank")
        exact = explore.simulate("slider-crank", design, angles=ANGLES)
        scale = max(magnitude(force).max() for force in pins.values())
        for name, body in (("crank_pivot_force", "crank"), ("crank_pin_force", "rod"), ("slider_pin_force", "cut")):
            assert np.abs(exact[name] - magnitude(pins[body])).max() <= 1e-11 * scale, design
        assert np.abs(exact["guide_force"] - pins["slider"][:, 1]).max() <= 1e-11 * scale, design
        assert np.abs(exact["drive_torque"] - torque).max() <= 1e-11 * scale * crank, design


@settings(derandomize=True, deadline=None, max_examples=60)
@given(sliders(), loads(), friction_shares)
def test_power_balances(slider, load, share):
    """The torque at the crank is the sum of the powers of inertia, weight and load, and that of friction is lost."""
    design = with_friction(slider, share) | load
    motion = explore.simulate("slider-crank", design, angles=ANGLES)
    reference = newton_euler_slider.forces(design, np.deg2rad(ANGLES))
    velocity = reference["velocity"]
    # the rod takes what it gives to the slider, the rest is left in crank and rod
    given_power = (
        reference["crank_pin_force"]
        * newton_euler_slider.kinematics(newton_euler_slider.DEFAULTS | design, np.deg2rad(ANGLES))[0][1]
    )
    arm = design.get("crank_centroid", 0.5) * 1e-3 * design["crank"] * np.cos(np.deg2rad(ANGLES))
    weight = design.get("crank_mass", 0.0) * 9.80665 * design["speed"] * arm
    scale = np.abs(motion["drive_power"]).max()
    assert np.abs(motion["drive_power"] - given_power.sum(axis=1) - weight).max() <= 1e-12 * scale
    assert motion["drive_power"].to_numpy() == pytest.approx(motion["drive_torque"] * design["speed"], rel=1e-15)
    assert motion["positive_power"].to_numpy() == pytest.approx(np.maximum(motion["drive_power"], 0.0), rel=1e-15)
    lost = design.get("opposing_force", 0.0) * np.abs(velocity) + design.get("damping", 0.0) * velocity**2
    lost = lost - reference["friction"] * velocity
    assert np.abs(motion["friction_power"] - lost).max() <= 1e-12 * max(lost.max(), scale)


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


@settings(derandomize=True, deadline=None, max_examples=60)
@given(sliders(), loads(CONSERVATIVE))
def test_conservative_loads_do_no_net_work(slider, load):
    row = evaluate(slider | load, ["drive_torque_mean", "drive_torque_rms", "net_work"])
    assert row["net_work"] == 0.0
    assert abs(row["drive_torque_mean"]) <= 1e-10 * row["drive_torque_rms"]


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


def test_the_mirrored_linkage_has_mirrored_forces():
    """With the offset on the other side and gravity upside down the guide pushes the other way, at mirrored angles."""
    design = {"crank": 50.0, "rod": 170.0, "offset": 30.0, "speed": 20.0, "mass": 2.0, "rod_mass": 1.0, "friction": 0.1}
    one = explore.simulate("slider-crank", design | {"gravity": 0.0}, angles=ANGLES)
    other = explore.simulate("slider-crank", design | {"gravity": 0.0, "offset": -30.0}, angles=360.0 - ANGLES)
    # the strokes are exchanged, and so is the sense of friction: without it the motion is the same backwards
    assert one["slider_position"].to_numpy() == pytest.approx(other["slider_position"], rel=1e-14)
    assert one["guide_force"].to_numpy() != pytest.approx(-other["guide_force"], rel=1e-3)
    one, other = (
        explore.simulate("slider-crank", design | {"gravity": 0.0, "friction": 0.0, "offset": offset}, angles=angles)
        for offset, angles in ((30.0, ANGLES), (-30.0, 360.0 - ANGLES))
    )
    peak = one["guide_force"].abs().max()
    assert np.abs(one["guide_force"].to_numpy() + other["guide_force"].to_numpy()).max() <= 1e-13 * peak
    assert one["crank_pin_force"].to_numpy() == pytest.approx(other["crank_pin_force"], rel=1e-12)


#: Designs whose guide force changes sign within the strokes, where the forces have corners.
CORNERED = {
    "crank": [84.04, 64.17, 31.71, 15.01], "rod": [203.6, 155.1, 132.1, 743.8], "offset": [0.83, 23.04, 34.92, 4.99],
    "speed": [3.434, 24.2, 22.11, 12.12], "constant_force": [3.255, -160.7, 44.42, -178.5],
    "opposing_force": [331.4, 171.7, 429.0, 68.2], "stiffness": [4545.0, 4498.0, 817.0, 4952.0], "mass": 5.0,
    "rod_mass": 3.0, "friction": [0.23, 0.154, 0.2415, 0.0],
}  # fmt: skip


def test_statistics_of_forces_with_corners():
    """Means and mean squares by Gauss rules between dead centres, corners and changes of sign."""
    names = ["drive_torque_mean", "drive_torque_rms", "positive_power_mean", "crank_pin_force_rms", "thrust_rms"]
    table = explore.evaluate("slider-crank", CORNERED, metrics=names, window="cycle")
    nodes, weights = np.polynomial.legendre.leggauss(60)
    for k, row in table.iterrows():
        design = {name: float(np.broadcast_to(column, 4)[k]) for name, column in CORNERED.items()}
        edges = np.array(corners(design))
        half, centre = np.diff(edges) / 2.0, (edges[1:] + edges[:-1]) / 2.0
        angles = (centre[:, None] + half[:, None] * nodes).ravel()
        shares = (half[:, None] * weights).ravel() / (2.0 * math.pi)
        forces = newton_euler_slider.forces(design, angles)
        torque, pin, thrust = forces["drive_torque"], magnitude(forces["crank_pin_force"]), forces["thrust"]
        rms = math.sqrt((shares * torque**2).sum())
        assert row["status"] == 1
        assert abs(row["drive_torque_mean"] - (shares * torque).sum()) <= row["error"] * rms
        assert row["drive_torque_rms"] == pytest.approx(rms, rel=row["error"])
        power = design["speed"] * np.maximum(torque, 0.0)
        assert row["positive_power_mean"] == pytest.approx((shares * power).sum(), rel=2.0 * row["error"])
        assert row["crank_pin_force_rms"] == pytest.approx(math.sqrt((shares * pin**2).sum()), rel=row["error"])
        assert row["thrust_rms"] == pytest.approx(math.sqrt((shares * thrust**2).sum()), rel=row["error"])


def corners(design):
    """Angles of a turn from the outer dead centre between which all forces are smooth, rad."""
    crank, rod, offset = design["crank"], design["rod"], design["offset"]
    outer, inner = math.asin(offset / (rod + crank)), math.pi + math.asin(offset / (rod - crank))
    edges = {outer, inner, outer + 2.0 * math.pi}
    for start, stop in ((outer, inner), (inner, outer + 2.0 * math.pi)):
        angles = np.linspace(start, stop, 2001)[1:-1]
        edges |= {*angles[::250]}
        for name in ("guide_force", "drive_torque"):
            values = newton_euler_slider.forces(design, angles)[name]
            for at in np.flatnonzero(values[:-1] * values[1:] < 0.0):
                low, high = angles[at], angles[at + 1]
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    same = newton_euler_slider.forces(design, np.array([middle]))[name][0] * values[at] > 0.0
                    low, high = (middle, high) if same else (low, middle)
                edges.add(low)
    return sorted(edges)
