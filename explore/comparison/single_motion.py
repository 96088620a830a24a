"""The motion of one crank-rocker by another method than the closed form, with its errors measured."""

from __future__ import annotations

import warnings

import numpy as np

from explore.comparison.verdicts import Verdict, judge
from explore.errors import RequestError
from explore.mechanisms import four_bar
from explore.methods.closed_form import KERNEL_ROWS, ClosedForm
from explore.methods.contract import Capability, Level, Method, Outcome, Task, method_label
from explore.model.quantities import FloatArray

#: The mechanism whose motion the methods solve.
SOLVED_MECHANISM = "crank-rocker"
_LINKS = ("crank", "coupler", "rocker", "ground")


def signals_by_method(
    method: Method, inputs: dict[str, float], crank_angle: FloatArray, tolerance: float
) -> FloatArray:
    """Rows of the kernel at crank angles in rad by another method, shape (s, t), with a warning if it is inaccurate."""
    if Capability.ANY_ANGLE not in method.capabilities and (np.diff(crank_angle) <= 0.0).any():
        raise RequestError(f"{method_label(method)} proceeds from one crank angle to the next; give ascending angles")
    lengths = np.array([[inputs[name] for name in _LINKS]])
    task = Task(lengths, np.array([inputs["branch"]]), crank_angle[None, :], Level.ACCELERATIONS)
    motion = method.solve(task)
    judgement = judge(task, motion, ClosedForm().solve(task).signals, tolerance)
    verdict = Verdict(int(judgement.verdict[0]))
    if verdict is not Verdict.ACCURATE:
        _warn(method_label(method), verdict, Outcome(int(motion.outcome[0])), judgement.max_error[:, 0], tolerance)
    rows = np.empty((four_bar.SIGNAL_ROWS, len(crank_angle)))
    rows[KERNEL_ROWS] = motion.signals[:, 0]
    difference = motion.signals[0, 0] - motion.signals[1, 0]
    rows[four_bar.TRANSMISSION_ANGLE] = np.abs(np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi)
    return rows


def _warn(name: str, verdict: Verdict, outcome: Outcome, errors: FloatArray, tolerance: float) -> None:
    if outcome is not Outcome.OK:
        problem = f"failed for this design: {outcome.sentence}"
    else:
        problem = "is on the wrong branch" if verdict is Verdict.WRONG_BRANCH else f"misses the tolerance {tolerance:g}"
        angle, velocity, acceleration = errors
        problem += f" for this design: its errors against the closed form are {angle:.1e} rad, {velocity:.1e} of the"
        problem += f" largest velocity and {acceleration:.1e} of the largest acceleration"
    warnings.warn(f"{name} {problem}; the default method, the closed form, is exact", RuntimeWarning, stacklevel=5)
