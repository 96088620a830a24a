"""The [parameters] of a study file become the axes of its design space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore.config.schema import Path, Problems, RangeTable, SpacedTable, read
from explore.design_space import Axis, Continuous, Listed, Spaced
from explore.errors import RequestError
from explore.request.units import quantity
from explore.suggest import closest, shown, suggestion
from explore.unit_cube import SAMPLERS
from explore.vocabulary import Mechanism, Parameter

#: The methods that draw designs, in words.
DRAWING_METHODS = " or ".join(f'"{method}"' for method in SAMPLERS)
_MOST_VALUES = 2**53


def read_axes(mechanism: Mechanism, raw: Mapping[str, Any], method: str | None, problems: Problems) -> tuple[Axis, ...]:
    """One axis for each parameter named but those solved for, in declared order but the speed last.

    Parameters
    ----------
    mechanism
        Whose parameters.
    raw
        The section [parameters].
    method
        Of the sampling: a grid has no ranges without a step, and a table leaves only fixed values; None when not known.
    problems
        Gets what is wrong, with the path of its key.
    """
    declared = {parameter.name: parameter for parameter in mechanism.parameters}
    meant = set()
    for name in raw:
        if name not in declared:
            meant.add(closest(name, declared))
            problems.append((("parameters", name), f"unknown parameter; {suggestion(name, declared)}"))
    required = [parameter.name for parameter in mechanism.parameters if parameter.default is None]
    missing = [name for name in required if name not in raw and name not in meant]
    if missing and method != "table":
        problems.append(
            (("parameters",), f"missing {', '.join(missing)}; a {mechanism.name} needs {', '.join(required)}")
        )
    axes = []
    # The last axis of a grid varies fastest: designs that differ only in speed are neighbours and share one motion.
    for parameter in (*mechanism.geometry, mechanism.speed):
        if parameter.name in raw and not is_solved(raw[parameter.name]):
            axis = _Reader(parameter, ("parameters", parameter.name), method, problems).axis(raw[parameter.name])
            if axis is not None:
                axes.append(axis)
    return tuple(axes)


def is_solved(raw: object) -> bool:
    """Whether the entry of a parameter asks to solve for it."""
    return isinstance(raw, Mapping) and bool({"solve", "value"} & raw.keys())


def read_value(parameter: Parameter, raw: object) -> float:
    """A number in the parameter's unit, within its bounds.

    Raises
    ------
    RequestError
        The reason alone; the caller knows where the value stands.
    """
    value = quantity(raw, parameter.unit)
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    if parameter.choices and value not in parameter.choices:
        raise RequestError(f"must be {_choices(parameter)}, got {shown(raw)}")
    if parameter.allows(value):
        return value
    if value <= parameter.lower:
        least = "at least" if parameter.zero and parameter.lower == 0.0 else "greater than"
        raise RequestError(f"must be {least} {parameter.lower:g}{unit}, got {shown(raw)}")
    if value > parameter.upper:
        raise RequestError(f"must be at most {parameter.upper:g}{unit}, got {shown(raw)}")
    return value


@dataclass(frozen=True)
class _Reader:
    """Reads the entry of one parameter; every method gives None where it has noted a problem."""

    parameter: Parameter
    path: Path
    method: str | None
    problems: Problems

    def note(self, reason: str, *below: str | int) -> None:
        self.problems.append(((*self.path, *below), reason))

    def axis(self, raw: object) -> Axis | None:
        if self.method == "table" and isinstance(raw, Mapping | list):
            self.note("a table gives each design, so this must be one value; make it a column of the table instead")
            return None
        if isinstance(raw, Mapping):
            return self.range(raw) if {"min", "max", "log"} & raw.keys() else self.spaced(raw)
        if isinstance(raw, list):
            return self.listed(raw)
        value = self.value(raw)
        return None if value is None else Listed(self.parameter.name, (value,))

    def value(self, raw: object, *below: str | int) -> float | None:
        """A number in the declared unit, within the declared bounds."""
        try:
            return read_value(self.parameter, raw)
        except RequestError as error:
            self.note(str(error), *below)
        return None

    def listed(self, raw: list[object]) -> Listed | None:
        if not raw:
            self.note("an empty list makes no designs; give at least one value")
            return None
        values: list[float] = []
        for position, item in enumerate(raw):
            value = self.value(item, position)
            if value is not None and value in values:
                self.note(f"{shown(item)} occurs twice; remove one, or the same designs are computed again", position)
            if value is not None:
                values.append(value)
        return Listed(self.parameter.name, tuple(values)) if len(values) == len(raw) else None

    def spaced(self, raw: Mapping[str, object]) -> Listed | Spaced | None:
        table = read(SpacedTable, raw, self.path, self.problems)
        if table is None:
            return None
        start, stop, num = self.value(table.start, "start"), self.value(table.stop, "stop"), table.num
        if not 1 <= num <= _MOST_VALUES:
            most = "more than 2^53 values are not distinct in double precision"
            self.note(f"must be a whole number from 1, got {num}" if num < 1 else most, "num")
            return None
        if start is None or stop is None:
            return None
        if start > stop:
            self.note(f"start = {start:g} is above stop = {stop:g}; swap them")
        elif start == stop and num > 1:
            self.note(
                f"{num} values from {start:g} to {stop:g} are all the same; write {self.parameter.name} = {start:g}"
            )
        elif num == 1:
            return Listed(self.parameter.name, (start,))
        else:
            return self.on_choices(Spaced(self.parameter.name, start, stop, num))
        return None

    def on_choices(self, axis: Spaced) -> Spaced | None:
        """The axis, if all its values are ones that the parameter can take."""
        choices = self.parameter.choices
        if not choices:
            return axis
        if len(axis) <= len(choices) and set(axis.at(np.arange(len(axis)))) <= set(choices):
            return axis
        self.note(f"every value must be {_choices(self.parameter)}; write them as a list")
        return None

    def range(self, raw: Mapping[str, object]) -> Continuous | None:
        table = read(RangeTable, raw, self.path, self.problems)
        if self.method == "grid":
            self.note(
                f"a range {{ min, max }} needs [sampling] method = {DRAWING_METHODS}; in a grid write "
                "{ start, stop, num }"
            )
        if table is None:
            return None
        low, high = self.value(table.min, "min"), self.value(table.max, "max")
        if self.parameter.choices:
            self.note(f"must be {_choices(self.parameter)}, which a range cannot promise; write the values as a list")
        elif low is None or high is None:
            return None
        elif low >= high:
            self.note(f"min = {low:g} must be below max = {high:g}")
        elif table.log and low <= 0.0:
            self.note(f"a logarithmic range needs min above 0, got {low:g}")
        else:
            return Continuous(self.parameter.name, low, high, table.log)
        return None


def _choices(parameter: Parameter) -> str:
    """The values that a parameter can take, in words."""
    choices = parameter.choices
    if len(choices) > 3 and choices == tuple(float(n) for n in range(int(choices[0]), int(choices[-1]) + 1)):
        return f"a whole number {choices[0]:g} to {choices[-1]:g}"
    return " or ".join(f"{choice:g}" for choice in choices)
