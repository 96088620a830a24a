"""The search for four-bars whose coupler point passes points in order, and what is found as candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray
from explore.model.targets import PathTarget
from explore.synthesis.candidates import Candidates
from explore.synthesis.cognates import find_cognates
from explore.synthesis.defects import find_passage
from explore.synthesis.linkages import ComplexArray, FourBar, distinct, is_alike
from explore.synthesis.tasks.pivot_boxes import Box
from explore.synthesis.tasks.placed_four_bars import PlacedFourBar, candidates_of

if TYPE_CHECKING:
    from explore.synthesis.paths.search import PathSolution

#: Bounds on the transmission angle that are searched beside a smaller one that is asked for, deg.
_FLOORS = (30.0, 40.0, 50.0)
#: Number of curves that are laid over the path with these bounds.
_FEWER = 1000
#: Difference over the longest link up to which found linkages, whose sum of squares is flat, are the same.
_SAME = 1e-3
#: Difference over the longest link up to which computed linkages are the same.
_SAME_ROUNDED = 1e-9
#: Difference up to which crank angles are the same, rad.
_SAME_ANGLE = 1e-6
#: Number of directions of the angle 0 that are tried where it is free, before the best is improved.
_N_SHIFTS = 720


@dataclass(frozen=True)
class PathSearch:
    """What is searched: a path, and bounds on its four-bars.

    Crank angles and what they count from are as of `explore.synthesis.paths.search.PathTask`. The least turn of the
    crank and transmission angle are in rad, sizes those of the longest and the shortest link over that of the path,
    and `link_ratio_max` is the longest over the shortest. Then where "crank_pivot" and "rocker_pivot" may be, how many
    solutions are kept before their cognates, and whether all linkages exactly through nine points are found.
    """

    target: PathTarget
    crank_angles: FloatArray | None
    angles_from: str
    span_min: float
    transmission_angle_min: float
    size_ratio_max: float
    size_ratio_min: float
    link_ratio_max: float
    boxes: Mapping[str, Box]
    count: int
    is_exact: bool

    @property
    def points(self) -> ComplexArray:
        """The points, shape (n,), mm."""
        return np.array([complex(*place) for place in self.target.points])

    @property
    def size(self) -> float:
        """The larger side of the box of the points."""
        return float(np.ptp(self.target.points, axis=0).max())

    def find(self, report: ReportProgress | None) -> Candidates:
        """The candidates, best first, each before its two cognates."""
        return self._find_all(report) if self.is_exact else self._find_best(report)

    def _find_best(self, report: ReportProgress | None) -> Candidates:
        """The best linkages for bounds on the transmission angle from that asked for up: error against quality."""
        from explore.synthesis.paths.search import PathTask, find_paths, numbers_of_boxes

        weights = np.array(self.target.weights) if self.target.weights else None
        held, other = numbers_of_boxes(self.boxes["crank_pivot"], self.boxes["rocker_pivot"])
        asked = np.degrees(self.transmission_angle_min)
        floors = [asked, *(floor for floor in _FLOORS if floor > asked + 1.0)]
        found: list[PathSolution] = []
        is_interrupted = False
        for step, floor in enumerate(floors):
            if report is not None:
                report(step, len(floors))
            task = PathTask(
                self.points, self.target.closed, self.crank_angles, self.angles_from, self.span_min,
                float(np.radians(floor)), self.size_ratio_max, self.size_ratio_min, weights, held,
                other, self.size_ratio_max, self.link_ratio_max,
            )  # fmt: skip
            try:
                found += find_paths(task, -(-self.count // len(floors)), **({"n_starts": _FEWER} if step else {}))
            except KeyboardInterrupt:
                if not found:
                    raise
                floors, is_interrupted = floors[:step], True
                break
        found = _distinct(found)
        bounds = f"a transmission angle of at least {asked:g} deg"
        bounds += f" and links of at most {self.size_ratio_max * self.size:.4g} mm"
        if not found:
            raise RequestError(f"no four-bar whose crank turns was found with {bounds}; widen [bounds]")
        more = f", and of {', '.join(f'{floor:g}' for floor in floors[1:])} deg" if len(floors) > 1 else ""
        tried = f"searched four-bars whose crank turns, with {bounds}{more}: {len(found)} local optima"
        rows = [self._timed(row) for n, each in enumerate(found, 1) for row in _with_cognates(each, n)]
        kept = candidates_of(rows, (f"{tried}, each with its cognates",))
        return replace(kept, most=self.count, is_interrupted=is_interrupted)

    def _timed(self, row: PlacedFourBar) -> PlacedFourBar:
        """The row with its errors at the crank angles of the task, if there are any."""
        if self.crank_angles is None:
            return row
        weights = np.array(self.target.weights or np.ones(len(self.points)))
        is_free = self.angles_from == "free"
        errors = find_timed_errors(row.linkage, self.points, self.crank_angles, weights, is_shift_free=is_free)
        return replace(row, timed_errors=errors)

    def _find_all(self, reported: ReportProgress | None) -> Candidates:
        from explore.synthesis.nine_points.report import find_linkages

        report = find_linkages(self.points, reported)
        complete = "the search is complete" if report.is_complete else "the search is not complete"
        tried = f"{report.sentence} So {complete}."
        if not report.linkages:
            raise RequestError(f"{tried} None passes the points exactly: leave out exact = true for the nearest ones.")
        rows = [
            PlacedFourBar(each.linkage, each.solution, each.cognate, each.passage.fate, each.is_proved)
            for each in report.linkages
        ]
        return replace(candidates_of(rows, (tried,)), is_interrupted=report.solutions.is_interrupted)


def _distinct(solutions: Sequence[PathSolution]) -> list[PathSolution]:
    """Linkages that differ, best first: one may be best with several bounds, and a cognate of one that was found."""
    return distinct(sorted(solutions, key=lambda each: each.error), _is_same)


def _is_same(one: PathSolution, other: PathSolution) -> bool:
    """Whether one is the other or its cognate, driven by either link, and passes the points at the same places."""
    size = max(*one.linkage.lengths, *other.linkage.lengths)
    apart = np.abs(one.linkage.points(one.angles) - other.linkage.points(other.angles)).max()
    return bool(apart < _SAME * size) and any(is_alike(one.linkage, each, _SAME) for each in _family(other))


def _family(solution: PathSolution) -> tuple[FourBar, ...]:
    """A linkage and its cognates, of which there are none where the point is a pin of the linkage."""
    try:
        return solution.linkage, *find_cognates(solution.linkage, float(solution.angles[0]))
    except RequestError:
        return (solution.linkage,)


def _with_cognates(solution: PathSolution, number: int) -> list[PlacedFourBar]:
    """A solution and its cognates, each once: those of some symmetric linkages are equal."""
    passed = _apart(solution.linkage.points(solution.angles), solution.angles)
    family = _family(solution)
    return [
        PlacedFourBar(each, number, cognate, find_passage(each, passed).fate)
        for cognate, each in enumerate(family)
        if not any(is_alike(each, other, _SAME_ROUNDED) for other in family[:cognate])
    ]


def _apart(points: ComplexArray, angles: FloatArray) -> ComplexArray:
    """The points without those at the crank angle of the one before."""
    return np.asarray(points[np.concatenate([[True], np.abs(np.diff(angles)) > _SAME_ANGLE])])


def find_timed_errors(
    linkage: FourBar, points: ComplexArray, angles: FloatArray, weights: FloatArray, *, is_shift_free: bool
) -> tuple[float, float]:
    """The weighted rms and the largest distance, NaN where the linkage cannot be assembled at an angle.

    Points, angles of the crank, rad, and weights have shape (n,). If `is_shift_free` the angles count from any
    direction, the best one; else from the line of the pivots.
    """
    from scipy.optimize import minimize_scalar

    def distances(shift: float) -> FloatArray:
        return np.asarray(np.abs(linkage.points(angles + shift) - points))

    def square(shift: float) -> float:
        total = float(np.average(distances(shift) ** 2, weights=weights))
        return total if np.isfinite(total) else np.inf

    shift = float(np.angle(linkage.rocker_pivot - linkage.crank_pivot))
    if is_shift_free:
        step = 2.0 * np.pi / _N_SHIFTS
        tried = np.arange(_N_SHIFTS) * step
        squares = [square(each) for each in tried]
        shift = float(tried[int(np.argmin(squares))])
        if np.isfinite(min(squares)):
            shift = float(minimize_scalar(square, bounds=(shift - step, shift + step), options={"xatol": 1e-12}).x)
    if not np.isfinite(square(shift)):
        return np.nan, np.nan
    return float(np.sqrt(square(shift))), float(distances(shift).max())
