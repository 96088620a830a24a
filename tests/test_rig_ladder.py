"""Designs are evaluated only as far as the request and their load need; a missing input is reported in one line."""

import numpy as np
import pytest

import explore
from explore.base.compiling import LANES
from explore.mechanisms import four_bar, four_bar_forces, rocking
from explore.mechanisms.rig.declaration import TEST_RIG
from explore.model.status import Status

RIG = {"crank": 37.0, "coupler": 1271.5, "rocker": 595.0, "ground": 751.0}
STUDY = """\
mechanism = "test-rig"
[parameters]
crank = 37
coupler = 1271.5
rocker = 595
ground = 751
"""
VELOCITY = [four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY]
ACCELERATION = [four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION]
ANGLE = [four_bar.COUPLER_ANGLE, four_bar.ROCKER_ANGLE]


def filled_rows(needs, **load):
    """Rows of the four-bar that the kernel fills for a load."""
    inputs = {p.name: p.default for p in TEST_RIG.parameters} | RIG | load
    parameters = np.array([[inputs[p.name]] for p in TEST_RIG.kernel_parameters])
    constants = TEST_RIG.constants(parameters)
    out = np.full((3, TEST_RIG.signal_rows, LANES), np.nan)
    tangents = np.repeat([-0.5, 0.1, 0.9], LANES)
    variant = int(constants[TEST_RIG.variant_row, 0])
    TEST_RIG.fill(np.repeat(constants, LANES, axis=1).ravel(), tangents, 1, 0, variant, 3, needs, out.reshape(-1))
    return [row for row in range(four_bar.SIGNAL_ROWS) if not np.isnan(out[:, row]).any()]


@pytest.mark.parametrize(
    "metric",
    ["swing_angle", "mid_angle", "time_ratio", "transmission_angle_worst", "grashof_margin", "size",
     "swing_sensitivity_crank", "swing_sensitivity_coupler", "swing_sensitivity_rocker", "swing_sensitivity_ground"],
)  # fmt: skip
def test_geometry_samples_nothing(metric):
    frame = explore.evaluate("test-rig", RIG | {"constant_torque": 25e3}, metrics=[metric])
    assert frame["nodes"][0] == 0
    assert frame.attrs["kinematic_evaluations"] == 0
    assert np.isfinite(frame[metric][0])


@pytest.mark.parametrize(
    ("load", "rows"),
    [
        ({"constant_torque": 1.0}, []),
        ({"opposing_torque": 1.0}, []),
        ({"stiffness": 1.0}, ANGLE),
        ({"damping": 1.0}, VELOCITY),
        ({"stiffness": 1.0, "damping": 1.0}, [*VELOCITY, *ANGLE]),
        ({"inertia": 1.0}, [*VELOCITY, *ACCELERATION]),
        ({"coupler_mass": 1.0}, [*VELOCITY, *ACCELERATION]),
    ],
)
def test_forces_compute_only_the_motion_that_their_load_needs(load, rows):
    assert filled_rows(four_bar_forces.FORCES, **load) == rows


def test_torque_needs_the_ratio_of_velocities_too():
    assert filled_rows(four_bar_forces.TORQUE, constant_torque=1.0) == VELOCITY


@pytest.mark.parametrize(
    ("load", "evaluations"),
    [({"constant_torque": 25e3}, 1), ({"opposing_torque": 25e3, "stiffness": 1e5}, 1), ({"damping": 100.0}, 4),
     ({"inertia": 8.0}, 4), ({"constant_torque": 25e3, "rocker_mass": 40.0}, 4)],
)  # fmt: skip
def test_only_dynamic_loads_depend_on_the_speed(load, evaluations):
    speed = np.array([10.0, 20.0, 40.0, 60.0])
    frame = explore.evaluate(
        "test-rig", RIG | load | {"speed": speed}, metrics=["pin_force_peak", "power_rms", "velocity_thd"]
    )
    assert frame.attrs["kinematic_evaluations"] == evaluations
    alone = [
        explore.evaluate("test-rig", RIG | load | {"speed": w}, metrics=["pin_force_peak", "power_rms"]) for w in speed
    ]
    for name in ("pin_force_peak", "power_rms"):
        assert frame[name].to_numpy() == pytest.approx([one[name][0] for one in alone], rel=1e-12)


def test_loads_and_allowed_stresses_need_no_further_evaluations():
    many = RIG | {"stiffness": np.linspace(1e3, 1e5, 8), "speed": np.tile([1.0, 2.0], 4)}
    frame = explore.evaluate("test-rig", many, metrics=["velocity_thd", "rocker_velocity_max"])
    assert frame.attrs["kinematic_evaluations"] == 1
    many = RIG | {"stiffness": 1e5, "allowed_stress": np.linspace(50.0, 120.0, 8)}
    frame = explore.evaluate("test-rig", many, metrics=["rod_diameter", "pin_force_peak"])
    assert frame.attrs["kinematic_evaluations"] == 1
    assert frame["rod_diameter"].is_monotonic_decreasing


