"""Random test rigs: identities of any linkage, and comparison with the equations of Newton and Euler."""

import math

import newton_euler
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import explore

OK = 1
ANGLES = np.linspace(0.0, 360.0, 97)[:-1] + 1.234
LOADS = ("constant_torque", "opposing_torque", "stiffness", "damping", "inertia")
MASSES = ("crank_mass", "coupler_mass", "rocker_mass", "coupler_inertia", "rocker_inertia")


@st.composite
def rigs(draw):
    """Lengths of a crank-rocker that stays clear of the change point, and a speed."""
    rocker = draw(st.floats(100.0, 900.0))
    ground = rocker * draw(st.floats(0.5, 2.0))
    coupler = rocker * draw(st.floats(0.5, 2.5))
    # the largest crank: the Grashof condition with each of the others as the longest
    largest_crank = min(
        rocker, ground, coupler, ground + rocker - coupler, ground + coupler - rocker, coupler + rocker - ground
    )
    assume(largest_crank > 0.05 * rocker)
    crank = largest_crank * draw(st.floats(0.02, 0.9))
    return {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground, "speed": draw(st.floats(0.5, 80.0))}


torques = st.floats(10.0, 3e4)


@st.composite
def loads(draw, names=LOADS):
    """Some of the loads, at least one."""
    sizes = {
        "constant_torque": torques | torques.map(lambda x: -x),
        "opposing_torque": torques,
        "stiffness": st.floats(1e2, 3e5),
        "damping": st.floats(0.1, 1e3),
        "inertia": st.floats(0.01, 20.0),
    }
    chosen = draw(st.lists(st.sampled_from(names), min_size=1, unique=True))
    return {name: draw(sizes[name]) for name in chosen}


@st.composite
def links(draw):
    """Masses, centroids and inertias of the links."""
    return {name: draw(st.floats(0.1, 50.0)) for name in MASSES} | {
        f"{link}_centroid": draw(st.integers(-50, 150)) / 100.0 for link in ("crank", "coupler", "rocker")
    }


def evaluate(design, metrics):
    row = explore.evaluate("test-rig", design, metrics=metrics, tolerance=1e-10).iloc[0]
    assert row["status"] == OK
    return row


def magnitude(pairs):
    return np.hypot(*pairs.T)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), loads(), links() | st.just({}))
def test_forces_agree_with_newton_and_euler(rig, load, link):
    design = rig | load | link
    motion = explore.simulate("test-rig", design, angles=ANGLES)
    pins, torque, _, _ = newton_euler.forces(design, np.deg2rad(ANGLES))
    scale = max(magnitude(force).max() for force in pins.values())
    # the reference uses an arccos, which loses half of the digits where the links are nearly in line
    for pin, force in pins.items():
        assert motion[f"pin_force_{pin}"].to_numpy() == pytest.approx(magnitude(force), rel=0.0, abs=1e-8 * scale)
    assert motion["drive_torque"].to_numpy() == pytest.approx(
        torque, rel=0.0, abs=1e-8 * scale * design["crank"] * 1e-3
    )


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), loads())
def test_power_balances(rig, load):
    # identity 1: at every node the power of the crank is that of the load and of the inertia
    design = rig | load
    motion = explore.simulate("test-rig", design, angles=ANGLES)
    _, _, torque, _ = newton_euler.forces(design, np.deg2rad(ANGLES))
    torque = load.get("inertia", 0.0) * motion["rocker_acceleration"].to_numpy() - torque
    load_power = torque * motion["rocker_velocity"].to_numpy()
    scale = np.abs(torque).max() * np.abs(motion["rocker_velocity"]).max()
    assert motion["power"].to_numpy() == pytest.approx(load_power, rel=0.0, abs=1e-8 * scale)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), loads(), links())
