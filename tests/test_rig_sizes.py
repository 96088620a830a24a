"""Sizes, stresses, safety and life of the test rig: the rules of `explore.sizing` under the peaks of the cycle."""

import dataclasses
import math
import pickle

import numpy as np
import pytest

import explore
from explore import sizing
from explore.evaluation.derived import derive
from explore.mechanisms.rig.declaration import TEST_RIG
from explore.model.status import Status
from explore.studies.request.requests import make_request

RIG = {"crank": 37.0, "coupler": 1271.5, "rocker": 595.0, "ground": 751.0, "speed": 60.0, "opposing_torque": 25e3}
SIZING = {
    "allowed_stress": 116.7, "allowed_shear": 80.0, "yield_strength": 350.0, "tensile_strength": 620.0,
    "endurance_limit": 200.0, "notch_factor": 3.0, "hollow_ratio": 0.5, "bearing_rating": 44.6e3,
    "built_rod": 60.0, "built_rocker": 220.0, "built_pin": 45.0, "built_shaft": 95.0,
}  # fmt: skip
#: Ends of the names of what holds for a part, not for a stroke.
SIZES = ("_diameter", "_height", "_stress", "_safety", "_factor", "_life")


def evaluate(design, metrics, tolerance=1e-9):
    row = explore.evaluate("test-rig", design, metrics=metrics, tolerance=tolerance).iloc[0]
    assert row["status"] == 1
    assert row["error"] <= tolerance
    return row


def test_every_size_is_its_rule_under_the_peaks_of_the_cycle():
    signals = ["coupler_force_min", "coupler_force_max", "rocker_moment_peak", "rocker_axial_force_peak",
               "pin_force_peak", "pin_force_peak_b", "drive_torque_peak", "bearing_mean_force"]  # fmt: skip
    names = [formula.name for formula in TEST_RIG.formulas]
    row = evaluate(RIG | SIZING, [*dict.fromkeys([*signals, *names])])
    axial = max(abs(row["coupler_force_min"]), row["coupler_force_max"])
    moment, axial_peak, pin = row["rocker_moment_peak"] * 1e3, row["rocker_axial_force_peak"], row["pin_force_peak"]
    bending, torque = sizing.shaft_moment(row["pin_force_peak_b"], 67.0), row["drive_torque_peak"] * 1e3
    area = sizing.rod_area(60.0, 0.5)
    span, middle = (
        row["coupler_force_max"] - row["coupler_force_min"],
        row["coupler_force_max"] + row["coupler_force_min"],
    )
    expected = {
        "rod_diameter": sizing.rod_diameter(axial, 116.7, 0.5),
        "sleeve_diameter": sizing.sleeve_diameter(axial, 116.7, sizing.rod_diameter(axial, 116.7, 0.5)),
        "rocker_height": sizing.rocker_height(moment, axial_peak, 116.7, 20.0),
        "pin_diameter": sizing.pin_diameter(pin, 80.0),
        "shaft_diameter": sizing.shaft_diameter(bending, torque, 116.7),
        "buckling_factor": sizing.buckling_factor(
            row["coupler_force_max"], 1271.5, 60.0, 206e3, 0.5, yield_strength=350.0
        ),
        "fatigue_factor": sizing.fatigue_factor(span / 2 / area, -middle / 2 / area, 200.0, 620.0, 350.0, 3.0),
        "bearing_life": sizing.bearing_life_hours(44.6e3, row["bearing_mean_force"] / 4.0, 1800.0 / math.pi),
        "rod_stress": sizing.rod_stress(axial, 60.0, 0.5),
        "rocker_stress": sizing.rocker_stress(moment, axial_peak, 20.0, 220.0),
        "pin_stress": sizing.pin_shear_stress(pin, 45.0),
        "shaft_stress": sizing.shaft_stress(bending, torque, 95.0),
    }
    expected |= {f"{part}_safety": 350.0 / expected[f"{part}_stress"] for part in ("rod", "rocker", "shaft")}
    expected["pin_safety"] = 350.0 / math.sqrt(3.0) / expected["pin_stress"]
    for name, value in expected.items():
        assert row[name] == pytest.approx(float(value), rel=1e-13), name
    # the rocker's moment is the load on either stroke
    assert row["rocker_moment_peak"] == pytest.approx(25e3, rel=1e-14)