def test_a_force_without_a_load():
    for metric in ("pin_force_peak", "drive_torque_mean", "rod_diameter", "coupler_force_rms"):
        with pytest.raises(explore.RequestError) as refusal:
            explore.evaluate("test-rig", RIG | {"allowed_stress": 100.0}, metrics=[metric])
        assert str(refusal.value).startswith(f"{metric} needs constant_torque, opposing_torque, stiffness, damping, ")
        assert "\n" not in str(refusal.value)


def test_within_a_sweep_a_missing_input_is_a_status():
    designs = RIG | {"stiffness": np.array([0.0, 1e5, 1e5]), "bearing_rating": np.array([44.6e3, 0.0, 44.6e3])}
    frame = explore.evaluate("test-rig", designs, metrics=["bearing_life", "swing_angle"])
    assert list(frame["status"]) == [Status.NOT_GIVEN, Status.NOT_GIVEN, Status.OK]
    assert list(frame["feasible"]) == [False, False, True]
    assert frame["bearing_life"].notna().tolist() == [False, False, True]
    assert np.isfinite(frame["swing_angle"]).all()
    forces_alone = explore.evaluate("test-rig", designs, metrics=["pin_force_peak"])
    assert list(forces_alone["status"]) == [Status.NOT_GIVEN, Status.OK, Status.OK]
    assert forces_alone["pin_force_peak"].notna().tolist() == [False, True, True]


@pytest.mark.parametrize(
    ("lines", "metrics", "line"),
    [
        ("", '["swing_angle", "pin_force_peak"]', "study.toml:8: evaluate.metrics: pin_force_peak needs "),
        ("stiffness = 1e5\n", '["bearing_life"]', "bearing_life needs bearing_rating; give it a value that is not 0"),
        ("stiffness = 1e5\n", '["rod_diameter"]', "rod_diameter needs allowed_stress; give it a value that is not 0"),
        ("stiffness = 1e5\n", '["buckling_factor"]', "buckling_factor needs built_rod or allowed_stress; give one"),
        ("stiffness = [0]\n", '["pin_force_rms"]', "pin_force_rms needs constant_torque"),
        ("coupler_mass = -2\n", '["swing_angle"]', "parameters.coupler_mass: must be at least 0 kg, got -2"),
        ("damping = -1\n", '["swing_angle"]', "parameters.damping: must be at least 0 N m s/rad, got -1"),
        ("hollow_ratio = 1\n", '["swing_angle"]', "parameters.hollow_ratio: must be at most 0.999, got 1"),
        ("stiffness = 1e5\n", '["pin_force_a_std"]', "pin_force_a is a magnitude, which has no std; use "),
        ("stiffness = 1e5\n", '["rocker_velocity_cv"]', "the mean of rocker_velocity over a full turn is exactly 0"),
        ("stiffness = 1e5\n", '["pin_force_paek"]', "unknown metric 'pin_force_paek'; did you mean 'pin_force_peak'?"),
    ],
)
def test_bad_studies_get_one_line(problems, lines, metrics, line):
    (problem,) = problems(STUDY + lines + f"[evaluate]\nmetrics = {metrics}\n")
    assert line in problem


def test_a_constraint_on_a_force_needs_a_load(problems):
    (line,) = problems(STUDY + '[evaluate]\nmetrics = ["swing_angle"]\n[constraints]\nbearing_life = { min = 100 }\n')[
        :1
    ]
    assert "constraints.bearing_life: bearing_life needs " in line


def test_loads_and_speeds_with_units(load):
    study = load(
        STUDY + 'speed = "12 Hz"\nconstant_torque = "25 kN m"\nopposing_torque = 0\nstiffness = "2500 N m/deg"\n'
    )
    values = {axis.name: axis.values[0] for axis in study.space.axes}
    assert values["speed"] == pytest.approx(24.0 * np.pi, rel=1e-15)
    assert values["constant_torque"] == 25e3
    assert values["opposing_torque"] == 0.0
    assert values["stiffness"] == pytest.approx(450e3 / np.pi, rel=1e-15)


def test_designs_that_cannot_turn_keep_their_reason():
    designs = RIG | {"crank": np.array([37.0, 74.5, 103.3, 2000.0, -1.0]), "constant_torque": 25e3}
    frame = explore.evaluate("test-rig", designs, metrics=["pin_force_peak"])
    expected = [Status.OK, rocking.CHANGE_POINT, rocking.CRANK_BLOCKED, rocking.CRANK_BLOCKED, Status.NOT_FINITE]
    assert list(frame["status"]) == expected
    assert frame["pin_force_peak"].notna().tolist() == [True, False, False, False, False]


def test_the_bound_of_a_row_covers_its_sampled_metrics_and_its_derived_ones():
    """Derived metrics have their inputs sampled at a fiftieth of the tolerance; here their own bound is the smaller."""
    inputs = ["rocker_velocity_variance_cycle", "velocity_deviation_variance_cycle",
              "velocity_deviation_cosine_mean_cycle", "velocity_deviation_sine_mean_cycle"]  # fmt: skip
    sampled = explore.evaluate("test-rig", RIG, metrics=["rocker_acceleration_std", *inputs], tolerance=2e-11)
    both = explore.evaluate("test-rig", RIG, metrics=["rocker_acceleration_std", "velocity_thd"], tolerance=1e-9)

    assert both["nodes"][0] == sampled["nodes"][0]
    assert both["error"][0] >= sampled["error"][0] > 0.0
