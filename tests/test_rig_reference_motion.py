"""Comparison with reference/test_rig.json: limit positions, motion of both links, harmonics, extremes, work."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rig_cases import LINKS, REFERENCE, lengths, load_of, parametrize_cases

import explore
from explore.base.lanes.designs import fill_motion_of_design
from explore.mechanisms import four_bar
from explore.mechanisms.rig.declaration import TEST_RIG

SIZING = json.loads((Path(__file__).parent / "reference" / "test_rig_sizing.json").read_text())
TURNING = [case for case in REFERENCE["kinematics"] if case["crank_is_shortest"]]
LIMITS = ("extended", "folded")


def motion_rows(design, angles):
    """Rows of the four-bar that the kernel fills, for unit speed at crank angles, rad."""
    inputs = {p.name: p.default for p in TEST_RIG.parameters} | design
    parameters = np.array([[inputs[p.name]] for p in TEST_RIG.kernel_parameters])
    constants = np.ascontiguousarray(TEST_RIG.constants(parameters)[:, 0])
    needs = four_bar.VELOCITIES | four_bar.ACCELERATIONS | four_bar.ANGLES | four_bar.TRANSMISSION
    out = np.full((TEST_RIG.signal_rows, len(angles)), np.nan)
    half_turns = np.round(np.array(angles) / math.pi)
    tangents, anchors = np.tan(0.5 * (angles - half_turns * math.pi)), half_turns.astype(np.int64) % 2
    laws = np.zeros(len(angles), dtype=np.int64)  # the motion has none
    fill_motion_of_design(TEST_RIG.fill, constants, anchors, laws, tangents, 0, needs, TEST_RIG.signal_rows, out)
    return out


@parametrize_cases(TURNING)
def test_the_limit_positions(case):
    limits = [case[f"limit_{name}"] for name in LIMITS]
    design = lengths(case)
    values = motion_rows(design, [float(limit["th1_rad"]) for limit in limits])
    for row, key, unit in ((four_bar.COUPLER_ANGLE, "th2_rad", 1.0), (four_bar.ROCKER_ANGLE, "th3_rad", 1.0),
                           (four_bar.TRANSMISSION_ANGLE, "gamma_deg", math.pi / 180.0)):  # fmt: skip
        assert values[row] == pytest.approx([unit * float(limit[key]) for limit in limits], rel=0.0, abs=1e-12)
    assert values[four_bar.ROCKER_VELOCITY] == pytest.approx([0.0, 0.0], abs=1e-12)
    row = explore.evaluate("test-rig", design, metrics=["swing_angle", "time_ratio"]).iloc[0]
    assert math.radians(row["swing_angle"]) == pytest.approx(float(case["swing_rad"]), rel=1e-12)
    pole = math.radians(float(case["pole_angle_deg"]))
    assert row["time_ratio"] == pytest.approx((math.pi + abs(pole)) / (math.pi - abs(pole)), rel=1e-12)


@parametrize_cases(TURNING)
def test_the_transmission_angle_in_line_with_the_ground(case):
    values = motion_rows(lengths(case), [0.0, math.pi])[four_bar.TRANSMISSION_ANGLE]
    assert np.rad2deg(values) == pytest.approx([float(case[f"gamma_at_th1_{at}_deg"]) for at in (0, 180)], rel=1e-12)
    assert np.sin(values).min() == pytest.approx(float(case["min_sin_gamma"]), rel=1e-12)


@parametrize_cases(TURNING)
def test_the_motion_of_both_links(case):
    table = case["positions_unit_crank_speed"]
    values = motion_rows(lengths(case), [float(at["th1_rad"]) for at in table])
    for row, key in ((four_bar.COUPLER_ANGLE, "th2_rad"), (four_bar.COUPLER_VELOCITY, "omega2"),
                     (four_bar.COUPLER_ACCELERATION, "alpha2"), (four_bar.ROCKER_ANGLE, "th3_rad"),
                     (four_bar.ROCKER_VELOCITY, "omega3"), (four_bar.ROCKER_ACCELERATION, "alpha3")):  # fmt: skip
        true = np.array([float(at[key]) for at in table])
        assert values[row] == pytest.approx(true, rel=0.0, abs=1e-12 * np.abs(true).max())


@parametrize_cases(TURNING)
def test_values_at_the_positions_of_the_extremes(case):
    for row, key in ((four_bar.ROCKER_VELOCITY, "omega3_over_omega1"),
                     (four_bar.ROCKER_ACCELERATION, "alpha3_over_omega1sq")):  # fmt: skip
        extremes = [case[f"{key}_{end}"] for end in ("max", "min")]
        values = motion_rows(lengths(case), [float(extreme["th1_rad"]) for extreme in extremes])[row]
        assert values == pytest.approx([float(extreme["value"]) for extreme in extremes], rel=1e-12)


@parametrize_cases(TURNING)
def test_harmonics_by_the_fourier_transform(case):
    expected = case["harmonics"]
    count = int(expected["trapezoid_N"])
    angles = explore.simulate("test-rig", lengths(case), angles=count)["rocker_angle"].to_numpy()
    transform = np.fft.rfft(angles) / count
    sizes = 2.0 * np.abs(transform[1 : count // 2])
    scale = sizes[0]
    assert transform[0].real == pytest.approx(float(expected["mean_deg"]), rel=1e-12)
    assert scale == pytest.approx(float(expected["A1_deg"]), rel=1e-12)
    for order, size in expected["amps_deg"].items():
        assert sizes[int(order) - 1] == pytest.approx(float(size), rel=0.0, abs=1e-12 * scale)
    orders = np.arange(1.0, len(sizes) + 1.0)
    # rounding errors of the transform, multiplied by the order or its square
    for power, key, tolerance in ((0, "THD_phi", 1e-11), (1, "THD_omega", 1e-10), (2, "THD_alpha", 1e-8)):
        harmonics = orders**power * sizes
        distortion = math.sqrt(np.sum(harmonics[1:] ** 2)) / harmonics[0]
        assert distortion == pytest.approx(float(expected[key]), rel=tolerance)


@parametrize_cases(REFERENCE["quasistatic"])
def test_the_work_of_a_turn_and_values_at_the_peaks(case):
    design = lengths(case) | load_of(case["inputs"])
    row = explore.evaluate("test-rig", design, metrics=["drive_torque_mean", "drive_torque_rms", "mid_angle"]).iloc[0]
    work = 2.0 * math.pi * row["drive_torque_mean"]
    scale = 2.0 * math.pi * row["drive_torque_rms"]
    assert work == pytest.approx(float(case["work_per_cycle_J"]), rel=1e-9, abs=1e-9 * scale)
    assert math.radians(row["mid_angle"]) == pytest.approx(float(case["phi0_rad"]), rel=1e-12)
    for signal, key in (("coupler_force", "peak_N"), ("drive_torque", "peak_T")):
        angle, *values = case[key].values()
        computed = explore.simulate("test-rig", design, angles=[math.degrees(float(angle))])[signal].iloc[0]
        assert abs(computed) == pytest.approx(abs(float(values[0])), rel=1e-9)


@parametrize_cases([case for case in REFERENCE["quasistatic"] if case["inputs"]["load_law"] != "opposing"])
def test_components_of_the_force_at_the_limits(case):
    design = lengths(case) | load_of(case["inputs"])
    limits = [case["limits"][name] for name in LIMITS]
    angles = [float(limit["th1_rad"]) for limit in limits]
    motion = explore.simulate("test-rig", design, angles=np.rad2deg(angles))
    force, direction = motion["coupler_force"].to_numpy(), motion_rows(lengths(case), angles)[four_bar.COUPLER_ANGLE]
    scale = explore.evaluate("test-rig", design, metrics=["pin_force_peak"])["pin_force_peak"][0]
    for component, key in ((np.cos(direction), "Fx_N"), (np.sin(direction), "Fy_N")):
        true = [float(limit[key]) for limit in limits]
        assert force * component == pytest.approx(true, rel=0.0, abs=1e-11 * scale)
    # crank and coupler in one line: no torque, to the rounding of the angle
    true = [float(limit["T_drive_Nm"]) for limit in limits]
    assert motion["drive_torque"].to_numpy() == pytest.approx(true, abs=1e-12 * scale * design["crank"] * 1e-3)


def test_which_designs_of_20_deg_are_on_the_fronts():
    # the reference lists 20 of the grid's 30 pairs of lengths; its fronts are over all
    study = explore.load_study(Path(__file__).parent.parent / "configs" / "rig_20deg.toml")
    designs = pd.DataFrame(study.space.designs(0, 30)).dropna()
    metrics = ["pin_force_peak", "velocity_thd", "size", "transmission_angle_worst"]
    table = explore.evaluate("test-rig", designs, metrics=metrics).set_index(["rocker", "coupler"])
    cases = [case for case in REFERENCE["swing20_family_L0_751"] if case["feasible"]]
    pairs = [(float(case["L3_mm"]), float(case["L2_mm"])) for case in cases]
    for key, objectives in (("pareto_F_THD_size", ["pin_force_peak", "velocity_thd", "size"]),
                      ("pareto_F_L1_size", ["pin_force_peak", "crank:min", "size"])):  # fmt: skip
        front = explore.rank(table, objectives=objectives).index
        assert [pair in front for pair in pairs] == [case[key] for case in cases]
    assert (table.loc[pairs, "transmission_angle_worst"] >= 40.0).tolist() == [case["gamma_ok_40"] for case in cases]
    unreachable = [case for case in REFERENCE["swing20_family_L0_751"] if not case["feasible"]]
    assert not any((float(case["L3_mm"]), float(case["L2_mm"])) in table.index for case in unreachable)


def test_centric_rigs():
    facts = SIZING["design_facts"]
    for crank in ("5", "13.58", "37"):
        minimum = facts[f"swing_min_over_L2_L1_{crank}"]
        # the swing is stationary in the coupler, whose rounding has an effect of second order only
        design = {"crank": float(crank), "coupler": float(minimum["L2_mm"]), "rocker": 595.0, "ground": 751.0}
        row = explore.evaluate(
            "test-rig", design, metrics=["swing_angle", "swing_sensitivity_coupler", "time_ratio"]
        ).iloc[0]
        assert row["swing_angle"] == pytest.approx(float(minimum["swing_deg"]), rel=1e-12)
        assert row["swing_sensitivity_coupler"] == pytest.approx(0.0, abs=1e-15)
        assert row["time_ratio"] == pytest.approx(1.0, abs=1e-13)
    centric = {link: float(facts["centric_20deg"][f"{key}_mm"]) for link, key in LINKS.items() if key in ("L1", "L2")}
    row = explore.evaluate("test-rig", centric | {"rocker": 595.0, "ground": 751.0}, metrics=["swing_angle"]).iloc[0]
    assert row["swing_angle"] == pytest.approx(20.0, rel=1e-12)
