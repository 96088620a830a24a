"""Read targets of the kind "path": a path that a point of the floating link is to follow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from explore.errors import KeyPath, Problems, RequestError
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS, AnglesFrom, PathTarget
from explore.request.path_files import read_path_file
from explore.request.target_entries import is_list, note_unknown_keys, read_numbers, read_point
from explore.suggest import format_value
from explore.units.quantities import quantity

_KEYS = ("kind", "point", "points", "file", "closed", "weights", "crank_angles", "angles_from")
#: Fewest points of a path.
_FEWEST = 3


def read_path_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> PathTarget | None:
    """The path that a section describes; see `explore.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    point = read_point(mechanism, entries.get("point"), problems)
    entries = _with_file(entries, folder, problems)
    points = _places(entries.get("points"), problems)
    closed = entries.get("closed", False)
    if not isinstance(closed, bool):
        problems.append((("closed",), f"must be true or false, got {format_value(closed)}"))
    weights = read_numbers("weights", entries.get("weights", ()), "1", problems)
    for number, weight in enumerate(weights):
        if not weight > 0.0:
            problems.append((("weights", number), f"must be above 0, got {weight:g}"))
    angles = read_numbers("crank_angles", entries.get("crank_angles", ()), "deg", problems)
    start = entries.get("angles_from", "free")
    if start not in get_args(AnglesFrom):
        problems.append((("angles_from",), f'must be "free" or "frame", got {format_value(start)}'))
    n_points = len(entries["points"]) if is_list(entries.get("points")) else 0
    for key, listed in (("weights", weights), ("crank_angles", angles)):
        if listed and len(listed) != n_points:
            problems.append(((key,), f"{len(listed)} for {n_points} points; give each point one"))
    return None if len(problems) > before else PathTarget(point, points, closed, weights, angles, start)


def _with_file(entries: Mapping[str, Any], folder: Path, problems: Problems) -> Mapping[str, Any]:
    """The entries with the points of their file; after a problem with one point, which has no second problem."""
    if "file" not in entries:
        return entries
    problem = ""
    if "points" in entries:
        problem = "the points are given twice; leave out 'points' or 'file'"
    elif not isinstance(entries["file"], str):
        problem = f"must be the name of a CSV file in quotes, got {format_value(entries['file'])}"
    else:
        try:
            places, angles = read_path_file(folder / entries["file"])
        except RequestError as error:
            problem = str(error)
        else:
            return {**entries, "points": places, **({"crank_angles": angles} if angles else {})}
    problems.append((("file",), problem))
    return {"points": [[0, 0], [1, 0], [0, 1]]} | {key: entries[key] for key in ("closed",) if key in entries}


def _places(value: object, problems: Problems) -> tuple[tuple[float, float], ...]:
    """The points of a path, mm."""
    if value is None:
        problems.append(((), "the key 'points' is missing; give the path as [[0, 0], [10, 5], [20, 0]]"))
        return ()
    if not is_list(value):
        problems.append((("points",), f"must be a list of points [x, y], got {format_value(value)}"))
        return ()
    if not _FEWEST <= len(value) <= MOST_TARGET_POINTS:
        few = "a path has at least 3" if len(value) < _FEWEST else f"at most {MOST_TARGET_POINTS} are possible; thin it"
        problems.append((("points",), f"{len(value):,} points; {few}"))
        return ()
    places: list[tuple[float, float]] = []
    for number, place in enumerate(value):
        key: KeyPath = ("points", number)
        if not is_list(place) or len(place) != 2:
            problems.append((key, f"must be a point [x, y], got {format_value(place)}"))
            continue
        try:
            places.append((quantity(place[0], "mm"), quantity(place[1], "mm")))
        except RequestError as error:
            problems.append((key, str(error)))
    if len(places) == len(value) and len(set(places)) == 1:
        problems.append((("points",), "all points are the same place; a path has at least two"))
    return tuple(places)
