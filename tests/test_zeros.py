"""Zeros of a signal on one panel: how near they are found, and by how many tiles of points."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from explore.base.compiling import FILL_SIGNATURE, LANES, compiled
from explore.evaluation.quadrature.panels import ANCHOR, HALF, PANELS_SIZE, SCALE
from explore.evaluation.quadrature.tiles import NODE_CAPACITY
from explore.evaluation.quadrature.zeros import collect_zeros, sample_row

#: Half the length of the gap of a signal without numbers there.
GAP_HALF = 0.05
SINE, CUBE, JUMP, POLE, GAP = range(5)
#: Places of the zero in the constants of the signal, and of the number of tiles that were filled.
ZERO, TILES = range(2)


class Tile(NamedTuple):
    """What is read and written of a tile."""

    constants: npt.NDArray[np.float64]
    node: npt.NDArray[np.float64]
    node_signals: npt.NDArray[np.float64]
    tangents: npt.NDArray[np.float64]
    signals: npt.NDArray[np.float64]
    weights: npt.NDArray[np.float64]
    roots: npt.NDArray[np.float64]
    state: npt.NDArray[np.float64]


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, kind, _law, _variant, count, _needs, out):
    """A signal of one kind; the position is the inverse hyperbolic sine of the half-tangent."""
    constants[TILES] += count
    for i in range(count * LANES):
        x = math.asinh(tangents[i]) - constants[ZERO]
        if kind == SINE:
            out[i] = math.sin(5.0 * x)
        elif kind == CUBE:
            out[i] = x * x * x
        elif kind == JUMP:
            out[i] = 1.0 if x > 0.0 else -0.3
        elif kind == POLE:
            out[i] = 1.0 / (x + 1e-300)
        else:
            out[i] = math.nan if abs(x) < GAP_HALF else x


def zeros_of(kind, zero):
    """The zeros between -1 and 1 that are found, and the number of tiles after the samples."""
    panels, tile = np.zeros(PANELS_SIZE), Tile(*(np.zeros(LANES * NODE_CAPACITY) for _ in Tile._fields))
    panels[ANCHOR], panels[HALF], panels[SCALE], tile.constants[ZERO] = kind, 1.0, 1.0, zero
    last = sample_row(fill, 0, 1, 0, -1, 0.0, panels, 0, tile)
    tile.constants[TILES] = 0.0
    found = collect_zeros(fill, 0, 0, 0.0, panels, 0, last, 0, 8, tile)
    return tile.state[:found], tile.constants[TILES]


@pytest.mark.parametrize("kind", [SINE, CUBE, JUMP, POLE])
@pytest.mark.parametrize("zero", [-0.8123, -0.1234, 0.3141, 0.7771])
def test_zeros_are_found_up_to_rounding(kind, zero):
    """Secants do not help where a zero is triple, a jump or a pole."""
    zeros, _ = zeros_of(kind, zero)

    assert abs(zeros - zero).min() <= 1e-15


@pytest.mark.parametrize("zero", [-0.8123, -0.1234, 0.3141, 0.7771])
def test_secants_find_a_zero_of_a_smooth_signal_in_a_few_steps(zero):
    zeros, tiles = zeros_of(SINE, zero)

    assert tiles <= 6 * len(zeros)


@pytest.mark.parametrize("zero", [-0.8123, -0.1234, 0.3141, 0.7771])
def test_ends_of_a_gap_without_numbers_are_places_like_zeros(zero):
    zeros, _ = zeros_of(GAP, zero)

    assert zeros[-1] == pytest.approx(zero + GAP_HALF, abs=1e-12)
