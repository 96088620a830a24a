"""Newton's method of `explore.comparison.methods.newton`, compiled: the same iteration, one design after the other."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.base.compiling import compiled
from explore.comparison.methods.closed_form import find_sides, initial_guess
from explore.comparison.methods.compiled_loop import (
    add_right,
    add_terms,
    fill_acceleration_terms,
    fill_gap,
    fill_rate_terms,
    number_terms,
    solve_rows,
    unit_vector,
)  # fmt: skip
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.newton import MOST_CORRECTIONS

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
    """

    tolerance: float = 1e-12
    name: ClassVar[str] = "newton-compiled"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.FOLLOWS_ANGLES | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve angle by angle; a design that fails keeps its signals before the crank angle of the failure.

        Evaluations are those of residuals and corrections; the rates, once per angle, are not counted.
        """
        motion, loop, angle, n = Motion.blank(task), task.loop, np.array(task.crank_angle, order="C"), len(task)
        carriers = [-1 if angle is None else angle for angle in loop.carriers]
        given = np.zeros((3, n, 0))
        if (known := loop.given(task.upright, angle, np)) is not None:
            given = np.array(np.broadcast_arrays(*known, angle)[:3])
        _solve_all(
            number_terms(loop), np.array([np.broadcast_to(c, n) for chain in task.numbers for c in chain]).T.copy(),
            np.array(carriers, dtype=np.int64), loop.n_angles, loop.n_lengths, loop.turns, given, angle,
            find_sides(task), self.tolerance * task.size, np.array(initial_guess(task), order="C"),
            motion.signals, motion.outcome, motion.evaluations, motion.iterations,
        )  # fmt: skip
        is_ok = motion.outcome == Outcome.OK
        motion.outcome[is_ok & ~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        not_converged = motion.outcome == Outcome.NOT_CONVERGED
        motion.outcome[not_converged & ~np.isfinite(task.parameters).all(axis=1)] = Outcome.NOT_FINITE
        return motion


# compiled for the types of the first call, which only a comparison makes
@compiled(allocates=True)
def _solve_all(
    which, numbers, carriers, n_angles, n_lengths, turns, given, crank_angle, sides, max_gap, start, signals, outcome,
    evaluations, iterations,
):  # fmt: skip
    """Follow each design from angle to angle until it fails.

    `which` is as `number_terms` has it.
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
                turned[n_angles] = unit_vector(crank_angle[i, j])
            if has_given:
                slid[n_lengths], sliding[n_lengths] = given[0, i, j], given[1, i, j]
            corrections = 0
            while True:
                for k in range(n_angles):
                    turned[k] = unit_vector(unknowns[k])
                slid[:n_lengths] = unknowns[n_angles:]
                gap = add_terms(which, numbers[i], turned, slid, by_angle, by_length)
                is_closed = gap <= max_gap[i]  # false for NaN
                if is_closed or corrections == MOST_CORRECTIONS:
                    break
                fill_gap(rows, by_angle)
                solve_rows(rows, by_angle, by_length, n_angles)
                unknowns -= rows[:, m]
                corrections += 1
            iterations[i] += corrections
            evaluations[i] += 2 * corrections + 1
            if not is_closed:
                outcome[i] = _NOT_CONVERGED
                break
            fill_rate_terms(rows, by_angle, by_length, n_angles, n_lengths, turns, sliding)
            if solve_rows(rows, by_angle, by_length, n_angles) * sides[i, j] < 0.0:
                outcome[i] = _WRONG_BRANCH
                break
            signals[:m, i, j] = unknowns
            if signals.shape[0] > m:
                signals[m : 2 * m, i, j] = rows[:, m]
            if signals.shape[0] > 2 * m:
                turning[:n_angles], sliding[:n_lengths] = rows[:n_angles, m], rows[n_angles:, m]
                fill_acceleration_terms(rows, by_angle, by_length, carriers, turning, sliding)
                if has_given:
                    for c in range(chains):
                        add_right(rows, c, -by_length[c, n_lengths] * given[2, i, j])
                solve_rows(rows, by_angle, by_length, n_angles)
                signals[2 * m :, i, j] = rows[:, m]
