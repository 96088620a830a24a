"""Candidates: the linkages that solvers find for a task, as columns of designs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from explore.model.columns import Arrays, Column
from explore.model.quantities import FloatArray

#: Column with the number of the solution that a candidate is, or is a variant of.
SOLUTION = Column("solution", "", "number of the solution, from 1", "bookkeeping", "<i4")
#: Names of columns that solvers add and do not measure.
BOOKKEEPING = (
    SOLUTION.name, "method", "family", "cognate", "proved", "rest_x", "rest_y", "guide_angle", "dwell_start",
    "dwell_angle", "slider_link",
)  # fmt: skip


@dataclass(frozen=True)
class Candidates:
    """Linkages for a task, the best first by the solver's own measure.

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
    is_interrupted
        Whether the user stopped the search, of which these were found.
    most
        Number of solutions to keep, of those the objectives choose among all; None for all.
    always
        Rows that are kept in any case, beside those.
    traits
        Numbers by which solutions are alike where all of them differ by less than 1, shape (n, k); None where none are.
    """

    parameters: Arrays
    added: tuple[Column, ...]
    values: Arrays
    tried: tuple[str, ...] = ()
    sentences: dict[str, str] = field(default_factory=dict)
    is_interrupted: bool = False
    most: int | None = None
    always: tuple[int, ...] = ()
    traits: FloatArray | None = None

    @property
    def count(self) -> int:
        """Number of candidates."""
        return len(self.values[SOLUTION.name])

    def rows(self, rows: npt.NDArray[np.int64]) -> Candidates:
        """Some of the candidates, all to be kept; their solutions are numbered anew."""
        values = {name: column[rows] for name, column in self.values.items()}
        values[SOLUTION.name] = np.unique(values[SOLUTION.name], return_inverse=True)[1] + 1
        parameters = {name: column[rows] for name, column in self.parameters.items()}
        return replace(self, parameters=parameters, values=values, most=None, always=(), traits=None)

    def stored(self) -> Arrays:
        """The added columns as they are stored."""
        return {column.name: np.ascontiguousarray(self.values[column.name], column.dtype) for column in self.added}
