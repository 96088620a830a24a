"""Task "path": four-bars whose coupler point passes points in order."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from explore.errors import Problems, RequestError
from explore.mechanisms.registry import mechanism_by_name
from explore.model.targets import PathTarget
from explore.request.names import find_mechanism
from explore.request.path_targets import read_path_target
from explore.suggest import format_value
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.four_bars import FORMULAS, LENGTHS
from explore.synthesis.tasks.path_points import read_path_table, reason_against
from explore.synthesis.tasks.path_search import PathSearch
from explore.synthesis.tasks.pivot_boxes import pivot_bounds, read_box
from explore.synthesis.tasks.placed_four_bars import PARAMETERS, POINT, read_passage
from explore.synthesis.tasks.sections import SectionReader
from explore.units.quantities import quantity

#: Largest number of candidates before their cognates, and of points that all linkages are found through.
_MOST, _NINE = 200, 9
#: A linkage passes nine points exactly if it misses them by less than this share of the path's size.
_ROUNDING = 1e-6
#: The longest link; the arm of the coupler from the crank's pin to the point is one.
_LONGEST = f"max({', '.join(LENGTHS)}, hypot({POINT}_along, {POINT}_across))"


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    """The task, or None after the problems of its sections are noted."""
    bounds, search = sections.bounds, sections.search
    target, angles = read_path(sections.target, sections.folder, problems)
    points = np.array([complex(*place) for place in target.points]) if target else np.empty(0, complex)
    angles = _angles(sections.target, len(points)) or angles
    angles_from = sections.target.word("angles_from", ("free", "frame"), "free")
    angle = bounds.number("transmission_angle_min", "deg", default=20.0, least=0.0, below=90.0)
    ratio = bounds.number("size_ratio_max", "1", default=10.0, above=0.0)
    least_ratio = bounds.number("size_ratio_min", "1", default=min(0.01, 0.1 * ratio), above=0.0, below=ratio)
    is_open = target is None or not (target.closed or angles)
    span = bounds.number("crank_span_min", "deg", default=90.0 if is_open else 0.0, least=0.0, below=360.0)
    if "crank_span_min" in bounds and not is_open:
        bounds.note("crank_span_min", "is for open paths without crank angles; remove it")
    boxes = {name: read_box(bounds, name) for name in ("crank_pivot", "rocker_pivot")}
    passage = read_passage(bounds)
    is_exact = search.flag("exact", default=False)
    count = search.count("count", 20, _MOST)
    if is_exact and len(points) and len(points) != _NINE:
        search.note("exact", f"needs nine points, but the path has {len(points)}; leave it out")
    if is_exact and angles is not None:
        search.note("exact", "the points have crank angles, of which five at most can be met exactly; leave it out")
    if problems or target is None:
        return None
    found = PathSearch(
        target, None if angles is None else np.radians(angles), angles_from, float(np.radians(span)),
        float(np.radians(angle)), ratio, least_ratio, boxes, count, is_exact,
    )  # fmt: skip
    return _task_of(found, passage)


def read_path(section: SectionReader, folder: Path, problems: Problems) -> tuple[PathTarget | None, list[float] | None]:
    """The path, None after its problems are noted, and the crank angles, deg, of a table that has them."""
    given = {key: section.get(key) for key in ("points", "closed", "weights")}
    content = {key: entry for key, entry in given.items() if key in section}
    angles, key = None, "points"
    if (file := section.get("file")) is not None:
        if "points" in section:
            section.note("file", "the path has points too; remove one of the two")
            return None, None
        try:
            rows = read_path_table(folder, file)
        except RequestError as error:
            section.note("file", str(error))
            return None, None
        key, content["points"] = "file", rows[:, :2].tolist()
        angles = rows[:, 2].tolist() if rows.shape[1] > 2 else None
    own: Problems = []
    mechanism = find_mechanism("crank-rocker", (POINT,))
    target = read_path_target(mechanism, {"kind": "path", "point": POINT, **content}, own)
    problems += [(("target", *(path if path[:1] != ("points",) or key == "points" else (key,))), reason)
                 for path, reason in own]  # fmt: skip
    if target is not None:
        points = np.array([complex(*place) for place in target.points])
        if reason := reason_against(points, is_closed=target.closed):
            section.note(key, reason)
    return target, angles


def _task_of(search: PathSearch, passage: Mapping[str, Mapping[str, float]]) -> Task:
    """The task of a search, whose candidates have this bound on their passage."""
    formulas, constraints = pivot_bounds(search.boxes, search.size)
    formulas |= {
        **FORMULAS,
        "longest_link": {"formula": _LONGEST, "unit": "mm"},
        "shortest_link": {"formula": f"min({', '.join(LENGTHS)})", "unit": "mm"},
    }
    constraints |= {
        "transmission_angle_worst": {"min": float(np.degrees(search.transmission_angle_min)) * (1.0 - 1e-9)},
        "longest_link": {"max": search.size_ratio_max * search.size * (1.0 + 1e-9)},
        "shortest_link": {"min": search.size_ratio_min * search.size * (1.0 - 1e-9)},
    }
    if search.is_exact and passage:
        constraints["path_error_max"] = {"max": _ROUNDING * search.size}
    is_timed = search.crank_angles is not None
    return Task(
        mechanism="crank-rocker",
        find=search.find,
        parameters=PARAMETERS,
        objectives=(
            "timed_error_rms:min" if is_timed else "path_error_rms:min", "transmission_angle_worst:max",
            "footprint:min",
        ),
        measured={"timed_error_rms": "min", "timed_error_max": "min"} if is_timed else {},
        metrics=(
            *mechanism_by_name("crank-rocker").targets["path"].defaults, "transmission_angle_min",
            "transmission_angle_max",
        ),
        constraints=constraints,
        measured_constraints=passage,
        formulas=formulas,
        points=(POINT,),
        target=search.target.to_content(),
    )  # fmt: skip


def _angles(target: SectionReader, count: int) -> list[float] | None:
    """Crank angles, deg, one for each point; None where the key is missing or wrong."""
    key, entries = "crank_angles", target.get("crank_angles")
    if entries is None:
        return None
    if not isinstance(entries, list):
        target.note(key, f"must be a list of numbers, one for each point, got {format_value(entries)}")
        return None
    if count and len(entries) != count:
        target.note(key, f"has {len(entries)} angles, but the path has {count} points")
        return None
    values = []
    for position, entry in enumerate(entries):
        try:
            values.append(quantity(entry, "deg"))
        except RequestError as error:
            target.note(key, f"angle {position + 1}: {error}", position)
    return values if len(values) == len(entries) else None


TYPE = TaskType("path", "a four-bar whose coupler point passes points in order", _read)
