"""Read the bodies and joints of a table: points of the frame and of links, slots, and links that only translate."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from explore.base.entries import read_table
from explore.base.errors import KeyPath, Problems
from explore.base.suggest import closest_name, format_value, suggestion
from explore.mechanisms.linkages.coordinate import ZERO, Coordinate, Place
from explore.mechanisms.linkages.table import FRAME, Body, Slide, Slot, sliders_of
from explore.studies.linkages.coordinates import read_pair, read_place, value_of
from explore.studies.linkages.names import reason_against

#: The section of a study, which the keys of all problems begin with.
SECTION = "linkage"

_EXAMPLES = {
    "frame": "O = [0, 0]",
    "links": 'crank = { O = 0, A = "r" }',
    "slots": 'ram = { pin = "S", link = "frame", along = [[0, 0], [1, 0]] }',
    "slides": 'yoke = { link = "frame", direction = [1, 0] }',
    "copies": "b = 120",
    "branch": 'B = "left of A C"',
    "sketch": "crank_angle = 40",
    "loads": "gravity = [0, -9.81]",
    "parameters": 'k = { unit = "1" }',
}
_SLOT_KEYS, _SLIDE_KEYS = ("pin", "link", "along"), ("link", "direction")


def read_part(section: Mapping[str, Any], name: str, problems: Problems) -> Mapping[str, Any]:
    """A table within [linkage], by its name; an empty one where it is missing or wrong."""
    return read_table(section.get(name, {}), (SECTION, name), (), _EXAMPLES[name], problems)


@dataclass
class Structure:
    """The bodies and joints that a section describes.

    `problems` has what is wrong with them; `is_whole` is False where so much is that joints may be missing. `copied`
    has the point or slot that each one of a copy is of, `phases` the link, and the phase, deg.
    """

    problems: Problems
    is_whole: bool = True
    bodies: dict[str, Body] = field(default_factory=dict)
    slots: list[Slot] = field(default_factory=list)
    slides: list[Slide] = field(default_factory=list)
    travel: Place | None = None
    copied: dict[str, str] = field(default_factory=dict)
    phases: dict[str, tuple[str, Coordinate]] = field(default_factory=dict)

    @property
    def links(self) -> tuple[Body, ...]:
        """The moving bodies."""
        return tuple(body for body in self.bodies.values() if body.name != FRAME)

    @property
    def sliders(self) -> tuple[str, ...]:
        """The slots, and the links that slide and do not turn."""
        return sliders_of(self.slots, self.slides)

    @property
    def points(self) -> tuple[str, ...]:
        """All points, each once."""
        return tuple(dict.fromkeys(point for body in self.bodies.values() for point, _ in body.points))


def read_structure(section: Mapping[str, Any], problems: Problems) -> Structure:
    """The bodies and joints of a section; those that are wrong are left out after their problems are appended."""
    structure = Structure(problems)
    parts = {name: read_part(section, name, problems) for name in ("frame", "links", "slots", "slides")}
    for name in ("frame", "links"):
        if not parts[name] and isinstance(section.get(name, {}), Mapping):
            key: KeyPath = (SECTION, name) if name in section else (SECTION,)
            problems.append((key, f"[linkage.{name}] has no entry; write one such as {_EXAMPLES[name]}"))
        structure.is_whole &= bool(parts[name])
    structure.bodies[FRAME] = _body(FRAME, parts["frame"], (SECTION, "frame"), problems)
    for name, entry in parts["links"].items():
        key = (SECTION, "links", name)
        if not isinstance(entry, Mapping):
            problems.append((key, f"must be a table such as {_EXAMPLES['links']}, got {format_value(entry)}"))
        elif not entry:
            problems.append((key, f"has no point; write the points of the link, such as {_EXAMPLES['links']}"))
        structure.is_whole &= isinstance(entry, Mapping) and bool(entry)
        structure.bodies[name] = _body(name, entry if isinstance(entry, Mapping) else {}, key, problems)
    structure.slots += [_slot(structure, name, entry) for name, entry in parts["slots"].items()]
    structure.slides += [_slide(structure, name, entry) for name, entry in parts["slides"].items()]
    if "travel" in section:
        structure.travel = read_pair(section["travel"], (SECTION, "travel"), problems, "[first, last]")
    taken = dict.fromkeys(structure.points, "a point")
    for kind, word in (("links", "a link"), ("slots", "a slot")):
        for name in parts[kind]:
            reason = f"this is also the name of {taken[name]}; choose another" if name in taken else ""
            if reason := reason_against(name) or reason:
                problems.append(((SECTION, kind, name), reason))
            taken.setdefault(name, word)
    return structure


def _body(name: str, entries: Mapping[str, Any], key: KeyPath, problems: Problems) -> Body:
    points = []
    for point, entry in entries.items():
        if reason := reason_against(point):
            problems.append(((*key, point), reason))
        points.append((point, read_place(entry, (*key, point), problems)))
    return Body(name, tuple(points))


def _slot(structure: Structure, name: str, entry: object) -> Slot:
    key = (SECTION, "slots", name)
    given = read_table(entry, key, _SLOT_KEYS, _EXAMPLES["slots"], structure.problems, _SLOT_KEYS)
    pin = _named(structure, given, "pin", key, structure.points)
    link = _named(structure, given, "link", key, structure.bodies)
    along = given.get("along")
    ends: tuple[str | Place, ...] = ()
    before = len(structure.problems)
    if isinstance(along, list | tuple) and len(along) == 2:
        ends = tuple(_end(structure, each, link, (*key, "along", number)) for number, each in enumerate(along))
        places = structure.bodies[link].place_of if link in structure.bodies else {}
        found = [places.get(end) if isinstance(end, str) else end for end in ends]
        if len(structure.problems) == before and None not in found and found[0] == found[1]:
            reason = "the two ends are the same place, so they give no direction"
            structure.problems.append(((*key, "along"), reason))
    elif along is not None:
        reason = 'must be two points of the link, or pairs in its coordinates, such as ["C", [1, 0]]'
        structure.problems.append(((*key, "along"), f"{reason}, got {format_value(along)}"))
    body = structure.bodies.get(link)
    if body and pin in body.place_of:
        reason = f"{pin} is a point of {link}, so it cannot move along a line of it; name a pin of another link"
        structure.problems.append(((*key, "pin"), reason))
        structure.is_whole = False
    return Slot(name, pin, link, (ends[0], ends[1]) if ends else ((ZERO, ZERO), (ZERO, ZERO)))


def _end(structure: Structure, entry: object, link: str, key: KeyPath) -> str | Place:
    """One of the two ends of a slot."""
    if isinstance(entry, Mapping):
        return read_place(entry, key, structure.problems)
    if not isinstance(entry, str):
        return read_pair(entry, key, structure.problems)
    body = structure.bodies.get(link)
    if body is not None and body.points and entry not in body.place_of:
        hint = suggestion(entry, body.place_of)
        structure.problems.append((key, f"{format_value(entry)} is no point of {link}; {hint}"))
    return entry


def _slide(structure: Structure, name: str, entry: object) -> Slide:
    key = (SECTION, "slides", name)
    problems = structure.problems
    links = [link.name for link in structure.links]
    if name not in links:
        problems.append(
            (key, f"unknown link {format_value(name)}; a slide has the name of its link; {suggestion(name, links)}")
        )
    given = read_table(entry, key, _SLIDE_KEYS, _EXAMPLES["slides"], problems, _SLIDE_KEYS)
    body = _named(structure, given, "link", key, structure.bodies)
    if body == name:
        problems.append(((*key, "link"), f"{name} cannot slide in itself; name another link or {FRAME}"))
    before = len(problems)
    direction = read_pair(given["direction"], (*key, "direction"), problems) if "direction" in given else (ZERO, ZERO)
    fixed = not direction[0].names and not direction[1].names
    if (
        "direction" in given
        and len(problems) == before
        and fixed
        and math.hypot(*(value_of(c, {}) for c in direction)) == 0.0
    ):
        problems.append(((*key, "direction"), "has no length, so it is no direction; write one such as [1, 0]"))
    return Slide(name, body, direction)


def _named(structure: Structure, given: Mapping[str, Any], word: str, key: KeyPath, names: Iterable[str]) -> str:
    """The point or link that an entry names; in place of an unknown one, which is noted, the closest or none."""
    name, known = given.get(word, ""), list(names)
    if name in known:
        return str(name)
    kind = "point" if word == "pin" else "link"
    if not isinstance(name, str):
        structure.problems.append(((*key, word), f"must be a string in quotes, got {format_value(name)}"))
    elif word in given:
        structure.problems.append(((*key, word), f"unknown {kind} {format_value(name)}; {suggestion(name, known)}"))
    match = closest_name(str(name), known) or ""
    structure.is_whole &= bool(match)
    return match


def note_loose_links(structure: Structure) -> None:
    """Note links with one joint or none, which are mostly misspelt pins; nothing where other joints are missing."""
    for body in structure.links if structure.is_whole else ():
        joints = _joints(structure, body)
        if len(joints) > 1:
            continue
        found = f"has one joint only, {joints[0]}" if joints else "has no joint"
        alone = [point for point, _ in body.points if point not in joints]
        others = [point for point in structure.points if point not in body.place_of]
        matches = [(point, match) for point in alone if (match := closest_name(point, others))]
        hint = (
            f"is {matches[0][0]} to be '{matches[0][1]}'?" if matches else f"is {alone[0]} misspelt?" if alone else ""
        )
        reason = f"{found}; a pin joins links that name the same point{hint and f': {hint}'}"
        structure.problems.append(((SECTION, "links", body.name), reason))


def _joints(structure: Structure, body: Body) -> list[str]:
    """The pins, slots and slides that join a body to others."""
    others = [other for other in structure.bodies.values() if other is not body]
    shared = {point for other in others for point, _ in other.points}
    pins = shared | {slot.pin for slot in structure.slots if slot.body != body.name}
    joints = [point for point, _ in body.points if point in pins]
    joints += [slot.name for slot in structure.slots if slot.body == body.name]
    return joints + [slide.link for slide in structure.slides if body.name in (slide.link, slide.body)]
