"""Columns of designs as compiled measures of targets take them."""

from __future__ import annotations

import numpy as np

from explore.model.quantities import FloatArray


def designs_of(columns: tuple[FloatArray, ...]) -> FloatArray:
    """Designs as rows, shape (n, p).

    Parameters
    ----------
    columns
        The p numbers that are measured, then a metric that is NaN where the crank does not turn, each of shape (n,).

    Returns
    -------
    (n, p) array
        The first number is NaN where any is not finite or the crank does not turn.
    """
    table = np.column_stack(np.broadcast_arrays(*columns)).astype(np.float64)
    designs = np.ascontiguousarray(table[:, :-1])
    designs[~np.isfinite(table).all(axis=1), 0] = np.nan
    return designs
