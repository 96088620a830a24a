"""Closing the loop again, and noticing that it no longer closes: for methods that go along the motion."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.methods import loop
from explore.methods.contract import Motion, Outcome, Task
from explore.vocabulary import FloatArray

#: A correction (rad) after which the next would be lost in rounding, Newton's iteration being quadratic.
_LAST_CORRECTION = 1e-8
#: From any angles on which a step was accepted it takes one to three; a diverging iteration ends here.
_MOST_CORRECTIONS = 6


def project(lengths: FloatArray, crank: FloatArray, angles: FloatArray) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Put coupler and rocker angle, first axis 2, back onto the closed loop by Newton's corrections.

    Returns the angles and the number of corrections of each pair. Where the iteration diverges the angles are of no
    use: `mark_open` finds that.
    """
    corrections = np.zeros(angles.shape[1:], dtype=np.int64)
    active = np.ones(angles.shape[1:], dtype=bool)
    for _ in range(_MOST_CORRECTIONS):
        step = loop.correction(lengths, loop.residual(lengths, crank, *angles), *angles)
        angles = np.where(active, angles + step, angles)
        corrections += active
        active &= ~(np.abs(step).max(axis=0) <= _LAST_CORRECTION)
        if not active.any():
            break
    return angles, corrections


def mark_open(task: Task, motion: Motion, gap_tolerance: float) -> None:
    """Mark, of the designs still OK, those that are not finite, on the other branch, or whose loop is open.

    A gap counts when it is wider than `gap_tolerance` times the longest link at any crank angle of the task.
    """
    lengths, (coupler, rocker) = task.lengths.T[:, :, None], motion.signals[:2]
    with np.errstate(all="ignore"):  # what is not finite is asked for in the first line
        finite = np.isfinite(motion.signals).all(axis=(0, 2))
        gap = np.hypot(*loop.residual(lengths, task.crank_angle, coupler, rocker)).max(axis=1)
        other = (loop.determinant(lengths, coupler, rocker) * task.branch[:, None] > 0.0).any(axis=1)
    open_loop = gap > gap_tolerance * task.lengths.max(axis=1)
    still = motion.outcome == Outcome.OK
    motion.outcome[still & other] = Outcome.WRONG_BRANCH
    motion.outcome[still & open_loop] = Outcome.OPEN_LOOP
    motion.outcome[still & ~finite] = Outcome.NOT_FINITE
