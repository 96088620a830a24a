"""Newton's method of `explore.comparison.methods.newton`, compiled: the same iteration, one design after the other."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.comparison.methods.closed_form import initial_guess
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.vector_loop import UnknownAngle, UnknownLength
from explore.model.quantities import FloatArray

_OK, _NOT_CONVERGED, _WRONG_BRANCH = int(Outcome.OK), int(Outcome.NOT_CONVERGED), int(Outcome.WRONG_BRANCH)
#: Kind of an unknown: a link of unknown angle.
_ANGLE = 0
#: Kind of an unknown: a length along the x axis.
_ALONG_X = 1
#: Kind of an unknown: a length along the input link.
_ALONG_INPUT = 2


@dataclass(frozen=True)
class CompiledNewton:
    """The iteration of `Newton` compiled by Numba; sines and cosines of the last residual also give the rates.

    The difference in time to `Newton` is mostly that of the language, the difference to the closed form that of the
    method.

    Attributes
    ----------
    tolerance
        Largest gap of a closed loop, relative to the longest link.
    max_iterations
        Most corrections at one crank angle.
    """

    tolerance: float = 1e-12
    max_iterations: int = field(default=20, repr=False)
    name: ClassVar[str] = "newton-compiled"
    summary: ClassVar[str] = "Newton's method from angle to angle, compiled"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.FOLLOWS_ANGLES | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve angle by angle; a design that fails keeps its signals before the crank angle of the failure.

        Evaluations are those of residuals and corrections; the rates, once per angle, are not counted.
        """
        motion, loop, angle = Motion.blank(task), task.loop, np.array(task.crank_angle, order="C")
        parameters = task.parameters.T[:, :, None]
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            direction = np.cos(angle), np.sin(angle)
            known = np.empty((task.level, 2, *angle.shape))
            for order in range(task.level):
                known[order, 0], known[order, 1] = loop.known(parameters, angle, direction, order)
            sides = loop.orientation(parameters, angle) * task.branch[:, None] * np.ones_like(angle)
        kinds, sizes = zip(*(_specify(unknown, task.parameters) for unknown in (loop.first, loop.second)), strict=True)
        _solve_all(
            known, angle, sides, np.array(kinds), np.stack(sizes), self.tolerance * loop.size(task.parameters.T),
            np.array(initial_guess(task), order="C"), self.max_iterations, motion.signals, motion.outcome,
            motion.evaluations, motion.iterations,
        )  # fmt: skip
        is_ok = motion.outcome == Outcome.OK
        motion.outcome[is_ok & ~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        not_converged = motion.outcome == Outcome.NOT_CONVERGED
        motion.outcome[not_converged & ~np.isfinite(task.parameters).all(axis=1)] = Outcome.NOT_FINITE
        return motion


def _specify(unknown: UnknownAngle | UnknownLength, parameters: FloatArray) -> tuple[int, FloatArray]:
    """Kind of the vector of an unknown, and its signed length, or the sign of its direction, of each design."""
    if isinstance(unknown, UnknownAngle):
        return _ANGLE, unknown.sign * parameters[:, unknown.length]
    return _ALONG_INPUT if unknown.turns else _ALONG_X, np.full(len(parameters), unknown.sign)


# compiled for the types of the first call, which only a comparison makes
@compiled()
def _solve_all(
    known, crank_angle, sides, kinds, sizes, max_gap, start, max_iterations, signals, outcome, evaluations, iterations
):
    """Follow each design from angle to angle until it fails."""
    for i in range(crank_angle.shape[0]):
        first, second = start[i, 0], start[i, 1]
        for j in range(crank_angle.shape[1]):
            direction = math.cos(crank_angle[i, j]), math.sin(crank_angle[i, j])
            first, second, u, v, corrections, is_closed = _close_loop(
                known[0, 0, i, j], known[0, 1, i, j], direction, kinds, sizes[:, i], first, second, max_gap[i],
                max_iterations,
            )  # fmt: skip
            iterations[i] += corrections
            evaluations[i] += 2 * corrections + 1
            if not is_closed:
                outcome[i] = _NOT_CONVERGED
            elif (u[2] * v[3] - u[3] * v[2]) * sides[i, j] < 0.0:
                outcome[i] = _WRONG_BRANCH
            if outcome[i] != _OK:
                break
            signals[0, i, j], signals[1, i, j] = first, second
            _fill_rates(signals[2:, i, j], known[:, :, i, j], kinds, u, v)


@subroutine()
def _vector(kind, size, unknown, direction):
    """The vector of an unknown, and its derivative by it."""
    if kind == _ANGLE:
        x, y = size * math.cos(unknown), size * math.sin(unknown)
        return x, y, -y, x
    if kind == _ALONG_INPUT:
        x, y = size * direction[0], size * direction[1]
        return unknown * x, unknown * y, x, y
    return unknown * size, 0.0, size, 0.0


@subroutine()
def _close_loop(x, y, direction, kinds, sizes, first, second, max_gap, max_iterations):
    """Correct both unknowns until the gap is small enough.

    Returns the unknowns, their vectors with derivatives, the number of corrections, and whether the loop is closed.
    """
    corrections = 0
    while True:
        u = _vector(kinds[0], sizes[0], first, direction)
        v = _vector(kinds[1], sizes[1], second, direction)
        gap_x, gap_y = x + u[0] + v[0], y + u[1] + v[1]
        is_closed = math.hypot(gap_x, gap_y) <= max_gap  # false for NaN
        if is_closed or corrections == max_iterations:
            return first, second, u, v, corrections, is_closed
        step = _solve(u, v, gap_x, gap_y)
        first -= step[0]
        second -= step[1]
        corrections += 1


@subroutine()
def _solve(u, v, x, y):
    """Solve the Jacobian's linear equations by Cramer's rule."""
    determinant = u[2] * v[3] - u[3] * v[2]
    return (x * v[3] - y * v[2]) / determinant, (y * u[2] - x * u[3]) / determinant


@subroutine()
def _fill_rates(rates, known, kinds, u, v):
    """Fill none, the velocities, or velocities and accelerations; see `explore.comparison.methods.vector_loop`."""
    if len(rates) > 0:
        x, y = known[1, 0], known[1, 1]
        if kinds[0] == _ALONG_INPUT:
            x, y = x - u[1], y + u[0]
        rates[0], rates[1] = _solve(u, v, -x, -y)
    if len(rates) > 2:
        x, y = _carry_twice(kinds[0], known[2, 0], known[2, 1], u, rates[0])
        x, y = _carry_twice(kinds[1], x, y, v, rates[1])
        rates[2], rates[3] = _solve(u, v, -x, -y)


@subroutine()
def _carry_twice(kind, x, y, vector, rate):
    """Add the second derivative of a vector by the input angle at a constant rate of its unknown."""
    if kind == _ANGLE:
        return x - rate * rate * vector[0], y - rate * rate * vector[1]
    if kind == _ALONG_INPUT:
        return x - 2.0 * rate * vector[3] - vector[0], y + 2.0 * rate * vector[2] - vector[1]
    return x, y
