"""Task "dwell": crank-rockers whose coupler point moves along an arc, so that a slider that a link ties to it rests."""

import math
from dataclasses import dataclass

import numpy as np

from explore.base.errors import Problems, RequestError
from explore.model.columns import Arrays, Column
from explore.model.progress import ReportProgress
from explore.model.quantities import GivenMetric
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.dwell_fitting import DwellTask
from explore.synthesis.dwell_search import N_DRAWN, N_STARTS, find_dwells
from explore.synthesis.dwells import Dwell
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.placed_four_bars import FORMULAS, LENGTHS, POINT, FourBarBounds

_MOST_CANDIDATES = 100
#: Share by which the search stays within the bounds on the slider, which it measures at fewer angles.
_WITHIN = 1e-3
#: Share by which the search stays within the other bounds, which it meets up to rounding.
_ROUNDING = 1e-6


def _column(name: str, unit: str, meaning: str, role: str = "bookkeeping") -> Column:
    return Column(name, unit, meaning, role)


_STROKE = _column("slider_stroke", "mm", "travel of the slider over the turn")
_PRESSURE = _column("slider_pressure_angle_max", "deg", "largest angle between link and guide over the turn", "metric")
_ERROR = _column("dwell_error", "mm", "travel of the slider in the dwell", "metric")
_MEASURED = (GivenMetric(_STROKE), GivenMetric(_PRESSURE, "min"), GivenMetric(_ERROR, "min"))
# A narrow table drops the first of these first.
_ADDED = (
    SOLUTION,
    _column("rest_x", "mm", "where the slider rests, along the ground from the crank's pivot"),
    _column("rest_y", "mm", "where the slider rests, across the ground from the crank's pivot"),
    _column("guide_angle", "deg", "angle of the slider's guide from the ground"),
    _column("dwell_start", "deg", "crank angle at which the dwell begins, from the ground"),
    _column("dwell_angle", "deg", "angle that the crank turns in the dwell"),
    _PRESSURE,
    _column("slider_link", "mm", "length of the link from the coupler point to the slider"),
    _STROKE,
    _ERROR,
)


@dataclass(frozen=True)
class _Search:
    """The dwell, in lengths of the crank; that length, mm; and the number of candidates."""

    task: DwellTask
    crank: float
    count: int

    def find(self, report: ReportProgress | None) -> Candidates:
        """The candidates with the least travel in the dwell first."""
        if report is not None:
            report(0, 1)
        found = find_dwells(self.task, self.count)
        if not found:
            raise RequestError(
                f"of arcs and guides of {N_DRAWN:,} crank-rockers, even those that come nearest to this dwell have "
                f"links that do not reach their guides over the whole turn; ease stroke, pressure_angle_max or "
                f"link_ratio_max"
            )
        linkages = [each.linkage for each in found]
        arms = np.array([linkage.point * linkage.coupler for linkage in linkages])
        lengths = {name: np.array([getattr(linkage, name) for linkage in linkages]) for name in LENGTHS}
        tried = (
            f"compared arcs and guides of {N_DRAWN:,} crank-rockers within the bound on the transmission angle and "
            f"improved {N_STARTS:,} or more of them: {len(found)} local optima"
        )
        return Candidates(
            parameters={
                **{name: self.crank * values for name, values in lengths.items()},
                "branch": np.array([float(linkage.branch) for linkage in linkages]),
                f"{POINT}_along": self.crank * arms.real,
                f"{POINT}_across": self.crank * arms.imag,
            },
            added=_ADDED,
            values={"solution": np.arange(1, len(found) + 1), **self._measured(found)},
            tried=(tried,),
            most=self.count,
        )

    def _measured(self, found: list[Dwell]) -> Arrays:
        """What the solver measures, in mm and deg."""
        centres = np.array([each.centre for each in found])
        lengths = {
            "rest_x": centres.real, "rest_y": centres.imag, "slider_link": np.array([each.link for each in found]),
            "slider_stroke": np.array([each.stroke for each in found]),
            "dwell_error": np.array([each.error for each in found]),
        }  # fmt: skip
        angles = {
            "guide_angle": [each.direction for each in found],
            "dwell_start": [each.start for each in found],
            "dwell_angle": [each.span for each in found],
            "slider_pressure_angle_max": [each.pressure_angle_max for each in found],
        }
        return {
            **{name: self.crank * values for name, values in lengths.items()},
            **{name: np.degrees(values) for name, values in angles.items()},
        }


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    target = sections.target
    span = target.number("dwell_angle", "deg", "90", least=1.0, below=300.0)
    stroke = target.number("stroke", "mm", "30", above=0.0)
    crank = target.number("crank", "mm", default=20.0, above=0.0)
    bounds = FourBarBounds.read(sections.bounds)
    pressure = sections.bounds.number("pressure_angle_max", "deg", default=50.0, above=0.0, below=89.0)
    count = sections.search.count("count", 5, _MOST_CANDIDATES)
    if problems:
        return None
    task = DwellTask(
        math.radians(span), stroke / crank * (1.0 + _WITHIN), bounds.angle + _ROUNDING,
        math.radians(pressure) * (1.0 - _WITHIN), bounds.link_ratio_max * (1.0 - _ROUNDING),
    )  # fmt: skip
    return Task(
        mechanism="crank-rocker",
        find=_Search(task, crank, count).find,
        parameters=(*LENGTHS, "branch", f"{POINT}_along", f"{POINT}_across"),
        fixed=("crank",),
        objectives=("dwell_error:min", "transmission_angle_worst:max", "footprint:min"),
        measured=_MEASURED,
        metrics=("transmission_angle_min", "transmission_angle_max", "link_ratio"),
        constraints={
            **bounds.constraints,
            "slider_stroke": {"min": stroke},
            "slider_pressure_angle_max": {"max": pressure},
        },
        formulas=FORMULAS,
        points=(POINT,),
    )


TYPE = TaskType("dwell", "a crank-rocker that lets a slider rest over part of the turn", _read)
