"""Least travel of sliders in their dwells within all limits: successive linear programmes from good starts.

Each programme lessens half the travel of the slider at sampled crank angles, with what misses a limit at a high price,
to first order in the nine numbers within a box of trust.
"""

from typing import NamedTuple

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.dwell_fitting import DwellTask, excesses_of_lengths
from explore.synthesis.dwell_motions import N_NUMBERS, Motions, slider_motions

#: Price of missing a limit by 1, in lengths of the crank that the slider moves.
_PRICE = 3.0
#: Number of crank angles over the dwell.
_N_DWELL = 73
#: Number of crank angles over the turn.
_N_TURN = 180
#: Largest number of steps.
_MOST_STEPS = 20
#: Half the box of trust at first.
_FIRST_BOX = 0.1
#: Half the box of trust at which the search ends.
_LEAST_BOX = 1e-6
#: Least share of the expected progress for which a step is taken.
_LEAST_SHARE = 0.1
#: Expected progress over the cost that ends the search.
_LITTLE = 1e-3
#: Share of the limit from which on sines of pressure angles are in the programme.
_NEAR = 0.7


class _Rows(NamedTuple):
    """Values and slopes, (r, 9), of positions in the dwell and of excesses over limits, at the numbers."""

    rest: FloatArray
    rest_slopes: FloatArray
    excesses: FloatArray
    excess_slopes: FloatArray

    @property
    def half(self) -> float:
        """Half the travel in the dwell."""
        return float(np.ptp(self.rest)) / 2.0

    @property
    def cost(self) -> float:
        """Half the travel, and the price of the limit that is missed most."""
        return self.half + _PRICE * float(np.max(self.excesses, initial=0.0))


def _rows(task: DwellTask, numbers: FloatArray, side: float) -> _Rows:
    turned = [np.linspace(0.0, task.span, _N_DWELL), np.linspace(0.0, 2.0 * np.pi, _N_TURN, endpoint=False)]
    both = slider_motions(numbers[None], np.array([side]), np.concatenate(turned))
    turn = Motions(*(part[0, ..., _N_DWELL:] for part in both))
    values, slopes = excesses_of_lengths(task, numbers[None])
    far, near = turn.positions.argmax(), turn.positions.argmin()
    largest = np.sin(task.pressure_angle_max)
    steep = np.flatnonzero(np.abs(turn.sines) > _NEAR * largest)
    signs = np.sign(turn.sines[steep])
    stroke_slopes = turn.position_slopes[:, near] - turn.position_slopes[:, far]
    return _Rows(
        both.positions[0, :_N_DWELL],
        both.position_slopes[0, :, :_N_DWELL].T,
        np.concatenate([values[0], [task.stroke - np.ptp(turn.positions)], signs * turn.sines[steep] - largest]),
        np.vstack([slopes[0].T, stroke_slopes, (signs * turn.sine_slopes[:, steep]).T]),
    )


class Polished(NamedTuple):
    """A linkage with its slider after the search, as of `slider_motions`.

    Its cost is half the travel in the dwell, and the price of missed limits.
    """

    numbers: FloatArray
    side: float
    cost: float


def polish(task: DwellTask, numbers: FloatArray, side: float) -> Polished:
    """The linkage of least travel within the limits near one, shape (9,)."""
    box = _FIRST_BOX
    rows = _rows(task, numbers, side)
    for _ in range(_MOST_STEPS):
        step, expected = _step(task, numbers, rows, box)
        if expected <= _LITTLE * rows.cost:
            break
        tried = _rows(task, numbers + step, side)
        share = (rows.cost - tried.cost) / expected
        if share > _LEAST_SHARE:
            numbers, rows = numbers + step, tried
        box = box * 2.0 if share > 0.75 else box if share > 0.25 else float(np.abs(step).max()) / 4.0
        if box < _LEAST_BOX:
            break
    return Polished(numbers, side, rows.cost)


def _step(task: DwellTask, numbers: FloatArray, rows: _Rows, box: float) -> tuple[FloatArray, float]:
    """The step of least cost to first order, and by how much it lessens the cost so."""
    from scipy.optimize import linprog

    n_rest, n_excesses = len(rows.rest), len(rows.excesses)
    # In units of the travel: it may be far less than the tolerance of the solver.
    unit = max(rows.half, 1e-12)
    rest, slopes = (rows.rest - rows.rest.min()) / unit, rows.rest_slopes / unit
    one, nothing = np.ones((n_rest, 1)), np.zeros((n_rest, 1))
    # Unknowns: the step, the middle of the travel, half the travel, and what misses the limits.
    matrix = np.vstack([
        np.hstack([slopes, -one, -one, nothing]),
        np.hstack([-slopes, one, -one, nothing]),
        np.hstack([rows.excess_slopes, np.zeros((n_excesses, 2)), -np.ones((n_excesses, 1))]),
    ])  # fmt: skip
    bounds = [
        (float(max(-box, low - number)), float(min(box, high - number)))
        for low, high, number in zip(task.lower, task.upper, numbers, strict=True)
    ]
    found = linprog(
        [0.0] * (N_NUMBERS + 1) + [1.0, _PRICE / unit],
        A_ub=matrix,
        b_ub=np.concatenate([-rest, rest, -rows.excesses]),
        bounds=[*bounds, (None, None), (0.0, None), (0.0, None)],
    )
    if found.x is None or found.fun is None:
        return np.zeros(N_NUMBERS), 0.0
    return found.x[:N_NUMBERS], rows.cost - unit * float(found.fun)
