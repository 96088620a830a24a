"""Check the values of parameters and convert designs to columns of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.model.columns import Arrays
from explore.model.mechanism import Mechanism
from explore.model.points import COORDINATES
from explore.model.quantities import FloatArray, Parameter

if TYPE_CHECKING:
    import pandas as pd


def parameter_columns(mechanism: Mechanism, designs: Mapping[str, npt.ArrayLike] | pd.DataFrame) -> Arrays:
    """Convert designs to columns of one length, each of shape (n,), checked against the declaration."""
    if not hasattr(designs, "keys"):
        raise RequestError("designs must be a table or a dict of parameters by name")
    given = {str(name): designs[name] for name in list(designs.keys())}
    declared, owner = [p.name for p in mechanism.parameters], mechanism.in_words
    for name in given:
        if name not in declared:
            raise RequestError(f"{owner} has no parameter '{name}'; it has {', '.join(declared)}")
    missing = [p.name for p in mechanism.parameters if p.default is None and p.name not in given]
    if missing:
        raise RequestError(f"{owner} needs {', '.join(missing)}")
    try:
        values = [_numbers(mechanism.parameter(name), column) for name, column in given.items()]
        arrays = np.broadcast_arrays(*values)
    except RequestError:
        raise
    except (TypeError, ValueError) as error:
        raise RequestError(f"designs must be numbers of one length: {error}") from None
    if arrays[0].ndim > 1:
        raise RequestError(f"designs must be numbers or one-dimensional arrays, not of shape {arrays[0].shape}")
    return {name: np.atleast_1d(array).copy() for name, array in zip(given, arrays, strict=True)}


def point_parameters(points: Mapping[str, Sequence[float | str]]) -> dict[str, float | str]:
    """The parameters that are the coordinates of points."""
    if not isinstance(points, Mapping):
        raise RequestError(f'points: must be a dict such as {{"knife": (120, 40)}}, got {format_value(points)}')
    found: dict[str, float | str] = {}
    for name, place in points.items():
        if isinstance(place, str) or np.shape(np.asarray(place, dtype=object)) != (len(COORDINATES),):
            example = "along and across, such as (120, 40)"
            raise RequestError(f"the point {name} needs {example}, got {format_value(place)}")
        found |= {f"{name}_{axis}": value for axis, value in zip(COORDINATES, place, strict=True)}
    return found


def _numbers(parameter: Parameter, column: Any) -> FloatArray:
    """The numbers of a column in the declared unit; it may be a string with a unit, or a list with some."""
    try:
        if isinstance(column, str):
            column = quantity(column, parameter.unit)
        elif isinstance(column, (list, tuple)):
            column = [quantity(value, parameter.unit) if isinstance(value, str) else value for value in column]
        elif isinstance(column, np.ma.MaskedArray):
            column = np.ma.filled(column.astype(np.float64), np.nan)
    except RequestError as error:
        raise RequestError(f"{parameter.name}: {error}") from None
    return np.asarray(column, dtype=np.float64)


def read_value(parameter: Parameter, entry: object) -> float:
    """A number in the parameter's unit, within its bounds; a `RequestError` has the reason alone, without the key."""
    value = quantity(entry, parameter.unit)
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    if parameter.choices and value not in parameter.choices:
        raise RequestError(f"must be {describe_choices(parameter)}, got {format_value(entry)}")
    if parameter.allows(value):
        return value
    if value <= parameter.lower:
        limit = "at least" if parameter.zero_meaning and parameter.lower == 0.0 else "greater than"
        raise RequestError(f"must be {limit} {parameter.lower:g}{unit}, got {format_value(entry)}")
    if value > parameter.upper:
        raise RequestError(f"must be at most {parameter.upper:g}{unit}, got {format_value(entry)}")
    return value


def describe_choices(parameter: Parameter) -> str:
    """The values that a parameter can take, in words."""
    choices = parameter.choices
    if len(choices) > 3 and choices == tuple(float(n) for n in range(int(choices[0]), int(choices[-1]) + 1)):
        return f"a whole number from {choices[0]:g} to {choices[-1]:g}"
    return " or ".join(f"{choice:g}" for choice in choices)
