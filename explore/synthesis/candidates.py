"""Candidates: the linkages that solvers find for a task, as columns of designs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from explore.model.columns import Arrays, Column

#: Column with the number of the solution that a candidate is, or is a variant of.
SOLUTION = Column("solution", "", "number of the solution, from 1", "bookkeeping", "<i4")


@dataclass(frozen=True)
class Candidates:
    """Linkages for a task, those that the solver holds for the best first.

    Attributes
    ----------
    parameters
        Parameters of the mechanism by name, each of shape (n,), in declared units.
    added
        The columns beside those of a sweep, the first of them `SOLUTION`.
    values
        Their values by name, each of shape (n,).
    tried
        Sentences: what was searched, and what comes nearest where nothing meets the bounds.
    sentences
        For labels of the added columns what they mean.
    """

    parameters: Arrays
    added: tuple[Column, ...]
    values: Arrays
    tried: tuple[str, ...] = ()
    sentences: dict[str, str] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of candidates."""
        return len(self.values[SOLUTION.name])

    def stored(self) -> Arrays:
        """The added columns as they are stored."""
        return {column.name: np.ascontiguousarray(self.values[column.name], column.dtype) for column in self.added}
