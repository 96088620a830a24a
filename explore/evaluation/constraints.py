"""Signed margins of constraints."""

import numpy as np

from explore.model.quantities import FloatArray
from explore.model.request import Constraint


def margin(constraint: Constraint, values: FloatArray) -> FloatArray:
    """Signed distance of a metric (n,) to its nearer bound, in its unit: >= 0 where satisfied, NaN where undefined."""
    margins = []
    if constraint.minimum is not None:
        margins.append(values - constraint.minimum)
    if constraint.maximum is not None:
        margins.append(constraint.maximum - values)
    return np.minimum.reduce(margins) if len(margins) > 1 else margins[0]
