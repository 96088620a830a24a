"""Levenberg and Marquardt's method within bounds, for many starts at once.

In flow the values of starts, one row each, and two functions: one gives the sum of squares of each row and what a step
from there needs, the other a damped step. Out flow the best values found and their sums. What the values mean, this
module does not know: it knows no mechanism and no target, and neither points nor their order. A start ends after three
steps in a row of little relative gain, where its sum is met, or where no step improves it.

`explore.synthesis.paths.fitting` has a loop of its own with the same rule of damping: it is compiled, and a step of one
linkage takes as long there as the calls of NumPy for a step of one row here.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray

BoolArray = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.int64]
Bounds = tuple[FloatArray, FloatArray]
#: Arrays with a row for each start.
Kept = Sequence[npt.NDArray[Any]]
#: New values, and whether each step has its full length.
Stepped = tuple[FloatArray, BoolArray]
#: Function from values of some rows to their sums of squares and what is kept of them for a step.
Evaluate = Callable[[FloatArray, Rows], tuple[FloatArray, Kept]]
#: Function from values, what is kept of them, rows and damping to new values.
Step = Callable[[FloatArray, Kept, Rows, FloatArray], Stepped]

#: Damping of the first step.
FIRST_DAMPING = 1e-2
#: Least damping.
LEAST_DAMPING = 1e-12
#: Damping at which a start ends.
LARGEST_DAMPING = 1e8
#: Factor on the damping after a step that improves.
LOWER = 0.2
#: Factor on the damping after a step that does not improve.
RAISE = 4.0
#: Number of steps of little gain in a row that end a start.
MOST_SLOW = 3
#: Least diagonal element of the normal equations.
_LEAST_DIAGONAL = 1e-14
#: Largest change of a number in one step of `gauss_newton`.
_LARGEST_CHANGE = 0.5


def improve(
    starts: FloatArray, evaluate: Evaluate, step: Step, most_steps: int, tolerance: float, met: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Values after at most so many steps each, shape (n, k), and their sums of squares, shape (n,).

    `tolerance` is the relative gain of a step that counts as little, `met` the sum of squares at which a start ends.
    """
    values = starts.copy()
    costs, kept = evaluate(values, np.arange(len(values)))
    damping, slow = np.full(len(values), FIRST_DAMPING), np.zeros(len(values), dtype=np.int64)
    for _ in range(most_steps):
        rows = np.flatnonzero((slow < MOST_SLOW) & (damping < LARGEST_DAMPING) & (costs > met))
        if not len(rows):
            break
        trial, is_full = step(values[rows], [each[rows] for each in kept], rows, damping[rows])
        found, found_kept = evaluate(trial, rows)
        is_better = found < costs[rows]
        better = rows[is_better]
        is_slow = costs[better] - found[is_better] < tolerance * costs[better]
        slow[better] = np.where(is_slow, slow[better] + 1, 0)
        damping[rows[~is_better]] = RAISE * damping[rows[~is_better]] + LEAST_DAMPING
        lowered = rows[is_better & is_full]
        damping[lowered] = np.maximum(LOWER * damping[lowered], LEAST_DAMPING)
        for own, new in zip((values, costs, *kept), (trial, found, *found_kept), strict=True):
            own[better] = new[is_better]
    return values, costs


def damped_step(
    matrix: FloatArray,
    gradient: FloatArray,
    damping: FloatArray,
    values: FloatArray,
    bounds: Bounds,
    floor: float = 0.0,
) -> FloatArray:
    """The step (n, k) that solves the damped normal equations; values at a bound that it would pass stay.

    The matrix, shape (n, k, k), is overwritten. The floor is a share of the largest diagonal element, which is added to
    what is damped: numbers of little influence then move little.
    """
    lower, upper = bounds
    held = ((values <= lower) & (gradient > 0.0)) | ((values >= upper) & (gradient < 0.0))
    matrix[held[:, :, None] | held[:, None, :]] = 0.0
    diagonal = np.einsum("nii->ni", matrix)
    floors = floor * diagonal.max(axis=1, keepdims=True)
    diagonal += damping[:, None] * (diagonal + floors) + held + _LEAST_DIAGONAL
    return -np.asarray(np.linalg.solve(matrix, np.where(held, 0.0, gradient)[..., None])[..., 0])


def gauss_newton(
    values: FloatArray,
    residuals: FloatArray,
    slopes: FloatArray,
    damping: FloatArray,
    bounds: Bounds,
    *,
    floor: float = 0.0,
    keeps_direction: bool = False,
) -> Stepped:
    """Values after a damped step for residuals (n, r) and their slopes (n, k, r).

    No number changes by more than a limit: each is cut by itself, or all are shortened, which keeps the direction.
    Measured: the best dwell of 135 deg needs the one, and starts of logarithms converge by the other only.
    """
    matrix, gradient = slopes @ slopes.transpose(0, 2, 1), (slopes @ residuals[..., None])[..., 0]
    step = damped_step(matrix, gradient, damping, values, bounds, floor)
    if keeps_direction:
        step /= np.maximum(np.abs(step).max(axis=1, keepdims=True) / _LARGEST_CHANGE, 1.0)
    step = np.clip(step, -_LARGEST_CHANGE, _LARGEST_CHANGE)
    return np.clip(values + step, *bounds), np.ones(len(values), dtype=np.bool_)
