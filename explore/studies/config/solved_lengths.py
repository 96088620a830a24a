"""Read the entry ``{ solve = "swing_angle", value = 20 }`` of a parameter: a length to solve for."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.quantities import AnyMetric, GivenMetric, Metric
from explore.model.request import Request
from explore.model.window import Window
from explore.studies.config.axes import is_solved
from explore.studies.config.schema import SolveTable, read
from explore.studies.designs.spaces import SolvedLength
from explore.studies.request.names import find_metric, make_window
from explore.studies.request.parameters import read_value
from explore.studies.request.requests import RequestArguments, make_request, refuse_label, resolve_request


def read_solved_length(
    mechanism: Mechanism, entries: Mapping[str, Any], asked: RequestArguments, problems: Problems
) -> SolvedLength | None:
    """The length to solve for in the section [parameters], or None when there is none or it is wrong."""
    declared = {parameter.name for parameter in mechanism.parameters}
    lengths: list[SolvedLength | None] = []
    for name, entry in entries.items():
        if name not in declared or not is_solved(entry):  # `read_axes` reports unknown names
            continue
        path = ("parameters", name)
        if mechanism.loop_lengths and name not in mechanism.loop_lengths:
            solvable = ", ".join(mechanism.loop_lengths)
            problems.append((path, f"cannot be solved for; a {mechanism.name} can be solved for {solvable}"))
        elif mechanism.parameter(name).choices:
            problems.append((path, "is one of a few choices, which cannot be solved for"))
        elif lengths:
            problems.append((path, "another length is already solved for; one prescribed value determines one length"))
        else:
            lengths.append(_solved_length(mechanism, name, entry, path, asked, problems))
    return lengths[0] if lengths else None


def _solved_length(
    mechanism: Mechanism,
    name: str,
    entry: Mapping[str, Any],
    path: KeyPath,
    asked: RequestArguments,
    problems: Problems,
) -> SolvedLength | None:
    table = read(SolveTable, entry, path, problems)
    if table is None:
        return None
    try:
        request = _request(mechanism, table.solve, asked)
    except RequestError as error:
        problems.append(((*path, "solve"), str(error)))
        return None
    if request is None:
        return None
    metric = request.metrics[0]
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
    if not (mechanism.loop_lengths or math.isfinite(high - low)):
        problems.append((path, "needs bounds between which values are tried, such as min = 10, max = 100"))
    return SolvedLength(name, request, numbers["value"], low, high) if len(problems) == before else None


def _request(mechanism: Mechanism, name: str, asked: RequestArguments) -> Request | None:
    """The request for the metric of that name, as the study asks; None if that has a mistake of its own.

    A `RequestError` has the reason alone why the metric cannot be solved for.
    """
    if mechanism.loop_lengths:
        _check_closed_form(mechanism, name, make_window(mechanism, None))
        return make_request(mechanism, metrics=[name])
    request, problems = resolve_request(mechanism, replace(asked, metrics=[name], constraints=None))
    for (argument, *_), reason in problems:
        if argument == "metrics":
            raise RequestError(reason)
    metric = request.metrics[0]
    refuse_label(metric, "solved for")
    if isinstance(metric, GivenMetric):
        raise RequestError(f"{name} comes with the designs, so it cannot be solved for")
    return None if problems else replace(request, metrics=(metric,))


def _check_closed_form(mechanism: Mechanism, name: str, window: Window) -> None:
    """Raise where the name is that of no closed-form metric."""
    candidates = [metric.name for metric in mechanism.metrics if not metric.labels]
    if name in candidates:
        return
    solvable = ", ".join(candidates)
    if any(metric.name == name for metric in mechanism.metrics):
        raise RequestError(f"{name} is a label, not a quantity; available: {solvable}")
    try:
        find_metric(mechanism, name, window)
    except RequestError:
        raise RequestError(f"unknown metric {format_value(name)}; {suggestion(name, candidates)}") from None
    raise RequestError(f"{name} is not a closed-form metric; only these can be solved for: {solvable}")


def _read_target(metric: AnyMetric, entry: object) -> float:
    """The prescribed value, in the metric's unit."""
    value = quantity(entry, metric.unit)
    if not isinstance(metric, Metric):
        return value
    unit = "" if metric.unit == "1" else f" {metric.unit}"
    if value < metric.lower:
        raise RequestError(f"{metric.name} is at least {metric.lower:g}{unit}, got {format_value(entry)}")
    if value > metric.upper:
        raise RequestError(f"{metric.name} is at most {metric.upper:g}{unit}, got {format_value(entry)}")
    return value
