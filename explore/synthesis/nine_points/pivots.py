"""All four-bars through seven points with one given pivot, or through five points with both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.synthesis.defects import MISSES, PASSES
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.classes import compressed, is_degenerate
from explore.synthesis.nine_points.equations import N_POINTS
from explore.synthesis.nine_points.four_bars import distance_from_real, linkages_of
from explore.synthesis.nine_points.homotopy import follow
from explore.synthesis.nine_points.report import FoundLinkage, rank, simulated
from explore.synthesis.nine_points.tracking import ARRIVED, FATE

#: Attempts at a path: error of the predictor and most steps.
_ATTEMPTS = ((1e-4, 5_000), (1e-6, 20_000), (1e-7, 60_000))
#: Largest relative distance of one solution found twice.
_SAME = 1e-6
#: Largest relative distance of hats from conjugates in real solutions.
_REAL = 1e-6


@dataclass(frozen=True)
class PivotReport:
    """The linkages through points with given pivots.

    First the ones that pass the points in order, of the least ratio of links. With one given pivot, cognates that share
    it are linkages of their own. Beside them, the numbers of complex solutions of a generic problem and of those found.
    """

    linkages: tuple[FoundLinkage, ...]
    n_paths: int
    n_found: int

    @property
    def is_complete(self) -> bool:
        """Whether all solutions of a generic problem were found, so that no other linkage exists."""
        return self.n_found == self.n_paths

    @property
    def sentence(self) -> str:
        """What was found, and whether anything can be missing."""
        n_passing = sum(each.passage.fate == PASSES for each in self.linkages)
        found = f"All {self.n_paths} solutions were found."
        if not self.is_complete:
            found = (
                f"{self.n_found} of {self.n_paths} solutions were found; the others are infinite, singular or lost, so "
                "that linkages may be missing."
            )
        return f"{found} {len(self.linkages)} linkages are real, {n_passing} of which take the points in order."


def find_with_pivots(points: ComplexArray, pivots: Sequence[complex]) -> PivotReport:
    """All linkages through seven points with one given pivot, or five with both, each simulated.

    Raises `RequestError` if the numbers of points and pivots do not fit, or two of either are equal.
    """
    vectors, size = _checked(points, pivots)
    n_vectors = len(vectors)
    half = np.zeros(N_POINTS, dtype=np.complex128)
    half[:n_vectors] = vectors
    for place, pivot in zip((6, 4), pivots, strict=False):
        half[place] = pivot - points[0]
    half /= size
    parameters = np.concatenate([half, half.conj()])
    found, n_paths = _solve(parameters, n_vectors, 0)
    if len(found) < n_paths:
        both = np.concatenate([found, _solve(parameters, n_vectors, 1)[0]])
        found = both[distinct_rows(both)]
    linkages = []
    for number, solution in enumerate(found[distance_from_real(found) < _REAL], start=1):
        linkage = linkages_of(solution, complex(points[0]), size)[0]
        linkages.append(simulated(linkage, points, number, 0, is_proved=False))
    kept = sorted((each for each in linkages if each.passage.fate != MISSES), key=rank)
    return PivotReport(tuple(kept), n_paths, len(found))


def _checked(points: ComplexArray, pivots: Sequence[complex]) -> tuple[ComplexArray, float]:
    """Vectors from the first point to the others, and their mean length."""
    n_points = {1: 7, 2: 5}.get(len(pivots))
    if n_points is None:
        raise RequestError(f"give one pivot or both, not {len(pivots)}")
    if len(points) != n_points:
        given = "one given pivot" if len(pivots) == 1 else "two given pivots"
        raise RequestError(f"with {given}, {n_points} points determine all linkages, not {len(points)}")
    for name, places in (("points", np.asarray(points)), ("pivots", np.asarray(pivots, dtype=np.complex128))):
        for one in range(len(places)):
            for other in range(one + 1, len(places)):
                if not abs(places[one] - places[other]) > 1e-9 * np.abs(points - points[0]).mean():
                    raise RequestError(f"{name} {one + 1} and {other + 1} are equal; remove one or move it")
    vectors = np.asarray(points[1:] - points[0], dtype=np.complex128)
    return vectors, float(np.abs(vectors).mean())


@lru_cache(maxsize=4)
def _start_system(n_points: int, number: int) -> tuple[ComplexArray, ComplexArray]:
    """Solutions and parameters of a generic problem; see `tests/reference/make_pivot_points.py`."""
    with files("explore").joinpath("data/pivot_points.npz").open("rb") as stream, np.load(stream) as data:
        return data[f"solutions_{n_points}_{number}"], data[f"parameters_{n_points}_{number}"]


def _solve(parameters: ComplexArray, n_vectors: int, number: int) -> tuple[ComplexArray, int]:
    """The solutions that the paths from a start system lead to, each once, and the number of paths.

    A path that does not arrive, or arrives where another one does, is followed again with smaller steps.
    """
    solutions, start = _start_system(n_vectors + 1, number)
    found = np.full_like(solutions, np.nan)
    is_good = np.zeros(len(solutions), dtype=bool)
    todo = np.arange(len(solutions))
    for wanted, most_steps in _ATTEMPTS:
        ends, facts = follow(solutions[todo], start, parameters - start, wanted, most_steps, 1e-14, n_vectors)
        found[todo] = ends
        is_good[todo] = (facts[:, FATE] == ARRIVED) & ~is_degenerate(ends, 1e-9)
        rows = np.flatnonzero(is_good)
        kept = rows[distinct_rows(found[rows])]
        todo = np.setdiff1d(np.arange(len(solutions)), kept)
        if not len(todo):
            break
    return np.asarray(found[kept]), len(solutions)


@np.errstate(all="ignore")  # solutions that were lost are NaN or overflow
def distinct_rows(solutions: ComplexArray) -> npt.NDArray[np.intp]:
    """Rows of the first of each set of equal solutions."""
    from scipy.spatial import cKDTree

    table = compressed(solutions)
    is_seen, kept = np.zeros(len(table), dtype=bool), []
    neighbours = cKDTree(table).query_ball_point(table, _SAME) if len(table) else []
    for row, near in enumerate(neighbours):
        if not is_seen[row]:
            kept.append(row)
            is_seen[near] = True
    return np.array(kept, dtype=np.intp)
