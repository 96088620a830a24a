"""Improvement of many linkages in stages: few steps for all, more for the best of a group, many for the best of all."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.columns import Columns
from explore.synthesis.paths.fitting import fit
from explore.synthesis.paths.ordering import order_angles
from explore.synthesis.paths.problems import ORDERED, UNORDERED, Task

#: Steps of each stage of a group, and the share of its linkages that goes on.
_STAGES = ((8, 0.15), (30, 0.15), (400, 1.0))
#: Number of linkages that are improved together.
_GROUP = 512
#: Least number of linkages of a group that goes on.
_LEAST = 4
#: Largest number of steps of the last stage.
_MOST_STEPS = 4000
#: Number of linkages of the last stage beside the ones asked for.
_MORE = 14
#: Relative gain that counts as little before the last stage.
_COARSE = 1e-7
#: Relative gain that counts as little in the last stage.
_FINE = 1e-10
#: Samples of a turn, and between two of them, when the angles of all starts are chosen.
_OF_ALL = (64, 8)
#: Samples of a turn, and between two of them, when the angles of the best of a group are chosen anew.
_OF_GROUP = (128, 4)
#: Samples of a turn, and between two of them, when the angles of the best of all are chosen anew.
_OF_BEST = (256, 4)
#: Number of times that the angles of the best of all are chosen anew.
_REPETITIONS = 3
#: Relative difference of errors up to which linkages are the same.
_SAME = 1e-4


@dataclass(frozen=True)
class Candidates(Columns):
    """Linkages under improvement.

    Branches and senses, 1.0 or -1.0; whether the ground, or the crank, is the longer of both; numbers, (n, 10); angles
    of the crank from the frame, rad, (n, k); weighted sums of squares.
    """

    branches: FloatArray
    senses: FloatArray
    are_grounds_longer: np.ndarray
    numbers: FloatArray
    angles: FloatArray
    errors: FloatArray

    def fit(self, task: Task, most_steps: int, tolerance: float) -> Candidates:
        """Improve all in place, and return them."""
        fit(
            task, self.branches, self.senses, self.are_grounds_longer, self.numbers, self.angles, most_steps, tolerance,
            self.errors,
        )  # fmt: skip
        return self

    def ordered(self, task: Task, n_samples: int, stride: int) -> Candidates:
        """The same linkages with the best angles among samples of a turn."""
        other = self.rows(np.arange(len(self.errors)))
        order_angles(
            task, other.branches, other.are_grounds_longer, other.numbers, n_samples, stride, other.senses,
            other.angles, other.errors,
        )  # fmt: skip
        return other

    def best(self, count: int) -> Candidates:
        """The best, in order."""
        return self.rows(np.argsort(self.errors, kind="stable")[:count])


def improve(task: Task, candidates: Candidates, count: int) -> Candidates:
    """The distinct best of all after improvement, about `count`, best first."""
    n = len(candidates.errors)
    groups = [candidates.rows(np.arange(first, min(first + _GROUP, n))) for first in range(0, n, _GROUP)]
    with ThreadPoolExecutor(os.cpu_count()) as threads:

        def each(improved: Callable[[Candidates], Candidates], of: Candidates) -> Candidates:
            of = of.best(count + _MORE)
            singles = (of.rows(np.array([k])) for k in range(len(of.errors)))
            return _distinct(Candidates.joined(threads.map(improved, singles)))

        best = _distinct(Candidates.joined(threads.map(lambda group: _improve_group(task, group), groups)))
        if task.mode in (ORDERED, UNORDERED):
            for _ in range(_REPETITIONS):
                best = each(lambda one: _with_angles_anew(task, one, *_OF_BEST).fit(task, _STAGES[-1][0], _FINE), best)
        return each(lambda one: one.fit(task, _MOST_STEPS, _FINE), best)


def _improve_group(task: Task, group: Candidates) -> Candidates:
    if task.mode in (ORDERED, UNORDERED):
        group = group.ordered(task, *_OF_ALL)
    for most_steps, share in _STAGES:
        is_last = most_steps == _STAGES[-1][0]
        if is_last and task.mode in (ORDERED, UNORDERED):
            group = _with_angles_anew(task, group, *_OF_GROUP)
        group = group.fit(task, most_steps, _FINE if is_last else _COARSE)
        group = group.best(max(_LEAST, int(len(group.errors) * share)))
    return group


def _with_angles_anew(task: Task, group: Candidates, n_samples: int, stride: int) -> Candidates:
    """Linkages with their angles, and again with the best among samples of a turn."""
    return Candidates.joined([group, group.ordered(task, n_samples, stride)])


def _distinct(candidates: Candidates) -> Candidates:
    """The linkages with different errors, best first."""
    kept: list[int] = []
    for k in np.argsort(candidates.errors, kind="stable").tolist():
        error = candidates.errors[k]
        if not kept or error - candidates.errors[kept[-1]] > _SAME * error:
            kept.append(k)
    return candidates.rows(np.array(kept))
