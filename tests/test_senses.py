"""Senses of pieces, by the sign of a node or of a load: which designs are left to the adaptive rule or have breaks."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from loaded_designs import any_rockers, any_sliders

import explore
from explore.base.compiling import LANES
from explore.evaluation.quadrature.equispaced import has_left_panel
from explore.evaluation.quadrature.panels import PANELS_SIZE
from explore.evaluation.quadrature.senses import leave_other_senses
from explore.evaluation.quadrature.single_cuts import code_of_sense
from explore.model.status import Status

ROWS, NODES = 3, 4


class Tables(NamedTuple):
    """What is read of the tables: the senses are the rows 2 and 0."""

    sense_count: int
    corner_rows: npt.NDArray[np.int64]


class Work(NamedTuple):
    """What is written: the panels."""

    panels: npt.NDArray[np.float64]


class Tile(NamedTuple):
    """The panel of each lane."""

    lane_panels: npt.NDArray[np.int64]


def left_panels(law, signals, lanes):
    """Which of as many panels as lanes are left."""
    panels = np.ones(PANELS_SIZE)
    tables = Tables(2, np.array([(2, -1), (0, -1)]))
    leave_other_senses(signals.ravel(), ROWS, tables, law, NODES, lanes, Work(panels), Tile(np.arange(LANES)))
    return [k for k in range(LANES) if has_left_panel(panels, k, 1, 1)]


@pytest.mark.parametrize(("row", "law"), [(2, 1 | 2 << 2), (0, 1 | 2 << 2), (2, 2 | 1 << 2), (0, 2 | 1 << 2)])
def test_one_node_of_another_sign_leaves_its_panel(row, law):
    signs = np.array([1.0, 0.0, -1.0]) if law & 3 == 2 else np.array([-1.0, 0.0, 1.0])
    signals = np.tile(signs[None, :, None], (NODES, 1, LANES))
    assert left_panels(law, signals, LANES) == []
    signals[2, row, 5] *= -1.0
    assert left_panels(law, signals, LANES) == [5]
    assert left_panels(law, signals, 5) == []  # the other lanes are padding
    assert left_panels(0, signals, LANES) == []  # no sense is told


def test_what_is_rounding_has_no_sense():
    """A value has to exceed a hundredth of what disturbances change, which are 8,192 times as large as rounding."""
    assert [code_of_sense(value, 1.0) for value in (0.5, -0.5, 0.005, -0.005)] == [1.0, 2.0, 0.0, 0.0]


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
