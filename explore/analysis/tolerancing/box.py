"""The worst case: the extremes of the metrics over the box of the tolerances.

Corners are evaluated, points inside, and points ever closer around the most extreme ones. Of more than twelve
dimensions not all corners are: from the most extreme of 4096 random ones, neighbours lead on. Where a metric rises or
falls along each dimension all over the box, the extremes are corners and exact. An extreme elsewhere is one that the
search found: no proof that there is none beyond.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.status import Status

#: Number of points drawn inside the box.
_N_INSIDE = 2048
#: Number of points of each round around an extreme.
_N_ROUND = 64
#: Number of rounds, each half as wide as the one before.
_N_ROUNDS = 24
#: Number of corners drawn at random where the box has more.
_MOST_CORNERS = 1 << 12
#: Excess over the value at a corner, as a share of the range over the box, up to which the corner is the extreme.
_SAME = 1e-9


@dataclass(frozen=True)
class Extreme:
    """An extreme of a metric over the box.

    It is NaN where a part within the tolerances has no motion, at its deviations then, or where the metric is
    undefined.
    """

    value: float
    deviations: FloatArray
    is_corner: bool


@dataclass(frozen=True)
class WorstCase:
    """The extremes over the box, by metric, and which kinds of parts were found.

    Parts with no motion; parts that miss the error bound; and parts that are not feasible for any reason.
    """

    low: Mapping[str, Extreme]
    high: Mapping[str, Extreme]
    has_unassembled: bool
    has_inexact: bool
    has_infeasible: bool


def find_worst_case(request: TolerancedRequest, nominal: Mapping[str, float], seed: int) -> WorstCase:
    """Search the box for the extremes of all metrics."""
    random = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(1,))))
    d = len(request.tolerances)
    corners, inside = _corners(d, random), random.uniform(-1.0, 1.0, (d, _N_INSIDE))
    search = _Search(request, nominal)
    search.look_at(corners)
    if corners.shape[1] < 2**d:
        for _ in range(d):
            if not search.look_at(search.neighbouring_corners()):
                break
    search.keep_corners()
    search.look_at(np.concatenate([np.zeros((d, 1)), inside], axis=1))
    for k in range(_N_ROUNDS):
        search.look_at(search.next_points(random, 0.5**k))
    return WorstCase(*search.extremes(), search.has_unassembled, search.has_inexact, search.has_infeasible)


def searched_parts(request: TolerancedRequest) -> int:
    """Number of parts that the search evaluates."""
    d, extremes = len(request.tolerances), 2 * len(request.metrics)
    corners = 2**d if 2**d <= _MOST_CORNERS else _MOST_CORNERS + d * d * extremes
    return corners + 1 + _N_INSIDE + _N_ROUNDS * _N_ROUND * extremes


def _corners(d: int, random: np.random.Generator) -> FloatArray:
    """The corners of the unit box, (d, n)."""
    if 2**d <= _MOST_CORNERS:
        return np.stack(np.meshgrid(*[[-1.0, 1.0]] * d, indexing="ij")).reshape(d, -1)
    return random.choice([-1.0, 1.0], (d, _MOST_CORNERS))


class _Search:
    """The most extreme points so far, two for each metric: (place in the unit box, value), and undefined places."""

    def __init__(self, request: TolerancedRequest, nominal: Mapping[str, float]) -> None:
        self._request, self._nominal = request, nominal
        self._widths, self._names = request.widths, request.metrics
        self._at = np.zeros((2, len(self._names), len(self._widths)))
        self._value = np.full((2, len(self._names)), -np.inf)
        self._undefined: dict[str, FloatArray] = {}
        self.has_unassembled = self.has_inexact = self.has_infeasible = False

    def look_at(self, places: FloatArray) -> bool:
        """Evaluate points, (d, n), and take over those that are more extreme; return whether there are any."""
        found = self._request.outcomes(self._nominal, self._widths[:, None] * places)
        self.has_unassembled |= not found.is_assembled.all()
        self.has_inexact |= bool((found.status == Status.TOLERANCE_NOT_MET).any())
        self.has_infeasible |= not found.is_feasible.all()
        before = self._value.copy()
        self._include(places, found.metrics)
        return not np.array_equal(self._value, before)

    def keep_corners(self) -> None:
        """Note that the most extreme points so far are corners."""
        self._corner_at, self._corner_value = self._at.copy(), self._value.copy()

    def neighbouring_corners(self) -> FloatArray:
        """The corners that differ from each extreme in one dimension, (d, n)."""
        flips = 1.0 - 2.0 * np.eye(len(self._widths))
        return np.ascontiguousarray((self._at[:, :, None] * flips).reshape(-1, len(flips)).T)

    def _include(self, places: FloatArray, values: Arrays) -> None:
        """Take over points that are more extreme; row 0 seeks the smallest value by its negative."""
        for m, name in enumerate(self._names):
            column = values[name]
            undefined = np.isnan(column)
            if undefined.any():
                self._undefined.setdefault(name, places[:, int(np.argmax(undefined))])
                if undefined.all():
                    continue
            for side, sign in enumerate((-1.0, 1.0)):
                best = int(np.nanargmax(sign * column))
                if sign * column[best] > self._value[side, m]:
                    self._value[side, m], self._at[side, m] = sign * column[best], places[:, best]

    def next_points(self, random: np.random.Generator, width: float) -> FloatArray:
        """Points around each extreme, (d, n)."""
        steps = random.uniform(-width, width, (*self._at.shape[:2], _N_ROUND, self._at.shape[2]))
        points = np.clip(self._at[:, :, None] + steps, -1.0, 1.0)
        return np.ascontiguousarray(points.reshape(-1, self._at.shape[2]).T)

    def extremes(self) -> tuple[dict[str, Extreme], dict[str, Extreme]]:
        """The smallest and the largest values, by metric."""
        with np.errstate(invalid="ignore"):
            ranges = np.abs(self._value[0] + self._value[1])
        ranges[~np.isfinite(ranges)] = 0.0  # of infinite values, as of a buckling factor without compression
        sides = []
        for side, sign in enumerate((-1.0, 1.0)):
            extremes = {}
            for m, name in enumerate(self._names):
                at, value, is_corner = self._at[side, m], float(self._value[side, m]), False
                corner = float(self._corner_value[side, m])
                if name in self._undefined:
                    at, value = self._undefined[name], np.nan
                elif value == corner or value - corner <= _SAME * ranges[m]:
                    at, value, is_corner = self._corner_at[side, m], corner, True
                extremes[name] = Extreme(sign * value, self._widths * at, is_corner)
            sides.append(extremes)
        return sides[0], sides[1]
