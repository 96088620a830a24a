"""Intervals from replicates, by leaving out one at a time."""

import numpy as np
from scipy.special import stdtrit

from explore.model.quantities import FloatArray

#: Probability that an interval holds the true value.
CONFIDENCE = 0.95


def half_width(without: FloatArray) -> FloatArray:
    """Half the width of the interval of an estimate, from it without each of r replicates, shape (..., r)."""
    r = without.shape[-1]
    deviations = without - without.mean(axis=-1, keepdims=True)
    error = np.sqrt((r - 1) / r * (deviations**2).sum(axis=-1))
    return np.asarray(stdtrit(r - 1, 0.5 + 0.5 * CONFIDENCE) * error)
