"""Newton's method on the loops, each crank angle starting from the solution at the previous one."""

from dataclasses import dataclass, field

import numpy as np

from explore.comparison.methods.closed_form import find_sides, initial_guess
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.elimination import solve
from explore.model.quantities import FloatArray

#: Largest number of corrections at one crank angle.
MOST_CORRECTIONS = 20


@dataclass(frozen=True)
class Newton:
    """Newton-Raphson iteration for many designs at a time (Norton, Design of Machinery, chapter 4).

    At each crank angle, designs whose loop is closed and designs that failed leave the working set. Where the sine of
    the transmission angle is of the order of the square root of the tolerance, a gap within the tolerance does not
    determine the velocity, even if the branch is checked.

    Attributes
    ----------
    tolerance
        Largest gap of a closed loop, relative to the longest link.
    check_branch
        Whether the sign of the Jacobian's determinant is compared with that of the exact motion. Without it a jump to
        another assembly is reported as solved.
    """

    tolerance: float = 1e-12
    check_branch: bool = field(default=True, repr=False)

    @property
    def name(self) -> str:
        """Key in the registry."""
        return "newton" if self.check_branch else "newton-unchecked"

    @property
    def capabilities(self) -> Capability:
        """Properties; the branch is checked by default."""
        follows = Capability.BATCHED | Capability.FOLLOWS_ANGLES
        return follows | (Capability.CHECKS_BRANCH if self.check_branch else Capability(0))

    def solve(self, task: Task) -> Motion:
        """Solve angle by angle; a design that fails keeps its signals before the crank angle of the failure.

        Evaluations are those of residuals and corrections; the rates, once per angle, are not counted.
        """
        motion, loop, sides = Motion.blank(task), task.loop, find_sides(task)
        unknowns = initial_guess(task).T.copy()
        solutions = np.full((loop.count, *task.crank_angle.shape), np.nan)
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            for j in range(task.crank_angle.shape[1]):
                crank = task.crank_angle[:, j]
                self._correct(task, crank, unknowns, motion)
                if self.check_branch:
                    about = loop.about(task.columns, crank, unknowns)
                    is_other = solve(about.columns, about.gap)[1] * sides[:, j] < 0.0
                    motion.outcome[is_other & (motion.outcome == Outcome.OK)] = Outcome.WRONG_BRANCH
                is_ok = motion.outcome == Outcome.OK
                solutions[:, is_ok, j] = unknowns[:, is_ok]
            loop.fill_signals(motion.signals, task.upright, task.crank_angle, solutions)
        is_ok = motion.outcome == Outcome.OK
        motion.outcome[is_ok & ~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion

    def _correct(self, task: Task, crank: FloatArray, unknowns: FloatArray, motion: Motion) -> None:
        """Correct the unknowns, shape (m, n), in place until the loop of every design that is still OK is closed."""
        max_gap = self.tolerance * task.size
        active = np.flatnonzero(motion.outcome == Outcome.OK)
        for iteration in range(MOST_CORRECTIONS + 1):
            columns = {name: column[active] for name, column in task.columns.items()}
            about = task.loop.about(columns, crank[active], unknowns[:, active])
            motion.evaluations[active] += 1
            is_open = ~(np.abs(np.stack(about.gap)).max(axis=0) <= max_gap[active])  # true for NaN as well
            active = active[is_open]
            if not active.size or iteration == MOST_CORRECTIONS:
                break
            unknowns[:, active] -= np.stack(solve(about.columns, about.gap)[0])[:, is_open]
            motion.evaluations[active] += 1
            motion.iterations[active] += 1
        is_finite = np.isfinite(task.parameters[active]).all(axis=1)
        motion.outcome[active] = np.where(is_finite, Outcome.NOT_CONVERGED, Outcome.NOT_FINITE)
