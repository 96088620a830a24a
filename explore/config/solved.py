"""The entry ``{ solve = "swing_angle", value = 20 }`` of a study file becomes the axis of a length solved for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from explore.config.axes import is_solved, read_value
from explore.config.schema import Path, Problems, SolveTable, read
from explore.design_space import Solved
from explore.errors import RequestError
from explore.request.names import find_metric, make_window
from explore.request.units import quantity
from explore.suggest import shown, suggestion
from explore.vocabulary import Mechanism, Metric


def read_solved(mechanism: Mechanism, raw: Mapping[str, Any], problems: Problems) -> Solved | None:
    """The length to solve for, or None when there is none or it is wrong.

    Parameters
    ----------
    mechanism
        Whose parameters.
    raw
        The section [parameters].
    problems
        Gets what is wrong, with the path of its key.
    """
    declared = {parameter.name for parameter in mechanism.parameters}
    found: list[Solved | None] = []
    for name in raw:
        if name not in declared or not is_solved(raw[name]):  # an unknown name is told of elsewhere
            continue
        path = ("parameters", name)
        if name not in mechanism.loop:
            lengths = ", ".join(mechanism.loop) or "nothing"
            problems.append((path, f"cannot be solved for; of a {mechanism.name}, {lengths} can"))
        elif found:
            problems.append((path, "another length is solved for already; one value fixes one length"))
        else:
            found.append(_solved(mechanism, name, raw[name], path, problems))
    return found[0] if found else None


def _solved(mechanism: Mechanism, name: str, raw: Mapping[str, Any], path: Path, problems: Problems) -> Solved | None:
    table = read(SolveTable, raw, path, problems)
    if table is None:
        return None
    try:
        metric = _metric(mechanism, table.solve)
    except RequestError as error:
        problems.append(((*path, "solve"), str(error)))
        return None
    before = len(problems)
    numbers = {"value": 0.0, "min": 0.0, "max": math.inf}
    for key, written in (("value", table.value), ("min", table.min), ("max", table.max)):
        if key in raw:
            try:
                numbers[key] = (
                    _value(metric, written) if key == "value" else read_value(mechanism.parameter(name), written)
                )
            except RequestError as error:
                problems.append(((*path, key), str(error)))
    low, high = numbers["min"], numbers["max"]
    if low >= high:
        problems.append((path, f"min = {low:g} must be below max = {high:g}"))
    return Solved(name, metric, numbers["value"], low, high) if len(problems) == before else None


def _metric(mechanism: Mechanism, name: str) -> Metric:
    """The closed-form metric of that name.

    Raises
    ------
    RequestError
        The reason alone, when there is none, or none that has a value to solve for.
    """
    known = {metric.name: metric for metric in mechanism.metrics if not metric.labels}
    if name in known:
        return known[name]
    solvable = ", ".join(known)
    if any(metric.name == name for metric in mechanism.metrics):
        raise RequestError(f"{name} is a label, not a quantity; there is {solvable}")
    try:
        find_metric(mechanism, name, make_window(mechanism, None))
    except RequestError:
        raise RequestError(f"unknown metric {shown(name)}; {suggestion(name, known)}") from None
    raise RequestError(f"{name} is no closed-form metric, and only these can be solved for: {solvable}")


def _value(metric: Metric, raw: object) -> float:
    """The value wanted, in the metric's unit."""
    value = quantity(raw, metric.unit)
    unit = "" if metric.unit == "1" else f" {metric.unit}"
    if value < metric.lower:
        raise RequestError(f"{metric.name} is at least {metric.lower:g}{unit}, got {shown(raw)}")
    if value > metric.upper:
        raise RequestError(f"{metric.name} is at most {metric.upper:g}{unit}, got {shown(raw)}")
    return value
