"""Sobol' indices of a function of independent inputs, from points that share coordinates in pairs.

Each scramble of the Sobol' sequence gives points A and B. Point i of a further set has coordinate i of B and the others
of A: with B it shares one coordinate, with A all others. The correlation of the function at points that share some
coordinates is the share of its variance that these explain, alone and together. That is the estimator of Janon et al.
(2014), doi:10.1051/ps/2013040, with the mean and the variance of both points of a pair; for the total index of an
indicator it equals Jansen's. As far as the further set repeats the function at A, the correlation of A and B, which is
of chance, is subtracted from the first-order index: it is then 0 for an input without effect. Sums over an indicator
are whole numbers and exact in any order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from explore.analysis.sensitivity.jackknife import CONFIDENCE, half_width
from explore.base.counts import check_count
from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.studies.designs.samplers import sobol
from explore.studies.designs.spaces import BLOCK_SIZE

#: Least number of scrambles, from whose spread the intervals follow.
LEAST_REPLICATES = 16
#: Least number of points of a scramble.
LEAST_SIZE = 64
#: Number of pairs, known to an eighth then, below which an interval follows from it and not from its spread alone.
_FEW = 64


@dataclass(frozen=True)
class Estimate:
    """Values with the ends of their intervals, each of shape (d,)."""

    value: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class PairedPoints:
    """The points of the unit cube at which a function of so many inputs is evaluated.

    Each scramble has `size` points A, a power of two.
    """

    dimensions: int
    replicates: int
    size: int
    seed: int

    @staticmethod
    def within(evaluations: int, dimensions: int, seed: int) -> PairedPoints:
        """The points of at most so many evaluations; `RequestError` if they are too few."""
        sets = dimensions + 2
        least = LEAST_REPLICATES * LEAST_SIZE * sets
        check_count("evaluations", evaluations, 0)
        check_count("seed", seed, 0)
        if evaluations < least:
            raise RequestError(
                f"evaluations = {evaluations:,}: the indices of {dimensions} parameters need at least {least:,}"
            )
        size = _power_of_two(evaluations // (LEAST_REPLICATES * sets))
        return PairedPoints(dimensions, evaluations // (size * sets), size, seed)

    @property
    def n_evaluations(self) -> int:
        """Number of points of all parts."""
        return self.replicates * self.size * (self.dimensions + 2)

    @property
    def n_parts(self) -> int:
        """Number of parts, each of at most a block of points."""
        return self.replicates * (self.size // self._step)

    @property
    def _step(self) -> int:
        """Number of points A of a part."""
        return min(self.size, _power_of_two(max(BLOCK_SIZE // (self.dimensions + 2), 1)))

    def part(self, number: int) -> FloatArray:
        """The points of a part, shape (n, d): A, B and the d sets that mix them, one after the other."""
        d, start = self.dimensions, number * self._step % self.size
        seeds = np.random.SeedSequence(self.seed, spawn_key=(self.replicate(number),)).generate_state(1, np.uint64)
        both = sobol(2 * d, start, start + self._step, self.size, int(seeds[0]))
        points = np.empty((d + 2, self._step, d))
        points[:] = both[:, :d]
        points[1] = both[:, d:]
        for i in range(d):
            points[2 + i, :, i] = both[:, d + i]
        return points.reshape(-1, d)

    def replicate(self, number: int) -> int:
        """The scramble that a part belongs to."""
        return number * self._step // self.size

    def moments(self, values: FloatArray) -> FloatArray:
        """Sums over the pairs of a part, shape (d, 3, 3), from the function's values at its points.

        For each input, of pairs that share it, that share all others, and that share none: half the sum of both
        values, of their squares, and the sum of their products.
        """
        a, b, *mixed = np.asarray(values, dtype=np.float64).reshape(self.dimensions + 2, -1)
        return np.array([[_sums(b, values), _sums(a, values), _sums(a, b)] for values in mixed])

    def indices(self, moments: FloatArray) -> tuple[Estimate, Estimate]:
        """First-order and total indices of all inputs, from the sums over the parts of each replicate, (r, d, 3, 3).

        NaN where the function does not vary, and bounds that are NaN where it does not without some replicate.
        """
        together = moments.sum(axis=0)
        count = self.size * self.replicates
        value = _indices(together, count)
        half = half_width(np.moveaxis(_indices(together - moments, count - self.size), 1, -1))
        low, high = value - half, value + half
        if np.array_equal(moments[..., 0], moments[..., 1]):  # the squares of 0 and 1
            low, high = _widened(low, high, together[:, :2], count)
        first_order, total = (Estimate(*each) for each in zip(value, low, high, strict=True))
        return first_order, total


def _sums(first: FloatArray, second: FloatArray) -> list[float]:
    return [0.5 * (first.sum() + second.sum()), 0.5 * (first @ first + second @ second), first @ second]


def _indices(sums: FloatArray, count: int) -> FloatArray:
    """First-order and total indices, shape (2, ..., d), from sums over so many pairs, shape (..., d, 3, 3)."""
    mean, square, product = np.moveaxis(sums / count, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        correlations = (product - mean**2) / (square - mean**2)
    one, others, none = np.moveaxis(correlations, -1, 0)
    return np.array([one - others * none, 1.0 - others])


def _widened(low: FloatArray, high: FloatArray, sums: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """The ends of the intervals of an indicator, at least as far as Clopper's and Pearson's where few pairs decide.

    Pairs that are rarer than replicates do not show in the spread of these. A first-order index is from 0 to the total.
    """
    mean, _, both = np.moveaxis(sums, -1, 0)
    rare = np.minimum(mean, count - mean)
    both = both + rare - mean
    either = 2.0 * rare - both
    tail = 0.5 - 0.5 * CONFIDENCE
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(both > 0.0, betaincinv(both, either - both + 1.0, tail), 0.0)
        greatest = np.where(both < either, betaincinv(both + 1.0, either - both, 1.0 - tail), 1.0)
        ends = np.array([least, greatest]) * either / count
        means = 0.5 * (either / count + ends)
        correlations = (ends - means**2) / (means - means**2)
    is_few = (np.minimum(both, either - both) < _FEW).any(axis=1, keepdims=True)
    (one_low, others_low), (one_high, others_high) = np.swapaxes(np.where(is_few, correlations, np.nan), 1, 2)
    total_high = np.fmax(high[1], 1.0 - others_low)
    low = np.fmin(low, [np.maximum(one_low, 0.0), 1.0 - others_high])
    return low, np.fmax(high, [np.minimum(one_high, total_high), total_high])


def _power_of_two(limit: int) -> int:
    """The largest power of two up to a limit."""
    return 1 << (limit.bit_length() - 1)
