"""Newton's method on the vector loop, each crank angle starting from the solution of the one before."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from explore.methods import loop
from explore.methods.closed_form import first_guess
from explore.methods.contract import Capability, Motion, Outcome, Task
from explore.vocabulary import FloatArray


@dataclass(frozen=True)
class Newton:
    """Continuation, many designs at a time (Norton, Design of Machinery, chapter 4, Newton-Raphson Solution Method).

    At each angle the designs whose loop is closed leave the working set, and those that failed are worked on no more.
    At a crank angle so near a singular position that the sine of the transmission angle is of the size of the square
    root of the tolerance, a gap within the tolerance leaves the velocity open, whichever branch the sign names.

    Attributes
    ----------
    tolerance
        The gap in the loop, as a part of the longest link, at which the loop counts as closed.
    max_iterations
        Corrections allowed at one crank angle.
    check_branch
        Whether the sign of the Jacobian's determinant is compared with the branch. Without it a guess that falls to the
        other side is followed there and reported as solved.
    """

    tolerance: float = 1e-12
    max_iterations: int = field(default=20, repr=False)
    check_branch: bool = field(default=True, repr=False)

    @property
    def name(self) -> str:
        """The key in the list of methods."""
        return "newton" if self.check_branch else "newton-unchecked"

    @property
    def summary(self) -> str:
        """What it is, in a line."""
        return "Newton's method from angle to angle" + ("" if self.check_branch else ", whatever branch it ends on")

    @property
    def capabilities(self) -> Capability:
        """The branch is checked unless that is switched off."""
        follows = Capability.BATCHED | Capability.FOLLOWS_ANGLES
        return follows | (Capability.CHECKS_BRANCH if self.check_branch else Capability(0))

    def solve(self, task: Task) -> Motion:
        """Solve angle by angle; a design keeps what it had before the angle at which it failed.

        Evaluations are residuals and corrections; the rates, once per angle, are not counted.
        """
        motion = Motion.blank(task)
        lengths, angles = task.lengths.T, first_guess(task).T.copy()
        found = np.full((2, *task.crank_angle.shape), np.nan)
        with np.errstate(all="ignore"):  # a singular step is not finite, and the outcome says so
            for j in range(task.crank_angle.shape[1]):
                self._close(lengths, task.crank_angle[:, j], angles, motion)
                if self.check_branch:
                    other = loop.determinant(lengths, *angles) * task.branch > 0.0
                    motion.outcome[other & (motion.outcome == Outcome.OK)] = Outcome.WRONG_BRANCH
                good = motion.outcome == Outcome.OK
                found[:, good, j] = angles[:, good]
            loop.fill_rates(motion.signals, lengths[:, :, None], task.crank_angle, *found)
        good = motion.outcome == Outcome.OK
        motion.outcome[good & ~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion

    def _close(self, lengths: FloatArray, crank: FloatArray, angles: FloatArray, motion: Motion) -> None:
        """Correct the angles, shape (2, n), in place until the loops of all designs that are still good are closed."""
        enough = self.tolerance * lengths.max(axis=0)
        active = np.flatnonzero(motion.outcome == Outcome.OK)
        for iteration in range(self.max_iterations + 1):
            gap = loop.residual(lengths[:, active], crank[active], *angles[:, active])
            motion.evaluations[active] += 1
            is_open = ~(np.hypot(*gap) <= enough[active])  # true for NaN as well
            active, gap = active[is_open], gap[:, is_open]
            if not active.size or iteration == self.max_iterations:
                break
            angles[:, active] += loop.correction(lengths[:, active], gap, *angles[:, active])
            motion.evaluations[active] += 1
            motion.iterations[active] += 1
        finite = np.isfinite(lengths[:, active]).all(axis=0)
        motion.outcome[active] = np.where(finite, Outcome.NOT_CONVERGED, Outcome.NOT_FINITE)
