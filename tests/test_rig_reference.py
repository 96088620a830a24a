"""Comparison with reference/test_rig.json: closed form, extremes, distortion, forces with and without masses."""

import math

import numpy as np
import pandas as pd
import pytest
from rig_cases import LINKS, REFERENCE, lengths, load_of, parametrize_cases

import explore

PINS = "abcd"
OK = 1
#: Status of each class of the reference.
STATUSES = {"crank_rocker": 1, "cannot_assemble": 2, "non_grashof": 3, "grashof_double_rocker": 3, "change_point": 4,
            "double_crank": 5}  # fmt: skip


def evaluate(design, metrics, **more):
    row = explore.evaluate("test-rig", design, metrics=metrics, **more).iloc[0]
    assert row["status"] == OK
    assert row["error"] <= more.get("tolerance", 1e-9)
    return row


def close(value, text, tolerance, scale=0.0):
    """Compare relative to the number, or to a scale where the number is a difference of larger ones."""
    assert value == pytest.approx(float(text), rel=tolerance, abs=tolerance * scale)


@parametrize_cases(REFERENCE["kinematics"])
def test_closed_form(case):
    metrics = ["grashof_margin", "swing_angle", "mid_angle", "time_ratio", "transmission_angle_worst", "size"]
    design = lengths(case)
    row = explore.evaluate("test-rig", design, metrics=metrics).iloc[0]
    assert row["nodes"] == 0
    if not case["crank_is_shortest"]:
        assert row["status"] != OK
        return
    assert row["status"] == OK
    # decimal lengths are rounded by up to half an ulp each
    close(row["grashof_margin"], case["grashof_margin_mm"], 1e-12, scale=1.0)
    close(row["swing_angle"], case["swing_deg"], 1e-12)
    close(row["mid_angle"], case["rocker_mid_deg"], 1e-12)
    close(row["time_ratio"], case["K_time_ratio"], 1e-12)
    close(row["transmission_angle_worst"], case["gamma_worst_deg"], 1e-12)
    assert row["size"] == design["coupler"] + design["rocker"]


@parametrize_cases([case for case in REFERENCE["kinematics"] if case["crank_is_shortest"]])
def test_extremes_and_distortion(case):
    speed = 7.0
    names = {"rocker_velocity": "omega3_over_omega1", "rocker_acceleration": "alpha3_over_omega1sq"}
    metrics = [f"{name}_{extreme}" for name in names for extreme in ("max", "min")]
    row = evaluate(lengths(case) | {"speed": speed}, [*metrics, "velocity_thd"])
    for power, (name, key) in enumerate(names.items(), 1):
        for extreme in ("max", "min"):
            close(row[f"{name}_{extreme}"] / speed**power, case[f"{key}_{extreme}"]["value"], 1e-12)
    # far above the error of the reference's trapezoidal rule
    close(row["velocity_thd"], case["harmonics"]["THD_omega"], 1e-9)


@parametrize_cases(REFERENCE["kinematics"])
def test_positions(case):
    if not case["crank_is_shortest"]:
        return
    angles = [math.degrees(float(at["th1_rad"])) for at in case["positions_unit_crank_speed"]]
    motion = explore.simulate("test-rig", {"speed": 1.0, **lengths(case)}, angles=angles)
    signals = {"rocker_angle": "th3_rad", "rocker_velocity": "omega3", "rocker_acceleration": "alpha3"}
    for signal, key in signals.items():
        true = np.array([float(at[key]) for at in case["positions_unit_crank_speed"]])
        values = np.deg2rad(motion[signal].to_numpy()) if signal == "rocker_angle" else motion[signal].to_numpy()
        assert values == pytest.approx(true, rel=0.0, abs=1e-12 * np.abs(true).max())


@pytest.mark.parametrize("number", range(1, 7))
def test_sensitivities(number):
    expected = REFERENCE["design_facts"]["sensitivity_deg_per_mm_L0_751"][f"doc{number}"]
    crank, coupler = [(37, 1271.5), (37, 460), (13.58, 1271.5), (13.58, 460), (5, 1271.5), (5, 460)][number - 1]
    design = {"crank": crank, "coupler": coupler, "rocker": 595.0, "ground": 751.0}
    row = evaluate(design, [f"swing_sensitivity_{link}" for link in LINKS])
    assert row["nodes"] == 0
    for link, key in LINKS.items():
        close(row[f"swing_sensitivity_{link}"], expected[f"d{key}"], 1e-12)


