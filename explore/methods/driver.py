"""Running a method: the exact geometry speaks first, so that no method says ok where the linkage cannot close."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.mechanisms import four_bar
from explore.methods.contract import Method, Motion, Outcome, Task
from explore.vocabulary import FloatArray

_TURNS = (four_bar.CRANK_ROCKER, four_bar.DOUBLE_CRANK)
_REFUSED = {
    four_bar.CANNOT_ASSEMBLE: Outcome.CANNOT_ASSEMBLE,
    four_bar.CHANGE_POINT: Outcome.CHANGE_POINT,
}


def solve(method: Method, task: Task) -> Motion:
    """Solve a task by a method, for the designs whose crank can turn; the others are told by the exact geometry.

    The method alone, ``method.solve``, may say ok to any of them: it is what the charts of failures show.
    """
    possible = geometric_outcome(task.lengths)
    turns = possible == Outcome.OK
    if turns.all():
        return method.solve(task)
    motion = Motion.blank(task)
    motion.outcome[:] = possible
    if turns.any():
        motion.put(turns, method.solve(task.part(turns)))
    return motion


def geometric_outcome(lengths: FloatArray) -> npt.NDArray[np.int8]:
    """What the exact sums of lengths, shape (n, 4), say of a full turn of the crank, shape (n,)."""
    outcome = np.full(len(lengths), Outcome.OK, dtype=np.int8)
    for i, row in enumerate(lengths):
        if not (np.isfinite(row).all() and (row > 0.0).all()):
            outcome[i] = Outcome.NOT_FINITE
            continue
        linkage_class, _ = four_bar.classify(*row)
        if linkage_class not in _TURNS:
            outcome[i] = _REFUSED.get(linkage_class, Outcome.CRANK_BLOCKED)
    return outcome
