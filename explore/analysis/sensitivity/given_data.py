"""First-order indices of a metric from designs that are there, whose parameters may depend on each other.

The index of a parameter is the variance of the metric's mean given the parameter, over the variance of the metric. The
designs are divided into bins of equal numbers along the parameter, and the mean is a line in each bin: a step would
need thousands of bins where a metric rises steeply. Lines explain some variance by chance, which is corrected for as
for random designs. Designs of a Sobol' sequence fill each bin more evenly than random ones, so that the truth is
between the values with and without that correction. A full grid has every combination of its values: its means are
exact.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from explore.analysis.sensitivity.jackknife import half_width
from explore.model.quantities import FloatArray

#: Ways in which designs fill the ranges: at random, more evenly, or with every combination of listed values.
Filling = Literal["random", "even", "complete"]
#: Least number of designs, except of a full grid.
LEAST_DESIGNS = 256
#: Largest change of a converged index when the number of bins is halved.
CONVERGED = 0.01
#: Least number of designs for each value of a parameter with which each value has its own bin.
_DESIGNS_PER_VALUE = 16
#: Number of groups that the designs are divided into at random, to leave out one at a time.
_GROUPS = 16
#: Spread of the parameter in a bin, relative to its size, below which the bin has no line.
_LEAST_SPREAD = 1e-9


@dataclass(frozen=True)
class FirstOrder:
    """A first-order index and its interval, NaN where the metric does not vary.

    `n_designs` have both values. `coarser` is the index with half the bins, the same where each value of the parameter
    has its bin.
    """

    value: float
    low: float
    high: float
    n_designs: int
    n_bins: int
    coarser: float

    @property
    def has_converged(self) -> bool:
        """Whether more bins would change the index little."""
        return abs(self.value - self.coarser) <= CONVERGED


def first_order(parameter: FloatArray, metric: FloatArray, filling: Filling, seed: int) -> FirstOrder:
    """The first-order index of a parameter; designs without both values, or with infinite ones, are left out."""
    is_defined = np.isfinite(parameter) & np.isfinite(metric)
    x, y = parameter[is_defined], metric[is_defined]
    n = len(x)
    if n < (2 if filling == "complete" else LEAST_DESIGNS) or y.min() == y.max():
        return FirstOrder(np.nan, np.nan, np.nan, n, 0, np.nan)
    y = np.ldexp(y, -np.frexp(np.abs(y).max())[1])  # squares of 1e200 and of 1e-200 are no doubles
    groups = np.random.default_rng(seed).permutation(n) % _GROUPS
    order = np.argsort(x, kind="stable")
    x, y, groups = x[order], y[order] - y.mean(), groups[order]
    is_new = np.concatenate([[True], x[1:] != x[:-1]])
    n_values = int(is_new.sum())
    if filling == "complete" or n_values <= n // _DESIGNS_PER_VALUE:
        value, low, high = _index(x, y, np.cumsum(is_new) - 1, groups, filling)
        return FirstOrder(value, low, high, n, n_values, value)
    # As many bins as designs in each: the share that is explained by chance then falls as fast as the interval.
    n_bins = math.isqrt(n) // 2 * 2
    value, low, high = _index(x, y, _bins(is_new, n_bins), groups, filling)
    coarser, _, _ = _index(x, y, _bins(is_new, n_bins // 2), groups, filling)
    return FirstOrder(value, low, high, n, n_bins, coarser)


def _bins(is_new: npt.NDArray[np.bool_], n_bins: int) -> npt.NDArray[np.intp]:
    """The bin of each design in the order of the parameter; equal values are in one bin."""
    places = np.arange(len(is_new))
    return np.maximum.accumulate(np.where(is_new, places, 0)) * n_bins // len(is_new)


def _index(
    x: FloatArray, y: FloatArray, bins: npt.NDArray[np.intp], groups: npt.NDArray[np.intp], filling: Filling
) -> tuple[float, float, float]:
    """The index and the ends of its interval, from designs in the order of the parameter."""
    n_bins = int(bins[-1]) + 1
    x = x - x[np.searchsorted(bins, bins)]  # from the first of its bin, so that squares keep their digits
    cells = bins * _GROUPS + groups
    parts = np.array([
        np.bincount(cells, weights, n_bins * _GROUPS) for weights in (None, x, y, x * x, x * y, y * y)
    ]).reshape(6, n_bins, _GROUPS)  # fmt: skip
    total = parts.sum(axis=2, keepdims=True)
    (raw,), (corrected,) = _explained(total)
    if filling == "complete":
        return float(raw), float(raw), float(raw)
    raw_half, half = (float(half_width(without)) for without in _explained(total - parts))
    if filling == "random":
        return float(corrected), float(corrected) - half, float(corrected) + half
    return float(0.5 * (raw + corrected)), float(corrected) - half, float(raw) + raw_half


def _explained(sums: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of the variance that lines in bins explain, as it is and corrected for random designs, each (k,).

    The sums are of 1, x, y, x^2, x y and y^2 in each bin, (6, bins, k).
    """
    n, x, y, xx, xy, yy = sums
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = xx - x * x / n
        has_line = (n > 2) & (spread > _LEAST_SPREAD * xx)
        rest = yy - y * y / n - np.where(has_line, (xy - x * y / n) ** 2 / spread, 0.0)
    is_filled = n > 0
    count, unexplained = n.sum(axis=0), np.where(is_filled, rest, 0.0).sum(axis=0)
    variance = yy.sum(axis=0) - y.sum(axis=0) ** 2 / count
    fitted = (is_filled + has_line.astype(np.int64)).sum(axis=0)
    raw = 1.0 - unexplained / variance
    with np.errstate(divide="ignore", invalid="ignore"):
        return raw, 1.0 - unexplained / (count - fitted) * (count - 1.0) / variance
