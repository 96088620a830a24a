"""Remarks on a study that is valid, but may not say what its author means: each with its key, as problems have."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from explore.base.errors import KeyPath, Problems
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.base.units.shown import ShownUnits
from explore.model.request import Request
from explore.model.targets import PathTarget, PosesTarget
from explore.studies.config.schema import StudyFile
from explore.studies.request.path_order import remark_on_order

#: Keys of entries of parameters whose numbers are in no unit, or in that of another column.
_PLAIN = ("num", "log", "solve", "value")
#: Units of the numbers in a row of a target, by the key.
_TARGET_UNITS: Mapping[str, tuple[str, ...]] = {
    "points": ("mm", "mm"), "poses": ("mm", "mm", "deg"), "crank_angles": ("deg",), "lever": ("mm",),
}  # fmt: skip

#: Key, entry, and unit of the entry's numbers.
Entry = tuple[KeyPath, Any, str]


def study_remarks(study: StudyFile, request: Request, units: ShownUnits) -> Problems:
    """The remarks on a study whose names are resolved."""
    mechanism, target = request.mechanism, request.mechanism.target
    is_ordered = isinstance(target, PathTarget) or (isinstance(target, PosesTarget) and target.order == "given")
    path = target.path if target is not None and is_ordered else None
    parameters = {parameter.name: parameter.unit for parameter in mechanism.parameters}
    entries: list[Entry] = [
        (("parameters", name), entry, parameters.get(name, "1")) for name, entry in study.parameters.items()
    ]
    entries += [(("points", name), entry, "mm") for name, entry in study.points.items()]
    entries += target_entries(study.target or {})
    entries += [
        (("constraints", each.metric.name), study.constraints.get(each.metric.name), each.metric.unit)
        for each in request.constraints
    ]
    entries += [(("tolerances", name), entry, parameters.get(name, "1")) for name, entry in study.tolerances.items()]
    key = ("target", "file" if "file" in (study.target or {}) else "poses" if path is not target else "points")
    remarks = [*(remark_on_order(path, key) if path else []), *remark_on_units(entries, units)]
    return [*remarks, *_remarks_on_solved(study, request)]


def _remarks_on_solved(study: StudyFile, request: Request) -> Problems:
    """That a constraint has the value that a length is solved for as its limit."""
    remarks: Problems = []
    for name, entry in study.parameters.items():
        if not isinstance(entry, Mapping) or "solve" not in entry:
            continue
        for each in request.constraints:
            limits = (each.minimum, each.maximum)
            if each.metric.name == entry["solve"] and quantity(entry["value"], each.metric.unit) in limits:
                reason = f"a limit is the value that {name} is solved for: rounding decides which designs meet it"
                remarks.append((("constraints", each.metric.name), reason))
    return remarks


def target_entries(target: Mapping[str, Any]) -> list[Entry]:
    """The entries of a section [target] that have units, row by row."""
    found: list[Entry] = []
    for key, units in _TARGET_UNITS.items():
        rows = target.get(key)
        for number, row in enumerate(rows if isinstance(rows, list) else [rows]):
            cells = row if isinstance(row, list) else [row]
            found += [(("target", key, number), cell, unit) for cell, unit in zip(cells, units, strict=False)]
    return found


def remark_on_units(entries: Iterable[Entry], units: ShownUnits) -> Problems:
    """That numbers without a unit are not in the units that are shown, with the first of them; none where none is."""
    found = [
        (key, number, unit) for key, entry, unit in entries if not units.scale(unit).is_declared
        for number in _bare_numbers(entry)
    ]  # fmt: skip
    if not found:
        return []
    key, number, unit = found[0]
    shown, value = units.scale(unit).shown, format_value(number)
    more = f"; {len(found) - 1:,} more such numbers follow" if len(found) > 1 else ""
    advice = f'write "{value} {shown}" or "{value} {unit}"'
    return [(key, f"{value} is {value} {unit}, although [units] shows {shown}; {advice}{more}")]


def _bare_numbers(entry: object) -> Iterator[float]:
    """The numbers of an entry that have no unit; 0 is the same in all."""
    if isinstance(entry, Mapping):
        for key, item in entry.items():
            if key not in _PLAIN:
                yield from _bare_numbers(item)
    elif isinstance(entry, list | tuple):
        for item in entry:
            yield from _bare_numbers(item)
    elif isinstance(entry, int | float) and not isinstance(entry, bool) and entry != 0:
        yield entry
