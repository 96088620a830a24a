"""Where solutions go that do not simply arrive: Cauchy's endgame.

Near the target a solution is a power series in s^(1/w), where s = 1 - t and w is its winding number: led around s = 0
on a circle, it returns after w turns. A turn leads to the next one of the w that meet, so each is led around once.
Numbers that go to infinity have a first term of negative power. The argument of a number, over all turns, grows by
2 pi times w times its power, an integer, and the mean over the turns is its limit (A. P. Morgan, A. J. Sommese, C. W.
Wampler, Computing singular solutions to nonlinear analytic systems, Numer. Math. 58 (1991) 669-684). What is infinite,
zero or neither is thus counted and not judged by its size. Over the one of (1, x, a, y, b) that grows fastest, and over
that of the hats, all limits are finite; two circles must agree on them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np
import numpy.typing as npt

from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.classes import cognates, combined, compressed, members
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
_LEAST_RADIUS = 1e-8
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
#: Largest difference of each unknown of a solution from where another one arrives, relative to the unknown.
_BACK = 1e-5
#: Largest difference of each unknown of a solution from where another one arrives, relative to the largest unknown.
_BACK_IN_GROUP = 1e-8
#: Number of solutions of one task of a thread.
_CHUNK = 4

Bools = npt.NDArray[np.bool_]
#: Function that follows solutions from one set of parameters to another.
Follow = Callable[[ComplexArray, ComplexArray, ComplexArray], tuple[ComplexArray, Bools]]


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
    before: dict[int, _Circle] = {}
    todo, places = np.arange(n), solutions.copy()
    for _ in range(math.ceil(math.log(_LEAST_RADIUS) / math.log(shrinkage))):
        circles: dict[int, _Circle] = {}
        for rows, samples in _cycles(places[todo], target, rates):
            own, found = todo[rows], _Circle.around(samples)
            circles[own[0]] = found
            if own[0] in before and found.agrees(before[own[0]]):
                fates[own], windings[own], limits[own] = found.fate, found.winding, found.limit
        before = circles
        smaller = shrinkage * rates
        todo = todo[fates[todo] == LOST]
        if not len(todo):
            break
        places[todo], arrived = _lead(follow, places[todo], target - rates, rates - smaller)
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
    def around(cls, samples: ComplexArray) -> _Circle:
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
        return cls(
            len(samples) // N_SIDES, unknowns, lengths, np.concatenate(means), limit, float(max(left, default=0.0))
        )

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


def _cycles(
    solutions: ComplexArray, target: ComplexArray, rates: ComplexArray
) -> Iterator[tuple[npt.NDArray[np.intp], ComplexArray]]:
    """Rows of solutions that turn into one another around the target and back, and the samples on their way.

    Led around once, a solution arrives at itself or another one, or at a member of its class, whose turn is known too.
    """
    samples, has_arrived = _lead(_turns, solutions, target, rates)
    rows, turns = np.flatnonzero(has_arrived), members(samples[has_arrived])
    after = _following(turns[:, 0], samples[has_arrived, -1])
    is_known = np.zeros(len(rows), dtype=bool)
    for first in range(len(rows)):
        way, there = [first], after[first]
        while 0 <= there != first and len(way) < _MOST_TURNS:
            way.append(there)
            member, row = divmod(there, len(rows))
            next_member, next_row = divmod(after[row], len(rows))
            there = combined(member, next_member) * len(rows) + next_row if after[row] >= 0 else -1
        own = np.array(way) % len(rows)
        if there == first and not is_known[own].any():
            is_known[own] = True
            yield rows[own], np.concatenate(turns[way, :N_SIDES])


def _lead(way: Follow, solutions: ComplexArray, start: ComplexArray, rates: ComplexArray) -> tuple[ComplexArray, Bools]:
    """Lead solutions on, or where that fails one of their cognates, which lie elsewhere."""
    found, arrived = way(solutions, start, rates)
    for k, others in enumerate(cognates(solutions)[1:], start=1):
        rest = np.flatnonzero(~arrived)
        there, arrived[rest] = way(others[rest], start, rates)
        found[rest] = cognates(there)[3 - k]
    return found, arrived


@np.errstate(all="ignore")  # members of some solutions are not finite
def _following(starts: ComplexArray, ends: ComplexArray) -> npt.NDArray[np.intp]:
    """The start where each end is; -1 where it is at none, or two paths have become one there."""
    from scipy.spatial import cKDTree

    table = compressed(starts)
    usable = np.flatnonzero(np.isfinite(table).all(axis=1))
    if not len(usable):
        return np.full(len(ends), -1)
    near = usable[cKDTree(table[usable]).query(compressed(ends), 2)[1]]
    sizes, gaps = np.abs(starts[near]), np.abs(ends[:, None] - starts[near])
    largest = np.concatenate([sizes[..., k::2].max(axis=-1, keepdims=True) for k in (0, 1)], axis=-1)
    wanted = _BACK * sizes + _BACK_IN_GROUP * np.tile(largest, N_UNKNOWNS // 2)
    is_there = np.asarray((gaps < wanted).all(axis=-1))
    return np.where(is_there[:, 0] & ~is_there[:, 1], near[:, 0], -1)


def _turns(solutions: ComplexArray, target: ComplexArray, rates: ComplexArray) -> tuple[ComplexArray, Bools]:
    """Samples of one turn around the target, and whether it was completed, on all cores; see `tracking.circle`."""
    solutions = np.ascontiguousarray(solutions)
    samples = np.zeros((len(solutions), N_SIDES + 1, N_UNKNOWNS), dtype=np.complex128)
    arrived = np.zeros(len(solutions), dtype=bool)

    def run(first: int) -> None:
        part = slice(first, first + _CHUNK)
        circle(solutions[part], target, rates, _WANTED, samples[part], arrived[part])

    with ThreadPoolExecutor(cpu_count()) as pool:
        list(pool.map(run, range(0, len(solutions), _CHUNK)))
    return samples, arrived
