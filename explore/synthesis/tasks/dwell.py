"""Task "dwell": crank-rockers whose coupler point moves along an arc, so that a slider that a link ties to it rests."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from explore.errors import Problems, RequestError
from explore.model.columns import Column
from explore.model.progress import ReportProgress
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.dwells import Dwell, DwellTask, find_dwell
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.four_bars import FORMULAS, LENGTHS, FourBarBounds

POINT = "M"
#: Candidates at most, each a search of its own; and generations of each.
_MOST_CANDIDATES, _GENERATIONS = 100, 80
#: By which share the search stays within the bounds on the slider, which it measures at fewer angles.
_WITHIN = 0.01


def _column(name: str, unit: str, meaning: str, role: str = "bookkeeping") -> Column:
    return Column(name, unit, meaning, role)


# A narrow table drops the first of these first.
_ADDED = (
    SOLUTION,
    _column("rest_x", "mm", "where the slider rests, along the ground from the crank's pivot"),
    _column("rest_y", "mm", "where the slider rests, across the ground from the crank's pivot"),
    _column("guide_angle", "deg", "angle of the slider's guide from the ground"),
    _column("dwell_start", "deg", "crank angle at which the dwell begins, from the ground"),
    _column("slider_pressure_angle_max", "deg", "largest angle between link and guide over the turn", "metric"),
    _column("slider_link", "mm", "length of the link from the coupler point to the slider"),
    _column("slider_stroke", "mm", "travel of the slider over the turn"),
    _column("dwell_error", "mm", "travel of the slider in the dwell", "metric"),
)


@dataclass(frozen=True)
class _Search:
    """The dwell, in lengths of the crank; that length, mm; and the number of searches."""

    task: DwellTask
    crank: float
    count: int

    def find(self, report: ReportProgress | None) -> Candidates:
        """The best of each search, those of the least error over the stroke first."""
        found: list[Dwell] = []
        for seed in range(self.count):
            if report is not None:
                report(seed, self.count)
            try:
                found.append(find_dwell(self.task, seed, _GENERATIONS))
            except RequestError:
                continue
        if not found:
            raise RequestError(
                f"none of {self.count} searches found a crank-rocker with such a dwell; ease the stroke or [bounds]"
            )
        found.sort(key=lambda each: each.error / each.stroke)
        linkages = [each.linkage for each in found]
        arms = np.array([linkage.point * linkage.coupler for linkage in linkages])
        lengths = {name: np.array([getattr(linkage, name) for linkage in linkages]) for name in LENGTHS}
        centres = np.array([each.centre for each in found])
        measured = {
            "rest_x": centres.real, "rest_y": centres.imag, "slider_link": np.array([each.link for each in found]),
            "slider_stroke": np.array([each.stroke for each in found]),
            "dwell_error": np.array([each.error for each in found]),
        }  # fmt: skip
        angles = {
            "guide_angle": [each.direction for each in found],
            "dwell_start": [each.start for each in found],
            "slider_pressure_angle_max": [each.pressure_angle_max for each in found],
        }
        tried = f"{self.count} searches by differential evolution, {len(found)} with a dwell within the bounds"
        return Candidates(
            parameters={
                **{name: self.crank * values for name, values in lengths.items()},
                "branch": np.array([float(linkage.branch) for linkage in linkages]),
                f"{POINT}_along": self.crank * arms.real,
                f"{POINT}_across": self.crank * arms.imag,
            },
            added=_ADDED,
            values={
                "solution": np.arange(1, len(found) + 1),
                **{name: self.crank * values for name, values in measured.items()},
                **{name: np.degrees(values) for name, values in angles.items()},
            },
            tried=(tried,),
        )


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    """The task, or None after the problems of its sections are noted."""
    target = sections.target
    span = target.number("dwell_angle", "deg", "90", above=0.0, below=300.0)
    stroke = target.number("stroke", "mm", "30", above=0.0)
    crank = target.number("crank", "mm", default=20.0, above=0.0)
    bounds = FourBarBounds.read(sections.bounds)
    pressure = sections.bounds.number("pressure_angle_max", "deg", default=50.0, above=0.0, below=89.0)
    count = sections.search.count("count", 5, _MOST_CANDIDATES)
    if problems:
        return None
    task = DwellTask(
        math.radians(span), stroke / crank * (1.0 + _WITHIN), bounds.angle, math.radians(pressure) * (1.0 - _WITHIN),
        bounds.link_ratio_max,
    )  # fmt: skip
    return Task(
        mechanism="crank-rocker",
        find=_Search(task, crank, count).find,
        parameters=(*LENGTHS, "branch", f"{POINT}_along", f"{POINT}_across"),
        fixed=("crank",),
        objectives=("dwell_error:min", "transmission_angle_worst:max", "footprint:min"),
        measured={"dwell_error": "min", "slider_pressure_angle_max": "min"},
        metrics=("transmission_angle_min", "transmission_angle_max", "link_ratio"),
        constraints=bounds.constraints,
        formulas=FORMULAS,
        points=(POINT,),
    )


TYPE = TaskType("dwell", "a crank-rocker that lets a slider rest over part of the turn", _read)
