"""The textbook solution: law of cosines and arccos, or the root of the loop equation for an unknown length."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.vector_loop import UnknownLength
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class TextbookArccos:
    """Two triangles that share the diagonal from crank pin to rocker pivot; with a slider, one right triangle.

    The first of the two families of position analysis in Constans, Dyer and Sangelkar, A New Method for Teaching the
    Fourbar Linkage, ASEE Annual Conference 2019, paper 24648, page 1. Near the change point the argument of arccos
    is close to 1, where arccos loses half the digits. So does the root of a small difference of squares.
    """

    name: ClassVar[str] = "textbook"
    summary: ClassVar[str] = "law of cosines with arccos, or the root for an unknown length"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently; NOT_FINITE where the argument of arccos or root has no value."""
        motion, parameters, first = Motion.blank(task), task.parameters.T[:, :, None], task.loop.first
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            unknowns = _length_and_angle(task, first) if isinstance(first, UnknownLength) else _angles(task)
            task.loop.fill_signals(motion.signals, parameters, task.crank_angle, *unknowns)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion


def _angles(task: Task) -> tuple[FloatArray, FloatArray]:
    """Coupler and rocker angle."""
    crank, branch = task.crank_angle, task.branch[:, None]
    r1, r2, r3, r4 = task.parameters.T[:, :, None]
    square = r1**2 + r4**2 - 2.0 * r1 * r4 * np.cos(crank)
    diagonal, direction = np.sqrt(square), np.arctan2(-r1 * np.sin(crank), r4 - r1 * np.cos(crank))
    at_pin = np.arccos((r2**2 + square - r3**2) / (2.0 * r2 * diagonal))
    at_pivot = np.arccos((r3**2 + square - r2**2) / (2.0 * r3 * diagonal))
    return direction + branch * at_pin, direction + np.pi - branch * at_pivot


def _length_and_angle(task: Task, first: UnknownLength) -> tuple[FloatArray, FloatArray]:
    """The unknown length, a root of a quadratic equation, and the angle of the rod."""
    loop, parameters, angle = task.loop, task.parameters.T[:, :, None], task.crank_angle
    direction = np.cos(angle), np.sin(angle)
    x, y = loop.known(parameters, angle, direction, 0)
    dx, dy = first.direction(direction)
    across = x * dy - y * dx
    root = np.sqrt(parameters[loop.second.length] ** 2 - across**2)
    length = -(x * dx + y * dy) - loop.orientation(parameters, angle) * task.branch[:, None] * root
    return length, np.arctan2(-(y + length * dy), -(x + length * dx))
