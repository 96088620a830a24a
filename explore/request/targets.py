"""Targets of a study, of a request and of results: read, checked against the mechanism, and found again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard, get_args

from explore.errors import KeyPath, Problems, RequestError
from explore.model.drawing import PLACE
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS, AnglesFrom, PathTarget
from explore.request.path_files import read_path_file
from explore.suggest import format_value, suggestion
from explore.units.quantities import quantity

#: A target, or the section of a study file that describes one.
TargetOrSection = PathTarget | Mapping[str, Any]
_KEYS = ("kind", "point", "points", "file", "closed", "weights", "crank_angles", "angles_from")
#: Fewest points of a path.
_FEWEST = 3


def add_target(mechanism: Mechanism, target: TargetOrSection | None) -> Mechanism:
    """The mechanism with a target.

    Raises
    ------
    RequestError
        With one line ``target.key: reason`` for each problem.
    """
    if target is None:
        return mechanism
    if isinstance(target, PathTarget):
        target = target.to_content()
    problems: Problems = []
    found = read_target(mechanism, target, problems)
    if problems or found is None:
        raise RequestError("\n".join(f"{'.'.join(map(str, ('target', *key)))}: {reason}" for key, reason in problems))
    return mechanism.with_target(found)


def read_target(mechanism: Mechanism, entries: object, problems: Problems, folder: Path = Path()) -> PathTarget | None:
    """The target that a section describes; None after each of its problems is appended with its key.

    Parameters
    ----------
    mechanism
        With the points of the study.
    entries
        The section.
    problems
        Keys are those within the section.
    folder
        The folder that the name of a file of points is relative to.
    """
    if not isinstance(entries, Mapping):
        problems.append(((), f'must be a table with kind = "path", got {format_value(entries)}'))
        return None
    if not mechanism.targets:
        problems.append(((), f"{mechanism.name} meets no targets; leave it out"))
        return None
    before = len(problems)
    problems += [((key,), f"unknown key; {suggestion(str(key), _KEYS)}") for key in entries if key not in _KEYS]
    kind = entries.get("kind")
    if kind not in mechanism.targets:
        reason = f"{suggestion(str(kind), mechanism.targets)}" if "kind" in entries else 'write kind = "path"'
        problems.append((("kind",) if "kind" in entries else (), f"the kind of target is missing or unknown; {reason}"))
    point = _point(mechanism, entries.get("point"), problems)
    entries = _with_file(entries, folder, problems)
    points = _places(entries.get("points"), problems)
    closed = entries.get("closed", False)
    if not isinstance(closed, bool):
        problems.append((("closed",), f"must be true or false, got {format_value(closed)}"))
    weights = _numbers("weights", entries.get("weights", ()), "1", problems)
    for number, weight in enumerate(weights):
        if not weight > 0.0:
            problems.append((("weights", number), f"must be above 0, got {weight:g}"))
    angles = _numbers("crank_angles", entries.get("crank_angles", ()), "deg", problems)
    start = entries.get("angles_from", "free")
    if start not in get_args(AnglesFrom):
        problems.append((("angles_from",), f'must be "free" or "frame", got {format_value(start)}'))
    n_points = len(entries["points"]) if _is_list(entries.get("points")) else 0
    for key, listed in (("weights", weights), ("crank_angles", angles)):
        if listed and len(listed) != n_points:
            problems.append(((key,), f"{len(listed)} for {n_points} points; give each point one"))
    taken = {signal.name for signal in mechanism.signals} | {parameter.name for parameter in mechanism.parameters}
    for name in PLACE:
        if name in taken:
            problems.append(((), f"its parameter {name} would have the name of another column; rename the point"))
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


def _point(mechanism: Mechanism, name: object, problems: Problems) -> str:
    """The point that is to follow the target."""
    points = mechanism.points
    if not points:
        reason = "the mechanism has no point to follow it; give it one, [points] M = { along = 120, across = 40 }"
        problems.append(((), reason))
    elif name is None and len(points) == 1:
        return points[0]
    elif name is None:
        problems.append(((), f"which point follows it? Write point = {' or '.join(map(repr, points))}"))
    elif name not in points:
        problems.append((("point",), f"unknown point {format_value(name)}; {suggestion(str(name), points)}"))
    return str(name)


def _places(value: object, problems: Problems) -> tuple[tuple[float, float], ...]:
    """The points of a path, mm."""
    if value is None:
        problems.append(((), "the key 'points' is missing; give the path as [[0, 0], [10, 5], [20, 0]]"))
        return ()
    if not _is_list(value):
        problems.append((("points",), f"must be a list of points [x, y], got {format_value(value)}"))
        return ()
    if not _FEWEST <= len(value) <= MOST_TARGET_POINTS:
        few = "a path has at least 3" if len(value) < _FEWEST else f"at most {MOST_TARGET_POINTS} are possible; thin it"
        problems.append((("points",), f"{len(value):,} points; {few}"))
        return ()
    places: list[tuple[float, float]] = []
    for number, place in enumerate(value):
        key: KeyPath = ("points", number)
        if not _is_list(place) or len(place) != 2:
            problems.append((key, f"must be a point [x, y], got {format_value(place)}"))
            continue
        try:
            places.append((quantity(place[0], "mm"), quantity(place[1], "mm")))
        except RequestError as error:
            problems.append((key, str(error)))
    if len(places) == len(value) and len(set(places)) == 1:
        problems.append((("points",), "all points are the same place; a path has at least two"))
    return tuple(places)


def _numbers(key: str, value: object, unit: str, problems: Problems) -> tuple[float, ...]:
    """Numbers of a list, in a unit."""
    if not _is_list(value):
        problems.append(((key,), f"must be a list of numbers, got {format_value(value)}"))
        return ()
    numbers: list[float] = []
    for position, entry in enumerate(value):
        try:
            numbers.append(quantity(entry, unit))
        except RequestError as error:
            problems.append(((key, position), str(error)))
    return tuple(numbers)


def _is_list(value: Any) -> TypeGuard[Sequence[Any]]:
    return isinstance(value, Sequence) and not isinstance(value, str)
