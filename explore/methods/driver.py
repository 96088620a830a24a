"""Running a method: the exact geometry speaks first, so that no method says ok where the linkage cannot close."""

from __future__ import annotations

from explore.methods.contract import Method, Motion, Outcome, Task
from explore.methods.geometry import geometric_outcome


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
