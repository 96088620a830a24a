"""Projection onto the closed loop, and detection of open loops, for the integrators."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.methods import vector_loop
from explore.methods.contract import Motion, Outcome, Task
from explore.model.quantities import FloatArray

#: Size of a correction (rad) after which the next, Newton's iteration being quadratic, is below rounding.
_LAST_CORRECTION = 1e-8
#: From the angles of an accepted step one to three corrections suffice; this bound ends a diverging iteration.
_MAX_CORRECTIONS = 6


def project_onto_loop(
    lengths: FloatArray, crank: FloatArray, angles: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Project coupler and rocker angle, first axis 2, onto the closed loop by Newton's corrections.

    Returns
    -------
    angles : array as given
        Meaningless where the iteration diverges, which `mark_failures` detects.
    corrections : array without the first axis
        Number for each pair.
    """
    corrections = np.zeros(angles.shape[1:], dtype=np.int64)
    active = np.ones(angles.shape[1:], dtype=bool)
    for _ in range(_MAX_CORRECTIONS):
        step = vector_loop.newton_correction(lengths, vector_loop.residual(lengths, crank, *angles), *angles)
        angles = np.where(active, angles + step, angles)
        corrections += active
        active &= ~(np.abs(step).max(axis=0) <= _LAST_CORRECTION)
        if not active.any():
            break
    return angles, corrections


def mark_failures(task: Task, motion: Motion, gap_tolerance: float) -> None:
    """Mark the designs, of those still OK, that are not finite, on the other branch, or whose loop is open.

    The loop is open if its gap exceeds `gap_tolerance` times the longest link at any crank angle of the task.
    """
    lengths, (coupler, rocker) = task.lengths.T[:, :, None], motion.signals[:2]
    with np.errstate(all="ignore"):  # values that are not finite become an outcome
        is_finite = np.isfinite(motion.signals).all(axis=(0, 2))
        gap = np.hypot(*vector_loop.residual(lengths, task.crank_angle, coupler, rocker)).max(axis=1)
        is_other_branch = (vector_loop.determinant(lengths, coupler, rocker) * task.branch[:, None] > 0.0).any(axis=1)
    is_open = gap > gap_tolerance * task.lengths.max(axis=1)
    still_ok = motion.outcome == Outcome.OK
    motion.outcome[still_ok & is_other_branch] = Outcome.WRONG_BRANCH
    motion.outcome[still_ok & is_open] = Outcome.OPEN_LOOP
    motion.outcome[still_ok & ~is_finite] = Outcome.NOT_FINITE
