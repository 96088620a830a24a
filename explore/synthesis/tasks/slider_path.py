"""Task "slider-path": slider-cranks with a point of the rod that passes points in order."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from explore.base.errors import Problems, RequestError
from explore.mechanisms.registry import mechanism_by_name
from explore.model.columns import Column
from explore.model.progress import ReportProgress
from explore.model.targets import PathTarget
from explore.studies.request.path_order import remark_on_order
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.slider_cranks import SliderCrank
from explore.synthesis.slider_path_search import SliderPath, SliderPathTask, distinct_paths, find_slider_paths
from explore.synthesis.slider_paths import closed_spline, find_guide, reach_path
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.path import read_path
from explore.synthesis.tasks.pivot_boxes import pivot_bounds, read_box
from explore.synthesis.tasks.placed_four_bars import POINT, placed

_LENGTHS = ("crank", "rod", "offset")
_PARAMETERS = (*_LENGTHS, f"{POINT}_along", f"{POINT}_across", "crank_pivot_x", "crank_pivot_y", "ground_angle")
_METHOD = Column(
    "method", "", "how the linkage was found", "bookkeeping", "|i1", {1: "direct", 2: "guide_offset"}
)  # fmt: skip
_SENTENCES = {
    "direct": "the distances of the points to the simulated path are least, among linkages nearby",
    "guide_offset": "at the pivot of the best one, the guide-offset error is least: a surrogate of the distances",
}
_MOST_CANDIDATES = 200
#: Bounds on the pressure angle that are searched beside a larger one that is asked for, deg.
_CEILINGS = (40.0, 30.0)
#: Number of points of the spline between two of the path, for the guide-offset error.
_PER_CHORD = 10


@dataclass(frozen=True)
class _Search:
    """What is searched: a path, and bounds on its slider-cranks.

    The largest pressure angle, deg; the rod over the size of the path; where the crank's pivot may be, by coordinate;
    missing ones have the default. `count` is the number of candidates.
    """

    target: PathTarget
    pressure_angle_max: float
    size_ratio_max: float
    box: Mapping[str, tuple[float, float]]
    count: int

    def task(self, pressure_angle_max: float) -> SliderPathTask:
        """The search within a bound on the pressure angle, deg."""
        points = np.array([complex(*place) for place in self.target.points])
        weights = np.array(self.target.weights) if self.target.weights else None
        free = SliderPathTask(
            points, self.target.closed, math.radians(pressure_angle_max), self.size_ratio_max, weights=weights
        )
        low, high = free.box
        x, y = self.box.get("x", (low.real, high.real)), self.box.get("y", (low.imag, high.imag))
        box = complex(x[0], y[0]), complex(x[1], y[1])
        return SliderPathTask(points, free.is_closed, free.pressure_angle_max, free.length_ratio_max, box, weights)

    def find(self, report: ReportProgress | None) -> Candidates:
        """The candidates, best first, and the linkage of the guide-offset method for a closed path."""
        asked = self.pressure_angle_max
        ceilings = [asked, *(ceiling for ceiling in _CEILINGS if ceiling < asked - 1.0)]
        found: list[SliderPath] = []
        for step, ceiling in enumerate(ceilings):
            if report is not None:
                report(step, len(ceilings))
            found += find_slider_paths(self.task(ceiling))
        found = distinct_paths(found)
        linkages, methods = [each.linkage for each in found], [1] * len(found)
        low, high = found[0].box
        n_edge = sum(each.is_on_edge for each in found)
        tried = (
            f"searched slider-cranks with the crank's pivot within x {low.real:.5g} … {high.real:.5g} mm and y "
            f"{low.imag:.5g} … {high.imag:.5g} mm and pressure angles up to "
            f"{', '.join(f'{ceiling:g}' for ceiling in ceilings)} deg: {len(found)} local optima, {n_edge} of "
            f"them on the edge of the box"
        )
        if self.target.closed:
            linkages.append(_by_guide_offset(self.task(asked), found[0].linkage.crank_pivot))
            methods.append(2)
        return _candidates(linkages, methods, (tried,), self.count)


def _by_guide_offset(task: SliderPathTask, pivot: complex) -> SliderCrank:
    """The linkage of least guide-offset error with a pivot, in the better sense of the crank."""
    points = closed_spline(task.points, _PER_CHORD)
    senses = [reach_path(points, pivot, sense) for sense in (1, -1)]
    guides = [(find_guide(followers, task.length_ratio_max * task.size), followers) for followers in senses]
    guide, followers = min(guides, key=lambda pair: pair[0].error)
    rods = followers.side_angles - guide.beta
    # The offset of the method counts to the right of its direction, which may point away from the slider.
    ahead = 1.0 if np.cos(rods - guide.direction).sum() > 0.0 else -1.0
    direction = guide.direction if ahead > 0.0 else guide.direction - math.pi
    point = followers.side / guide.rod * complex(math.cos(guide.beta), math.sin(guide.beta))
    return SliderCrank(pivot, followers.crank, guide.rod, -ahead * guide.offset, direction, point)


def _candidates(
    linkages: Sequence[SliderCrank], methods: Sequence[int], tried: tuple[str, ...], most: int
) -> Candidates:
    angles = np.degrees([linkage.direction for linkage in linkages])
    return Candidates(
        parameters=placed(linkages, _LENGTHS, [linkage.rod for linkage in linkages], angles),
        added=(SOLUTION, _METHOD),
        values={"solution": np.arange(1, len(linkages) + 1), "method": np.array(methods)},
        tried=tried,
        sentences=_SENTENCES,
        most=most,
        always=tuple(np.flatnonzero(np.array(methods) == 2).tolist()),
    )


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    bounds = sections.bounds
    target = read_path(sections.target, sections.folder, (), problems)
    if target is not None and target.crank_angles:
        sections.target.note("file", "crank angles are not taken into account here; leave out the column crank_angle")
    pressure = bounds.number("pressure_angle_max", "deg", default=50.0, above=0.0, below=89.0)
    ratio = bounds.number("size_ratio_max", "1", default=10.0, above=0.0)
    box = read_box(bounds, "crank_pivot")
    count = sections.search.count("count", 20, _MOST_CANDIDATES)
    if problems or target is None:
        return None
    search = _Search(target, pressure, ratio, box, count)
    task = search.task(pressure)
    try:
        task.check()
    except RequestError as error:
        sections.target.note("points", str(error))
        return None
    formulas, constraints = pivot_bounds({"crank_pivot": box}, task.size)
    constraints |= {
        "pressure_angle_max": {"max": pressure * (1.0 + 1e-9)},
        "longest_link": {"max": ratio * task.size * (1.0 + 1e-9)},
    }
    return Task(
        mechanism="slider-crank",
        find=search.find,
        parameters=_PARAMETERS,
        objectives=("path_error_rms:min", "pressure_angle_max:min", "footprint:min"),
        metrics=mechanism_by_name("slider-crank").targets["path"].defaults,
        constraints=constraints,
        formulas={**formulas, "longest_link": {"formula": "max(crank, rod)", "unit": "mm"}},
        points=(POINT,),
        target=target.to_content(),
        remarks=remark_on_order(target, ("target", "file" if "file" in sections.target else "points")),
    )


TYPE = TaskType("slider-path", "a slider-crank with a point of the rod that follows a path", _read)
