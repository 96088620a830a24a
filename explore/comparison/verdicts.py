"""Verdicts on the motion of a method, from its errors against the exact motion and the outcome that it reports."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.contract import Motion, Outcome, Task
from explore.comparison.methods.geometry import geometric_outcome
from explore.comparison.methods.vector_loop import UnknownLength
from explore.model.quantities import FloatArray

#: Ratio of the distances to its own and to the other branch from which on a motion is on the other one.
_BRANCH_FACTOR = 10.0


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


@dataclass(frozen=True)
class Judgement:
    """Verdict and errors of every design.

    The errors over the crank angles, (level, n), of positions (angles in rad, lengths over the longest link),
    velocities and accelerations (relative to the largest absolute value of the signal in the exact motion), are the
    larger of both unknowns; NaN without exact motion.
    """

    verdict: npt.NDArray[np.int8]
    max_error: FloatArray
    rms_error: FloatArray


def judge(task: Task, motion: Motion, exact: FloatArray, goal: float) -> Judgement:
    """Judge a motion by its errors against the exact one, NaN for designs without one, and its reported outcomes.

    The goal is the largest error of an accurate motion, in the norms of `Judgement`.
    """
    errors = signal_errors(task, motion.signals, exact)
    pairs = errors.reshape(len(errors) // 2, 2, *errors.shape[1:])
    max_error, rms_error = pairs.max(axis=(1, 3)), np.sqrt((pairs**2).mean(axis=3)).max(axis=1)
    verdict = np.full(len(task), Verdict.ACCURATE, dtype=np.int8)
    verdict[~(max_error.max(axis=0) <= goal)] = Verdict.INACCURATE
    verdict[(verdict == Verdict.INACCURATE) & _on_the_other_branch(task, motion, exact)] = Verdict.WRONG_BRANCH
    verdict[~np.isfinite(motion.signals).all(axis=(0, 2))] = Verdict.UNREPORTED_NAN
    reported_ok = motion.outcome == Outcome.OK
    verdict[~reported_ok] = Verdict.REPORTED
    possible = geometric_outcome(task.parameters, task.loop) == Outcome.OK
    verdict[~possible] = np.where(reported_ok[~possible], Verdict.FALSE_SUCCESS, Verdict.REJECTED)
    verdict[motion.outcome == Outcome.RAISED] = Verdict.RAISED
    return Judgement(verdict, max_error, rms_error)


def signal_errors(task: Task, signals: FloatArray, exact: FloatArray) -> FloatArray:
    """Absolute errors of all rows of a motion, shape (2 level, n, t), in the norms of `Judgement`."""
    difference = signals - exact[: len(signals)]
    difference[:2] = _position_difference(task, signals, exact)
    peak = np.abs(exact[2 : len(signals)]).max(axis=-1, keepdims=True)
    difference[2:] /= np.where(peak > 0.0, peak, np.nan)
    return np.abs(difference)


def _on_the_other_branch(task: Task, motion: Motion, exact: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether some position of a motion lies on the other branch, shape (n,)."""
    with np.errstate(all="ignore"):
        other = task.loop.mirror(task.parameters.T[:, :, None], task.crank_angle, exact[0], exact[1])
        own_distance = np.abs(_position_difference(task, motion.signals, exact)).max(axis=0)
        other_distance = np.abs(_position_difference(task, motion.signals, other)).max(axis=0)
        return np.asarray((own_distance > _BRANCH_FACTOR * other_distance).any(axis=-1))


def _position_difference(task: Task, signals: FloatArray, others: FloatArray) -> FloatArray:
    """Differences of both unknowns, shape (2, n, t): angles from -pi to pi, lengths over the longest link."""
    difference = signals[:2] - others[:2]
    if isinstance(task.loop.first, UnknownLength):
        difference[0] /= task.loop.size(task.parameters.T)[:, None]
    else:
        difference[0] = _wrapped(difference[0])
    difference[1] = _wrapped(difference[1])
    return difference


def _wrapped(angle: FloatArray) -> FloatArray:
    """Reduce an angle to the interval from -pi to pi."""
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)
