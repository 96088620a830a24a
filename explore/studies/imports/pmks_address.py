"""Addresses of PMKS+, whose query holds the linkage: settings, joints, links and forces, with numbers of 64 digits.

The format is that of `string-transcoder.ts` of PMKS-Web/PMKSWeb.
"""

import cmath
import math
from dataclasses import dataclass
from urllib.parse import unquote

from explore.base.errors import RequestError
from explore.mechanisms.linkages.table import FRAME
from explore.studies.imports.drawn import Drawn, DrawnSlot

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
# Bits of the first character of a joint.
_PRISMATIC, _INPUT, _GROUNDED, _WELDED = 1, 2, 4, 8
#: First characters of links that are parts of another one only.
_PARTS = "Namg4567"
#: Millimetres of inches, centimetres and metres, by the first of the enumerated settings; of no unit 1.
_UNITS = (25.4, 10.0, 1000.0, 1.0)
#: Angle within which a written one, rounded to 0.001 rad, is a multiple of 90 deg, rad.
_ROUNDING = 0.0006


@dataclass(frozen=True)
class _Joint:
    flags: int
    name: str
    place: complex
    angle: float
    slot: tuple[str, ...]  # of one that moves: the link that has it, and two joints of this along its line


def read_pmks(text: str) -> Drawn:
    """The linkage of an address or of its query; a `RequestError` says in one line where it is none."""
    query = unquote(text.strip().partition("?")[2] or text.strip())
    parts = query.split(".")
    if len(parts) < 8 or not parts[3]:
        raise RequestError("is no address of PMKS+ with a linkage: ...?settings.joints.links.forces")
    groups: list[list[str]] = [[], [], []]
    at = 0
    for part in parts[4:]:
        if part:
            groups[min(at, 2)].append(part)
        else:
            at += 1
    unit = _number(parts[3][0])
    scale = _UNITS[unit] if 0 <= unit < len(_UNITS) else 1.0
    joints = {}
    for part in groups[0]:
        identifier, joint = _joint(part, scale)
        joints[identifier] = joint
    drawn = _read(joints, [part for part in groups[1] if part[0] not in _PARTS])
    if _number(parts[0]) & 1:
        drawn.remarks.append("the driver turns counter-clockwise here, and clockwise in PMKS+")
    if len(groups[2]) > 1:  # the last part is what is selected, and a checksum
        drawn.remarks.append("forces are left out")
    speed = abs(_number(parts[2].partition(",")[0]))
    drawn.speed = f"{speed} rpm" if speed else drawn.speed
    return drawn


def _joint(part: str, scale: float) -> tuple[str, _Joint]:
    flags = _DIGITS.find(part[0])
    tokens = part[1:].split(",")
    if flags < 0 or len(tokens) < 5:
        raise RequestError(f"a joint of the address is damaged: {part[:40]}")
    x, y, angle = (_number(token) / 1000.0 for token in tokens[2:5])
    slot = tuple(tokens[5:8]) if any(tokens[5:6]) else ()
    return tokens[0], _Joint(flags, tokens[1] or tokens[0], complex(x, y) * scale, angle, slot)


def _number(text: str) -> int:
    """A whole number; one that begins with 0 is negative."""
    if len(text) > 12 or any(digit not in _DIGITS for digit in text):
        raise RequestError(f"a number of the address is damaged: {text[:40]}")
    value = 0
    for digit in text:
        value = 64 * value + _DIGITS.index(digit)
    return -value if text.startswith("0") else value


def _read(joints: dict[str, _Joint], parts: list[str]) -> Drawn:
    drawn = Drawn()
    links: dict[str, tuple[str, list[str]]] = {}
    pistons: list[list[str]] = []
    for part in parts:
        tokens = part[2:].split(",")
        ids = tokens[7 : tokens.index("", 7) if "" in tokens[7:] else None]
        if len(tokens) < 8 or any(each not in joints for each in ids):
            raise RequestError(f"a link of the address is damaged: {part[:40]}")
        if part[1] == "P":
            pistons.append(ids)
        else:
            links[tokens[0]] = (tokens[1] or tokens[0], ids)
    pins = {key: joint for key, joint in joints.items() if not joint.flags & _PRISMATIC}
    drawn.points = {joint.name: joint.place for joint in pins.values()}
    drawn.links[FRAME] = [joint.name for joint in pins.values() if joint.flags & _GROUNDED]
    for name, ids in links.values():
        drawn.links[name] = [joints[each].name for each in ids if each in pins]
    for ids in pistons:
        _add_piston(drawn, joints, links, ids)
    drawn.driver = _driver(joints, links)
    return drawn


def _add_piston(
    drawn: Drawn, joints: dict[str, _Joint], links: dict[str, tuple[str, list[str]]], ids: list[str]
) -> None:
    """A pin in a slot; where the pin is welded to its block, the link translates along the slot."""
    pin = next((joints[each] for each in ids if not joints[each].flags & _PRISMATIC), None)
    slot = next((joints[each] for each in ids if joints[each].flags & _PRISMATIC), None)
    if pin is None or slot is None:
        raise RequestError("a slider of the address has no pin")
    if slot.flags & _INPUT:
        raise RequestError(
            f"{slot.name} is a driven slider or cylinder, which is not read; write it as travel in [linkage]"
        )
    body, direction = FRAME, cmath.rect(1.0, slot.angle)
    if slot.slot:
        link, *ends = slot.slot
        body, its_joints = links.get(link, ("", []))
        places = [joints[end].place for end in ends if end in its_joints]
        if len(places) != 2 or places[0] == places[1]:
            raise RequestError(f"the slot {slot.name} of the address is damaged: two joints of a link have its line")
        direction = places[1] - places[0]
    elif abs(math.remainder(slot.angle, math.pi / 2)) < _ROUNDING:
        direction = complex(round(direction.real), round(direction.imag))
    if not pin.flags & _WELDED:
        drawn.slots[slot.name] = DrawnSlot(pin.name, body, direction)
        return
    for name, points in list(drawn.links.items()):
        if pin.name in points and name not in (FRAME, body):
            drawn.slides[name] = (body, direction)


def _driver(joints: dict[str, _Joint], links: dict[str, tuple[str, list[str]]]) -> str:
    inputs = [key for key, joint in joints.items() if joint.flags & _INPUT]
    if len(inputs) != 1:
        raise RequestError(f"has {len(inputs)} joints that are driven; a linkage has one driver")
    joint = joints[inputs[0]]
    if not joint.flags & _GROUNDED:
        raise RequestError(f"its driven joint {joint.name} is not in the frame, which is not read")
    return next((name for name, ids in links.values() if inputs[0] in ids), "")
