"""A bundle method in a trust region, for objectives and margins with kinks.

Each step is the best one that the quadratic pieces of the samples so far allow; samples at its ends tell new pieces.
"""

from collections.abc import Callable

import numpy as np

from explore.analysis.refining.pieces import OBJECTIVE, Pieces, best_step, pieces_at
from explore.model.quantities import FloatArray

#: Function from positions, shape (n, d), to values to minimise, (n,), and margins, (n, k); NaN where undefined.
Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
#: Largest change of a coordinate in the first step.
_FIRST = 0.01
#: Largest change of a coordinate in any step.
_LARGEST = 0.1
#: Largest change of a coordinate below which the search ends.
_SMALLEST = 1e-9
#: Change of the objective that is rounding, relative.
_ROUNDING = 1e-14
#: Number of steps after which it ends.
_MOST_STEPS = 200
#: Distance of samples from the place that they tell of, of the radius.
_SPREAD = 0.1
#: Step of the differences of a sample, of the radius.
_DIFFERENCE = 0.005
#: Number of samples at the end of a step.
_AT_END = 2
#: Number of samples kept, for each coordinate and one more.
_KEPT = 3
#: Parts of a step that are tried: a little less than all, where that breaks a constraint by rounding.
_PARTS = np.array([1.0, 0.999, 0.99, 0.9, 0.5, 0.1])


def descend(evaluate: Evaluate, position: FloatArray) -> FloatArray:
    """The best position of a search from a feasible one; each coordinate is 0 … 1."""
    search = _Search(evaluate, position)
    for _ in range(_MOST_STEPS):
        search.step()
        if search.radius < _SMALLEST:
            break
    return search.position


class _Search:
    """The best position so far, the pieces about it, and the radius within which they are trusted."""

    def __init__(self, evaluate: Evaluate, position: FloatArray) -> None:
        self._evaluate, self._random = evaluate, np.random.default_rng(0)
        self.position, self.radius = position, _FIRST
        self._now = self._functions(position[None])[0]
        self._pieces = self._samples(np.tile(position, (len(position) + 1, 1)))

    def _functions(self, positions: FloatArray) -> FloatArray:
        """The objective and the margins, (n, 1 + k)."""
        return np.column_stack(self._evaluate(np.clip(positions, 0.0, 1.0)))

    def _samples(self, places: FloatArray) -> Pieces:
        """The pieces beside places."""
        places = np.clip(places + self._random.uniform(-1, 1, places.shape) * self.radius * _SPREAD, 0.0, 1.0)
        return pieces_at(self._functions, places, self.radius * _DIFFERENCE)

    def step(self) -> None:
        """Try a step; adapt the radius to how much of what the pieces promise it gains; sample at both of its ends."""
        step, promised = best_step(self._pieces, self.position, self._now, self.radius)
        ends = np.clip(self.position + _PARTS[:, None] * step, 0.0, 1.0)
        found = self._functions(ends)
        is_better = (found[:, 1:] >= 0.0).all(axis=1) & (found[:, OBJECTIVE] < self._now[OBJECTIVE])
        before = self._now[OBJECTIVE]
        if is_better.any():
            best = np.flatnonzero(is_better)[found[is_better, OBJECTIVE].argmin()]
            self.position, self._now = ends[best], found[best]
        gained = before - self._now[OBJECTIVE]
        if gained <= 0.25 * abs(promised):
            self.radius *= 0.1 if abs(promised) <= _ROUNDING * abs(before) else 0.5
        elif gained > 0.5 * promised and np.abs(step).max() > 0.9 * self.radius:
            self.radius = min(2.0 * self.radius, _LARGEST)
        new = self._samples(np.concatenate([self.position[None], np.tile(ends[0], (_AT_END, 1))]))
        pieces = new.joined(self._pieces)
        near = np.flatnonzero(np.abs(pieces.places - self.position).max(axis=1) < 2.0 * self.radius)
        self._pieces = pieces.chosen(near[: _KEPT * (len(self.position) + 1) * len(self._now)])
