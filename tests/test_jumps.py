"""Only a load against the motion or friction makes forces jump: other designs are sampled without breaks."""

import numpy as np
import pytest
from loaded_designs import any_rockers, any_sliders

import explore
from explore.model.status import Status

#: Designs of each mechanism, a load that jumps, loads that corners come from, and metrics under load.
CASES = {
    "crank-rocker": (any_rockers, "opposing_torque", (), ("drive_torque", "pin_force_a", "coupler_force")),
    "test-rig": (any_rockers, "opposing_torque", (), ("drive_torque", "pin_force_a", "coupler_force")),
    "slider-crank": (any_sliders, "opposing_force", ("friction",), ("drive_torque", "crank_pin_force", "thrust")),
}
#: Load that is smaller than the rounding of any other.
NEXT_TO_NOTHING = 1e-29
#: Rounding of forces and torques that cancel to a hundredth, relative; more where a linkage nearly stretches out.
ROUNDING = 1e-12


def evaluated(mechanism, designs, signals, window="cycle"):
    names = [f"{signal}_{statistic}" for signal in signals for statistic in ("rms", "max")]
    table = explore.evaluate(mechanism, designs, window=window, metrics=names)
    return table[table["status"] == Status.OK]


@pytest.mark.parametrize("mechanism", CASES)
def test_statistics_without_breaks_are_those_between_breaks(mechanism):
    draw, jumping, cornering, signals = CASES[mechanism]
    designs = draw(200, seed=3)
    smooth = designs | {name: np.zeros(200) for name in (jumping, *cornering)}
    without = evaluated(mechanism, smooth, signals)
    between = evaluated(mechanism, smooth | {jumping: np.full(200, NEXT_TO_NOTHING)}, signals)
    assert len(without) > 20
    assert list(without.index) == list(between.index)
    assert (without["nodes"] < between["nodes"]).mean() > 0.8
    for signal in signals:
        size = np.maximum(without[f"{signal}_rms"], without[f"{signal}_max"].abs())
        for name in (f"{signal}_rms", f"{signal}_max"):
            difference = (without[name] - between[name]).abs() / size
            assert (difference <= without["error"] + between["error"]).all()
            assert (difference <= ROUNDING).mean() > 0.9


@pytest.mark.parametrize("mechanism", CASES)
def test_designs_with_and_without_jumps_do_not_know_of_each_other(mechanism):
    draw, jumping, cornering, signals = CASES[mechanism]
    designs = draw(64, seed=4)
    together = evaluated(mechanism, designs, signals)
    has_jumps = np.any([designs[name] != 0.0 for name in (jumping, *cornering)], axis=0)
    assert has_jumps.any()
    assert not has_jumps.all()
    for chosen in (has_jumps, ~has_jumps):
        apart = evaluated(mechanism, {name: column[chosen] for name, column in designs.items()}, signals)
        rows = together[chosen[together.index]]
        np.testing.assert_array_equal(rows.drop(columns="status").to_numpy(float), apart.drop(columns="status"))
