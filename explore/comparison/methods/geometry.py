"""Outcomes known from the exact geometry, before any method is run."""

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.contract import Method, Motion, Outcome, Task
from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray

#: Outcome by status code; codes that mechanisms declare are designs without a motion.
_OUTCOMES = np.full(128, Outcome.NO_MOTION, dtype=np.int8)
for _outcome in (Outcome.OK, Outcome.CANNOT_ASSEMBLE, Outcome.CRANK_BLOCKED, Outcome.CHANGE_POINT, Outcome.NOT_FINITE):
    _OUTCOMES[_outcome] = _outcome


def geometric_outcome(parameters: FloatArray, loop: VectorLoop = FOUR_BAR) -> npt.NDArray[np.int8]:
    """An `Outcome` for each design: whether its crank can make a full turn, NOT_FINITE if a parameter is not usable.

    The parameters, (n, p), are those of the loop; lengths of a four-bar are compared by exactly rounded sums.
    """
    return np.asarray(_OUTCOMES[loop.status(parameters)])


def solve_screened(method: Method, task: Task) -> Motion:
    """Solve the designs whose crank can turn by a method; the exact geometry gives the outcome of the others.

    ``method.solve`` alone may report OK for designs without a motion; the comparison counts these as failures.
    """
    possible = geometric_outcome(task.parameters, task.loop)
    turns = possible == Outcome.OK
    if turns.all():
        return method.solve(task)
    motion = Motion.blank(task)
    motion.outcome[:] = possible
    if turns.any():
        motion.assign(turns, method.solve(task.part(turns)))
    return motion
