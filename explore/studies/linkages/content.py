"""The content of [linkage] that describes a table: `reading.read_table` reads it as the same table."""

import math
from dataclasses import fields
from typing import Any

from explore.mechanisms.linkages.coordinate import ZERO, Coordinate, Place
from explore.mechanisms.linkages.group_steps import groups_of
from explore.mechanisms.linkages.load_table import Curve, Element, Loads, Mass, Motor
from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import Body, LinkageTable, TableParameter
from explore.studies.linkages.branch import two_sided, words_of
from explore.studies.linkages.coordinates import text_of
from explore.studies.linkages.groups import branch_of

#: Largest number that is written without a decimal point.
_LARGEST_WHOLE = 1e15


def content_of(table: LinkageTable) -> dict[str, Any]:
    """The sections of a table, with the sides of joints in place of a sketch; equal for equal tables."""
    steps = find_steps(table)
    sides, groups = two_sided(steps), groups_of(steps)
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
        "branch": {name: words_of(sides[name])[sign < 0] for name, sign in table.signs}
        | {
            link: said
            for group, start in zip(groups, table.starts, strict=True)
            for link, said in branch_of(group, start).items()
        },
        "loads": _loads(table.loads) if table.loads else {},
        "parameters": {
            p.name: declared
            for p in table.parameters
            if (declared := _declared(p, tells_unit=p.name not in table.moving_names or p.unit == "1"))
        },
    }
    return {name: part for name, part in parts.items() if part}


def _loads(loads: Loads) -> dict[str, Any]:
    """The section of the loads."""
    parts: dict[str, Any] = {
        "gravity": _pair(loads.gravity) if loads.gravity else [],
        "masses": {mass.owner: _mass(mass) for mass in loads.masses},
        "forces": {force.point: _pair(force.force) for force in loads.forces},
        "torques": {each.name: _torque(each) for each in loads.elements if each.kind == "torque"},
        "opposing": {each.name: _number(each.size) for each in loads.elements if each.kind == "opposing"},
        "friction": {each.name: _friction(each) for each in loads.elements if "friction" in each.kind},
        "springs": {each.name: _spring(each) for each in loads.elements if each.kind == "spring"},
        "dampers": {each.name: _spring(each) for each in loads.elements if each.kind == "damper"},
        "curves": {curve.name: _curve(curve) for curve in loads.curves},
        "motor": {each.name: _number(getattr(loads.motor, each.name)) for each in fields(Motor)} if loads.motor else {},
    }
    return {name: part for name, part in parts.items() if part}


def _mass(mass: Mass) -> Any:
    if mass.centroid == mass.owner:
        return _number(mass.mass)
    centroid = mass.centroid if isinstance(mass.centroid, str) else _pair(mass.centroid)
    inertia = {} if mass.inertia == ZERO else {"inertia": _number(mass.inertia)}
    return {"mass": _number(mass.mass), "centroid": centroid, **inertia}


def _torque(element: Element) -> Any:
    size = _number(element.size)
    return size if len(element.ends) == 1 else {"torque": size, "against": element.ends[1]}


def _friction(element: Element) -> Any:
    size = _number(element.size)
    return {"coefficient": size, "radius": _number(element.rest)} if element.rest else size


def _spring(element: Element) -> dict[str, Any]:
    ends = element.ends[0] if len(element.ends) == 1 else list(element.ends)
    return {"between": ends, "rate": _number(element.size)} | ({"rest": _number(element.rest)} if element.rest else {})


def _curve(curve: Curve) -> dict[str, Any]:
    over: Any = curve.over
    if not isinstance(over, str):
        over = {"point": over[0], "along": _pair(over[1])}
    points = [[_whole(x), _whole(y)] for x, y in curve.points]
    return {"over": over, "points": points} | ({"shape": "cubic"} if curve.is_cubic else {})


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


def _declared(parameter: TableParameter, *, tells_unit: bool) -> dict[str, Any]:
    """What [linkage.parameters] has to say of a parameter; empty where its use says everything."""
    stated = {
        "default": parameter.default,
        "min": parameter.lower if math.isfinite(parameter.lower) else None,
        "max": parameter.upper if math.isfinite(parameter.upper) else None,
        "meaning": parameter.meaning or None,
    }
    given = {name: value for name, value in stated.items() if value is not None}
    return {"unit": parameter.unit, **given} if given or tells_unit else {}
