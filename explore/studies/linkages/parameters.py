"""The parameters of a table: their units by how coordinates use them, what [linkage.parameters] says, and values."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any

from explore.base.entries import read_number, read_table
from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.quantities import quantity
from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.loads import SPEED
from explore.mechanisms.linkages.table import TableParameter
from explore.model.target_kinds import BODY_POSE, STARTS
from explore.studies.linkages.coordinates import uses_of
from explore.studies.linkages.names import reason_against
from explore.studies.linkages.structure import SECTION, Structure

_KEYS = ("unit", "default", "min", "max", "meaning")
#: Units that a parameter can be declared in, first of coordinates, then of loads.
_UNITS = (
    "mm", "deg", "1", "kg", "kg m^2", "N", "N m", "N/m", "N m/rad", "N s/m", "N m s/rad", "m/s^2",
)  # fmt: skip

_KINDS = {"mm": "a length", "deg": "an angle"}

#: A coordinate, its key and its unit.
Located = tuple[Coordinate, KeyPath, str]
#: Names of the parameters that targets add.
_OF_TARGETS = {parameter.name for parameter in (*BODY_POSE, *STARTS)}


def located_coordinates(structure: Structure) -> Iterator[Located]:
    """All coordinates of a table with their keys, in the order of the table."""
    for body in structure.bodies.values():
        base: KeyPath = (SECTION, "frame") if body.name not in {link.name for link in structure.links} else (
            SECTION, "links", body.name,
        )  # fmt: skip
        for point, place in body.points:
            yield from ((coordinate, (*base, point), "mm") for coordinate in place)
    for slot in structure.slots:
        for number, end in enumerate(slot.along):
            key = (SECTION, "slots", slot.name, "along", number)
            yield from ((coordinate, key, "mm") for coordinate in end if isinstance(coordinate, Coordinate))
    for slide in structure.slides:
        yield from ((coordinate, (SECTION, "slides", slide.link, "direction"), "mm") for coordinate in slide.direction)
    yield from ((coordinate, (SECTION, "travel"), "mm") for coordinate in structure.travel or ())


def read_parameters(
    declared: Mapping[str, Any],
    coordinates: list[Located],
    curves: Collection[str],
    taken: Mapping[str, str],
    problems: Problems,
) -> tuple[TableParameter, ...]:
    """The parameters of all coordinates, in the order of their first use.

    Curves stand in expressions as parameters do; `taken` says what points and slots are, whose names no parameter has.
    """
    units: dict[str, set[str]] = {}
    found: dict[str, KeyPath] = {}
    for coordinate, key, unit in coordinates:
        for name in coordinate.names:
            found.setdefault(name, key)
            units.setdefault(name, set())
        for name, told in _told_units(coordinate, unit):
            units[name].add(told)
    for name in curves:
        found.pop(name, None)
    for name, key in found.items():
        if reason := reason_against(name) or (f"{name} is also the name of {taken[name]}" if name in taken else ""):
            problems.append((key, f"the parameter {format_value(name)}: {reason}"))
    for name in declared:
        if name not in found:
            hint = suggestion(name, found) if found else "no coordinate has a parameter"
            problems.append(((SECTION, "parameters", name), f"is never used; {hint}"))
    return tuple(_parameter(name, units[name], declared.get(name, {}), found[name], problems) for name in found)


def _told_units(coordinate: Coordinate, unit: str) -> Iterator[tuple[str, str]]:
    """Parameters with the units in which a coordinate uses them; of a load only one that stands alone."""
    lengths, angles = uses_of(coordinate)
    yield from ((name, "deg") for name in angles)
    is_alone = {operation for operation, _ in coordinate.steps} <= {"input", "negate"}
    if unit == "mm" or is_alone:
        yield from ((name, unit) for name in lengths)
    if unit == "mm":  # as in "0 * r": of no unit of its own
        yield from ((name, "mm") for name in coordinate.names if name not in lengths | angles)


def _parameter(name: str, units: set[str], entry: object, use: KeyPath, problems: Problems) -> TableParameter:
    key: KeyPath = (SECTION, "parameters", name)
    entry = read_table(entry, key, _KEYS, '{ unit = "1" }', problems)
    unit = next(iter(units)) if len(units) == 1 else ""
    given = entry.get("unit", unit)
    if len(units) > 1 and given != "1":
        uses = [_KINDS.get(each, f"in {each}") for each in sorted(units, reverse=True)]
        advice = f'if it is a plain number, write {name} = {{ unit = "1" }} in [linkage.parameters]'
        problems.append((use, f"{name} is {uses[0]} here or elsewhere, and {uses[1]} as well; {advice}"))
    elif not units and "unit" not in entry:
        advice = f'write it, such as {name} = {{ unit = "kg" }}, in [linkage.parameters]'
        problems.append((use, f"the unit of {name} does not follow from expressions of loads; {advice}"))
    elif given not in _UNITS:
        problems.append(((*key, "unit"), f"must be one of {', '.join(_UNITS)}, got {format_value(given)}"))
    elif unit and given not in ("1", unit):
        problems.append(((*key, "unit"), f'it is used as {_KINDS.get(unit, f"in {unit}")}; write "{unit}" or "1"'))
    unit = given if given in _UNITS else "mm"
    words = [word for word in ("default", "min", "max") if word in entry]
    read = {word: read_number(entry[word], unit, (*key, word), problems) for word in words}
    numbers = {word: number for word, number in read.items() if number is not None}
    meaning = entry.get("meaning", "")
    if not isinstance(meaning, str) or len(meaning) > 200:
        problems.append(((*key, "meaning"), f"must be a text of at most 200 characters, got {format_value(meaning)}"))
        meaning = ""
    low, high, default = numbers.get("min", -math.inf), numbers.get("max", math.inf), numbers.get("default")
    if low >= high:
        problems.append((key, f"min = {low:g} must be below max = {high:g}"))
    elif default is not None and not low < default <= high:
        problems.append(((*key, "default"), f"must be above min and at most max, got {default:g}"))
    return TableParameter(name, unit, " ".join(meaning.split()), default, low, high)


def note_unused(
    parameters: Iterable[TableParameter], entries: Mapping[str, Any], problems: Problems, unread: Collection[str] = ()
) -> None:
    """Note entries of [parameters] that no coordinate uses, and no target; `unread` are words that may be of one."""
    used = [parameter.name for parameter in parameters]
    for name in entries:
        if name not in (*used, SPEED) and name not in _OF_TARGETS and name not in unread:
            hint = suggestion(str(name), [*used, SPEED])
            problems.append((("parameters", str(name)), f"nothing in [linkage] uses it; {hint}"))


def rough_values(
    parameters: tuple[TableParameter, ...], entries: Mapping[str, Any], problems: Problems
) -> dict[str, float]:
    """Values at which a sketch is read: the first of a list, the middle of a range, or the default.

    A parameter without any of them has none, after this is noted.
    """
    found: dict[str, float] = {}
    for parameter in parameters:
        name, entry = parameter.name, entries.get(parameter.name)
        key: KeyPath = ("parameters", name) if name in entries else ("parameters",)
        try:
            value = _rough_value(entry, parameter.unit)
        except RequestError as error:
            problems.append((key, str(error)))
            continue
        value = parameter.default if value is None else value
        if value is None:
            reason = f"the sketch needs a value of {name}; write it here, or as its default in [linkage.parameters]"
            if name in entries:
                advice = "write a number, a list or both ends of a range, or a default in [linkage.parameters]"
                reason = f"the sketch needs a value of {name}, which this entry has not; {advice}"
            problems.append((key, reason))
        else:
            found[name] = value
    return found


def _rough_value(entry: object, unit: str) -> float | None:
    """The value that stands for all of an entry of [parameters]; None where it has none."""
    if isinstance(entry, Mapping):
        ends = [quantity(entry[end], unit) for end in ("start", "stop", "min", "max") if end in entry]
        if len(ends) != 2:
            return None
        is_log = entry.get("log") is True and min(ends) > 0.0
        return math.sqrt(ends[0]) * math.sqrt(ends[1]) if is_log else ends[0] / 2.0 + ends[1] / 2.0
    if isinstance(entry, list | tuple):
        return quantity(entry[0], unit) if entry else None
    return None if entry is None else quantity(entry, unit)
