"""Limits that are narrower than the constraints of a sweep: what was swept need not be swept again."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.suggest import shown, suggestion
from explore.vocabulary import Columns, Objective

#: The bounds of the constraints of a study by metric, under "min" and "max"; None or nothing leaves a side open.
Bounds = Mapping[str, Mapping[str, float | None]]
#: Limits as Python has them: a number on the side that the constraint bounds, or sides by name.
Limits = Mapping[str, float | Mapping[str, float]]

_WRITTEN = re.compile(r"\s*(?P<name>[^\s<>=]+)\s*(?P<sign><=|>=|=)\s*(?P<value>.*?)\s*")
_SIDES = {"<=": "max", ">=": "min"}


@dataclass(frozen=True)
class Limit:
    """A bound on one metric; `margin_bound` is that of the sweep where only the margin is in the results."""

    metric: str
    side: str
    value: float
    column: str
    margin_bound: float | None = None

    def __str__(self) -> str:
        return f"{self.metric} {'>=' if self.side == 'min' else '<='} {self.value:g}"

    def met(self, columns: Columns) -> npt.NDArray[np.bool_]:
        """Which designs keep to the limit; an undefined metric keeps to none."""
        values = columns[self.column]
        if self.margin_bound is not None:
            return np.asarray(values >= abs(self.value - self.margin_bound))
        return np.asarray(values >= self.value if self.side == "min" else values <= self.value)

    def follows(self, objectives: Iterable[Objective]) -> bool:
        """Whether it bounds the worse side of an aim, so that no design that it leaves out beats one that it keeps."""
        better = "max" if self.side == "min" else "min"
        return any(objective.metric == self.metric and objective.sense == better for objective in objectives)


def parse_limits(texts: Iterable[str]) -> dict[str, float | dict[str, float]]:
    """Limits from texts such as "swing_angle=40", "cv<=0.4" and "time_ratio>=1.1"."""
    limits: dict[str, float | dict[str, float]] = {}
    for text in texts:
        match = _WRITTEN.fullmatch(text)
        if match is None:
            raise RequestError(f"limit {shown(text)}: write METRIC=VALUE, METRIC>=VALUE or METRIC<=VALUE")
        name, sign = match["name"], match["sign"]
        try:
            value = float(match["value"])
        except ValueError:
            reason = "is no number; numbers are in the metric's unit, without it"
            raise RequestError(f"limit {shown(text)}: {shown(match['value'])} {reason}") from None
        sides = limits.get(name, {})
        if isinstance(sides, float) or (sides and sign == "=") or _SIDES.get(sign) in sides:
            raise RequestError(f"limit {shown(text)}: {shown(name)} is limited twice; give one limit")
        limits[name] = value if sign == "=" else {**sides, _SIDES[sign]: value}
    return limits


def resolve_limits(limits: Limits | None, bounds: Bounds, columns: Sequence[str]) -> tuple[Limit, ...]:
    """Limits against the constraints that the designs were swept with.

    Parameters
    ----------
    limits
        By metric: a number where the constraint has one side, else ``{"min": …}``, ``{"max": …}`` or both.
    bounds
        Of the constraints.
    columns
        The columns there are.

    Raises
    ------
    RequestError
        If a name is unknown, the side cannot be told, or the limit is wider than the constraint was.
    """
    found = []
    for name, given in (limits or {}).items():
        own = {side: bound for side, bound in bounds.get(name, {}).items() if bound is not None}
        if name not in columns and name not in bounds:
            raise RequestError(
                f"limit: no metric {shown(name)}; {suggestion(name, dict.fromkeys([*columns, *bounds]))}"
            )
        for side, value in _sides(name, given, own).items():
            found.append(_limit(name, side, value, own, columns))
    return tuple(found)


def _sides(name: str, given: object, own: Mapping[str, float]) -> Mapping[str, object]:
    """The limit of one metric by side."""
    if isinstance(given, Mapping):
        wrong = [side for side in given if side not in ("min", "max")]
        if wrong or not given:
            raise RequestError(f"limit on {name}: give {{'min': …}}, {{'max': …}} or both")
        return given
    if len(own) != 1:
        why = "is constrained on both sides" if own else "has no constraint"
        raise RequestError(f"limit on {name}: it {why}, so write {name}>=VALUE or {name}<=VALUE")
    return dict.fromkeys(own, given)


def _limit(name: str, side: str, given: object, own: Mapping[str, float], columns: Sequence[str]) -> Limit:
    try:
        value = math.nan if isinstance(given, (bool, str)) else float(given)  # type: ignore[arg-type]  # or it raises
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise RequestError(f"limit on {name}: {shown(given)} is not a finite number")
    bound = own.get(side)
    if bound is not None and (value < bound if side == "min" else value > bound):
        beyond = "below" if side == "min" else "above"
        raise RequestError(
            f"limit on {name}: {value:g} is {beyond} the {side} of {bound:g} that the designs were swept with; "
            "those beyond it were screened, so sweep again with a wider constraint"
        )
    if name in columns:
        return Limit(name, side, value, name)
    if list(own) != [side]:
        raise RequestError(
            f"limit on {name}: its values are not in these results; sweep with {name} in evaluate.metrics"
        )
    return Limit(name, side, value, f"{name}_margin", bound)
