"""The variable crank: published and 40-digit values, hard designs, statuses."""

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
import scipy
from exact_groove import ExactGroove
from exact_loads import assert_signals
from exact_variable_crank import DIGITS, ExactVariableCrank

import explore
from explore.mechanisms.registry import MECHANISMS
from explore.model.status import Status

REFERENCE = json.loads((Path(__file__).parent / "reference/variable_crank.json").read_text(encoding="utf-8"))
CASES = [case for case in REFERENCE["cases"] if case["id"].startswith("vc")]
NAMES = {
    "rod": "L2_mm",
    "slider_speed": "V_mm_s",
    "speed": "rpm",
    "reversal_time": "t_rev_s",
    "blend_order": "blend_order",
}
PLAIN = {"rod": 500.0, "slider_speed": 800.0, "speed": 100.0 * np.pi / 30.0, "reversal_time": 0.1}
#: Travel per radian over rod, width of the reversals (rad), order: ordinary designs, then those next to a limit: a tiny
#: and a long crank, reversals of next to nothing and up to next to the regular angle.
HARD = [
    (0.15, 1.05, 2), (0.15, 2.1, 1), (0.1, 1.0, 3), (0.5, 1.05, 2), (0.02, 1.0, 2), (1e-4, 0.7, 3), (0.55, 0.3, 1),
    (0.15, 1e-3, 2), (0.15, 2.8417, 2), (0.3, 2.5769, 3), (0.3, 2.5769, 1),
]  # fmt: skip
#: Crank angles on both strokes, at the regular one and beside it, and in the reversals, deg.
ANGLES = np.array([1.0, 17.0, 44.0, 63.0, 80.9, 84.0, 89.3, 90.0, 112.0, 158.0, 179.5])
ANGLES = np.concatenate([ANGLES, 360.0 - ANGLES])
#: Forces on the slider beside that of its mass.
LOADS = {"constant_force": -30.0, "opposing_force": 20.0, "stiffness": 3000.0, "damping": 15.0}


def design_of(case):
    values = {name: float(case["inputs"][key]) for name, key in NAMES.items()}
    return {**values, "speed": values["speed"] * np.pi / 30.0}


def hard_design(ratio, width, order):
    speed = 7.0
    return {"rod": 400.0, "slider_speed": 400.0 * ratio * speed, "speed": speed, "reversal_time": width / speed,
            "blend_order": float(order)}  # fmt: skip


def evaluate(design, metrics, **more):
    row = explore.evaluate("variable-crank", design, metrics=metrics, **more).iloc[0]
    assert row["status"] == 1
    return row


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_closed_form_of_the_reference(case):
    outputs = case["outputs"]
    keys = {
        "stroke": "stroke_mm", "regular_angle": "phi_star_deg", "regular_crank": "L1_star_mm",
        "crank_outer": "L1_at_0_mm", "crank_inner": "L1_at_pi_mm", "slider_acceleration_max": "a_max_mm_s2",
        "steady_share": "time_fraction_exact_speed", "speed_share_1": "time_fraction_within_0.01",
        "speed_share_5": "time_fraction_within_0.05",
    }  # fmt: skip
    row = evaluate(design_of(case), list(keys))
    assert row["nodes"] == 0
    for name, key in keys.items():
        # the speed in rad/s is rounded, and a few operations follow
        assert row[name] == pytest.approx(float(outputs[key]), rel=2e-15), name
    assert row["crank_outer"] + row["crank_inner"] == pytest.approx(row["stroke"], rel=2e-15)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_shares_of_the_wanted_speed_are_those_of_smoothsteps(order):
    """A smoothstep of order n is the regularised incomplete beta function of n + 1 and n + 1."""
    row = evaluate(hard_design(0.15, 2.1, order), [f"speed_share_{percent}" for percent in (1, 2, 5)])
    for percent in (1, 2, 5):
        place = scipy.special.betaincinv(order + 1, order + 1, percent / 200.0)
        # the width over pi, a sum and two products are rounded, and SciPy's inverse to 1e-15 of 0.2 at most
        assert row[f"speed_share_{percent}"] == pytest.approx(1.0 - 2.1 / np.pi * (1.0 - 2.0 * place), rel=2e-15)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_motion_of_the_reference(case):
    design, samples = design_of(case), case["samples"]
    motion = explore.simulate("variable-crank", design, angles=[sample["phi_deg"] for sample in samples])
    keys = {"slider_position": "X_mm", "slider_velocity": "v_mm_s", "slider_acceleration": "a_mm_s2", "crank": "L1_mm"}
    for name, key in keys.items():
        exact = np.array([float(sample[key]) for sample in samples])
        # rounding of the angle, of the order of 1e-16, times the largest slope over the largest value, below 10
        assert np.abs(motion[name] - exact).max() <= 5e-15 * np.abs(exact).max(), name
    slope = np.array([float(sample["dL1_mm_per_rad"]) for sample in samples])
    # sums of terms of the rod's size, up to 17 times as large as the slope
    assert np.abs(motion["crank_rate"] / design["speed"] - slope).max() <= 2e-14 * np.abs(slope).max()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_statistics_of_the_reference(case):
    outputs = case["outputs"]
    keys = {
        "crank_min": ("L1_min_mm", 1e-14), "groove_pressure_angle_max": ("groove_pressure_angle_max_deg", 1e-12),
        "drive_torque_max": ("T_peak_Nm_per_kg", 1e-13), "drive_torque_rms": ("T_rms_Nm_per_kg", 1e-13),
        "positive_work": ("W_pos_J_per_kg_per_rev", 1e-12), "slider_acceleration_rms": ("a_rms_mm_s2", 1e-14),
    }  # fmt: skip  # the reference has 12 to 16 digits of extremes
    row = evaluate(design_of(case), list(keys))
    for name, (key, tolerance) in keys.items():
        assert row[name] == pytest.approx(float(outputs[key]), rel=tolerance), name


