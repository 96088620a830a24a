"""Read the section [parameters] as the axes of the design space."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.base.units.quantities import irrational_factor
from explore.model.mechanism import Mechanism
from explore.model.quantities import Parameter
from explore.studies.config.schema import RangeTable, SpacedTable, read
from explore.studies.designs.samplers import SAMPLERS
from explore.studies.designs.spaces import Axis, ContinuousAxis, ListedAxis, SpacedAxis
from explore.studies.request.parameters import describe_choices, read_value

#: Methods that draw designs, in words.
DRAWING_METHODS = " or ".join(f'"{method}"' for method in SAMPLERS)
#: Largest number of values of an axis, which are distinct in double precision.
_MOST_VALUES = 2**53


def read_axes(
    mechanism: Mechanism, entries: Mapping[str, Any], method: str | None, problems: Problems
) -> tuple[Axis, ...]:
    """Read one axis for each parameter that is not solved for, in declared order with the speed last.

    `entries` is the section [parameters]. A grid takes no continuous ranges, a table only single values; `method` is
    None when it is unknown.
    """
    declared = {parameter.name: parameter for parameter in mechanism.parameters}
    corrections = set()
    for name in entries:
        if name not in declared:
            corrections.add(closest_name(name, declared))
            problems.append((("parameters", name), f"unknown parameter; {suggestion(name, declared)}"))
    required = [parameter.name for parameter in mechanism.parameters if parameter.default is None]
    missing = [name for name in required if name not in entries and name not in corrections]
    if missing and method != "table":
        reason = f"missing {', '.join(missing)}; {mechanism.in_words} needs {', '.join(required)}"
        problems.append((("parameters",), reason))
    axes = []
    for parameter in mechanism.axis_order:
        entry = entries.get(parameter.name)
        if parameter.name in entries and not is_solved(entry):
            axis = _AxisReader(parameter, ("parameters", parameter.name), method, problems).axis(entry)
            if axis is not None:
                axes.append(axis)
    return tuple(axes)


def is_solved(entry: object) -> bool:
    """Whether the entry of a parameter asks to solve for it."""
    return isinstance(entry, Mapping) and bool({"solve", "value"} & entry.keys())


@dataclass(frozen=True)
class _AxisReader:
    """Reads the entry of one parameter; the methods return None after noting a problem."""

    parameter: Parameter
    path: KeyPath
    method: str | None
    problems: Problems

    def note(self, reason: str, *below: str | int) -> None:
        self.problems.append(((*self.path, *below), reason))

    def axis(self, entry: object) -> Axis | None:
        if self.method == "table" and isinstance(entry, Mapping | list):
            self.note("must be one value, because a table lists the designs; to vary it, make it a column of the table")
            return None
        if isinstance(entry, Mapping):
            return self.range(entry) if {"min", "max", "log"} & entry.keys() else self.spaced(entry)
        if isinstance(entry, list):
            return self.listed(entry)
        value = self.value(entry)
        return None if value is None else ListedAxis(self.parameter.name, (value,))

    def value(self, entry: object, *below: str | int) -> float | None:
        """A number in the declared unit, within the declared bounds."""
        try:
            return read_value(self.parameter, entry)
        except RequestError as error:
            self.note(str(error), *below)
        return None

    def listed(self, entry: list[object]) -> ListedAxis | None:
        if not entry:
            self.note("an empty list makes no designs; give at least one value")
            return None
        values: dict[float, None] = {}
        for position, item in enumerate(entry):
            value = self.value(item, position)
            if value in values:
                self.note(f"{format_value(item)} is listed twice; remove one", position)
            elif value is not None:
                values[value] = None
        return ListedAxis(self.parameter.name, tuple(values)) if len(values) == len(entry) else None

    def spaced(self, entry: Mapping[str, object]) -> ListedAxis | SpacedAxis | None:
        table = read(SpacedTable, entry, self.path, self.problems)
        if table is None:
            return None
        start, stop, num = self.value(table.start, "start"), self.value(table.stop, "stop"), table.num
        if not 1 <= num <= _MOST_VALUES:
            reason = "more than 2^53 values are not distinct in double precision"
            self.note(f"must be at least 1, got {num}" if num < 1 else reason, "num")
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
            return ListedAxis(self.parameter.name, (start,))
        else:
            unit = irrational_factor([table.start, table.stop], self.parameter.unit)
            return self.on_choices(SpacedAxis(self.parameter.name, start, stop, num, unit))
        return None

    def on_choices(self, axis: SpacedAxis) -> SpacedAxis | None:
        """The axis if the parameter can take all its values."""
        choices = self.parameter.choices
        if not choices:
            return axis
        if len(axis) <= len(choices) and set(axis.values_at(np.arange(len(axis)))) <= set(choices):
            return axis
        self.note(f"every value must be {describe_choices(self.parameter)}; write them as a list")
        return None

    def range(self, entry: Mapping[str, object]) -> ContinuousAxis | None:
        table = read(RangeTable, entry, self.path, self.problems)
        if self.method == "grid":
            self.note(
                f"a range {{ min, max }} needs the sampling method {DRAWING_METHODS}; in a grid give "
                "{ start, stop, num }"
            )
        if table is None:
            return None
        low, high = self.value(table.min, "min"), self.value(table.max, "max")
        if self.parameter.choices:
            self.note(
                f"must be {describe_choices(self.parameter)}, which a range does not ensure; write a list of values"
            )
        elif low is None or high is None:
            return None
        elif low >= high:
            self.note(f"min = {low:g} must be below max = {high:g}")
        elif table.log and low <= 0.0:
            self.note(f"a logarithmic range needs min above 0, got {low:g}")
        else:
            return ContinuousAxis(self.parameter.name, low, high, table.log)
        return None
