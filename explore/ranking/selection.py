"""Which feasible designs are ranked: those that meet a condition and keep to limits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from explore.ranking.conditions import Condition, parse_condition
from explore.ranking.limits import Bounds, Limit, Limits, resolve_limits
from explore.vocabulary import Columns, Objective


@dataclass(frozen=True)
class Selection:
    """What is asked of designs beyond being feasible; `left_out` counts the feasible ones that do not meet it."""

    condition: Condition | None = None
    limits: tuple[Limit, ...] = ()
    left_out: Counter[str] = field(default_factory=Counter)

    @property
    def names(self) -> tuple[str, ...]:
        """The columns that it needs."""
        return (*(self.condition.names if self.condition else ()), *(limit.column for limit in self.limits))

    @property
    def selects(self) -> bool:
        """Whether it asks for anything."""
        return self.condition is not None or bool(self.limits)

    def apply(self, blocks: Iterable[Columns]) -> Iterator[Columns]:
        """The blocks, with what was not chosen made infeasible."""
        for columns in blocks:
            yield self._narrowed(columns) if self.selects else columns

    def keeps_front(self, objectives: Sequence[Objective]) -> bool:
        """Whether the Pareto set of the chosen designs is part of that of all: nothing rises for what is left out."""
        return self.condition is None and all(limit.follows(objectives) for limit in self.limits)

    def _narrowed(self, columns: Columns) -> Columns:
        n = len(next(iter(columns.values())))
        feasible = np.asarray(columns["feasible"]).astype(bool) if "feasible" in columns else np.ones(n, dtype=bool)
        for limit in self.limits:
            met = limit.met(columns)
            self.left_out[f"miss the limit {limit}"] += int(np.count_nonzero(feasible & ~met))
            feasible = feasible & met
        if self.condition is not None:
            met = self.condition.test(columns)
            self.left_out[f"do not meet {self.condition.text}"] += int(np.count_nonzero(feasible & ~met))
            feasible = feasible & met
        return {**columns, "feasible": feasible}


def make_selection(
    where: str | None, limits: Limits | None, columns: Sequence[str], limited: Sequence[str], bounds: Bounds
) -> Selection:
    """A selection from names.

    Parameters
    ----------
    where, limits
        See `parse_condition` and `resolve_limits`.
    columns
        All columns of numbers, for the condition.
    limited
        Those that a limit can be put on.
    bounds
        Of the constraints that the designs were swept with.
    """
    condition = None if where is None else parse_condition(where, columns)
    return Selection(condition, resolve_limits(limits, bounds, limited))