@parametrize_cases(REFERENCE["classification"])
def test_classes(case):
    row = explore.evaluate("test-rig", lengths(case), metrics=["linkage_class", "swing_angle"]).iloc[0]
    assert row["status"] == STATUSES[case["classification"]]
    assert math.isnan(row["swing_angle"])


@parametrize_cases(REFERENCE["quasistatic"])
def test_forces_without_masses(case):
    design = lengths(case) | load_of(case["inputs"])
    peaks = [f"pin_force_peak_{pin}" for pin in PINS]
    metrics = ["pin_force_peak", *peaks, "coupler_force_peak", "drive_torque_peak", "drive_torque_mean",
               "drive_torque_rms", "power_mean"]  # fmt: skip
    row = evaluate(design, metrics)
    for name in ("pin_force_peak", "coupler_force_peak", *peaks):
        close(row[name], str(abs(float(case["peak_N"]["value_N"]))), 1e-9)
    peak = case["peak_T"]
    close(row["drive_torque_peak"], str(abs(float(peak.get("value_Nm", peak.get("abs_value_Nm"))))), 1e-9)
    close(row["drive_torque_mean"], case["mean_T_Nm"], 1e-9, scale=row["drive_torque_rms"])
    close(row["power_mean"], str(float(case["mean_T_Nm"]) * design["speed"]), 1e-9,
          scale=row["drive_torque_rms"] * design["speed"])  # fmt: skip
    if "rms_T_Nm" in case:
        close(row["drive_torque_rms"], case["rms_T_Nm"], 1e-9)


@parametrize_cases(REFERENCE["quasistatic"])
def test_forces_without_masses_at_crank_angles(case):
    design = lengths(case) | load_of(case["inputs"])
    table = case["table"]
    motion = explore.simulate("test-rig", design, angles=[math.degrees(float(at["th1_rad"])) for at in table])
    for ours, theirs in (("coupler_force", "N_coupler_N"), ("drive_torque", "T_drive_Nm")):
        true = np.array([float(at[theirs]) for at in table])
        assert motion[ours].to_numpy() == pytest.approx(true, rel=0.0, abs=1e-11 * np.abs(true).max())
    size = np.hypot([float(at["Fx_N"]) for at in table], [float(at["Fy_N"]) for at in table])
    for pin in PINS:
        assert motion[f"pin_force_{pin}"].to_numpy() == pytest.approx(size, rel=0.0, abs=1e-11 * size.max())
    assert motion["power"].to_numpy() == pytest.approx(motion["drive_torque"].to_numpy() * design["speed"], rel=1e-14)


@parametrize_cases([case for case in REFERENCE["quasistatic"] if case["inputs"]["load_law"] != "opposing"])
def test_forces_at_the_limits(case):
    design = lengths(case) | load_of(case["inputs"])
    for limit in case["limits"].values():
        angle = math.degrees(float(limit["th1_rad"]))
        motion = explore.simulate("test-rig", design, angles=[angle]).iloc[0]
        scale = evaluate(design, ["pin_force_peak"])["pin_force_peak"]
        close(motion["coupler_force"], limit["N_coupler_N"], 1e-11, scale=scale)
        close(motion["rocker_axial_force"], limit["F_par_rocker_N"], 1e-11, scale=scale)
        across = motion["rocker_moment"] / (design["rocker"] * 1e-3)
        close(abs(across), str(abs(float(limit["F_perp_rocker_N"]))), 1e-11, scale=scale)


