"""Selection of the feasible designs to rank, by a condition and limits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from explore.base.units.shown import Scale
from explore.model.columns import Arrays
from explore.model.request import Objective
from explore.results.ranking.conditions import Condition, parse_condition
from explore.results.ranking.limits import Bounds, Limit, Limits, resolve_limits


@dataclass(frozen=True)
class RankingCriteria:
    """Criteria beyond feasibility; `exclusions` counts the feasible designs that each criterion excludes."""

    condition: Condition | None = None
    limits: tuple[Limit, ...] = ()
    exclusions: Counter[str] = field(default_factory=Counter)

    @property
    def column_names(self) -> tuple[str, ...]:
        """Columns that the criteria use."""
        return (*(self.condition.names if self.condition else ()), *(limit.column for limit in self.limits))

    @property
    def has_criteria(self) -> bool:
        """Whether there is a condition or a limit."""
        return self.condition is not None or bool(self.limits)

    def apply(self, blocks: Iterable[Arrays]) -> Iterator[Arrays]:
        """Yield the blocks, with the excluded designs marked as infeasible."""
        for columns in blocks:
            yield self._restrict(columns) if self.has_criteria else columns

    def preserves_front(self, objectives: Sequence[Objective]) -> bool:
        """Whether the Pareto set of the selected designs is a subset of that of all feasible designs."""
        return self.condition is None and all(limit.bounds_worse_side_of(objectives) for limit in self.limits)

    def _restrict(self, columns: Arrays) -> Arrays:
        n = len(next(iter(columns.values())))
        feasible = np.asarray(columns["feasible"]).astype(bool) if "feasible" in columns else np.ones(n, dtype=bool)
        for limit in self.limits:
            is_met = limit.is_met(columns)
            self.exclusions[f"miss the limit {limit}"] += int(np.count_nonzero(feasible & ~is_met))
            feasible = feasible & is_met
        if self.condition is not None:
            is_met = self.condition.test(columns)
            self.exclusions[f"do not meet {self.condition.text}"] += int(np.count_nonzero(feasible & ~is_met))
            feasible = feasible & is_met
        return {**columns, "feasible": feasible}


def make_criteria(
    where: str | None,
    limits: Limits | None,
    columns: Sequence[str],
    limitable: Sequence[str],
    bounds: Bounds,
    scales: Mapping[str, Scale],
) -> RankingCriteria:
    """Parse the criteria of a request; see `parse_condition` and `resolve_limits`.

    The condition may use the numeric `columns`; those in `limitable` can have a limit. `bounds` are those of the
    constraints of the sweep, `scales` the declared and shown units of the columns that have one.
    """
    condition = None if where is None else parse_condition(where, columns, scales)
    return RankingCriteria(condition, resolve_limits(limits, bounds, limitable, scales))
