"""Where solutions go that do not simply arrive: Cauchy's endgame.

Near the target a solution is a power series in s^(1/w), where s = 1 - t and w is its winding number: led around s = 0
on a circle, it returns after w turns. Numbers that go to infinity have a first term of negative power. The argument of
a number, over all turns, grows by 2 pi times w times its power, an integer, and the mean over the turns is its limit
(A. P. Morgan, A. J. Sommese, C. W. Wampler, Computing singular solutions to nonlinear analytic systems, Numer. Math.
58 (1991) 669-684). What is infinite, zero or neither is thus counted and not judged by its size. Over the one of
(1, x, a, y, b) that grows fastest, and over that of the hats, all limits are finite; two circles must agree on them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np
import numpy.typing as npt

from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.equations import N_UNKNOWNS
from explore.synthesis.nine_points.tracking import N_SIDES, circle

#: Fate of a solution that goes to a linkage.
REGULAR = 0
#: Fate of a solution that goes to a linkage where several meet.
SINGULAR = 1
#: Fate of a solution that goes to a linkage with a link that is a point.
DEGENERATE = 2
#: Fate of a solution that goes to infinity.
INFINITE = 3
#: Fate of a solution that was lost.
LOST = 4
#: Ratios of the radii of one circle and the next, at the first and at a second attempt.
SHRINKAGES = (0.3, 0.55)
#: Least share of the first radius.
_LEAST_RADIUS = 1e-5
#: Largest number of turns.
_MOST_TURNS = 8
#: Error of the predictor.
_WANTED = 1e-6
#: Largest relative difference of the limits by two circles.
_AGREED = 1e-6
#: Largest relative difference of the limits by two circles at infinity, where digits are lost.
_AGREED_AT_INFINITY = 1e-4
#: A length counts as zero below this fraction of its value on the circle.
_ZERO = 1e-3
#: Largest reciprocal of an infinite unknown: 1e-13 were met, and 1e-6 at the largest finite solutions.
_ZERO_AT_INFINITY = 1e-9
#: Number of solutions of one task of a thread.
_CHUNK = 4
#: Function that follows solutions from one set of parameters to another.
Follow = Callable[[ComplexArray, ComplexArray, ComplexArray], tuple[ComplexArray, npt.NDArray[np.bool_]]]


@dataclass(frozen=True)
class Limits:
    """Where solutions go.

    Fates of this module, (n,), of which `REGULAR` says only that the limit is a linkage and w is 1; winding numbers, 0
    where lost, (n,); limits where all unknowns stay finite, else NaN, (n, 8).
    """

    fates: npt.NDArray[np.int64]
    windings: npt.NDArray[np.int64]
    solutions: ComplexArray


def find_limits(
    solutions: ComplexArray, target: ComplexArray, rates: ComplexArray, follow: Follow, shrinkage: float
) -> Limits:
    """Limits of solutions of the problem `target - rates` as its parameters go straight to `target`.

    The radii of two circles in turn have the ratio `shrinkage`.
    """
    n = len(solutions)
    fates, windings = np.full(n, LOST), np.zeros(n, dtype=np.int64)
    limits = np.full((n, N_UNKNOWNS), np.nan, dtype=np.complex128)
    before: list[_Circle | None] = [None] * n
    todo, places = np.arange(n), solutions.copy()
    for _ in range(math.ceil(math.log(_LEAST_RADIUS) / math.log(shrinkage))):
        samples, turns = _circles(places[todo], target, rates)
        for row, sampled, w in zip(todo, samples, turns, strict=True):
            last, found = before[row], _Circle.around(sampled[: w * N_SIDES], int(w)) if w > 0 else None
            before[row] = found
            if found is not None and last is not None and found.agrees(last):
                fates[row], windings[row], limits[row] = found.fate, w, found.limit
        smaller = shrinkage * rates
        todo = todo[fates[todo] == LOST]
        if not len(todo):
            break
        places[todo], arrived = follow(places[todo], target - rates, rates - smaller)
        todo, rates = todo[arrived], smaller
    return Limits(fates, windings, limits)


@dataclass(frozen=True)
class _Circle:
    """The limit of a solution as one circle tells it.

    The turns until the solution returned, its `winding`; leading powers of s, times that, of the unknowns and of the
    links' vectors; the limit of (1, x, a, y, b) over the number that grows fastest, and of the hats alike; that of the
    unknowns, NaN where one is infinite. `left` is the most that is left of a limit that the powers say is zero: of a
    link's vector, over its size on the circle, and of the reciprocal of an unknown.
    """

    winding: int
    unknowns: npt.NDArray[np.int64]
    lengths: npt.NDArray[np.int64]
    homogeneous: ComplexArray
    limit: ComplexArray
    left: float

    @classmethod
    @np.errstate(all="ignore")  # what is not finite agrees with nothing
    def around(cls, samples: ComplexArray, winding: int) -> _Circle:
        """From solutions along all turns, shape (turns times `N_SIDES`, 8)."""
        x, a, y, b = (samples[:, 2 * k : 2 * k + 2] for k in range(4))
        vectors = np.hstack([x, y, x - y, x - a, y - b, a - b])
        unknowns, lengths = _powers(samples), _powers(vectors)
        means, left = [], []
        for o in (0, 1):
            group = np.hstack([np.ones((len(samples), 1)), samples[:, o::2]])
            fastest = int(np.argmin(np.concatenate([[0], unknowns[o::2]])))
            means.append((group / group[:, [fastest]]).mean(axis=0))
            left.append(abs(means[-1][0]) if fastest else 0.0)
        is_finite = bool((unknowns >= 0).all())
        if is_finite:
            shares = np.abs(vectors.mean(axis=0)) / np.abs(vectors).max(axis=0)
            left = list(shares[lengths > 0])
        limit = samples.mean(axis=0) if is_finite else np.full(N_UNKNOWNS, np.nan, dtype=np.complex128)
        return cls(winding, unknowns, lengths, np.concatenate(means), limit, float(max(left, default=0.0)))

    @property
    def fate(self) -> int:
        """The fate of the solution."""
        if (self.unknowns < 0).any():
            return INFINITE
        if (self.lengths > 0).any():
            return DEGENERATE
        return REGULAR if self.winding == 1 else SINGULAR

    def agrees(self, other: _Circle) -> bool:
        """Whether both agree on the finite unknowns, the vanishing ones, and the limit."""
        if self.winding != other.winding or not self.left < (_ZERO_AT_INFINITY if self.fate == INFINITE else _ZERO):
            return False
        if not (np.array_equal(self.unknowns, other.unknowns) and np.array_equal(self.lengths, other.lengths)):
            return False
        agreed = _AGREED_AT_INFINITY if self.fate == INFINITE else _AGREED
        return bool(np.abs(self.homogeneous - other.homogeneous).max() < agreed)


def _powers(samples: ComplexArray) -> npt.NDArray[np.int64]:
    """How often each number goes around zero along all turns: its leading power of s, times w."""
    steps = np.nan_to_num(np.roll(samples, -1, axis=0) / samples)
    return np.asarray(np.rint(np.angle(steps).sum(axis=0) / (2.0 * np.pi)), dtype=np.int64)


def _circles(
    solutions: ComplexArray, target: ComplexArray, rates: ComplexArray
) -> tuple[ComplexArray, npt.NDArray[np.int64]]:
    """Samples and turns of circles around the target, on all cores; see `tracking.circle`."""
    solutions = np.ascontiguousarray(solutions)
    samples = np.empty((len(solutions), _MOST_TURNS * N_SIDES, N_UNKNOWNS), dtype=np.complex128)
    turns = np.zeros(len(solutions), dtype=np.int64)

    def run(first: int) -> None:
        part = slice(first, first + _CHUNK)
        circle(solutions[part], target, rates, _WANTED, samples[part], turns[part])

    with ThreadPoolExecutor(cpu_count()) as pool:
        list(pool.map(run, range(0, len(solutions), _CHUNK)))
    return samples, turns