def test_the_mean_power_is_that_of_damping_and_opposing_torque(rig, load, link):
    # the work of constant torque, spring, weight and inertia over a cycle is 0, with masses or without
    design = rig | load | link
    metrics = ["power_mean", "power_rms", "rocker_velocity_rms", "swing_angle"]
    row = evaluate(design, metrics)
    damping_power = load.get("damping", 0.0) * row["rocker_velocity_rms"] ** 2
    opposing_power = load.get("opposing_torque", 0.0) * math.radians(row["swing_angle"]) / math.pi * rig["speed"]
    assert row["power_mean"] == pytest.approx(damping_power + opposing_power, rel=0.0, abs=2e-10 * row["power_rms"])


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), loads(("constant_torque", "stiffness")))
def test_at_the_limits_the_force_passes_through_the_crank_pivot(rig, load):
    # identity 2: |F_y| = |M| / ground and no drive torque, in every configuration
    a, b, c, d = (rig[name] for name in ("crank", "coupler", "rocker", "ground"))
    for reach, offset in ((b + a, 0.0), (b - a, math.pi)):
        # the angle at the crank pivot by half angles
        s = (reach + c + d) / 2.0
        theta = 2.0 * math.atan2(math.sqrt((s - reach) * (s - d)), math.sqrt(s * (s - c))) + offset
        motion = explore.simulate("test-rig", {**rig, **load}, angles=[math.degrees(theta)]).iloc[0]
        middle = newton_euler.mid_angle(rig)
        torque = load.get("constant_torque", 0.0) - load.get("stiffness", 0.0) * (
            math.radians(motion["rocker_angle"]) - middle
        )
        across = motion["coupler_force"] * math.sin(theta - offset)
        scale = abs(motion["coupler_force"])
        assert abs(across) == pytest.approx(abs(torque) / (d * 1e-3), rel=1e-7, abs=1e-9 * scale)
        assert abs(motion["drive_torque"]) <= 1e-9 * scale * a * 1e-3


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), torques)
def test_the_mean_of_an_opposing_torque(rig, torque):
    # identity 3: work per cycle is the torque times twice the swing
    row = evaluate(rig | {"opposing_torque": torque}, ["drive_torque_mean", "drive_torque_peak", "swing_angle"])
    mean = torque * math.radians(row["swing_angle"]) / math.pi
    assert row["drive_torque_mean"] == pytest.approx(mean, rel=1e-9)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), st.sampled_from(["stiffness", "inertia", "constant_torque"]), st.floats(0.1, 1e4))
def test_conservative_loads_need_no_mean_torque(rig, name, size):
    row = evaluate(rig | {name: size}, ["drive_torque_mean", "drive_torque_rms"])
    assert abs(row["drive_torque_mean"]) <= 1e-10 * row["drive_torque_rms"]


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), torques, st.sampled_from(["constant_torque", "opposing_torque"]))
def test_pin_force_times_crank_is_bounded_below_by_the_work(rig, torque, name):
    # identity 4
    row = evaluate(rig | {name: torque}, ["pin_force_peak", "drive_torque_peak", "swing_angle"])
    smallest_peak = torque * math.radians(row["swing_angle"]) / math.pi
    assert row["pin_force_peak"] * rig["crank"] * 1e-3 >= row["drive_torque_peak"] * (1.0 - 1e-12)
    assert row["drive_torque_peak"] >= smallest_peak * (1.0 - 1e-9)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(rigs(), st.floats(0.1, 1e3))
def test_the_mean_of_a_damper(rig, damping):
    # identity 5
    row = evaluate(rig | {"damping": damping}, ["drive_torque_mean", "rocker_velocity_rms"])
    assert row["drive_torque_mean"] == pytest.approx(damping * row["rocker_velocity_rms"] ** 2 / rig["speed"], rel=1e-9)


@settings(derandomize=True, deadline=None, max_examples=30)
@given(rigs(), loads(), links() | st.just({}))
def test_statistics_against_many_samples(rig, load, link):
    design = rig | load | link
    metrics = [f"pin_force_{pin}_{s}" for pin in "abcd" for s in ("max", "rms", "mean", "power_mean")]
    metrics += ["drive_torque_peak", "drive_torque_rms", "coupler_force_max", "coupler_force_min", "velocity_thd",
                "rocker_moment_peak", "rocker_axial_force_peak"]  # fmt: skip
    row = evaluate(design, metrics)
    # midpoint rule: the mean of a smooth periodic signal is exact, that of a signal with jumps accurate to the step
    turn = explore.simulate("test-rig", design, angles=(np.arange(20_000) + 0.5) * (360.0 / 20_000))
    step = 1e-3
    for pin in "abcd":
        force = turn[f"pin_force_{pin}"]
        peak = row[f"pin_force_{pin}_max"]
        assert -1e-12 * peak <= peak - force.max() <= step * peak
        assert row[f"pin_force_{pin}_rms"] == pytest.approx(math.sqrt((force**2).mean()), rel=step)
        assert row[f"pin_force_{pin}_mean"] == pytest.approx(force.mean(), rel=step)
        assert row[f"pin_force_{pin}_power_mean"] == pytest.approx((force ** (10 / 3)).mean() ** 0.3, rel=step)
    assert row["drive_torque_peak"] == pytest.approx(turn["drive_torque"].abs().max(), rel=step)
    assert row["drive_torque_rms"] == pytest.approx(math.sqrt((turn["drive_torque"] ** 2).mean()), rel=step)
    for extreme in ("max", "min"):
        force = turn["coupler_force"]
        assert row[f"coupler_force_{extreme}"] == pytest.approx(
            getattr(force, extreme)(), rel=0.0, abs=step * force.abs().max()
        )
    spectrum = np.abs(np.fft.rfft(turn["rocker_velocity"]))
    thd = math.sqrt((spectrum[2:] ** 2).sum()) / spectrum[1]
    assert row["velocity_thd"] == pytest.approx(thd, rel=1e-8)
    moment, axial = turn["rocker_moment"].abs().max(), turn["rocker_axial_force"].abs().max()
    assert row["rocker_moment_peak"] == pytest.approx(moment, rel=step)
    assert row["rocker_axial_force_peak"] == pytest.approx(axial, rel=step)
