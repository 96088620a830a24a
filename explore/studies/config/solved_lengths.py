"""Read the entry ``{ solve = "swing_angle", value = 20 }`` of a parameter: a length to solve for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.quantities import Metric
from explore.studies.config.axes import is_solved
from explore.studies.config.schema import SolveTable, read
from explore.studies.designs.spaces import SolvedLength
from explore.studies.request.names import find_metric, make_window
from explore.studies.request.parameters import read_value


def read_solved_length(mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems) -> SolvedLength | None:
    """The length to solve for in the section [parameters], or None when there is none or it is wrong."""
    declared = {parameter.name for parameter in mechanism.parameters}
    lengths: list[SolvedLength | None] = []
    for name, entry in entries.items():
        if name not in declared or not is_solved(entry):  # `read_axes` reports unknown names
            continue
        path = ("parameters", name)
        if name not in mechanism.loop_lengths:
            solvable = ", ".join(mechanism.loop_lengths) or "no parameter"
            problems.append((path, f"cannot be solved for; a {mechanism.name} can be solved for {solvable}"))
        elif lengths:
            problems.append((path, "another length is already solved for; one prescribed value determines one length"))
        else:
            lengths.append(_solved_length(mechanism, name, entry, path, problems))
    return lengths[0] if lengths else None


def _solved_length(
    mechanism: Mechanism, name: str, entry: Mapping[str, Any], path: KeyPath, problems: Problems
) -> SolvedLength | None:
    table = read(SolveTable, entry, path, problems)
    if table is None:
        return None
    try:
        metric = _find_metric(mechanism, table.solve)
    except RequestError as error:
        problems.append(((*path, "solve"), str(error)))
        return None
    before = len(problems)
    parameter = mechanism.parameter(name)
    numbers = {"value": 0.0, "min": parameter.lower, "max": parameter.upper}
    for key, number in (("value", table.value), ("min", table.min), ("max", table.max)):
        if key in entry:
            try:
                is_target = key == "value"
                numbers[key] = _read_target(metric, number) if is_target else read_value(parameter, number)
            except RequestError as error:
                problems.append(((*path, key), str(error)))
    low, high = numbers["min"], numbers["max"]
    if low >= high:
        problems.append((path, f"min = {low:g} must be below max = {high:g}"))
    return SolvedLength(name, metric, numbers["value"], low, high) if len(problems) == before else None


def _find_metric(mechanism: Mechanism, name: str) -> Metric:
    """The closed-form metric of that name; a `RequestError` has the reason alone why it cannot be solved for."""
    candidates = {metric.name: metric for metric in mechanism.metrics if not metric.labels}
    if name in candidates:
        return candidates[name]
    solvable = ", ".join(candidates)
    if any(metric.name == name for metric in mechanism.metrics):
        raise RequestError(f"{name} is a label, not a quantity; available: {solvable}")
    try:
        find_metric(mechanism, name, make_window(mechanism, None))
    except RequestError:
        raise RequestError(f"unknown metric {format_value(name)}; {suggestion(name, candidates)}") from None
    raise RequestError(f"{name} is not a closed-form metric; only these can be solved for: {solvable}")


def _read_target(metric: Metric, entry: object) -> float:
    """The prescribed value, in the metric's unit."""
    value = quantity(entry, metric.unit)
    unit = "" if metric.unit == "1" else f" {metric.unit}"
    if value < metric.lower:
        raise RequestError(f"{metric.name} is at least {metric.lower:g}{unit}, got {format_value(entry)}")
    if value > metric.upper:
        raise RequestError(f"{metric.name} is at most {metric.upper:g}{unit}, got {format_value(entry)}")
    return value
