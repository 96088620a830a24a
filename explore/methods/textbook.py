"""The textbook solution: law of cosines and arccos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.methods import vector_loop
from explore.methods.contract import Capability, Motion, Outcome, Task


@dataclass(frozen=True)
class TextbookArccos:
    """Two triangles that share the diagonal from crank pin to rocker pivot.

    The first of the two families of position analysis in Constans, Dyer and Sangelkar, A New Method for Teaching the
    Fourbar Linkage, ASEE Annual Conference 2019, paper 24648, page 1. Near the change point the argument of arccos
    is close to 1, where arccos loses half the digits.
    """

    name: ClassVar[str] = "textbook"
    summary: ClassVar[str] = "law of cosines with arccos"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently; NOT_FINITE where the argument of arccos leaves [-1, 1]."""
        motion = Motion.blank(task)
        lengths, branch, crank = task.lengths.T[:, :, None], task.branch[:, None], task.crank_angle
        r1, r2, r3, r4 = lengths
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            square = r1**2 + r4**2 - 2.0 * r1 * r4 * np.cos(crank)
            diagonal, direction = np.sqrt(square), np.arctan2(-r1 * np.sin(crank), r4 - r1 * np.cos(crank))
            at_pin = np.arccos((r2**2 + square - r3**2) / (2.0 * r2 * diagonal))
            at_pivot = np.arccos((r3**2 + square - r2**2) / (2.0 * r3 * diagonal))
            coupler, rocker = direction + branch * at_pin, direction + np.pi - branch * at_pivot
            vector_loop.fill_signals(motion.signals, lengths, crank, coupler, rocker)
        motion.evaluations[:] = crank.shape[1]
        motion.outcome[~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion
