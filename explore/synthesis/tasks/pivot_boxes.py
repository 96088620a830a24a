"""Boxes that the fixed pivots of candidates have to be in."""

from collections.abc import Mapping
from typing import Any

from explore.base.errors import RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.synthesis.tasks.sections import SectionReader

#: Distance over the size of the task up to which a box is met, as a given pivot is rounded.
_ROUNDING = 1e-6

#: Ranges of the coordinates of a pivot; missing ones are open.
Box = Mapping[str, tuple[float, float]]


def pivot_bounds(
    boxes: Mapping[str, Box], size: float
) -> tuple[dict[str, Mapping[str, str]], dict[str, Mapping[str, float]]]:
    """Formulas of how far pivots are outside their boxes, and constraints on them."""
    places = {
        "crank_pivot": {"x": "crank_pivot_x", "y": "crank_pivot_y"},
        "rocker_pivot": {
            "x": "crank_pivot_x + ground * cos(ground_angle)",
            "y": "crank_pivot_y + ground * sin(ground_angle)",
        },
    }
    formulas: dict[str, Mapping[str, str]] = {}
    constraints: dict[str, Mapping[str, float]] = {}
    for name, box in boxes.items():
        sides = []
        for axis, (low, high) in box.items():
            place = places[name][axis]
            sides += [f"({low!r}) - ({place})", f"{place} - ({high!r})"]
        if sides:
            formulas[f"{name}_outside"] = {"formula": f"max({', '.join(sides)})", "unit": "mm"}
            constraints[f"{name}_outside"] = {"max": _ROUNDING * size}
    return formulas, constraints


def read_box(bounds: SectionReader, name: str) -> Box:
    """The ranges of the coordinates of a pivot: { x = [low, high], y = 5 }."""
    entry = bounds.get(name)
    if entry is None:
        return {}
    example = "{ x = [-50, 50], y = 0 }"
    if not isinstance(entry, Mapping):
        bounds.note(name, f"must be a table such as {example}, got {format_value(entry)}")
        return {}
    box: dict[str, tuple[float, float]] = {}
    for axis, given in entry.items():
        if axis not in ("x", "y"):
            bounds.note(name, f"unknown key; a pivot has x and y, such as {example}", axis)
            continue
        try:
            box[axis] = _range(given)
        except RequestError as error:
            bounds.note(name, str(error), axis)
    return box


def _range(given: Any) -> tuple[float, float]:
    """Two ends from a list of them, or from one number."""
    ends = given if isinstance(given, list) else [given, given]
    if len(ends) != 2:
        raise RequestError(f"must be a number or two such as [-50, 50], got {format_value(given)}")
    low, high = (quantity(end, "mm") for end in ends)
    if low > high:
        raise RequestError(f"must be [least, largest], got {format_value(given)}")
    return low, high
