"""Targets of a study, of a request and of results: read, checked against the mechanism, and found again."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any, get_args

from explore.base.entries import note_unknown, read_number
from explore.base.errors import Problems, RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.model.mechanism import Mechanism
from explore.model.targets import (
    MOST_TARGET_POINTS,
    AnglesFrom,
    DwellTarget,
    FunctionTarget,
    PathTarget,
    PoseOrder,
    PosesTarget,
    Target,
)
from explore.studies.request.target_entries import (
    RowKind,
    read_number_rows,
    read_numbers,
    read_point,
)
from explore.studies.request.target_files import FileColumn

#: Target, or the section of a study file that describes one.
TargetOrSection = Target | Mapping[str, Any]


def add_target(mechanism: Mechanism, target: TargetOrSection | None) -> Mechanism:
    """The mechanism with a target; a `RequestError` has one line ``target.key: reason`` for each problem."""
    if target is None:
        return mechanism
    if isinstance(target, Target):
        target = target.to_content()
    if isinstance(target, Mapping):
        target = {key: value.tolist() if hasattr(value, "tolist") else value for key, value in target.items()}
    problems: Problems = []
    found = read_target(mechanism, target, problems)
    if problems or found is None:
        raise RequestError("\n".join(f"{'.'.join(map(str, ('target', *key)))}: {reason}" for key, reason in problems))
    return mechanism.with_target(found)


def read_target(mechanism: Mechanism, entries: object, problems: Problems, folder: Path = Path()) -> Target | None:
    """The target that a section describes, of a mechanism with the points of the study; None where it has a problem.

    Keys of problems are those within the section. The name of a file of points is relative to `folder`.
    """
    kinds = " or ".join(f'"{kind}"' for kind in mechanism.targets)
    if not mechanism.targets:
        reason = "a linkage with a range meets no targets; leave out the target or the range"
        problems.append(((), reason if mechanism.limits else f"{mechanism.in_words} meets no targets; leave it out"))
        return None
    if not isinstance(entries, Mapping):
        problems.append(((), f"must be a table with kind = {kinds}, got {format_value(entries)}"))
        return None
    before = len(problems)
    kind = entries.get("kind")
    if kind not in list(mechanism.targets):
        reason = f"{suggestion(str(kind), mechanism.targets)}" if "kind" in entries else f"write kind = {kinds}"
        problems.append((("kind",) if "kind" in entries else (), f"the kind of target is missing or unknown; {reason}"))
        kind = closest_name(str(kind), mechanism.targets)  # its other mistakes are said too
    if kind is None:
        return None
    target = _READERS[kind](mechanism, entries, problems, folder)
    taken = {signal.name for signal in mechanism.signals} | {parameter.name for parameter in mechanism.parameters}
    described = mechanism.targets[kind]
    added = {"parameter": described.parameters, "metric": described.formulas(target) if target else ()}
    for what, name in ((what, each.name) for what, those in added.items() for each in those if each.name in taken):
        reason = f"its {what} {name} would have the name of another column"
        problems.append(((), f"{reason}; rename that column, or the point"))
    return None if len(problems) > before else target


def read_dwell_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, _: Path = Path()
) -> DwellTarget | None:
    """The dwell that a section describes; see `read_target`."""
    before = len(problems)
    note_unknown(entries, ("kind", "angle", "travel"), problems)
    given = [key for key in ("angle", "travel") if key in entries]
    if len(problems) > before:
        return None
    if len(given) != 1:
        both = "'angle' and 'travel' are given; leave out one of the two" if given else "write an angle or a travel"
        problems.append((tuple(given[1:]), f"{both}: how far the output moves in a dwell, or how long it rests"))
        return None
    key, of_angle = given[0], mechanism.targets[DwellTarget.kind].formulas(DwellTarget(angle=60.0))
    unit, most, limits = "deg", 360.0, "between 0 and 360 deg"
    if key == "travel":
        unit, most, limits = of_angle[0].unit, inf, "above 0"
    value = read_number(entries[key], unit, (key,), problems)
    if value is not None and not 0.0 < value < most:
        problems.append(((key,), f"must be {limits}, got {value:g}"))
    return None if len(problems) > before or value is None else DwellTarget(**{key: value})


_POSES = RowKind(
    "poses",
    "pose",
    (FileColumn("x", "mm"), FileColumn("y", "mm"), FileColumn("angle", "deg")),
    fewest=2,
    example="[[0, 0, 0], [10, 5, 20], [20, 0, 45]]",
)


def read_poses_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> PosesTarget | None:
    """The poses that a section describes; see `read_target`."""
    before = len(problems)
    note_unknown(entries, ("kind", "point", "poses", "file", "lever", "order"), problems)
    point = read_point(mechanism, PosesTarget.kind, entries.get("point"), problems)
    poses = read_poses(entries, folder, problems)
    lever = _lever(entries.get("lever", 0.0), problems) if "lever" in entries else 0.0
    order = entries.get("order", "given")
    if order not in get_args(PoseOrder):
        problems.append((("order",), f'must be "given" or "any", got {format_value(order)}'))
    if len(problems) > before:
        return None
    target = PosesTarget(point, poses, lever, order)
    if not target.length > 0.0:
        problems.append(((), "all poses have the same place; give the length at which angles count, lever = 50"))
        return None
    return target


def _lever(value: object, problems: Problems) -> float:
    """The length at whose end an angle counts as a distance, mm."""
    lever = read_number(value, "mm", ("lever",), problems)
    if lever is not None and not lever > 0.0:
        problems.append((("lever",), f"must be above 0, got {format_value(value)}"))
    return lever or 0.0


def read_poses(
    entries: Mapping[str, Any],
    folder: Path,
    problems: Problems,
    fewest: int = _POSES.fewest,
    most: int = MOST_TARGET_POINTS,
) -> tuple[tuple[float, float, float], ...]:
    """Places and angles, mm and deg, from 'poses' or from 'file'; none after a problem."""
    before = len(problems)
    rows = read_number_rows(entries, replace(_POSES, fewest=fewest), folder, problems, most)
    return tuple((row[0], row[1], row[2]) for row in rows) if len(problems) == before else ()


_PAIRS = RowKind(
    "table",
    "pair",
    (FileColumn("input", "deg"), FileColumn("output", "deg")),
    fewest=3,
    example="[[0, 0], [30, 12], [60, 31]]",
)


def read_function_target(
    _: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> FunctionTarget | None:
    """The function that a section describes; see `read_target`."""
    before = len(problems)
    note_unknown(entries, ("kind", "table", "file"), problems)
    table = [(row[0], row[1]) for row in read_number_rows(entries, _PAIRS, folder, problems) if row]
    if len(problems) > before:
        return None
    steps = [after[0] - previous[0] for previous, after in pairwise(table)]
    if not (all(step > 0.0 for step in steps) or all(step < 0.0 for step in steps)):
        key = "file" if "file" in entries else "table"
        problems.append(((key,), "the input angles must ascend, or descend, from pair to pair"))
        return None
    return FunctionTarget(tuple(table))


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
    """The path that a section describes; see `read_target`."""
    before = len(problems)
    note_unknown(
        entries, ("kind", "point", "points", "file", "closed", "weights", "crank_angles", "angles_from"), problems
    )
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


_Read = Callable[[Mechanism, Mapping[str, Any], Problems, Path], Target | None]
_READERS: Mapping[str, _Read] = {
    PathTarget.kind: read_path_target,
    FunctionTarget.kind: read_function_target,
    PosesTarget.kind: read_poses_target,
    DwellTarget.kind: read_dwell_target,
}
