"""The search for four-bars whose coupler point passes points in order, and what is found as candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from explore.errors import RequestError
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray
from explore.model.targets import PathTarget
from explore.synthesis.candidates import Candidates
from explore.synthesis.cognates import find_cognates
from explore.synthesis.defects import find_passage
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.tasks.pivot_boxes import Box
from explore.synthesis.tasks.placed_four_bars import PlacedFourBar, candidates_of
from explore.synthesis.tasks.timed_errors import find_timed_errors

if TYPE_CHECKING:
    from explore.synthesis.paths.search import PathSolution

#: Bounds on the transmission angle, deg, that are searched beside the one asked for, where they are larger.
_FLOORS = (30.0, 40.0, 50.0)
#: Curves that are laid over the path with these.
_FEWER = 1000
#: Linkages whose lengths differ by less, relatively, are the same; crank angles, rad, that differ by less are.
_SAME, _SAME_ANGLE = 1e-4, 1e-6


@dataclass(frozen=True)
class PathSearch:
    """What is searched: a path, and bounds on its four-bars.

    Attributes
    ----------
    target
        The path.
    crank_angles, angles_from
        As of `explore.synthesis.paths.search.PathTask`.
    span_min, transmission_angle_min
        In rad.
    size_ratio_max
        Of the longest link over the size of the path.
    size_ratio_min
        Of the shortest link over that size.
    boxes
        Where "crank_pivot" and "rocker_pivot" may be.
    count
        Number of solutions, before their cognates.
    is_exact
        Whether all linkages exactly through nine points are found.
    """

    target: PathTarget
    crank_angles: FloatArray | None
    angles_from: str
    span_min: float
    transmission_angle_min: float
    size_ratio_max: float
    size_ratio_min: float
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
        return self._find_all() if self.is_exact else self._find_best(report)

    def _find_best(self, report: ReportProgress | None) -> Candidates:
        """The best linkages for bounds on the transmission angle from that asked for up: error against quality."""
        from explore.synthesis.paths.numbers import PIVOT_X, PIVOT_Y
        from explore.synthesis.paths.search import PathTask, find_paths

        pivot, weights = self.boxes["crank_pivot"], np.array(self.target.weights) if self.target.weights else None
        held = {number: pivot[axis] for number, axis in ((PIVOT_X, "x"), (PIVOT_Y, "y")) if axis in pivot}
        asked = np.degrees(self.transmission_angle_min)
        floors = [asked, *(floor for floor in _FLOORS if floor > asked + 1.0)]
        found: list[PathSolution] = []
        for step, floor in enumerate(floors):
            if report is not None:
                report(step, len(floors))
            task = PathTask(
                self.points, self.target.closed, self.crank_angles, self.angles_from, self.span_min,
                float(np.radians(floor)), self.size_ratio_max, self.size_ratio_min, weights, held,
            )  # fmt: skip
            found += find_paths(task, -(-self.count // len(floors)), **({"n_starts": _FEWER} if step else {}))
        found = _distinct(found)[: self.count]
        bounds = f"a transmission angle of at least {asked:g} deg"
        bounds += f" and links of at most {self.size_ratio_max * self.size:.4g} mm"
        if not found:
            raise RequestError(f"no four-bar whose crank turns was found with {bounds}; widen [bounds]")
        more = f", and of {', '.join(f'{floor:g}' for floor in floors[1:])} deg" if len(floors) > 1 else ""
        tried = f"searched four-bars whose crank turns, with {bounds}{more}: {len(found)} local optima"
        rows = [self._timed(row) for n, each in enumerate(found, 1) for row in _with_cognates(each, n)]
        return candidates_of(rows, (f"{tried}, each with its cognates",))

    def _timed(self, row: PlacedFourBar) -> PlacedFourBar:
        """The row with its errors at the crank angles of the task, if there are any."""
        if self.crank_angles is None:
            return row
        weights = np.array(self.target.weights or np.ones(len(self.points)))
        is_free = self.angles_from == "free"
        errors = find_timed_errors(row.linkage, self.points, self.crank_angles, weights, is_shift_free=is_free)
        return replace(row, timed_errors=errors)

    def _find_all(self) -> Candidates:
        from explore.synthesis.nine_points.report import find_linkages

        report = find_linkages(self.points)
        complete = "the search is complete" if report.is_complete else "the search is not complete"
        tried = f"{report.sentence} So {complete}."
        if not report.linkages:
            raise RequestError(f"{tried} None passes the points exactly: leave out exact = true for the nearest ones.")
        rows = [
            PlacedFourBar(each.linkage, each.solution, each.cognate, each.passage.fate, each.is_proved)
            for each in report.linkages
        ]
        return candidates_of(rows, (tried,))


def _distinct(solutions: Sequence[PathSolution]) -> list[PathSolution]:
    """Linkages that differ, best first: the same one may be best with several bounds."""
    kept: list[PathSolution] = []
    for solution in sorted(solutions, key=lambda each: each.error):
        numbers = _numbers_of(solution.linkage)
        if not any(np.allclose(numbers, _numbers_of(other.linkage), rtol=_SAME, atol=0.0) for other in kept):
            kept.append(solution)
    return kept


def _numbers_of(linkage: FourBar) -> FloatArray:
    return np.array([*linkage.lengths, abs(linkage.point), abs(linkage.point - 1.0)])


def _with_cognates(solution: PathSolution, number: int) -> list[PlacedFourBar]:
    """A solution and its cognates, of which there are none where the point is a pin of the linkage."""
    linkage, angles = solution.linkage, solution.angles
    passed = _apart(linkage.points(angles), angles)
    cognates: tuple[FourBar, ...] = ()
    with suppress(RequestError):
        cognates = find_cognates(linkage, float(angles[0]))
    return [
        PlacedFourBar(each, number, cognate, find_passage(each, passed).fate)
        for cognate, each in enumerate((linkage, *cognates))
    ]


def _apart(points: ComplexArray, angles: FloatArray) -> ComplexArray:
    """The points without those at the crank angle of the one before."""
    return np.asarray(points[np.concatenate([[True], np.abs(np.diff(angles)) > _SAME_ANGLE])])