def test_the_slope_at_the_regular_angle():
    """There the quotient of the velocity loop is 0/0; its limit is that of the specification."""
    row = evaluate(PLAIN, ["regular_angle", "regular_crank"])
    at = row["regular_angle"] + np.array([-1e-3, -1e-9, 0.0, 1e-9, 1e-3])
    motion = explore.simulate("variable-crank", PLAIN, angles=at)
    slopes = motion["crank_rate"].to_numpy() / PLAIN["speed"]
    assert slopes[2] == pytest.approx(-0.127337834452418, abs=1e-12)  # terms of the rod's size, 500
    assert slopes[1:4] == pytest.approx(-0.127337834452418, abs=1e-9)  # 1e-9 deg times a second derivative of 27
    assert motion["crank"].to_numpy()[2] == pytest.approx(row["regular_crank"], rel=1e-15)
    rod = motion["rod_angle"].to_numpy()[2]
    assert row["regular_angle"] - rod == pytest.approx(90.0, rel=1e-15)  # crank and rod are perpendicular


@pytest.mark.parametrize("hard", HARD, ids=str)
def test_signals_against_40_digits(hard):
    design = hard_design(*hard)
    motion = explore.simulate("variable-crank", design, angles=ANGLES)
    # Size of what a signal is a sum of: rounding is that of a few operations on numbers of this size.
    sizes = {
        "slider_position": design["rod"], "slider_velocity": design["slider_speed"],
        "slider_acceleration": np.abs(motion["slider_acceleration"]).max(),
        "crank": design["slider_speed"] / design["speed"], "crank_rate": design["speed"] * design["rod"],
    }  # fmt: skip
    with mp.workdps(DIGITS):
        exact = ExactVariableCrank(**design)
        for k, degrees in enumerate(ANGLES):
            angle = mp.mpf(float(degrees)) * mp.pi / 180
            true = {
                "slider_position": exact.position(angle), "slider_velocity": exact.velocity(angle),
                "slider_acceleration": exact.acceleration(angle), "crank": exact.crank(angle),
                "crank_rate": exact.crank_slope(angle) * exact.speed,
            }  # fmt: skip
            # In short reversals an angle's rounding is a larger share of the reversal.
            room = 4e-15 * (1.0 + 1.0 / hard[1])
            for name, value in true.items():
                assert abs(motion[name].iloc[k] - value) <= room * sizes[name], (name, degrees)


@pytest.mark.parametrize("load", [{}, LOADS], ids=["mass", "all loads"])
@pytest.mark.parametrize("hard", HARD, ids=str)
def test_loaded_signals_are_those_of_free_bodies(hard, load):
    """Across a slot through which next to nothing moves, forces are differences of ones that are 1e3 times as large."""
    design = {**hard_design(*hard), "mass": 2.0, "friction": 0.12, **load}
    motion = explore.simulate("variable-crank", design, angles=ANGLES)
    assert_signals(motion, ExactGroove, design, "slider_velocity", 4e-12 if hard[0] < 1e-3 else 1e-13)


