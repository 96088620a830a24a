"""`scipy.optimize.fsolve` on the vector loop at each crank angle, as users of SciPy write it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import optimize

from explore.comparison.methods.closed_form import initial_guess
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray

#: MINPACK's code for success.
_CONVERGED = 1


@dataclass(frozen=True)
class Fsolve:
    """`scipy.optimize.fsolve` (MINPACK's hybrd) without a Jacobian, started from the solution at the previous angle.

    Velocities and accelerations are solved by `numpy.linalg.solve`. The branch is not checked.

    Attributes
    ----------
    tolerance
        ``xtol``: relative change of the angles at which the iteration stops.
    """

    tolerance: float = 1.49012e-8
    name: ClassVar[str] = "fsolve"
    summary: ClassVar[str] = "scipy.optimize.fsolve from angle to angle"
    capabilities: ClassVar[Capability] = Capability.PEER | Capability.FOLLOWS_ANGLES

    def solve(self, task: Task) -> Motion:
        """Solve design by design; a design that fails keeps its signals before the crank angle of the failure.

        Evaluations are those of the residual, including finite differences.
        """
        motion, start, loop = Motion.blank(task), initial_guess(task), task.loop
        with np.errstate(all="ignore"):
            for i, parameters in enumerate(task.parameters):
                guess = start[i]
                for j, crank in enumerate(task.crank_angle[i]):
                    guess, info, code, _ = optimize.fsolve(
                        _gap, guess, (loop, parameters, crank), full_output=True, xtol=self.tolerance
                    )
                    motion.evaluations[i] += info["nfev"]
                    if code == _CONVERGED:
                        motion.outcome[i] = _fill(loop, parameters, crank, guess, motion.signals[:, i, j])
                    else:
                        is_finite = np.isfinite(parameters).all()
                        motion.outcome[i] = Outcome.NOT_CONVERGED if is_finite else Outcome.NOT_FINITE
                    if motion.outcome[i] != Outcome.OK:
                        break
        return motion


def _gap(unknowns: FloatArray, loop: VectorLoop, parameters: FloatArray, crank: FloatArray) -> tuple[float, float]:
    return loop.linearise(parameters, crank, *unknowns).gap


def _fill(
    loop: VectorLoop, parameters: FloatArray, crank: FloatArray, unknowns: FloatArray, signals: FloatArray
) -> Outcome:
    """Fill the signals at one crank angle, shape (2 level,), from linear systems for velocities and accelerations."""
    linear = loop.linearise(parameters, crank, *unknowns)
    jacobian = np.array([linear.first_derivative, linear.second_derivative], dtype=float).T
    signals[:2] = unknowns
    try:
        if len(signals) > 2:
            signals[2:4] = np.linalg.solve(jacobian, loop.rate_terms(parameters, crank, linear))
        if len(signals) > 4:
            signals[4:6] = np.linalg.solve(jacobian, loop.acceleration_terms(parameters, crank, linear, signals[2:4]))
    except np.linalg.LinAlgError:
        return Outcome.RAISED
    return Outcome.OK if np.isfinite(signals).all() else Outcome.NOT_FINITE
