"""The content of [linkage] that describes a table: `reading.read_table` reads it as the same table."""

import math
from typing import Any

from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import Body, Coordinate, LinkageTable, Place, TableParameter
from explore.studies.linkages.branch import two_sided, words_of
from explore.studies.linkages.coordinates import ZERO, text_of

#: Largest number that is written without a decimal point.
_LARGEST_WHOLE = 1e15


def content_of(table: LinkageTable) -> dict[str, Any]:
    """The sections of a table, with the sides of joints in place of a sketch; equal for equal tables."""
    sides = two_sided(find_steps(table))
    parts: dict[str, Any] = {
        "driver": table.driver,
        "output": table.output,
        "travel": _pair(table.travel) if table.travel else [],
        "range": [_whole(angle) for angle in table.limits or ()],
        "frame": {name: _pair(place) for name, place in table.frame.points},
        "links": {link.name: _points(link) for link in table.links},
        "slots": {
            slot.name: {
                "pin": slot.pin,
                "link": slot.body,
                "along": [end if isinstance(end, str) else _pair(end) for end in slot.along],
            }
            for slot in table.slots
        },
        "slides": {slide.link: {"link": slide.body, "direction": _pair(slide.direction)} for slide in table.slides},
        "branch": {name: words_of(sides[name])[sign < 0] for name, sign in table.signs},
        "parameters": {p.name: declared for p in table.parameters if (declared := _declared(p))},
    }
    return {name: part for name, part in parts.items() if part}


def _points(body: Body) -> dict[str, Any]:
    return {name: _number(place[0]) if place[1] == ZERO else _pair(place) for name, place in body.points}


def _pair(place: Place) -> list[Any]:
    return [_number(coordinate) for coordinate in place]


def _number(coordinate: Coordinate) -> float | str:
    """A coordinate as the number or the expression of a study."""
    if coordinate.names:
        return text_of(coordinate)
    return _whole(coordinate.steps[0][1])


def _whole(value: float) -> float:
    return int(value) if value.is_integer() and abs(value) < _LARGEST_WHOLE else value


def _declared(parameter: TableParameter) -> dict[str, Any]:
    """What [linkage.parameters] has to say of a parameter; empty where its use says everything."""
    stated = {
        "default": parameter.default,
        "min": parameter.lower if math.isfinite(parameter.lower) else None,
        "max": parameter.upper if math.isfinite(parameter.upper) else None,
        "meaning": parameter.meaning or None,
    }
    given = {name: value for name, value in stated.items() if value is not None}
    return {"unit": parameter.unit, **given} if given or parameter.unit == "1" else {}
