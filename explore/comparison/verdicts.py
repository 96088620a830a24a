"""What a method's motion is worth, judged against the exact one and not by what the method says of itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Level, Motion, Outcome, Task
from explore.methods.geometry import geometric_outcome
from explore.vocabulary import FloatArray

#: A motion is on the other branch where it is this many times closer to it than to its own.
_CLOSER = 10.0


class Verdict(IntEnum):
    """What became of a design, the worst last."""

    RIGHT = 0
    REFUSED = 1
    NOTICED = 2
    RAISED = 3
    INACCURATE = 4
    SILENT_NAN = 5
    FALSE_OK = 6
    WRONG_BRANCH = 7

    @property
    def label(self) -> str:
        """The words used in tables and charts."""
        return _LABELS[self]


_LABELS = {
    Verdict.RIGHT: "right",
    Verdict.REFUSED: "rightly refused",
    Verdict.NOTICED: "gave up and said so",
    Verdict.RAISED: "raised",
    Verdict.INACCURATE: "inaccurate",
    Verdict.SILENT_NAN: "silent NaN",
    Verdict.FALSE_OK: "ok where none is",
    Verdict.WRONG_BRANCH: "wrong branch",
}
#: Verdicts on an answer that is not the motion asked for, and does not say so.
SILENTLY_WRONG = (Verdict.SILENT_NAN, Verdict.FALSE_OK, Verdict.WRONG_BRANCH)


@dataclass(frozen=True)
class Judgement:
    """Verdicts and errors of a motion.

    Attributes
    ----------
    verdict : (n,) array
        A `Verdict` for each design.
    largest, rms : (level, n) arrays
        Errors of the angles (rad), the velocities and the accelerations (each relative to its signal's largest size in
        the exact motion), the worse of coupler and rocker; NaN where there is nothing to compare.
    """

    verdict: npt.NDArray[np.int8]
    largest: FloatArray
    rms: FloatArray


def judge(task: Task, motion: Motion, exact: FloatArray, goal: float) -> Judgement:
    """Judge a motion.

    Parameters
    ----------
    exact : (6, n, t) array
        The exact motion; NaN for designs that have none.
    goal
        A right motion has no error above it, in the norms of `Judgement`.
    """
    largest, rms = _errors(motion.signals, exact[: len(motion.signals)])
    verdict = np.full(len(task), Verdict.RIGHT, dtype=np.int8)
    verdict[~(largest.max(axis=0) <= goal)] = Verdict.INACCURATE
    verdict[(verdict == Verdict.INACCURATE) & _on_the_other_branch(task, motion, exact)] = Verdict.WRONG_BRANCH
    verdict[~np.isfinite(motion.signals).all(axis=(0, 2))] = Verdict.SILENT_NAN
    said_ok = motion.outcome == Outcome.OK
    verdict[~said_ok] = Verdict.NOTICED
    possible = geometric_outcome(task.lengths) == Outcome.OK
    verdict[~possible] = np.where(said_ok[~possible], Verdict.FALSE_OK, Verdict.REFUSED)
    verdict[motion.outcome == Outcome.RAISED] = Verdict.RAISED
    return Judgement(verdict, largest, rms)


def _errors(found: FloatArray, exact: FloatArray) -> tuple[FloatArray, FloatArray]:
    difference = found - exact
    difference[:2] = _wrapped(difference[:2])
    size = np.abs(exact[2:]).max(axis=-1, keepdims=True)
    difference[2:] /= np.where(size > 0.0, size, np.nan)
    pairs = np.abs(difference).reshape(len(found) // 2, 2, *found.shape[1:])
    return pairs.max(axis=(1, 3)), np.sqrt((pairs**2).mean(axis=3)).max(axis=1)


def _on_the_other_branch(task: Task, motion: Motion, exact: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether some angle is that of the mirrored branch rather than the right one, shape (n,)."""
    mirrored = Task(task.lengths, -task.branch, task.crank_angle, Level.POSITIONS)
    with np.errstate(all="ignore"):
        other = ClosedForm().solve(mirrored).signals
    away = np.abs(_wrapped(motion.signals[:2] - exact[:2])).max(axis=0)
    across = np.abs(_wrapped(motion.signals[:2] - other)).max(axis=0)
    return np.asarray((away > _CLOSER * across).any(axis=-1))


def _wrapped(angle: FloatArray) -> FloatArray:
    """An angle between -pi and pi."""
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)
