"""Read targets of the kind "poses": places and angles that the floating link is to carry a body through."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS, PoseOrder, PosesTarget
from explore.studies.request.target_entries import is_list, note_unknown_keys, read_point, read_rows
from explore.studies.request.target_files import FileColumn

_KEYS = ("kind", "point", "poses", "file", "lever", "order")
#: Columns of a file of poses.
_COLUMNS = (FileColumn("x", "mm"), FileColumn("y", "mm"), FileColumn("angle", "deg"))
#: Smallest number of poses.
_FEWEST = 2

_EXAMPLE = "[[0, 0, 0], [10, 5, 20], [20, 0, 45]]"


def read_poses_target(
    mechanism: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> PosesTarget | None:
    """The poses that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    point = read_point(mechanism, entries.get("point"), problems)
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
    try:
        lever = quantity(value, "mm")
    except RequestError as error:
        problems.append((("lever",), str(error)))
        return 0.0
    if not lever > 0.0:
        problems.append((("lever",), f"must be above 0, got {format_value(value)}"))
    return lever


def read_poses(
    entries: Mapping[str, Any], folder: Path, problems: Problems, fewest: int = _FEWEST, most: int = MOST_TARGET_POINTS
) -> tuple[tuple[float, float, float], ...]:
    """Places and angles, mm and deg, from 'poses' or from 'file'; none after a problem."""
    before = len(problems)
    value, source = read_rows(entries, "poses", _COLUMNS, folder, problems)
    if not source:
        return ()
    if value is None:
        problems.append(((source,), f"is missing; give x, y and angle of each, such as poses = {_EXAMPLE}"))
        return ()
    if not is_list(value):
        problems.append(((source,), f"must be a list of poses such as {_EXAMPLE}, got {format_value(value)}"))
        return ()
    if not fewest <= len(value) <= most:
        advice = f"give {fewest} or more" if len(value) < fewest else f"at most {most} are possible; thin them"
        problems.append(((source,), f"{len(value):,} poses; {advice}"))
        return ()
    poses: list[tuple[float, float, float]] = []
    for number, pose in enumerate(value):
        if not is_list(pose) or len(pose) != 3:
            problems.append(((source, number), f"pose {number + 1} must be [x, y, angle], got {format_value(pose)}"))
            continue
        try:
            poses.append((quantity(pose[0], "mm"), quantity(pose[1], "mm"), quantity(pose[2], "deg")))
        except RequestError as error:
            problems.append(((source, number), f"pose {number + 1}: {error}"))
    return tuple(poses) if len(problems) == before else ()
