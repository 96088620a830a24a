"""Read targets of the kind "path": a path that a point of the floating link is to follow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS, AnglesFrom, PathTarget
from explore.studies.request.target_entries import is_list, note_unknown_keys, read_numbers, read_point, read_rows
from explore.studies.request.target_files import FileColumn

_KEYS = ("kind", "point", "points", "file", "closed", "weights", "crank_angles", "angles_from")
#: Columns of a file of points.
_COLUMNS = (FileColumn("x", "mm"), FileColumn("y", "mm"), FileColumn("crank_angle", "deg", is_optional=True))
#: Smallest number of points of a path.
_FEWEST = 3


def read_path_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> PathTarget | None:
    """The path that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    point = read_point(mechanism, entries.get("point"), problems)
    rows, source = read_rows(entries, "points", _COLUMNS, folder, problems)
    in_file = [row[2] for row in rows if len(row) > 2] if source == "file" else []
    points = _places([row[:2] for row in rows] if source == "file" else rows, source, problems) if source else ()
    closed = entries.get("closed", False)
    if not isinstance(closed, bool):
        problems.append((("closed",), f"must be true or false, got {format_value(closed)}"))
    weights = read_numbers("weights", entries.get("weights", ()), "1", problems)
    for number, weight in enumerate(weights):
        if not weight > 0.0:
            problems.append((("weights", number), f"must be above 0, got {weight:g}"))
    angles = read_numbers("crank_angles", entries.get("crank_angles", in_file), "deg", problems)
    if in_file and "crank_angles" in entries:
        problems.append((("crank_angles",), "the file has a column crank_angle; leave out one of the two"))
    start = entries.get("angles_from", "free")
    if start not in get_args(AnglesFrom):
        problems.append((("angles_from",), f'must be "free" or "frame", got {format_value(start)}'))
    for key, listed in (("weights", weights), ("crank_angles", angles)):
        if listed and is_list(rows) and len(listed) != len(rows):
            problems.append(((key,), f"{len(listed)} for {len(rows)} points; give each point one"))
    return None if len(problems) > before else PathTarget(point, points, closed, weights, angles, start)


def _places(value: object, source: str, problems: Problems) -> tuple[tuple[float, float], ...]:
    """The points of a path, mm; `source` is the key that has them."""
    if value is None:
        problems.append(((), "the key 'points' is missing; give the path as [[0, 0], [10, 5], [20, 0]]"))
        return ()
    if not is_list(value):
        problems.append(((source,), f"must be a list of points [x, y], got {format_value(value)}"))
        return ()
    if not _FEWEST <= len(value) <= MOST_TARGET_POINTS:
        few = "a path has at least 3" if len(value) < _FEWEST else f"at most {MOST_TARGET_POINTS} are possible; thin it"
        problems.append(((source,), f"{len(value):,} points; {few}"))
        return ()
    places: list[tuple[float, float]] = []
    for number, place in enumerate(value):
        key: KeyPath = (source, number)
        if not is_list(place) or len(place) != 2:
            problems.append((key, f"must be a point [x, y], got {format_value(place)}"))
            continue
        try:
            places.append((quantity(place[0], "mm"), quantity(place[1], "mm")))
        except RequestError as error:
            problems.append((key, str(error)))
    if len(places) == len(value) and len(set(places)) == 1:
        problems.append(((source,), "all points are the same place; a path has at least two"))
    return tuple(places)
