"""The intersection of two circles by Heron's formula, in NumPy."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from explore.comparison.methods.closed_form import find_sides
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.loop import cis
from explore.comparison.methods.textbook import direction_of, split_chain
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class CircleIntersection:
    """The coupler joint as intersection of the circles of coupler and rocker, rates as quotients of dot products.

    What a careful user of NumPy writes: Heron's formula in factors, and no trigonometric function but those of the
    crank and two arctangents. Near the change point a factor is the small difference of a rounded diagonal and links.
    """

    name: ClassVar[str] = "circles"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.TWO_ANGLES

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently; NOT_FINITE where the circles do not meet or touch."""
        motion = Motion.blank(task)
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            known, (first, second) = split_chain(task)
            r2, r3, square = abs(first), abs(second), known.real**2 + known.imag**2
            diagonal = np.sqrt(square)
            factors = (r2 + r3 + diagonal) * (r2 + r3 - diagonal) * (diagonal + r2 - r3) * (diagonal - r2 + r3)
            determinant = 0.5 * find_sides(task) * np.sqrt(factors)
            along, across = 0.5 + 0.5 * (r2 - r3) * (r2 + r3) / square, determinant / square
            link = (1j * across - along) * known
            _fill_signals(motion.signals, task, link, -known - link, determinant)
            motion.signals[0] = direction_of(link, first)
            motion.signals[1] = direction_of(-known - link, second)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion


def _fill_signals(signals: FloatArray, task: Task, first: Any, second: Any, determinant: FloatArray) -> None:
    """Fill the derivatives in ``signals[2 level, n, t]`` from the vectors of both links, which close the chain.

    The product of a derivative of this sum with the vector of one link gives the rate of the other.
    """
    loop, turning = task.loop, task.loop.n_angles
    numbers = zip(loop.chains[0], loop.numbers(task.upright)[0], strict=True)
    crank = sum(number for term, number in numbers if term.angle == turning) * cis(task.crank_angle)
    if len(signals) > 2:
        signals[2], signals[3] = -_cross(crank, second) / determinant, _cross(crank, first) / determinant
    if len(signals) > 4:
        inward = crank + signals[2] ** 2 * first + signals[3] ** 2 * second
        signals[4], signals[5] = _dot(inward, second) / determinant, -_dot(inward, first) / determinant


def _dot(a: Any, b: Any) -> FloatArray:
    return np.asarray(a.real * b.real + a.imag * b.imag)


def _cross(a: Any, b: Any) -> FloatArray:
    return np.asarray(a.real * b.imag - a.imag * b.real)
