"""The textbook solution of one chain: law of cosines and arccos, or the root of its equation for an unknown length."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from explore.comparison.methods.closed_form import find_sides
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.loop import cis
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class TextbookArccos:
    """Two triangles that share the diagonal from crank pin to rocker pivot; with a slider, one right triangle.

    The first of the two families of position analysis in Constans, Dyer and Sangelkar, A New Method for Teaching the
    Fourbar Linkage, ASEE Annual Conference 2019, paper 24648, page 1. Near the change point the argument of arccos
    is close to 1, where arccos loses half the digits. So does the root of a small difference of squares.
    """

    name: ClassVar[str] = "textbook"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.TRIANGLE

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently; NOT_FINITE where the argument of arccos or root has no value."""
        motion = Motion.blank(task)
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            known, unknown = split_chain(task)
            solve = _angles if task.loop.n_angles == 2 else _angle_and_length
            unknowns = np.stack(np.broadcast_arrays(*solve(task, known, *unknown)))
            task.loop.fill_signals(motion.signals, task.upright, task.crank_angle, unknowns)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion


def split_chain(task: Task) -> tuple[Any, list[Any]]:
    """The known vector of one chain, (n, t), and the numbers of the terms of both unknowns, the second also turned."""
    loop, known = task.loop, 0.0
    unknown: list[Any] = [None, None]
    given = loop.given(task.upright, task.crank_angle, np)
    for term, number in zip(loop.chains[0], loop.numbers(task.upright)[0], strict=True):
        is_input = term.angle == loop.n_angles
        vector = number * cis(task.crank_angle) if is_input else number
        if term.length is not None and term.length < loop.n_lengths:
            unknown[1] = vector
        elif term.angle is not None and not is_input:
            unknown[term.angle] = number
        else:
            known = known + (vector if term.length is None else vector * given[0])  # type: ignore[index]  # given
    return known, unknown


def _angles(task: Task, known: Any, first: Any, second: Any) -> tuple[FloatArray, FloatArray]:
    """Angles of two links in a triangle with the known vector; one is passed from its end to its start."""
    side = find_sides(task)
    r2, r3, square, diagonal = abs(first), abs(second), abs(known) ** 2, abs(known)
    at_first = np.arccos((r2**2 + square - r3**2) / (2.0 * r2 * diagonal))
    at_second = np.arccos((r3**2 + square - r2**2) / (2.0 * r3 * diagonal))
    return direction_of(-known, first) - side * at_first, direction_of(-known, second) + side * at_second


def _angle_and_length(task: Task, known: Any, link: Any, line: Any) -> tuple[FloatArray, FloatArray]:
    """The angle of the link, and the unknown length, a root of a quadratic equation."""
    along, across = (known * np.conj(line)).real, (known * np.conj(line)).imag
    length = -along + find_sides(task) * np.sqrt(abs(link) ** 2 - across**2)
    return direction_of(-(known + length * line), link), length


def direction_of(vector: Any, link: Any) -> FloatArray:
    """How far a link is turned whose vector this is, from -pi to pi."""
    return np.asarray(np.angle(vector * np.conj(link)))
