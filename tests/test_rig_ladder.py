"""Each design climbs only as far as the request and its own load demand; what lacks an input says so in one line."""

import numpy as np
import pytest

import explore
from explore.mechanisms import four_bar
from explore.mechanisms import test_rig_forces as rig_forces
from explore.mechanisms.test_rig import TEST_RIG
from explore.vocabulary import Status

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


def filled(needs, **load):
    """Rows of the four-bar that the kernel fills for a load."""
    inputs = {p.name: p.default for p in TEST_RIG.parameters} | RIG | load
    parameters = np.array([[inputs[p.name] for p in TEST_RIG.kernel_parameters]])
    kernel = np.zeros((1, TEST_RIG.kernel_size))
    TEST_RIG.closed_form(parameters, np.empty((len(TEST_RIG.metrics), 1)), np.zeros(1, np.int8), kernel,
                         np.ones((1, 3)), np.ones(1))  # fmt: skip
    out = np.full((TEST_RIG.signal_rows, 3), np.nan)
    half = np.array([0.3, 1.0, 2.5])
    TEST_RIG.fill(kernel[0], np.sin(half), np.cos(half), 3, needs, out)
    return [row for row in range(four_bar.SIGNAL_ROWS) if not np.isnan(out[row]).any()]


@pytest.mark.parametrize(
    "metric",
    ["swing_angle", "mid_angle", "time_ratio", "transmission_angle_worst", "grashof_margin", "size",
     "swing_sensitivity_crank", "swing_sensitivity_coupler", "swing_sensitivity_rocker", "swing_sensitivity_ground"],
)  # fmt: skip
def test_geometry_samples_nothing(metric):
    frame = explore.evaluate("test-rig", RIG | {"constant_torque": 25e3}, [metric])
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
def test_forces_need_no_more_of_the_motion_than_their_load(load, rows):
    assert filled(rig_forces.FORCES, **load) == rows


def test_torque_needs_the_ratio_of_velocities_too():
    assert filled(rig_forces.TORQUE, constant_torque=1.0) == VELOCITY


@pytest.mark.parametrize(
    ("load", "evaluations"),
    [({"constant_torque": 25e3}, 1), ({"opposing_torque": 25e3, "stiffness": 1e5}, 1), ({"damping": 100.0}, 4),
     ({"inertia": 8.0}, 4), ({"constant_torque": 25e3, "rocker_mass": 40.0}, 4)],
)  # fmt: skip
def test_only_loads_that_depend_on_the_speed_ask_for_it(load, evaluations):
    speed = np.array([10.0, 20.0, 40.0, 60.0])
    frame = explore.evaluate("test-rig", RIG | load | {"speed": speed}, ["pin_force_peak", "power_rms", "velocity_thd"])
    assert frame.attrs["kinematic_evaluations"] == evaluations
    alone = [explore.evaluate("test-rig", RIG | load | {"speed": w}, ["pin_force_peak", "power_rms"]) for w in speed]
    for name in ("pin_force_peak", "power_rms"):
        assert frame[name].to_numpy() == pytest.approx([one[name][0] for one in alone], rel=1e-12)


def test_loads_and_allowances_ask_for_no_motion_of_their_own():
    many = RIG | {"stiffness": np.linspace(1e3, 1e5, 8), "speed": np.tile([1.0, 2.0], 4)}
    frame = explore.evaluate("test-rig", many, ["velocity_thd", "rocker_velocity_max"])
    assert frame.attrs["kinematic_evaluations"] == 1
    many = RIG | {"stiffness": 1e5, "allowed_stress": np.linspace(50.0, 120.0, 8)}
    frame = explore.evaluate("test-rig", many, ["rod_diameter", "pin_force_peak"])
    assert frame.attrs["kinematic_evaluations"] == 1
    assert frame["rod_diameter"].is_monotonic_decreasing


def test_a_force_without_a_load():
    for metric in ("pin_force_peak", "drive_torque_mean", "rod_diameter", "coupler_force_rms"):
        with pytest.raises(explore.RequestError) as caught:
            explore.evaluate("test-rig", RIG | {"allowed_stress": 100.0}, [metric])
        assert str(caught.value).startswith(f"{metric} needs constant_torque, opposing_torque, stiffness, damping, ")
        assert "\n" not in str(caught.value)


def test_within_a_sweep_what_is_not_given_is_a_status():
    designs = RIG | {"stiffness": np.array([0.0, 1e5, 1e5]), "bearing_rating": np.array([44.6e3, 0.0, 44.6e3])}
    frame = explore.evaluate("test-rig", designs, ["bearing_life", "swing_angle"])
    assert list(frame["status"]) == [Status.NOT_GIVEN, Status.NOT_GIVEN, Status.OK]
    assert list(frame["feasible"]) == [False, False, True]
    assert frame["bearing_life"].notna().tolist() == [False, False, True]
    assert np.isfinite(frame["swing_angle"]).all()
    forces_alone = explore.evaluate("test-rig", designs, ["pin_force_peak"])
    assert list(forces_alone["status"]) == [Status.NOT_GIVEN, Status.OK, Status.OK]
    assert forces_alone["pin_force_peak"].notna().tolist() == [False, True, True]


@pytest.mark.parametrize(
    ("added", "metrics", "line"),
    [
        ("", '["swing_angle", "pin_force_peak"]', "study.toml:8: evaluate.metrics: pin_force_peak needs "),
        ("stiffness = 1e5\n", '["bearing_life"]', "bearing_life needs bearing_rating; give it a value that is not 0"),
        ("stiffness = 1e5\n", '["rod_diameter"]', "rod_diameter needs allowed_stress; give it a value that is not 0"),
        ("stiffness = 1e5\n", '["buckling_factor"]', "buckling_factor needs built_rod or allowed_stress; give one"),
        ("stiffness = [0]\n", '["pin_force_rms"]', "pin_force_rms needs constant_torque"),
        ("coupler_mass = -2\n", '["swing_angle"]', "parameters.coupler_mass: must be at least 0 kg, got -2"),
        ("damping = -1\n", '["swing_angle"]', "parameters.damping: must be at least 0 N m s/rad, got -1"),
        ("hollow_ratio = 1\n", '["swing_angle"]', "parameters.hollow_ratio: must be at most 0.999, got 1"),
        ("stiffness = 1e5\n", '["pin_force_a_std"]', "pin_force_a is a magnitude, which has no std; ask for "),
        ("stiffness = 1e5\n", '["rocker_velocity_cv"]', "the mean of rocker_velocity over a full turn is exactly 0"),
        ("stiffness = 1e5\n", '["pin_force_paek"]', "unknown metric 'pin_force_paek'; did you mean 'pin_force_peak'?"),
    ],
)
def test_bad_studies_get_one_line(problems, added, metrics, line):
    found = problems(STUDY + added + f"[evaluate]\nmetrics = {metrics}\n")
    assert len(found) == 1
    assert line in found[0]


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
    frame = explore.evaluate("test-rig", designs, ["pin_force_peak"])
    expected = [Status.OK, Status.CHANGE_POINT, Status.CRANK_BLOCKED, Status.CRANK_BLOCKED, Status.NOT_FINITE]
    assert list(frame["status"]) == expected
    assert frame["pin_force_peak"].notna().tolist() == [True, False, False, False, False]
