"""Signed margins of constraints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.vocabulary import Constraint, FloatArray


def margin(constraint: Constraint, values: FloatArray) -> FloatArray:
    """Distance to the nearer bound, in the metric's unit.

    Parameters
    ----------
    values
        The metric, shape (n,).

    Returns
    -------
    (n,) array
        >= 0 where satisfied; NaN where the metric is undefined.
    """
    sides = []
    if constraint.minimum is not None:
        sides.append(values - constraint.minimum)
    if constraint.maximum is not None:
        sides.append(constraint.maximum - values)
    return np.minimum.reduce(sides) if len(sides) > 1 else sides[0]


def satisfied(margins: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether margins are >= 0, shape (n,); an undefined metric satisfies nothing."""
    return np.asarray(margins >= 0.0)
