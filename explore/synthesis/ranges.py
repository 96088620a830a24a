"""Ranges around candidates, within which a refinement moves them."""

from __future__ import annotations

from typing import Any

import numpy as np

from explore.model.quantities import FloatArray, Parameter
from explore.studies.request.names import find_mechanism
from explore.synthesis.candidates import Candidates
from explore.synthesis.tasks.contract import Task

#: Share of a length, or of what a signed value spans, by which a range exceeds the candidates.
_BEYOND = 0.1
#: Angle by which a range exceeds the candidates, deg.
_DEGREES = 10.0
#: Range in place of one that is not known before there are candidates.
_ANY_RANGE = {"min": 1.0, "max": 2.0}


def any_ranges(task: Task) -> dict[str, Any]:
    """Entries in place of the ranges of candidates that are not found yet."""
    declared = _declared(task)
    choices = {name: declared[name].choices for name in task.parameters if name in declared}
    return {name: list(choices[name]) if choices.get(name) else dict(_ANY_RANGE) for name in task.parameters}


def ranges_around(task: Task, candidates: Candidates) -> dict[str, Any]:
    """Entries of the section [parameters] by name: ranges; lists of choices; numbers that the task gives."""
    declared = _declared(task)
    sizes = [np.abs(values).max() for values in candidates.parameters.values()]
    entries: dict[str, Any] = {}
    for name, values in candidates.parameters.items():
        if name in task.fixed:
            entries[name] = float(values[0])
        else:
            entries[name] = _range(declared.get(name), values, float(max(sizes)))
    return entries


def _declared(task: Task) -> dict[str, Parameter]:
    """The parameters of the task's mechanism with its points and its target, by name."""
    return {each.name: each for each in find_mechanism(task.mechanism, task.points, task.target).parameters}


def _range(parameter: Parameter | None, values: FloatArray, size: float) -> Any:
    low, high = float(values.min()), float(values.max())
    if parameter is not None and parameter.choices:
        return sorted(set(values.tolist()))
    if parameter is not None and parameter.unit == "deg":
        return {"min": low - _DEGREES, "max": high + _DEGREES}
    if parameter is not None and parameter.lower >= 0.0:
        return {"min": low / (1.0 + _BEYOND), "max": high * (1.0 + _BEYOND)}
    beyond = _BEYOND * max(high - low, 0.1 * size)
    return {"min": low - beyond, "max": high + beyond}
