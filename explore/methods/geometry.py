"""Outcomes known from the exact geometry, before any method is run."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.mechanisms import four_bar
from explore.methods.contract import Method, Motion, Outcome, Task
from explore.methods.kernels import classify_all
from explore.model.quantities import FloatArray

#: Outcome by linkage class.
_OUTCOMES = np.full(7, Outcome.CRANK_BLOCKED, dtype=np.int8)
_OUTCOMES[[four_bar.CRANK_ROCKER, four_bar.DOUBLE_CRANK]] = Outcome.OK
_OUTCOMES[four_bar.CHANGE_POINT] = Outcome.CHANGE_POINT
_OUTCOMES[four_bar.CANNOT_ASSEMBLE] = Outcome.CANNOT_ASSEMBLE


def geometric_outcome(lengths: FloatArray) -> npt.NDArray[np.int8]:
    """Determine whether the crank can make a full turn, from exactly rounded sums of lengths.

    Parameters
    ----------
    lengths : (n, 4) array
        Crank, coupler, rocker, ground.

    Returns
    -------
    (n,) array
        An `Outcome` for each: OK, CANNOT_ASSEMBLE, CRANK_BLOCKED, CHANGE_POINT, or NOT_FINITE if a length is no
        positive number.
    """
    usable: npt.NDArray[np.bool_] = np.all(np.isfinite(lengths) & (lengths > 0.0), axis=1)
    classes = np.zeros(len(lengths), dtype=np.int64)
    classify_all(np.ascontiguousarray(np.where(usable[:, None], lengths, 1.0)), classes)
    return np.where(usable, _OUTCOMES[classes], np.int8(Outcome.NOT_FINITE))


def solve_screened(method: Method, task: Task) -> Motion:
    """Solve the designs whose crank can turn by a method; the exact geometry gives the outcome of the others.

    ``method.solve`` alone may report OK for designs without a motion; the comparison counts these as failures.
    """
    possible = geometric_outcome(task.lengths)
    turns = possible == Outcome.OK
    if turns.all():
        return method.solve(task)
    motion = Motion.blank(task)
    motion.outcome[:] = possible
    if turns.any():
        motion.assign(turns, method.solve(task.part(turns)))
    return motion
