"""The projection of angles onto their order: pooling of adjacent violators, a turn at most, for compiled callers too.

`scipy.optimize.isotonic_regression` is neither batched nor compiled, and knows neither the turn nor the least span.
"""

import math

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine


@subroutine()
def pool(angles, weights, sense, least_span, values, sums, counts):
    """Bring angles in order, nondecreasing in the sense, the nearest in weighted least squares; at most one turn apart.

    The first and the last are at least `least_span` apart.
    """
    n, m = len(angles), 0
    for i in range(n):
        values[m], sums[m], counts[m] = sense * angles[i], weights[i], 1
        m += 1
        while m > 1 and values[m - 2] > values[m - 1]:
            total = sums[m - 2] + sums[m - 1]
            values[m - 2] = (values[m - 2] * sums[m - 2] + values[m - 1] * sums[m - 1]) / total
            sums[m - 2] = total
            counts[m - 2] += counts[m - 1]
            m -= 1
    missing = least_span - (values[m - 1] - values[0])
    if missing > 0.0 and m > 1:
        total = sums[0] + sums[m - 1]
        values[m - 1] += missing * sums[0] / total
        values[0] -= missing * sums[m - 1] / total
    i = 0
    last = values[0] + 2.0 * math.pi
    for block in range(m):
        for _ in range(counts[block]):
            angles[i] = sense * min(values[block], last)
            i += 1


@compiled(allocates=True)
def bring_in_order(angles, weights):
    """Bring rows of angles, shape (b, n), in order, in place; see `pool`."""
    n = angles.shape[1]
    values, sums, counts = np.empty(n), np.empty(n), np.empty(n, np.int64)
    for row in range(len(angles)):
        pool(angles[row], weights[row], 1.0, 0.0, values, sums, counts)
