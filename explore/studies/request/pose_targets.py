"""Read targets of the kind "poses": places and angles that the floating link is to carry a body through."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS, PoseOrder, PosesTarget
from explore.studies.request.target_entries import RowKind, note_unknown_keys, read_number_rows, read_point
from explore.studies.request.target_files import FileColumn

_KEYS = ("kind", "point", "poses", "file", "lever", "order")
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
    """The poses that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
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
    try:
        lever = quantity(value, "mm")
    except RequestError as error:
        problems.append((("lever",), str(error)))
        return 0.0
    if not lever > 0.0:
        problems.append((("lever",), f"must be above 0, got {format_value(value)}"))
    return lever


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
