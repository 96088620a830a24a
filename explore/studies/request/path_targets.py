"""Read targets of the kind "path": a path that a point of the floating link is to follow."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from explore.base.errors import Problems
from explore.base.suggest import format_value
from explore.model.mechanism import Mechanism
from explore.model.targets import AnglesFrom, PathTarget
from explore.studies.request.target_entries import (
    RowKind,
    note_unknown_keys,
    read_number_rows,
    read_numbers,
    read_point,
)
from explore.studies.request.target_files import FileColumn

_KEYS = ("kind", "point", "points", "file", "closed", "weights", "crank_angles", "angles_from")
_POINTS = RowKind(
    "points",
    "point",
    (FileColumn("x", "mm"), FileColumn("y", "mm"), FileColumn("crank_angle", "deg", is_optional=True)),
    fewest=3,
    example="[[0, 0], [10, 5], [20, 0]]",
)


def read_path_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> PathTarget | None:
    """The path that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    point = read_point(mechanism, PathTarget.kind, entries.get("point"), problems)
    rows = read_number_rows(entries, _POINTS, folder, problems)
    in_file = [row[2] for row in rows if len(row) > 2]
    points = [(row[0], row[1]) for row in rows if row]
    if len(points) == len(rows) and len(set(points)) == 1:
        problems.append((("file" if "file" in entries else "points",), "all points are the same place"))
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
    elif start == "frame" and not angles and "crank_angles" not in entries:
        problems.append((("angles_from",), "has no effect without crank_angles; remove it"))
    for key, listed in (("weights", weights), ("crank_angles", angles)):
        if listed and rows and len(listed) != len(rows):
            problems.append(((key,), f"{len(listed)} for {len(rows)} points; give each point one"))
    return None if len(problems) > before else PathTarget(point, tuple(points), closed, weights, angles, start)