@pytest.mark.parametrize("window", TEST_RIG.strokes)
def test_sizes_are_those_of_the_turn_in_studies_over_a_stroke(window):
    """Constant and opposing torque add up on one stroke alone, on the other the rod is only pulled."""
    names = [name for name in (formula.name for formula in TEST_RIG.formulas) if name.endswith(SIZES)]
    design = RIG | SIZING | {"constant_torque": 10e3}
    over_turn = evaluate(design, names)
    over_stroke = explore.evaluate("test-rig", design, metrics=names, window=window).iloc[0]
    assert len(names) == 17  # with the height of the envelope
    for name in names:
        assert over_stroke[name] == pytest.approx(over_turn[name], rel=1e-12), name


def test_a_rod_that_is_not_given_is_sized_for_strength():
    sized = evaluate(RIG | {"allowed_stress": 116.7}, ["rod_diameter", "buckling_factor"])
    built = evaluate(RIG | {"built_rod": sized["rod_diameter"]}, ["buckling_factor"])
    assert built["buckling_factor"] == pytest.approx(sized["buckling_factor"], rel=1e-12)


@pytest.mark.parametrize("rod", [{"built_rod": 60.0}, {"allowed_stress": 116.7}])
def test_a_formula_needs_no_more_than_the_metric_that_it_names(rod):
    """One of the two gives the rod, and the yield strength is optional, in formulas of formulas, too."""
    formulas = {"half": {"formula": "buckling_factor / 2", "unit": "1"}, "own": {"formula": "half + 1", "unit": "1"}}
    row = evaluate(RIG | rod, ["buckling_factor"])
    own = explore.evaluate("test-rig", RIG | rod, metrics=["own"], formulas=formulas).iloc[0]
    assert (own["status"], own["own"]) == (Status.OK, row["buckling_factor"] / 2.0 + 1.0)
    neither = explore.evaluate("test-rig", RIG | {"built_rod": [0.0, 60.0]}, metrics=["own"], formulas=formulas)
    assert list(neither["status"]) == [Status.NOT_GIVEN, Status.OK]


def test_johnson_limits_the_buckling_force_of_a_rod_that_is_not_slender():
    # Johnson's over Euler's stress is 2 r (1 - r/2) with r = (slenderness over 107.8)^2 up to 1; 25 mm has 182
    stocky = (4.0 * 1271.5 / (60.0 * math.sqrt(1.25))) ** 2 * 350.0 / (2.0 * math.pi**2 * 206e3)
    for diameter, share in ((60.0, 2.0 * stocky * (1.0 - 0.5 * stocky)), (25.0, 1.0)):
        design = RIG | {"built_rod": diameter}
        euler = evaluate(design, ["buckling_factor"])["buckling_factor"]
        checked = evaluate(design | {"yield_strength": 350.0}, ["buckling_factor"])["buckling_factor"]
        assert checked / euler == pytest.approx(share, rel=1e-13)


def test_a_rod_without_force_has_no_buckling_factor():
    still = RIG | {"opposing_torque": 0.0, "crank_mass": 20.0, "allowed_stress": 100.0, "yield_strength": 350.0}
    assert math.isnan(explore.evaluate("test-rig", still, metrics=["buckling_factor"])["buckling_factor"][0])


def test_a_rod_that_is_only_pulled_does_not_buckle():
    pulled = evaluate(RIG | {"opposing_torque": 0.0, "constant_torque": -25e3, "built_rod": 50.0}, ["buckling_factor"])
    assert pulled["buckling_factor"] == math.inf


