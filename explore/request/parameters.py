"""Designs as a caller writes them become columns of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.vocabulary import Columns, Mechanism

if TYPE_CHECKING:
    import pandas as pd


def parameter_columns(mechanism: Mechanism, designs: Mapping[str, npt.ArrayLike] | pd.DataFrame) -> Columns:
    """Designs as columns of one length, each of shape (n,), checked against the declaration.

    Raises
    ------
    RequestError
        For a parameter that the mechanism does not have, one that it lacks, or what is no number.
    """
    if not hasattr(designs, "keys"):
        raise RequestError("designs must be a table or a dict of parameters by name")
    given = {str(name): designs[name] for name in list(designs)}  # type: ignore[index]  # a table has any labels
    known = [p.name for p in mechanism.parameters]
    for name in given:
        if name not in known:
            raise RequestError(f"{mechanism.name} has no parameter '{name}'; it has {', '.join(known)}")
    missing = [p.name for p in mechanism.parameters if p.default is None and p.name not in given]
    if missing:
        raise RequestError(f"{mechanism.name} needs {', '.join(missing)}")
    try:
        values = [np.asarray(column, dtype=np.float64) for column in given.values()]
        arrays = np.broadcast_arrays(*values)
    except (TypeError, ValueError) as problem:
        raise RequestError(f"designs must be numbers of one length: {problem}") from None
    if arrays[0].ndim > 1:
        raise RequestError(f"designs must be numbers or one-dimensional arrays, not of shape {arrays[0].shape}")
    return {name: np.atleast_1d(array).copy() for name, array in zip(given, arrays, strict=True)}
