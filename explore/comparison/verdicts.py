"""Verdicts on the motion of a method, from its errors against the exact motion and the outcome that it reports."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.closed_form import geometric_outcome
from explore.comparison.methods.contract import Motion, Outcome, Task
from explore.comparison.methods.elimination import solve
from explore.model.quantities import FloatArray

#: Ratio of the distances to its own and to the nearest assembly from which on a motion is in another one.
_BRANCH_FACTOR = 10.0

#: Distance up to which rounding does not tell two assemblies apart: the root of that of doubles.
_SAME = 1e-8


class Verdict(IntEnum):
    """Verdict on the motion of a design, the worst last."""

    ACCURATE = 0
    REJECTED = 1
    REPORTED = 2
    RAISED = 3
    INACCURATE = 4
    UNREPORTED_NAN = 5
    FALSE_SUCCESS = 6
    WRONG_BRANCH = 7

    @property
    def label(self) -> str:
        """Words for tables and charts."""
        return _LABELS[self]


_LABELS = {
    Verdict.ACCURATE: "accurate",
    Verdict.REJECTED: "correctly rejected",
    Verdict.REPORTED: "reported failure",
    Verdict.RAISED: "raised",
    Verdict.INACCURATE: "inaccurate",
    Verdict.UNREPORTED_NAN: "unreported NaN",
    Verdict.FALSE_SUCCESS: "false success",
    Verdict.WRONG_BRANCH: "wrong branch",
}
#: Verdicts on a wrong motion that the method reports as OK.
SILENTLY_WRONG = (Verdict.UNREPORTED_NAN, Verdict.FALSE_SUCCESS, Verdict.WRONG_BRANCH)
#: Largest rate of an exact motion that is the rounding of 0, in the norm of positions.
_NOTHING = 1e-40


@dataclass(frozen=True)
class Judgement:
    """Verdict and errors of every design.

    The errors over the crank angles, (level, n), of positions (angles in rad, lengths over the longest link),
    velocities and accelerations (relative to the largest absolute value of the signal in the exact motion, or as
    positions where it is always 0), are the largest of all unknowns; NaN without exact motion.
    """

    verdict: npt.NDArray[np.int8]
    max_error: FloatArray
    rms_error: FloatArray


def judge(task: Task, motion: Motion, exact: FloatArray, goal: float) -> Judgement:
    """Judge a motion by its errors against the exact one, NaN for designs without one, and its reported outcomes.

    The goal is the largest error of an accurate motion, in the norms of `Judgement`.
    """
    errors = signal_errors(task, motion.signals, exact)
    levels = errors.reshape(task.level, task.loop.count, *errors.shape[1:])
    max_error, rms_error = levels.max(axis=(1, 3)), np.sqrt((levels**2).mean(axis=3)).max(axis=1)
    verdict = np.full(len(task), Verdict.ACCURATE, dtype=np.int8)
    verdict[~(max_error.max(axis=0) <= goal)] = Verdict.INACCURATE
    verdict[(verdict == Verdict.INACCURATE) & _in_another_assembly(task, motion, errors)] = Verdict.WRONG_BRANCH
    verdict[~np.isfinite(motion.signals).all(axis=(0, 2))] = Verdict.UNREPORTED_NAN
    reported_ok = motion.outcome == Outcome.OK
    verdict[~reported_ok] = Verdict.REPORTED
    possible = geometric_outcome(task) == Outcome.OK
    verdict[~possible] = np.where(reported_ok[~possible], Verdict.FALSE_SUCCESS, Verdict.REJECTED)
    verdict[motion.outcome == Outcome.RAISED] = Verdict.RAISED
    return Judgement(verdict, max_error, rms_error)


def signal_errors(task: Task, signals: FloatArray, exact: FloatArray) -> FloatArray:
    """Absolute errors of all rows of a motion, shape (m level, n, t), in the norms of `Judgement`."""
    m, angles = task.loop.count, task.loop.n_angles
    difference = signals - exact[: len(signals)]
    difference[:angles] = np.remainder(difference[:angles] + np.pi, 2.0 * np.pi) - np.pi
    difference[angles:m] /= task.size[:, None]
    peak = np.abs(exact[m : len(signals)]).max(axis=-1, keepdims=True)
    scale = np.tile(np.stack(task.loop.scales(task.columns)), (len(peak) // m, 1))[:, :, None]
    difference[m:] /= np.where(peak <= _NOTHING * scale, scale, peak)
    return np.abs(difference)


def _in_another_assembly(task: Task, motion: Motion, errors: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether some position, (n,), is much nearer to a solution of the loops than to the exact one: by Newton's step.

    A step from a position beside the exact one leads to that, so it is as long as the error.
    """
    m, loop = task.loop.count, task.loop
    with np.errstate(all="ignore"):
        about = loop.about(task.upright, task.crank_angle, motion.signals[:m])
        step = np.abs(np.stack(solve(about.columns, about.gap)[0]))
        step[loop.n_angles :] /= task.size[:, None]
        return np.asarray((errors[:m].max(axis=0) > _BRANCH_FACTOR * np.maximum(step.max(axis=0), _SAME)).any(axis=-1))
