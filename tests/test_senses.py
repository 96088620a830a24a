"""Senses of pieces: a node that has another sign than the law of its piece leaves the design to the adaptive rule."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from explore.base.compiling import LANES
from explore.evaluation.quadrature.equispaced import has_left_panel
from explore.evaluation.quadrature.panels import PANELS_SIZE
from explore.evaluation.quadrature.senses import leave_other_senses
from explore.evaluation.quadrature.zeros import code_of_sense

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