def test_the_mean_bearing_force_lies_between_rms_and_peak():
    row = evaluate(RIG | {"opposing_torque": 0.0, "stiffness": 143e3},
                   ["pin_force_a_mean", "pin_force_rms_a", "bearing_mean_force", "pin_force_peak_a"])  # fmt: skip
    assert row["pin_force_a_mean"] < row["pin_force_rms_a"] < row["bearing_mean_force"] < row["pin_force_peak_a"]


def test_the_error_of_a_derived_metric_follows_from_its_inputs():
    # Life is a power -10/3 of the mean force, and its relative error 10/3 of that; a maximum has the largest error.
    request = make_request(TEST_RIG, metrics=["bearing_life", "pin_force_peak", "drive_torque_peak"])
    life, largest, peak = request.derived
    (force,) = life.sampled
    values = {m.name: np.array([2.0 + k, 5.0]) for k, m in enumerate(request.sampled)}
    errors = {m.name: 1e-6 * values[m.name] for m in request.sampled}
    errors[force.name] = 1e-4 * values[force.name]
    inputs = {p.name: np.full(2, 1.0 if p.default is None else p.default) for p in TEST_RIG.parameters}
    inputs["bearing_rating"] = np.array([44.6e3, 0.0])
    for metric, expected in ((life, 1e-4 * 10.0 / 3.0), (largest, 1e-6), (peak, 1e-6)):
        metrics, bound = derive(dataclasses.replace(request, metrics=(metric,)), inputs, values, errors, 1e-9)
        assert bound[0] == pytest.approx(expected, rel=1e-3)
        assert metrics.keys() == {metric.name}
    metrics, bound = derive(dataclasses.replace(request, metrics=(life,)), inputs, values, errors, 1e-9)
    assert np.isnan(metrics["bearing_life"][1])
    assert bound[1] == 0.0


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_bounds_of_derived_metrics_hold(tolerance):
    rng = np.random.default_rng(2)
    designs = RIG | SIZING | {"crank": rng.uniform(1.0, 70.0, 200), "stiffness": 143e3, "damping": 50.0, "inertia": 4.0}
    names = ["velocity_thd", "bearing_life", "rod_diameter", "shaft_diameter", "drive_torque_peak", "fatigue_factor"]
    exact = explore.evaluate("test-rig", designs, metrics=names, tolerance=1e-12)
    for name in names:
        frame = explore.evaluate("test-rig", designs, metrics=[name], tolerance=tolerance)
        assert (frame["status"] == 1).all()
        errors = (frame[name] / exact[name] - 1.0).abs()
        assert (errors <= frame["error"] + exact["error"]).all(), name


def test_an_invalid_sizing_parameter_affects_its_design_alone():
    designs = RIG | {
        "allowed_stress": np.array([116.7, -1.0, np.nan, 116.7, 0.0]),
        "hollow_ratio": [0.5, 0.5, 0.5, 1.0, 0.5],
    }
    frame = explore.evaluate("test-rig", designs, metrics=["rod_diameter"])
    assert list(frame["status"]) == [Status.OK, *[Status.NOT_FINITE] * 3, Status.NOT_GIVEN]
    assert list(frame["rod_diameter"].notna()) == [True, False, False, False, False]


@pytest.mark.parametrize("crank", [1e-3, 1e-9, 1e-14])
def test_a_nearly_constant_force_has_a_fatigue_factor(crank):
    # the extremes differ by less than their error bounds, which must not give a negative amplitude
    rig = RIG | SIZING | {"crank": crank, "opposing_torque": 0.0, "constant_torque": 25e3}
    row = evaluate(rig, ["fatigue_factor", "rod_stress"], tolerance=1e-4)
    assert row["fatigue_factor"] == pytest.approx(350.0 / row["rod_stress"], rel=1e-3)


def test_a_request_of_derived_metrics_can_be_pickled():
    request = make_request(TEST_RIG, metrics=["pin_force_peak", "bearing_life", "swing_angle"])
    assert pickle.loads(pickle.dumps(request)) == request
