"""Selection of designs to rank: a condition, and limits that narrow the constraints of a sweep without a new one."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.shown import PLAIN, Scale, number_with_unit
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.request import Objective
from explore.results.ranking.conditions import Condition, parse_condition

#: Bounds of the constraints of a study by metric, under "min" and "max"; None or a missing key leaves a side open.
Bounds = Mapping[str, Mapping[str, float | None]]
# A number is in the declared unit; a string has a unit, or is a number in the unit in which the metric is shown.
#: Limits by metric: a value for the side that the constraint bounds, or values under "min" and "max".
Limits = Mapping[str, float | str | Mapping[str, float | str]]

_LIMIT_PATTERN = re.compile(r"\s*(?P<name>[^\s<>=]+)\s*(?P<sign><=|>=|=)\s*(?P<value>.*?)\s*")
_SIDES = {"<=": "max", ">=": "min"}


@dataclass(frozen=True)
class Limit:
    """A bound on one metric.

    `column` is the metric, or its margin where the results do not have the metric; then `margin_bound` is the bound of
    the sweep, from which the margin is counted. `scale` has the unit in which the limit is shown.
    """

    metric: str
    side: str
    value: float
    column: str
    margin_bound: float | None = None
    scale: Scale = PLAIN

    def __str__(self) -> str:
        return f"{self.metric} {'>=' if self.side == 'min' else '<='} {number_with_unit(self.value, self.scale)}"

    def is_met(self, columns: Arrays) -> npt.NDArray[np.bool_]:
        """Mask of the designs that meet the limit, (n,); an undefined metric meets none."""
        return np.asarray(self.margin(columns) >= 0.0)

    def margin(self, columns: Arrays) -> FloatArray:
        """Signed distance to the limit, (n,): >= 0 where it is met, NaN where the metric is undefined."""
        values = np.asarray(columns[self.column], dtype=np.float64)
        if self.margin_bound is not None:
            return np.asarray(values - abs(self.value - self.margin_bound))
        return np.asarray(values - self.value if self.side == "min" else self.value - values)


def parse_limits(texts: Iterable[str]) -> dict[str, str | dict[str, str]]:
    """Parse limits such as "swing_angle=40", "coupler<=4 in" and "time_ratio>=1.1"; the values stay texts."""
    limits: dict[str, str | dict[str, str]] = {}
    for text in texts:
        match = _LIMIT_PATTERN.fullmatch(text)
        if match is None:
            raise RequestError(f"limit {format_value(text)}: write METRIC=VALUE, METRIC>=VALUE or METRIC<=VALUE")
        name, sign, value = match["name"], match["sign"], match["value"]
        sides = limits.get(name, {})
        if isinstance(sides, str) or (sides and sign == "=") or _SIDES.get(sign) in sides:
            raise RequestError(f"limit {format_value(text)}: {format_value(name)} is limited twice; give one limit")
        limits[name] = value if sign == "=" else {**sides, _SIDES[sign]: value}
    return limits


def resolve_limits(
    limits: Limits | None, bounds: Bounds, columns: Sequence[str], scales: Mapping[str, Scale] | None = None
) -> tuple[Limit, ...]:
    """Check limits against the bounds of the constraints of the sweep.

    A limit is by metric, one of the columns: a value where the constraint has one side, else ``{"min": …}``, ``{"max":
    …}`` or both. `scales` are the declared and shown units of columns that have one. A `RequestError` says that a
    metric is unknown, the side is ambiguous, or the limit is wider than the constraint.
    """
    resolved = []
    for name, limit in (limits or {}).items():
        own_bounds = {side: bound for side, bound in bounds.get(name, {}).items() if bound is not None}
        if name not in columns and name not in bounds:
            raise RequestError(
                f"limit: no metric {format_value(name)}; {suggestion(name, dict.fromkeys([*columns, *bounds]))}"
            )
        known = scales or {}
        scale = known.get(name, known.get(f"{name}_margin", PLAIN))
        for side, value in _sides(name, limit, own_bounds).items():
            number = _read(name, value, scale)
            resolved.append(_make_limit(Limit(name, side, number, name, scale=scale), own_bounds, columns))
    return tuple(resolved)


def _sides(name: str, limit: object, own_bounds: Mapping[str, float]) -> Mapping[str, object]:
    """The limit of one metric, by side."""
    if isinstance(limit, Mapping):
        wrong = [side for side in limit if side not in ("min", "max")]
        if wrong or not limit:
            raise RequestError(f"limit on {name}: give {{'min': …}}, {{'max': …}} or both")
        return limit
    if len(own_bounds) != 1:
        reason = "is constrained on both sides" if own_bounds else "has no constraint"
        raise RequestError(
            f"limit on {name}: it {reason}, so say which side: min ({name}>=VALUE) or max ({name}<=VALUE)"
        )
    return dict.fromkeys(own_bounds, limit)


def _read(name: str, entry: object, scale: Scale) -> float:
    """The value of a limit in the declared unit."""
    if isinstance(entry, str):
        try:
            return scale.read(entry)
        except RequestError as error:
            raise RequestError(f"limit on {name}: {error}") from None
    try:
        value = math.nan if isinstance(entry, bool) else float(entry)  # type: ignore[arg-type]  # or it raises
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise RequestError(f"limit on {name}: {format_value(entry)} is not a finite number")
    return value


def _make_limit(limit: Limit, own_bounds: Mapping[str, float], columns: Sequence[str]) -> Limit:
    """The limit on the column that there is; `RequestError` if it is wider than the constraint, or has no column."""
    name, side, value, scale = limit.metric, limit.side, limit.value, limit.scale
    bound = own_bounds.get(side)
    if bound is not None and (value < bound if side == "min" else value > bound):
        direction = "below" if side == "min" else "above"
        given, own = number_with_unit(value, scale), number_with_unit(bound, scale)
        raise RequestError(
            f"limit on {name}: {given} is {direction} the {side} of {own} of the sweep; "
            "designs beyond that were screened, so sweep again with a wider constraint"
        )
    if name in columns:
        return limit
    if list(own_bounds) != [side]:
        raise RequestError(
            f"limit on {name}: its values are not in these results; sweep with {name} among the metrics of the study"
        )
    return replace(limit, column=f"{name}_margin", margin_bound=bound)


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
        """Whether the Pareto set of the selected designs is a subset of that of all feasible designs.

        It is where each limit bounds the worse side of an objective: no excluded design dominates one that meets it.
        """
        bounded = {(objective.metric, "min" if objective.sense == "max" else "max") for objective in objectives}
        return self.condition is None and all((limit.metric, limit.side) in bounded for limit in self.limits)

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
