"""Newton's method of `explore.comparison.methods.newton`, compiled: the same iteration, one design after the other."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.comparison.methods.closed_form import find_sides, initial_guess
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task

_OK, _NOT_CONVERGED, _WRONG_BRANCH = int(Outcome.OK), int(Outcome.NOT_CONVERGED), int(Outcome.WRONG_BRANCH)


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
        n, chains = len(task), len(loop.chains)
        terms = [(j, term, c) for j in range(chains) for term, c in zip(loop.chains[j], task.numbers[j], strict=True)]
        frame = loop.n_angles + int(loop.turns)
        which = [(j, frame if t.angle is None else t.angle, -1 if t.length is None else t.length) for j, t, _ in terms]
        carriers = [frame if angle is None else angle for angle in loop.carriers]
        given = np.zeros((3, n, 0))
        if (known := loop.given(task.upright, angle, np)) is not None:
            given = np.array(np.broadcast_arrays(*known, angle)[:3])
        _solve_all(
            np.array(which), np.array([np.broadcast_to(c, n) for _, _, c in terms]).T.copy(),
            np.array(carriers, dtype=np.int64), loop.n_angles, loop.n_lengths, loop.turns, given, angle,
            find_sides(task), self.tolerance * task.size, np.array(initial_guess(task), order="C"),
            self.max_iterations, motion.signals, motion.outcome, motion.evaluations, motion.iterations,
        )  # fmt: skip
        is_ok = motion.outcome == Outcome.OK
        motion.outcome[is_ok & ~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        not_converged = motion.outcome == Outcome.NOT_CONVERGED
        motion.outcome[not_converged & ~np.isfinite(task.parameters).all(axis=1)] = Outcome.NOT_FINITE
        return motion


# compiled for the types of the first call, which only a comparison makes
@compiled(allocates=True)
def _solve_all(
    which, numbers, carriers, n_angles, n_lengths, turns, given, crank_angle, sides, max_gap, start, max_iterations,
    signals, outcome, evaluations, iterations,
):  # fmt: skip
    """Follow each design from angle to angle until it fails.

    Row k of `which` has the numbers of chain, angle and length of term k; the last angle is that of the frame.
    """
    m, chains, has_given = n_angles + n_lengths, (n_angles + n_lengths) // 2, given.shape[2] > 0
    turned, slid = np.ones(n_angles + turns + 1, np.complex128), np.empty(n_lengths + has_given)
    by_angle, by_length = np.empty((chains, len(turned)), np.complex128), np.empty((chains, len(slid)), np.complex128)
    turning, sliding, rows, unknowns = np.ones(len(turned)), np.empty(len(slid)), np.empty((m, m + 1)), np.empty(m)
    turning[-1] = 0.0
    for i in range(crank_angle.shape[0]):
        unknowns[:] = start[i]
        for j in range(crank_angle.shape[1]):
            if turns:
                turned[n_angles] = _turn(crank_angle[i, j])
            if has_given:
                slid[n_lengths], sliding[n_lengths] = given[0, i, j], given[1, i, j]
            corrections = 0
            while True:
                for k in range(n_angles):
                    turned[k] = _turn(unknowns[k])
                slid[:n_lengths] = unknowns[n_angles:]
                gap = _add_terms(which, numbers[i], turned, slid, by_angle, by_length)
                is_closed = gap <= max_gap[i]  # false for NaN
                if is_closed or corrections == max_iterations:
                    break
                _fill_gap(rows, by_angle)
                _solve(rows, by_angle, by_length, n_angles)
                unknowns -= rows[:, m]
                corrections += 1
            iterations[i] += corrections
            evaluations[i] += 2 * corrections + 1
            if not is_closed:
                outcome[i] = _NOT_CONVERGED
                break
            _fill_rate_terms(rows, by_angle, by_length, n_angles, n_lengths, turns, sliding)
            if _solve(rows, by_angle, by_length, n_angles) * sides[i, j] < 0.0:
                outcome[i] = _WRONG_BRANCH
                break
            signals[:m, i, j] = unknowns
            if signals.shape[0] > m:
                signals[m : 2 * m, i, j] = rows[:, m]
            if signals.shape[0] > 2 * m:
                turning[:n_angles], sliding[:n_lengths] = rows[:n_angles, m], rows[n_angles:, m]
                _fill_acceleration_terms(rows, by_angle, by_length, carriers, turning, sliding)
                if has_given:
                    for c in range(chains):
                        _add_right(rows, c, -by_length[c, n_lengths] * given[2, i, j])
                _solve(rows, by_angle, by_length, n_angles)
                signals[2 * m :, i, j] = rows[:, m]


@subroutine()
def _turn(angle):
    """The unit vector at an angle."""
    return complex(math.cos(angle), math.sin(angle))


@subroutine()
def _add_terms(which, numbers, turned, slid, by_angle, by_length):
    """Fill the sums of terms by angle and by length; the largest gap of a chain."""
    by_angle[:] = 0.0
    by_length[:] = 0.0
    largest = 0.0
    for k in range(len(which)):
        chain, angle, length = which[k]
        vector = numbers[k] * turned[angle]
        if length >= 0:
            by_length[chain, length] += vector
            vector *= slid[length]
        by_angle[chain, angle] += vector
    for chain in range(len(by_angle)):
        gap = abs(by_angle[chain].sum())
        if not gap <= largest:
            largest = gap
    return largest


@subroutine()
def _add_right(rows, chain, value):
    """Add to both right-hand sides of a chain."""
    rows[2 * chain, -1] += value.real
    rows[2 * chain + 1, -1] += value.imag


@subroutine()
def _fill_gap(rows, by_angle):
    """Fill the right-hand sides with the gaps."""
    rows[:, -1] = 0.0
    for chain in range(len(by_angle)):
        _add_right(rows, chain, by_angle[chain].sum())


@subroutine()
def _fill_rate_terms(rows, by_angle, by_length, n_angles, n_lengths, turns, sliding):
    """Fill the right-hand sides for the rates."""
    rows[:, -1] = 0.0
    for chain in range(len(by_angle)):
        if turns:
            _add_right(rows, chain, -1j * by_angle[chain, n_angles])
        if len(sliding) > n_lengths:
            _add_right(rows, chain, -by_length[chain, n_lengths] * sliding[n_lengths])


@subroutine()
def _fill_acceleration_terms(rows, by_angle, by_length, carriers, turning, sliding):
    """Fill the right-hand sides for the second derivatives but for that of a given length."""
    rows[:, -1] = 0.0
    for chain in range(len(by_angle)):
        for k in range(len(turning)):
            _add_right(rows, chain, turning[k] * turning[k] * by_angle[chain, k])
        for k in range(len(sliding)):
            _add_right(rows, chain, -2j * turning[carriers[k]] * sliding[k] * by_length[chain, k])


@subroutine()
def _solve(rows, by_angle, by_length, n_angles):
    """Solve the equations of Newton's matrix in place of their right-hand sides, by elimination; its determinant."""
    m, determinant = len(rows), 1.0
    for chain in range(len(by_angle)):
        for k in range(m):
            column = 1j * by_angle[chain, k] if k < n_angles else by_length[chain, k - n_angles]
            rows[2 * chain, k], rows[2 * chain + 1, k] = column.real, column.imag
    for k in range(m):
        pivot = k
        for row in range(k + 1, m):
            if abs(rows[row, k]) > abs(rows[pivot, k]):
                pivot = row
        if pivot != k:
            determinant = -determinant
            for column in range(m + 1):
                rows[k, column], rows[pivot, column] = rows[pivot, column], rows[k, column]
        determinant *= rows[k, k]
        for row in range(k + 1, m):
            factor = rows[row, k] / rows[k, k]
            for column in range(k + 1, m + 1):
                rows[row, column] -= factor * rows[k, column]
    for k in range(m - 1, -1, -1):
        for column in range(k + 1, m):
            rows[k, m] -= rows[k, column] * rows[column, m]
        rows[k, m] /= rows[k, k]
    return determinant
