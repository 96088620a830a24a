"""Columns of results, and the blocks of designs that are computed and committed together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

#: Values of columns by name, each of shape (n,).
Arrays = dict[str, npt.NDArray[Any]]

#: Value of an attribute of a results file.
Attribute = str | int | float


@dataclass(frozen=True)
class Column:
    """One column of results.

    Attributes
    ----------
    name, unit, long_name
        Name in results, unit ("1" for ratios, empty for codes and numbers of designs), and description.
    role
        "index", "parameter", "metric", "margin" or "bookkeeping".
    dtype
        NumPy type of the stored values.
    labels
        Words for integer codes; empty for numbers.
    """

    name: str
    unit: str
    long_name: str
    role: str
    dtype: str = "<f8"
    labels: Mapping[int, str] = field(default_factory=dict, hash=False)


@dataclass(frozen=True)
class Block:
    """Consecutive designs that are computed and committed together, with parameters by name, each of shape (n,).

    `number` is that of the block in the study, `start` that of its first design.
    """

    number: int
    start: int
    columns: Arrays


def join_columns(parts: Sequence[Arrays]) -> Arrays:
    """The columns of designs, one part after the other; all parts have the same names."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
