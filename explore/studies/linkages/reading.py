"""Read the section [linkage] of a study as the table of a linkage, with all its mistakes at once."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from explore.base.entries import note_unknown
from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value, one_line, suggestion
from explore.base.units.quantities import exact_angle
from explore.mechanisms.linkages.group_steps import groups_of
from explore.mechanisms.linkages.steps import PoseBySlot, TableError, find_steps
from explore.mechanisms.linkages.table import FRAME, LinkageTable, TableParameter
from explore.studies.linkages.branch import note_missing, note_odd_words, read_branch, two_sided
from explore.studies.linkages.copies import add_copies
from explore.studies.linkages.friction import note_resting_pins, note_rigid_parts
from explore.studies.linkages.groups import note_groups, read_starts
from explore.studies.linkages.loads import LoadReader
from explore.studies.linkages.parallel_lines import note_parallel_lines
from explore.studies.linkages.parameters import located_coordinates, note_unused, read_parameters, rough_values
from explore.studies.linkages.sketch import Sketch, read_places
from explore.studies.linkages.structure import SECTION, Structure, note_loose_links, read_part, read_structure

_KEYS = (
    "driver", "travel", "range", "output", "frame", "links", "slots", "slides", "copies", "branch", "sketch",
    "parameters", "loads",
)  # fmt: skip
#: A turn of the crank, deg.
_TURN = 360.0
#: Largest number of points.
_MOST_POINTS = 60
#: Largest number of links.
_MOST_LINKS = 40
#: Largest number of links, slots and slides together: all their maxima cost up to 0.1 s of CPU time each.
_MOST_PARTS = 45
#: Largest number of them in a table with loads, where each costs up to 0.2 s.
_MOST_LOADED_PARTS = 26
#: Largest number of slots.
_MOST_SLOTS = 40
#: Largest number of parameters.
_MOST_PARAMETERS = 100
#: Largest number of numbers, names and operators of all coordinates together: each costs about 0.2 ms of compilation.
_MOST_STEPS = 1_000
#: Largest number of characters of a reason.
_LONGEST_REASON = 1000


def read_table(
    section: object, entries: Mapping[str, Any], problems: Problems, folder: Path | None = None
) -> LinkageTable | None:
    """The table that [linkage] describes, valid only without problems; None where it describes no linkage.

    The entries are those of [parameters], whose values a sketch is of; the files of curves are in the folder, and none
    is read without one.
    """
    found: Problems = []
    table = _read(section, entries, found, folder)
    # The names in a reason may be anything that a text can hold.
    problems += [(key, one_line(reason[:_LONGEST_REASON])) for key, reason in found]
    return table


def _read(section: object, entries: Mapping[str, Any], problems: Problems, folder: Path | None) -> LinkageTable | None:
    before = len(problems)
    if not isinstance(section, Mapping):
        problems.append(((SECTION,), f"must be a table with driver, frame and links, got {format_value(section)}"))
        return None
    note_unknown(section, _KEYS, problems, (SECTION,))
    if reason := _reason_against_size(section):
        problems.append(((SECTION,), reason))
        return None
    structure = read_structure(section, problems)
    driver = _driver(section, structure, problems)
    _add_copies(structure, driver, read_part(section, "copies", problems))
    output = _output(section, driver, structure, problems)
    reader = LoadReader(structure, driver, output, folder, turns="range" not in section)
    loads = reader.read(read_part(section, "loads", problems))
    coordinates = [*located_coordinates(structure), *reader.coordinates]
    taken = dict.fromkeys(structure.points, "a point") | {slot.name: "a slot" for slot in structure.slots}
    parameters = read_parameters(
        read_part(section, "parameters", problems), coordinates, reader.curves.names, taken, problems
    )
    parts = len(structure.links) + len(structure.slots) + len(structure.slides)
    steps = sum(len(coordinate.steps) for coordinate, _, _ in coordinates)
    if not parameters and len(problems) == before:
        problems.append(((SECTION,), 'no coordinate has a parameter; give one length a name, such as A = "crank"'))
    for count, most, what in (
        (len(parameters), _MOST_PARAMETERS, "parameters"),
        (steps, _MOST_STEPS, "numbers, names and operators in its coordinates"),
        (
            parts,
            _MOST_LOADED_PARTS if loads else _MOST_PARTS,
            f"links, slots and slides{' and loads' if loads else ''}",
        ),
    ):
        if count > most:
            problems.append(((SECTION,), f"has {count:,} {what}; at most {most:,} are possible"))
    note_loose_links(structure)
    table = LinkageTable(
        driver, output, structure.bodies[FRAME], structure.links, tuple(structure.slots), tuple(structure.slides),
        parameters, travel=structure.travel, limits=_limits(section, problems), loads=loads,
    )  # fmt: skip
    if len(problems) == before and (signed := _with_signs(table, section, entries, structure, problems)):
        return signed
    _note_others(section, structure, parameters, entries, problems)
    return None


def _note_others(
    section: Mapping[str, Any],
    structure: Structure,
    parameters: tuple[TableParameter, ...],
    entries: Mapping[str, Any],
    problems: Problems,
) -> None:
    """Note what else is wrong in a table whose joints are not known: sides, sketched places, unused values."""
    if structure.is_whole:
        names = [*structure.points, *(slot.name for slot in structure.slots), *(link.name for link in structure.links)]
        note_odd_words(read_part(section, "branch", problems), names, problems)
        read_places(read_part(section, "sketch", problems), structure.points, problems)
        note_unused(parameters, entries, problems, re.findall(r"\w+", str(section)))


def _reason_against_size(section: Mapping[str, Any]) -> str:
    """Why a table is too large to be read; empty if it is not."""
    bodies = [section.get("frame"), *_values(section.get("links"))]
    points = {point for body in bodies if isinstance(body, Mapping) for point in body}
    for count, most, what in (
        (len(points), _MOST_POINTS, "points"),
        (len(_values(section.get("links"))), _MOST_LINKS, "links"),
        (len(_values(section.get("slots"))), _MOST_SLOTS, "slots"),
        (len(_values(section.get("copies"))), _MOST_LINKS, "copies"),
        (len(_values(section.get("parameters"))), _MOST_PARAMETERS, "parameters"),
    ):
        if count > most:
            return f"has {count:,} {what}; at most {most} are possible"
    return ""


def _add_copies(structure: Structure, driver: str, entries: Mapping[str, Any]) -> None:
    """Add copies to a structure without mistakes; note a number of links, points or slots that is too large."""
    if not entries or structure.problems:
        return
    if driver not in {link.name for link in structure.links}:
        structure.problems.append(((SECTION, "copies"), f"{driver} is driven, so it has no phases; leave them out"))
        return
    add_copies(structure, driver, entries)
    for count, most, what in (
        (len(structure.points), _MOST_POINTS, "points"),
        (len(structure.links), _MOST_LINKS, "links"),
        (len(structure.slots), _MOST_SLOTS, "slots"),
    ):
        if count > most:
            structure.problems.append(((SECTION, "copies"), f"make {count:,} {what}; at most {most} are possible"))


def _values(entries: object) -> list[Any]:
    return list(entries.values()) if isinstance(entries, Mapping) else []


def _driver(section: Mapping[str, Any], structure: Structure, problems: Problems) -> str:
    """The link that turns, or the slot of a driven pin."""
    links = [link.name for link in structure.links]
    slots = [slot.name for slot in structure.slots]
    driver = section.get("driver")
    key: KeyPath = (SECTION, "driver")
    if driver is None:
        problems.append(
            ((SECTION,), "the key 'driver' is missing; write the link that turns, such as driver = \"crank\"")
        )
    elif driver in slots and "travel" not in section:
        reason = f"{driver} is a slot; write the two positions that its pin is driven between, such as travel = [0, 50]"
        problems.append((key, reason))
    elif driver not in (*links, *slots):
        reason = f"unknown link or slot {format_value(driver)}; {suggestion(str(driver), [*links, *slots])}"
        problems.append((key, reason))
    elif driver not in slots and "travel" in section:
        problems.append(((SECTION, "travel"), f"{driver} turns; leave it out, or name the slot of a driven pin"))
    return str(driver)


def _limits(section: Mapping[str, Any], problems: Problems) -> tuple[float, float] | None:
    """The first and the last crank angle of a driver that does not turn fully, deg."""
    if "range" not in section:
        return None
    ends, key = section["range"], (SECTION, "range")
    if not isinstance(ends, list | tuple) or len(ends) != 2:
        reason = f"must be the first and the last crank angle, such as [-50, 50], got {format_value(ends)}"
        problems.append((key, reason))
        return None
    try:
        first, last = (float(exact_angle(end)) for end in ends)
    except RequestError as error:
        problems.append((key, str(error)))
        return None
    if not first < last:
        problems.append((key, f"the first crank angle, {first:g}, must be below the last, {last:g}"))
    elif last - first >= _TURN:
        problems.append((key, f"spans {last - first:g} deg; leave it out for a driver that turns fully"))
    elif not -_TURN < first < _TURN:
        problems.append(
            (key, f"begins a turn or more from 0; write [{first % _TURN:g}, {first % _TURN + last - first:g}]")
        )
    return first, last


def _output(section: Mapping[str, Any], driver: str, structure: Structure, problems: Problems) -> str:
    """The link or slot of the plain statistics."""
    links = [link.name for link in structure.links]
    slots = [slot.name for slot in structure.slots]
    output = section.get("output", "")
    if output == driver and output in (*links, *slots):
        motion = "turns at constant speed" if output in links else "is driven"
        problems.append(((SECTION, "output"), f"{output} {motion}; name another link or a slot"))
    elif output not in ("", *links, *slots):
        reason = f"unknown link or slot {format_value(output)}; {suggestion(str(output), [*links, *slots])}"
        problems.append(((SECTION, "output"), reason))
    return str(output)


def _with_signs(
    table: LinkageTable,
    section: Mapping[str, Any],
    entries: Mapping[str, Any],
    structure: Structure,
    problems: Problems,
) -> LinkageTable | None:
    """The table with the side of each joint, by [linkage.branch] or the sketch; copies have that of their original."""
    copied = structure.copied
    try:
        steps = find_steps(table)
    except TableError as error:
        kind = "slots" if error.name in {slot.name for slot in table.slots} else "links"
        problems.append(((SECTION, kind, error.name), str(error)))
        return None
    note_parallel_lines(table, steps, problems)
    note_resting_pins(table, steps, problems)
    note_rigid_parts(table, steps, problems)
    before, groups = len(problems), groups_of(steps)
    note_groups(groups, problems)
    all_sides = two_sided(steps)
    sides = {name: step for name, step in all_sides.items() if name not in copied}
    branch = read_part(section, "branch", problems)
    of_groups = {link for group in groups for link in (group.first, group.second)}
    signs = read_branch({k: v for k, v in branch.items() if k not in of_groups}, table, sides, problems)
    sketch = None
    if "sketch" in section:
        moving = tuple(p for p in table.parameters if p.name in table.moving_names)
        values = rough_values(moving, entries, problems)
        if len(values) < len(moving):
            return table
        sketch = Sketch.read(read_part(section, "sketch", problems), table, steps, values, problems)
        if sketch is not None:
            signs |= sketch.signs(sides, signs)
    starts = read_starts(branch, groups, sketch, structure.phases, problems) if len(problems) == before else ()
    signs = {name: 1 for name, step in sides.items() if isinstance(step, PoseBySlot)} | signs
    if len(problems) == before:
        missing = {name: step for name, step in sides.items() if name not in signs}
        note_missing(missing, problems, has_branch="branch" in section)
    sided = tuple((name, signs.get(copied.get(name, name), 1)) for name in all_sides)
    return replace(table, signs=sided, starts=starts)
