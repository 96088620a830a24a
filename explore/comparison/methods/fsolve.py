"""`scipy.optimize.fsolve` on the loops at each crank angle, as users of SciPy write it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy  # whose parts are imported on first use

from explore.comparison.methods.closed_form import initial_guess
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.design_equations import DesignEquations
from explore.comparison.methods.elimination import Linear
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
    capabilities: ClassVar[Capability] = Capability.PEER | Capability.FOLLOWS_ANGLES

    def solve(self, task: Task) -> Motion:
        """Solve design by design; a design that fails keeps its signals before the crank angle of the failure.

        Evaluations are those of the residual, including finite differences.
        """
        motion, start = Motion.blank(task), initial_guess(task)
        with np.errstate(all="ignore"):
            for i, parameters in enumerate(task.parameters):
                guess, equations = start[i], DesignEquations(task.loop, parameters)
                for j, crank in enumerate(task.crank_angle[i]):
                    guess, info, code, _ = scipy.optimize.fsolve(
                        _gap, guess, (equations, float(crank)), full_output=True, xtol=self.tolerance
                    )
                    motion.evaluations[i] += info["nfev"]
                    if code == _CONVERGED:
                        motion.outcome[i] = _fill(equations, float(crank), guess, motion.signals[:, i, j])
                    else:
                        is_finite = np.isfinite(parameters).all()
                        motion.outcome[i] = Outcome.NOT_CONVERGED if is_finite else Outcome.NOT_FINITE
                    if motion.outcome[i] != Outcome.OK:
                        break
        return motion


def _gap(unknowns: FloatArray, equations: DesignEquations, crank: float) -> list[float]:
    return [part for number in equations.about(crank, unknowns)[0].gap for part in (number.real, number.imag)]


def _fill(equations: DesignEquations, crank: float, unknowns: FloatArray, signals: FloatArray) -> Outcome:
    """Fill the signals at one crank angle, shape (m level,), from linear systems for velocities and accelerations."""
    (about, given), m = equations.about(crank, unknowns), len(unknowns)
    jacobian = _real(about.columns).T
    signals[:m] = unknowns
    try:
        if len(signals) > m:
            signals[m : 2 * m] = np.linalg.solve(jacobian, _real([about.rate_terms(given)])[0])
        if len(signals) > 2 * m:
            terms = about.acceleration_terms(signals[m : 2 * m], given)
            signals[2 * m :] = np.linalg.solve(jacobian, _real([terms])[0])
    except np.linalg.LinAlgError:
        return Outcome.RAISED
    return Outcome.OK if np.isfinite(signals).all() else Outcome.NOT_FINITE


def _real(columns: Linear) -> FloatArray:
    """The rows of both components of complex columns."""
    return np.ascontiguousarray(np.array(columns, dtype=complex)).view(float)