@pytest.mark.parametrize("hard", HARD[:8], ids=str)
def test_the_groove_against_40_digits(hard):
    design = hard_design(*hard)
    angles = np.array([10.0, 71.0, 95.0, 170.0, 230.0])
    motion = explore.simulate("variable-crank", design, angles=angles)
    with mp.workdps(DIGITS):
        exact = ExactVariableCrank(**design)
        for k, degrees in enumerate(angles):
            angle = mp.mpf(float(degrees)) * mp.pi / 180
            crank, slope = exact.crank(angle), exact.crank_slope(angle)
            pressure = float(mp.degrees(mp.atan(slope / crank)))
            # the slope is a sum of terms of the rod's size, the curvature one of its second derivative
            terms = design["rod"] / float(crank)
            assert motion["groove_pressure_angle"].iloc[k] == pytest.approx(pressure, abs=2e-13 * (1.0 + terms))
            curvature = float(exact.curvature(angle))
            assert motion["groove_curvature"].iloc[k] == pytest.approx(
                curvature, abs=1e-13 * (1.0 + 1.0 / hard[1]) * (1.0 + terms) / float(crank)
            )


def test_strokes_and_lengths_only_scale():
    """Only travel over rod and the width of the reversals matter."""
    names = ["crank_min", "crank_max", "groove_pressure_angle_max", "speed_share_1", "stroke"]
    one = evaluate(PLAIN, names)
    other = evaluate({**PLAIN, "rod": 1500.0, "slider_speed": 4800.0, "speed": 2 * PLAIN["speed"],
                      "reversal_time": 0.05}, names)  # fmt: skip
    for name in names:
        factor = 3.0 if name in ("crank_min", "crank_max", "stroke") else 1.0
        assert other[name] == pytest.approx(factor * one[name], rel=1e-12), name


def test_the_longest_crank_is_at_a_dead_centre():
    for ratio, width, order in HARD:
        row = evaluate(hard_design(ratio, width, order), ["crank_max", "crank_outer", "crank_inner"])
        assert row["crank_max"] == pytest.approx(max(row["crank_outer"], row["crank_inner"]), rel=1e-12)


def test_statuses_of_designs_without_a_motion():
    designs = {"rod": [500.0, 500.0, 100.0], "slider_speed": 800.0, "speed": PLAIN["speed"],
               "reversal_time": [0.1, 0.28, 0.1]}  # fmt: skip
    table = explore.evaluate("variable-crank", designs, metrics=["stroke", "crank_min"])
    labels = MECHANISMS["variable-crank"].status_labels
    assert [labels[status] for status in table["status"]] == ["ok", "reversal_too_long", "shaft_reached"]
    assert np.isnan(table.loc[1:, ["stroke", "crank_min"]]).all(axis=None)
    with pytest.raises(explore.MotionError, match="no start length is regular"):
        explore.simulate("variable-crank", {**PLAIN, "reversal_time": 0.28})


def test_a_reversal_too_short_for_rounding_is_refused():
    """Its ends coincided: the slider had the law of a reversal, of 1e-15 s, over the whole stroke."""
    names = ["slider_velocity_mean_outer_to_inner", "stroke"]
    times = {"reversal_time": np.array([1e-9, 1e-11, 1e-13, 1e-15, 1e-20])}
    table = explore.evaluate("variable-crank", PLAIN | times, metrics=names, tolerance=1e-4)
    assert list(table["status"]) == [Status.OK, Status.OK, *[Status.NOT_FINITE] * 3]
    assert table[names[0]][:2].to_numpy() == pytest.approx(-PLAIN["slider_speed"], rel=1e-8)
    assert np.isnan(table.loc[2:, names]).all(axis=None)


def test_the_roller_needs_room():
    row = evaluate({**PLAIN, "roller_radius": 12.0}, ["groove_clearance", "groove_curvature_peak"])
    assert row["groove_clearance"] == pytest.approx(1.0 / row["groove_curvature_peak"] - 12.0, rel=1e-15)
    assert row["groove_curvature_peak"] == pytest.approx(0.0244, abs=5e-5)
