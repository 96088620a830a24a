"""Ranges around candidates, within which a refinement moves them."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray, Parameter
from explore.studies.designs.spaces import ContinuousAxis, ListedAxis
from explore.synthesis.candidates import Candidates

#: Share of a length, or of what a signed value spans, by which a range exceeds the candidates.
_BEYOND = 0.1
#: Angle by which a range exceeds the candidates, deg.
_DEGREES = 10.0


def axes_around(
    mechanism: Mechanism, fixed: Collection[str], candidates: Candidates
) -> dict[str, ListedAxis | ContinuousAxis]:
    """Axes of the parameters of candidates by name: ranges; lists of choices; one number where they are fixed."""
    columns = candidates.parameters
    size = max(float(np.abs(values).max()) for values in columns.values())
    axes: dict[str, ListedAxis | ContinuousAxis] = {}
    for parameter in mechanism.axis_order:
        name = parameter.name
        if name in fixed:
            axes[name] = ListedAxis(name, (float(columns[name][0]),))
        elif name in columns:
            axes[name] = _axis(parameter, columns[name], size)
    return axes


def axis_entry(axis: ListedAxis | ContinuousAxis, *, is_fixed: bool) -> Any:
    """The entry of an axis in a study file."""
    if isinstance(axis, ContinuousAxis):
        return {"min": axis.low, "max": axis.high}
    return axis.values[0] if is_fixed else list(axis.values)


def _axis(parameter: Parameter, values: FloatArray, size: float) -> ListedAxis | ContinuousAxis:
    low, high = float(values.min()), float(values.max())
    if parameter.choices:
        return ListedAxis(parameter.name, tuple(sorted(set(values.tolist()))))
    if parameter.unit == "deg":
        return ContinuousAxis(parameter.name, low - _DEGREES, high + _DEGREES)
    if parameter.lower >= 0.0:
        return ContinuousAxis(parameter.name, low / (1.0 + _BEYOND), high * (1.0 + _BEYOND))
    beyond = _BEYOND * max(high - low, 0.1 * size)
    return ContinuousAxis(parameter.name, low - beyond, high + beyond)
