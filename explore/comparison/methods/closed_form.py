"""The closed form of a mechanism, compiled, as a method; what it knows before any method runs."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.contract import Capability, Method, Motion, Outcome, Task
from explore.comparison.methods.elimination import solve
from explore.model.quantities import FloatArray

#: Outcome by status code; mechanisms have further codes.
_OUTCOMES = {outcome.value: outcome for outcome in Outcome if outcome <= Outcome.NOT_FINITE}


@dataclass(frozen=True)
class ClosedForm:
    """The compiled functions of the mechanism, or those of the graph of its table."""

    name: ClassVar[str] = "closed-form"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently."""
        motion = Motion.blank(task)
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            closed = task.loop.closed.close(task.columns)
            motion.signals[:] = closed.fill(task.crank_angle, len(motion.signals))
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[:] = _outcomes(closed.status)
        has_nan = ~np.isfinite(motion.signals).all(axis=(0, 2))
        motion.outcome[has_nan & (motion.outcome == Outcome.OK)] = Outcome.NOT_FINITE
        return motion


def geometric_outcome(task: Task) -> npt.NDArray[np.int8]:
    """An `Outcome` for each design: whether it has its whole motion, NOT_FINITE if a parameter is not usable."""
    return _outcomes(task.loop.closed.close(task.columns).status)


def _outcomes(status: npt.NDArray[np.int8]) -> npt.NDArray[np.int8]:
    known = {int(code): _OUTCOMES.get(int(code), Outcome.NO_MOTION) for code in np.unique(status)}
    return np.array([known[int(code)] for code in status], dtype=np.int8)


def solve_screened(method: Method, task: Task) -> Motion:
    """Solve the designs that have a motion by a method; the exact geometry gives the outcome of the others.

    ``method.solve`` alone may report OK for designs without a motion; the comparison counts these as failures.
    """
    possible = geometric_outcome(task)
    turns = possible == Outcome.OK
    if turns.all():
        return method.solve(task)
    motion = Motion.blank(task)
    motion.outcome[:] = possible
    if turns.any():
        motion.assign(turns, method.solve(task.part(turns)))
    return motion


def start_values(task: Task) -> FloatArray:
    """The unknowns at the first crank angle, shape (n, m): `Task.start`, or the exact values without it."""
    return task.exact_start if task.start is None else task.start


def initial_guess(task: Task) -> FloatArray:
    """Start values for an iteration, (n, m); where the loop does not close, links 1 rad apart."""
    start, loop = start_values(task), task.loop
    angles = np.tile(np.arange(1.0, loop.n_angles + 1.0), (len(task), 1))
    fallback = np.concatenate([angles, np.tile(task.size[:, None], (1, loop.n_lengths))], axis=1)
    return np.where(np.isfinite(start), start, fallback)


def find_sides(task: Task) -> FloatArray:
    """Sign of the determinant on the exact motion, (n, t); NaN for designs without an exact start."""
    loop, first = task.loop, task.crank_angle[:, 0]
    with np.errstate(all="ignore"):
        about = loop.about(task.columns, first, task.exact_start.T)
        side = np.sign(solve(about.columns, about.gap)[1] + np.zeros(len(task)))[:, None] * np.ones_like(
            task.crank_angle
        )
        if loop.side is None:
            return np.asarray(side)
        return np.asarray(
            side * loop.side(task.upright, task.crank_angle, np) * loop.side(task.columns, first, np)[:, None]
        )
