"""Mechanisms of pylinkage, as its `mechanism_to_dict` and `mechanism_to_json` write them."""

import cmath
import json
import math
from collections.abc import Mapping
from typing import Any

from explore.base.errors import RequestError
from explore.base.suggest import format_value
from explore.mechanisms.linkages.table import FRAME
from explore.studies.imports.drawn import Drawn, DrawnSlot

#: Distance of a joint from its line over the largest coordinate that is rounding.
_OFF = 1e-6

_OLD_TYPES = ("Static", "Crank", "Revolute", "Fixed", "Linear", "Prismatic")


def read_pylinkage(text: str) -> Drawn:
    """The linkage of a JSON text; a `RequestError` has one line, if it is none of a mechanism."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RequestError(f"is no JSON: {error}") from None
    joints, links = (_entries(data, name) for name in ("joints", "links"))
    if any(joint.get("type") in _OLD_TYPES for joint in joints):
        raise RequestError("is of a linkage of old versions; save it with mechanism_to_json of pylinkage 1 or later")
    return _Reader(joints, links).read()


def _entries(data: object, name: str) -> list[Mapping[str, Any]]:
    entries = data.get(name) if isinstance(data, Mapping) else None
    if not isinstance(entries, list) or not all(isinstance(each, Mapping) for each in entries):
        raise RequestError(f"has no list '{name}', so it is no mechanism of pylinkage")
    for each in entries:
        if not isinstance(each.get("id"), str):
            raise RequestError(f"one of its {name} has no id")
    return entries


class _Reader:
    """Joints and links of one mechanism."""

    def __init__(self, joints: list[Mapping[str, Any]], links: list[Mapping[str, Any]]) -> None:
        self._joints = {joint["id"]: joint for joint in joints}
        self._links, self._drawn = links, Drawn()
        self._names = {each["id"]: _name(each) for each in (*joints, *links)}

    def read(self) -> Drawn:
        drawn = self._drawn
        trackers = [joint for joint in self._joints.values() if joint.get("type") == "tracker"]
        for joint in self._joints.values():
            if joint not in trackers:
                drawn.points[self._names[joint["id"]]] = self._place(joint)
        for link in self._links:
            self._add_link(link)
        for joint in self._joints.values():
            name = self._names[joint["id"]]
            if joint.get("type") == "ground" and name not in drawn.links[FRAME]:
                drawn.links[FRAME].append(name)
            if joint.get("type") == "prismatic":
                drawn.slots[f"{name}_slot"] = DrawnSlot(name, FRAME, self._axis(joint, drawn.points[name]))
        for joint in trackers:
            self._add_tracker(joint)
        if not drawn.driver:
            raise RequestError("has no link of the type 'driver'; name the one that turns")
        return drawn

    def _axis(self, joint: Mapping[str, Any], place: complex) -> complex:
        """The direction of the line of a joint, which is to be on it."""
        name = self._names[joint["id"]]
        axis = _vector(joint.get("axis", [1.0, 0.0]), f"the axis of {name}")
        if "line_point" in joint:
            offset = place - _vector(joint["line_point"], f"the line_point of {name}")
            if abs((offset * axis.conjugate()).imag) > _OFF * abs(axis) * max(map(abs, self._drawn.points.values())):
                raise RequestError(
                    f"the position of {name[:40]} is not on its line; assemble the mechanism before you save it"
                )
        return axis

    def _place(self, joint: Mapping[str, Any]) -> complex:
        position = joint.get("position")
        if position is None or (isinstance(position, list) and None in position):
            raise RequestError(
                f"the joint {joint['id'][:40]} has no position; assemble the mechanism before you save it"
            )
        return _vector(position, f"the position of {joint['id'][:40]}")

    def _add_link(self, link: Mapping[str, Any]) -> None:
        name, kind = self._names[link["id"]], link.get("type", "link")
        points = link.get("joints")
        if not isinstance(points, list) or not all(isinstance(p, str) and p in self._joints for p in points):
            raise RequestError(f"the joints of the link {link['id'][:40]} are not all in its list of joints")
        names = [self._names[point] for point in points if self._joints[point].get("type") != "tracker"]
        if kind == "ground":
            self._drawn.links[FRAME] += [point for point in names if point not in self._drawn.links[FRAME]]
            return
        self._drawn.links[name] = list(dict.fromkeys(names))
        if kind in ("driver", "arc_driver"):
            if self._drawn.driver:
                raise RequestError(f"has two drivers, {self._drawn.driver} and {name}; a linkage has one")
            self._drawn.driver = name
            motor = link.get("motor_joint")
            if isinstance(motor, str) and motor in self._joints and self._names[motor] not in self._drawn.links[FRAME]:
                self._drawn.links[FRAME].append(self._names[motor])
        if kind == "driver" and _number(link.get("angular_velocity", 1.0), f"the angular_velocity of {name}") < 0.0:
            self._drawn.remarks.append(f"{name} turns counter-clockwise here, and clockwise in pylinkage")
        if kind == "arc_driver":
            self._drawn.remarks.append(f"{name} turns fully here, and to and fro between two angles in pylinkage")

    def _add_tracker(self, joint: Mapping[str, Any]) -> None:
        """A point at a distance and an angle from one joint, seen towards another, is of the link that has both."""
        name, drawn = self._names[joint["id"]], self._drawn
        ends = [self._names.get(str(joint.get(key)), "") for key in ("ref_joint1_id", "ref_joint2_id")]
        link = next((link for link, points in drawn.links.items() if set(ends) <= set(points)), None)
        if link is None:
            drawn.remarks.append(f"{name} is left out: no link has both joints that it follows")
            return
        first, second = (drawn.points[end] for end in ends)
        distance, angle = (_number(joint.get(key), f"{key} of {name}") for key in ("distance", "angle"))
        drawn.points[name] = first + cmath.rect(distance, angle + cmath.phase(second - first))
        drawn.links[link].append(name)


def _name(entry: Mapping[str, Any]) -> str:
    name = entry.get("name")
    return name if isinstance(name, str) and name else str(entry["id"])


def _vector(value: object, what: str) -> complex:
    if not isinstance(value, list) or len(value) != 2:
        raise RequestError(f"{what} is no pair of numbers: {format_value(value)}")
    return complex(*(_number(each, what) for each in value))


def _number(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RequestError(f"{what} is no finite number: {format_value(value)}")
    return float(value)
