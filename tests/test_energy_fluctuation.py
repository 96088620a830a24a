"""The energy that a flywheel stores in a turn: what energies tell it to be, and dense sampling beside corners."""

import numpy as np
import pytest
from linkage_cases import CASES, values_of, with_loads
from loaded_designs import any_grooves, any_rockers, any_sliders

import explore
from explore.base.errors import RequestError
from explore.testing import dense_statistics

WIPER = {"crank": 45.0, "coupler": 300.0, "rocker": 62.0, "ground": 305.0, "speed": 2 * np.pi}
TORQUE = "drive_torque_fluctuation_cycle"


def evaluate(mechanism, design, *others):
    metrics = ["energy_fluctuation", *others]
    return explore.evaluate(mechanism, design, metrics=metrics, window="cycle", tolerance=1e-12).iloc[0]


def test_an_inertia_takes_its_largest_kinetic_energy():
    """It rests at both limits. To a few roundings."""
    row = evaluate("crank-rocker", WIPER | {"inertia": 0.05}, "rocker_velocity_peak_cycle")
    assert row["status"] == 1
    assert row["energy_fluctuation"] == pytest.approx(0.025 * row["rocker_velocity_peak_cycle"] ** 2, rel=4e-15)


def test_a_spring_stores_the_energy_of_half_the_swing():
    """It is relaxed at the mid-angle: k (swing/2)^2/2, twice in a turn. To a few roundings."""
    row = evaluate("crank-rocker", WIPER | {"stiffness": 7.0}, "swing_angle")
    assert row["energy_fluctuation"] == pytest.approx(0.875 * np.radians(row["swing_angle"]) ** 2, rel=4e-15)


@pytest.mark.parametrize(("name", "point"), [("hoecken", "P"), ("watt-2", "E"), ("jansen", "T")])
def test_a_weight_stores_the_work_of_its_lift(name, point):
    """Of a table, turned so slowly that its kinetic energy is nothing. To a few roundings of its place."""
    case = CASES[name]
    linkage = with_loads(case, {"gravity": [0.0, -10.0], "masses": {point: 2.0}})
    row = evaluate(linkage, values_of(case) | {"speed": 1e-7}, f"{point}_y_peak_to_peak_cycle")
    assert row["energy_fluctuation"] == pytest.approx(0.02 * row[f"{point}_y_peak_to_peak_cycle"], rel=1e-13)


def test_a_steady_torque_needs_no_flywheel():
    """To the rounding of a statistic, relative to the torque over a turn."""
    case = CASES["hoecken"]
    row = evaluate(with_loads(case, {"torques": {"crank": 5.0}}), values_of(case) | {"speed": 3.0})
    assert row["status"] == 1
    assert row["energy_fluctuation"] == pytest.approx(0.0, abs=5.0 * 2.0 * np.pi * 4e-15)


@pytest.mark.parametrize(
    ("mechanism", "draw", "seed"),
    [("crank-rocker", any_rockers, 5), ("slider-crank", any_sliders, 6), ("variable-crank", any_grooves, 7)],
)
def test_fluctuations_under_any_loads(mechanism, draw, seed):
    """Corners of friction and jumps of opposing loads, against dense sampling and the bound of its error."""
    designs, count = draw(24, seed), 0
    rows = explore.evaluate(mechanism, designs, metrics=[TORQUE, "drive_torque_rms_cycle"], window="cycle")
    for i in np.flatnonzero(np.isfinite(rows[TORQUE])):
        design = {name: float(values[i]) for name, values in designs.items()}

        def motion(angles, design=design):
            return explore.simulate(mechanism, design, angles=angles)[["drive_torque"]].to_numpy().T

        values, errors = dense_statistics.measure(motion, dense_statistics.sample(motion, 0.0, 360.0))
        allowed = rows["error"][i] * 2.0 * np.pi * rows["drive_torque_rms_cycle"][i] + errors.fluctuation[0]
        assert abs(rows[TORQUE][i] - values.fluctuation[0]) <= allowed, design
        count += 1
    assert count > 10


def test_designs_keep_their_fluctuation_in_any_block():
    designs = any_sliders(40, 8)
    rows = explore.evaluate("slider-crank", designs, metrics=[TORQUE, "drive_torque_mean_cycle"], window="cycle")
    later = {name: values[17:] for name, values in designs.items()}
    others = explore.evaluate("slider-crank", later, metrics=[TORQUE], window="cycle")
    np.testing.assert_array_equal(rows[TORQUE][17:], others[TORQUE])


def test_a_fluctuation_is_of_a_turn_and_of_a_torque():
    with pytest.raises(RequestError, match="a fluctuation is that of a full turn; use drive_torque_fluctuation_cycle"):
        explore.evaluate("crank-rocker", WIPER | {"inertia": 0.05}, metrics=["drive_torque_fluctuation_drive"])
    with pytest.raises(RequestError, match="unknown metric 'rocker_velocity_fluctuation_cycle'"):
        explore.evaluate("crank-rocker", WIPER, metrics=["rocker_velocity_fluctuation_cycle"])
