"""What users of SciPy write: fsolve on the vector loop at each crank angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import optimize

from explore.methods import loop
from explore.methods.closed_form import first_guess
from explore.methods.contract import Capability, Motion, Outcome, Task
from explore.vocabulary import FloatArray

#: MINPACK's code for success; with any other, fsolve warns.
_CONVERGED = 1


@dataclass(frozen=True)
class Fsolve:
    """`scipy.optimize.fsolve` (MINPACK's hybrd), the previous angle's solution as guess, without the Jacobian.

    Velocities and accelerations by `numpy.linalg.solve`. Nothing tells it on which branch it is.

    Attributes
    ----------
    tolerance
        ``xtol``: the relative change of both angles at which it stops.
    """

    tolerance: float = 1.49012e-8
    name: ClassVar[str] = "fsolve"
    summary: ClassVar[str] = "scipy.optimize.fsolve from angle to angle"
    capabilities: ClassVar[Capability] = Capability.PEER | Capability.FOLLOWS_ANGLES

    def solve(self, task: Task) -> Motion:
        """Solve design by design; a design keeps what it had before the angle at which it failed.

        Evaluations are residuals, those for finite differences among them.
        """
        motion, start = Motion.blank(task), first_guess(task)
        with np.errstate(all="ignore"):
            for i, lengths in enumerate(task.lengths):
                guess = start[i]
                for j, crank in enumerate(task.crank_angle[i]):
                    guess, info, code, _ = optimize.fsolve(
                        _gap, guess, (lengths, crank), full_output=True, xtol=self.tolerance
                    )
                    motion.evaluations[i] += info["nfev"]
                    if code == _CONVERGED:
                        motion.outcome[i] = _fill(lengths, crank, guess, motion.signals[:, i, j])
                    else:
                        known = np.isfinite(lengths).all()
                        motion.outcome[i] = Outcome.NOT_CONVERGED if known else Outcome.NOT_FINITE
                    if motion.outcome[i] != Outcome.OK:
                        break
        return motion


def _gap(angles: FloatArray, lengths: FloatArray, crank: FloatArray) -> FloatArray:
    return loop.residual(lengths, crank, *angles)


def _fill(lengths: FloatArray, crank: FloatArray, angles: FloatArray, signals: FloatArray) -> Outcome:
    """Fill in the signals at one angle, shape (2 level,), from the linear systems for velocities and accelerations."""
    r1, r2, r3, _ = lengths
    links, cosine, sine = np.array([r2, -r3]), np.cos(angles), np.sin(angles)
    jacobian = np.array([-links * sine, links * cosine])
    signals[:2] = angles
    try:
        if len(signals) > 2:
            signals[2:4] = np.linalg.solve(jacobian, r1 * np.array([np.sin(crank), -np.cos(crank)]))
        if len(signals) > 4:
            outward = r1 * np.array([np.cos(crank), np.sin(crank)])
            signals[4:6] = np.linalg.solve(jacobian, outward + np.array([cosine, sine]) @ (links * signals[2:4] ** 2))
    except np.linalg.LinAlgError:
        return Outcome.RAISED
    return Outcome.OK if np.isfinite(signals).all() else Outcome.NOT_FINITE