@parametrize_cases(REFERENCE["dynamic_forces"])
def test_forces_with_masses(case):
    inputs = {key: float(value) for key, value in case["inputs"].items()}
    design = lengths(case) | {
        "speed": inputs["omega1"], "stiffness": inputs["k"], "damping": inputs["c"], "inertia": inputs["ID"],
        "crank_mass": inputs["m1"], "coupler_mass": inputs["m2"], "rocker_mass": inputs["m3"],
        "coupler_inertia": inputs["IG2"], "gravity": inputs["g"],
    }  # fmt: skip
    for link, key in (("crank", "c1"), ("coupler", "c2"), ("rocker", "c3")):
        design[f"{link}_centroid"] = inputs[key] / (design[link] * 1e-3)
    table = case["table"]
    motion = explore.simulate("test-rig", design, angles=[math.degrees(float(at["th1_rad"])) for at in table])
    for pin in PINS:
        true = np.array([math.hypot(*map(float, at[f"F{pin.upper()}"])) for at in table])
        assert motion[f"pin_force_{pin}"].to_numpy() == pytest.approx(true, rel=0.0, abs=1e-11 * true.max())
    torque = np.array([float(at["T_drive_Nm"]) for at in table])
    assert motion["drive_torque"].to_numpy() == pytest.approx(torque, rel=0.0, abs=1e-10 * np.abs(torque).max())
    row = evaluate(design, ["drive_torque_mean", "drive_torque_rms", *(f"pin_force_peak_{pin}" for pin in PINS)])
    close(row["drive_torque_mean"], case["mean_T_Nm"], 1e-9, scale=row["drive_torque_rms"])
    turn = explore.simulate("test-rig", design, angles=720)
    for pin in PINS:  # the reference is the largest of 720 samples, with ten digits, a little below the peak
        sampled, peak = turn[f"pin_force_{pin}"].max(), row[f"pin_force_peak_{pin}"]
        close(sampled, case["peak_pin_forces_N_sampled_720"][f"F{pin.upper()}"], 1e-9)
        # half a degree apart: (0.0087 / 2)^2 / 2 of a curvature that is about twice the peak
        assert 0.0 <= peak - sampled <= 2e-5 * peak


@pytest.mark.parametrize("family", ["swing20_family_L0_751", "config_sweep_L3_595_L0_751"])
def test_families(family):
    cases = [case for case in REFERENCE[family] if case["feasible"]]
    assert len(cases) == (16 if family.startswith("swing20") else 20)
    designs = pd.DataFrame([lengths(case) for case in cases]).assign(constant_torque=25e3)
    metrics = ["swing_angle", "transmission_angle_worst", "time_ratio", "mid_angle", "size",
               "pin_force_peak", "drive_torque_peak", "velocity_thd"]  # fmt: skip
    frame = explore.evaluate("test-rig", designs, metrics=metrics)
    opposing = designs.rename(columns={"constant_torque": "opposing_torque"})
    mean = explore.evaluate("test-rig", opposing, metrics=["drive_torque_mean"])
    assert (frame["status"] == OK).all()
    assert (mean["status"] == OK).all()
    names = {"swing_angle": "swing_deg", "transmission_angle_worst": "gamma_worst_deg", "time_ratio": "K",
             "mid_angle": "rocker_mid_deg", "pin_force_peak": "F_peak_N", "drive_torque_peak": "T_peak_Nm",
             "velocity_thd": "THD_omega"}  # fmt: skip
    for number, case in enumerate(cases):
        for ours, theirs in names.items():
            close(frame[ours][number], case[theirs], 1e-9 if "_peak" in ours or "thd" in ours else 1e-12)
        close(mean["drive_torque_mean"][number], case["T_mean_Nm"], 1e-9)
        if "size_L2_plus_L3_mm" in case:
            close(frame["size"][number], case["size_L2_plus_L3_mm"], 1e-15)


def test_the_limit_table_of_the_published_load():
    table = REFERENCE["design_facts"]["limit_table_25kNm_L0_751"]
    assert len(table) == 12
    cranks, couplers = (37, 37, 13.58, 13.58, 5, 5), (1271.5, 460) * 3
    for row in table:
        k = int(row["case"]) - 1
        design = {"crank": cranks[k], "coupler": couplers[k], "rocker": 595.0, "ground": 751.0}
        motion = explore.simulate(
            "test-rig", {"constant_torque": 25e3, **design}, angles=[math.degrees(float(row["th1"]))]
        )
        close(motion["coupler_force"].iloc[0], row["F_N"], 1e-11)
        # in any linkage the line of the force passes through the crank's pivot
        close(motion["coupler_force"].iloc[0] * math.sin(float(row["th2"])), str(25e3 / 0.751), 1e-11)
