"""Task "path": four-bars whose coupler point passes points in order."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from explore.base.errors import Problems
from explore.mechanisms.registry import mechanism_by_name
from explore.model.quantities import GivenMetric
from explore.model.targets import PathTarget
from explore.studies.request.names import find_mechanism
from explore.studies.request.path_order import remark_on_order
from explore.studies.request.targets import read_path_target
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.path_search import PathSearch
from explore.synthesis.tasks.pivot_boxes import pivot_bounds, read_box
from explore.synthesis.tasks.placed_four_bars import FORMULAS, LENGTHS, PARAMETERS, PASSAGE, POINT, TIMED, read_passage
from explore.synthesis.tasks.sections import SectionReader

#: Largest number of candidates before their cognates.
_MOST = 200
#: Number of points that all linkages are found through.
_NINE = 9
#: Distance over the size of the path up to which a linkage passes nine points exactly.
_ROUNDING = 1e-6
#: Formula of the longest link; the arm of the coupler from the crank's pin to the point is one.
_LONGEST = f"max({', '.join(LENGTHS)}, hypot({POINT}_along, {POINT}_across))"


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    bounds, search = sections.bounds, sections.search
    target = read_path(sections.target, sections.folder, ("crank_angles", "angles_from"), problems)
    n_points, angles = (len(target.points), target.crank_angles) if target else (0, ())
    angle = bounds.number("transmission_angle_min", "deg", default=20.0, least=0.0, below=90.0)
    ratio = bounds.number("size_ratio_max", "1", default=10.0, above=0.0)
    least_ratio = bounds.number("size_ratio_min", "1", default=min(0.01, 0.1 * ratio), above=0.0, below=ratio)
    is_open = target is None or not (target.closed or angles)
    link_ratio = bounds.number("link_ratio_max", "1", default=np.inf, above=1.0)
    span = bounds.number("crank_span_min", "deg", default=90.0 if is_open else 0.0, least=0.0, below=360.0)
    if "crank_span_min" in bounds and not is_open:
        bounds.note("crank_span_min", "is for open paths without crank angles; remove it")
    boxes = {name: read_box(bounds, name) for name in ("crank_pivot", "rocker_pivot")}
    passage = read_passage(bounds)
    is_exact = search.flag("exact")
    count = search.count("count", 20, _MOST)
    if is_exact and n_points and n_points != _NINE:
        search.note("exact", f"needs nine points, but the path has {n_points}; leave it out")
    if is_exact and angles:
        search.note("exact", "the points have crank angles, of which five at most can be met exactly; leave it out")
    if problems or target is None:
        return None
    found = PathSearch(
        replace(target, crank_angles=(), angles_from="free"), np.radians(angles) if angles else None,
        target.angles_from, float(np.radians(span)), float(np.radians(angle)), ratio, least_ratio, link_ratio, boxes,
        count, is_exact,
    )  # fmt: skip
    key = ("target", "file" if "file" in sections.target else "points")
    content = target.to_content()
    given = {name: content[name] for name in ("points", "crank_angles") if content.get(name)}
    return replace(_task_of(found, passage), given=given, remarks=remark_on_order(target, key))


def read_path(section: SectionReader, folder: Path, keys: Sequence[str], problems: Problems) -> PathTarget | None:
    """The path that these keys of a section describe, without those that are of no path; None after its problems."""
    content = section.entries("points", "file", "closed", "weights", *keys)
    own: Problems = []
    mechanism = find_mechanism("crank-rocker", (POINT,))
    target = read_path_target(mechanism, {"kind": "path", "point": POINT, **content}, own, folder)
    problems += [(("target", *key), reason) for key, reason in own]
    if target is not None and (reason := _reason_against(target)):
        section.note("file" if "file" in content else "points", reason)
    return target


def _reason_against(target: PathTarget) -> str:
    """Why no linkage is searched for a path; empty if one is."""
    points = np.array(target.points)
    if target.closed and (points[0] == points[-1]).all():
        return f"points 1 and {len(points)} are equal; leave out the last: a closed path returns to the first by itself"
    equal = np.flatnonzero((points[1:] == points[:-1]).all(axis=1))
    return f"points {equal[0] + 1} and {equal[0] + 2} are equal; remove one" if len(equal) else ""


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
    if np.isfinite(search.link_ratio_max):
        constraints["link_ratio"] = {"max": search.link_ratio_max * (1.0 + 1e-9)}
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
        measured=(GivenMetric(PASSAGE), *(GivenMetric(each, "min") for each in TIMED if is_timed)),
        metrics=(
            *mechanism_by_name("crank-rocker").targets["path"].defaults, "transmission_angle_min",
            "transmission_angle_max",
        ),
        constraints={**constraints, **passage},
        formulas=formulas,
        points=(POINT,),
        target=search.target.to_content(),
    )  # fmt: skip


TYPE = TaskType("path", "a four-bar whose coupler point passes points in order", _read)
