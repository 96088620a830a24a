"""The solutions of a generic problem of nine points, followed to those of the problem of given points."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.resources import files
from importlib.util import find_spec
from os import cpu_count

import numpy as np
import numpy.typing as npt

from explore.model.progress import ReportProgress
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.classes import (
    SAME,
    cognates,
    distinct,
    is_degenerate,
    keys,
    residuals,
)
from explore.synthesis.nine_points.endgame import (
    DEGENERATE,
    INFINITE,
    LOST,
    REGULAR,
    SHRINKAGES,
    SINGULAR,
    find_limits,
)
from explore.synthesis.nine_points.regularity import is_regular
from explore.synthesis.nine_points.tracking import track

#: Attempt at a path: error of the predictor, which cognate is followed, most steps, and least step.
_Attempt = tuple[float, int, int, float]
#: Attempts at a path up to its last share.
_ATTEMPTS: tuple[_Attempt, ...] = (
    (1e-4, 0, 5_000, 1e-12),
    (1e-5, 1, 10_000, 1e-14),
    (1e-5, 2, 10_000, 1e-14),
    (1e-6, 0, 30_000, 1e-15),
    (1e-6, 1, 30_000, 1e-15),
    (1e-6, 2, 30_000, 1e-15),
    (1e-7, 0, 60_000, 1e-15),
    (1e-7, 2, 60_000, 1e-15),
)
#: Last share of a path.
_NEAR = 0.05
#: Attempts at the last share of a path.
_LAST_ATTEMPTS: tuple[_Attempt, ...] = tuple(
    (wanted, member, 1_200, 1e-15) for wanted, member in ((1e-4, 0), (1e-5, 1))
)
#: Attempts at paths that neither arrived nor were classified: in generic problems, to solutions beyond 1e5.
_PATIENT_ATTEMPTS: tuple[_Attempt, ...] = tuple(
    (wanted, member, 4_000, 1e-18) for wanted in (1e-6, 3e-5, 1e-3, 1e-4) for member in (0, 1, 2)
)
#: Largest number of paths that are followed with more digits, a second or two for each: of a parabola 45.
_MOST_PRECISE = 60
#: Number of paths of one task of a thread.
_CHUNK = 32
#: Largest relative residual of a solution.
_RESIDUAL = 1e-5
#: Largest length, relative to the linkage, of a link that is a point.
_DEGENERATE = 1e-11
#: Distance of keys of limits of paths that meet.
_MEET = 1e-4


@dataclass(frozen=True)
class Ends:
    """Where the paths of one start system lead.

    Limits, (1442, 8), NaN where infinite or lost; fates of `endgame`; how many paths meet at the limit in a cycle, 0
    where that is not known. If the user stopped it, paths that were not followed are lost.
    """

    solutions: ComplexArray
    fates: npt.NDArray[np.int64]
    windings: npt.NDArray[np.int64]
    is_interrupted: bool = False

    def count(self, fate: int) -> int:
        """Number of paths of a fate."""
        return int((self.fates == fate).sum())

    @property
    def n_others(self) -> int:
        """Number of paths that are known to lead to no regular solution."""
        return len(self.fates) - self.count(REGULAR) - self.count(LOST)

    @property
    def regular(self) -> ComplexArray:
        """The regular solutions."""
        return np.asarray(self.solutions[self.fates == REGULAR])

    @property
    def singular(self) -> ComplexArray:
        """The singular solutions, one of each class."""
        found = self.solutions[self.fates == SINGULAR]
        return np.asarray(found[distinct(found, _MEET)])


@lru_cache(maxsize=2)
def start_system(number: int) -> tuple[ComplexArray, ComplexArray]:
    """Solutions, one of each class, and parameters of a generic problem; see `tests/reference/make_nine_points.py`."""
    with files("explore").joinpath("data/nine_points.npz").open("rb") as stream, np.load(stream) as data:
        return data[f"solutions_{number}"], data[f"parameters_{number}"]


def solve(parameters: ComplexArray, number: int, report: ReportProgress | None = None) -> Ends:
    """Where the paths from a start system lead.

    The paths first go near the parameters, where all solutions are regular and distinct; then straight to them, and
    those that do not simply arrive go around them. `report` is called with the number of paths whose ends are known.
    """
    solutions, start = start_system(number)
    rates = parameters - start
    last = _NEAR * rates
    near, is_near = _arrive(solutions, start, rates - last, _ATTEMPTS)
    ends = np.full_like(solutions, np.nan)
    fates, windings = np.full(len(solutions), LOST), np.zeros(len(solutions), dtype=np.int64)
    found = Ends(ends, fates, windings)
    try:
        _follow_to(near, np.flatnonzero(is_near), parameters, last, found, report)
    except KeyboardInterrupt:
        found = replace(found, is_interrupted=True)
    fates[(fates == REGULAR) & ~is_regular(ends, parameters)] = SINGULAR
    regular = np.flatnonzero(fates == REGULAR)
    ends[regular], arrived = follow(ends[regular], parameters, np.zeros_like(parameters), 1e-6, 10, 1e-3)
    # Circles around several paths to infinity may have a limit that solves no equation.
    fates[regular[~arrived]] = LOST
    fates[(fates == REGULAR) & is_degenerate(ends, _DEGENERATE)] = DEGENERATE
    fates[is_repeated(ends, fates == REGULAR)] = LOST
    if not found.is_interrupted:
        unclear = (fates == LOST) | _is_single_end(ends, fates == SINGULAR, windings)
        try:
            _follow_far(near, np.flatnonzero(is_near & unclear), parameters - last, last, found, report)
        except KeyboardInterrupt:
            found = replace(found, is_interrupted=True)
        fates[is_repeated(ends, fates == REGULAR)] = LOST
    return found


def _follow_to(
    near: ComplexArray,
    rows: npt.NDArray[np.intp],
    parameters: ComplexArray,
    last: ComplexArray,
    found: Ends,
    report: ReportProgress | None,
) -> None:
    """Follow the last share of paths, and enter where they lead: what arrives may still be singular."""
    ends, fates, windings = found.solutions, found.fates, found.windings
    ends[rows], arrived = _arrive(near[rows], parameters - last, last, _LAST_ATTEMPTS)
    arrived &= is_regular(ends[rows], parameters)
    fates[rows[arrived]], windings[rows[arrived]] = REGULAR, 1
    rest = rows[~arrived]
    _tell(report, found)
    for shrinkage in SHRINKAGES:
        limits = find_limits(near[rest], parameters, last, _follow_on, shrinkage)
        fates[rest], windings[rest], ends[rest] = limits.fates, limits.windings, limits.solutions
        rest = rest[limits.fates == LOST]
        _tell(report, found)
    ends[rest], arrived = _arrive(near[rest], parameters - last, last, _PATIENT_ATTEMPTS)
    fates[rest[arrived]], windings[rest[arrived]] = REGULAR, 1


def _tell(report: ReportProgress | None, found: Ends) -> None:
    """Report how many paths have a known end."""
    if report is not None:
        report(len(found.fates) - found.count(LOST), len(found.fates))


def _follow_far(
    near: ComplexArray,
    rows: npt.NDArray[np.intp],
    start: ComplexArray,
    rates: ComplexArray,
    ends: Ends,
    report: ReportProgress | None,
) -> None:
    """Follow paths with more digits, and enter where they lead; without the package for them none."""
    if not has_more_digits() or len(rows) > _MOST_PRECISE:
        return
    for row in rows:
        _tell(report, ends)
        from explore.synthesis.nine_points.precise_tracking import follow_precisely

        for member in cognates(near[[row]]):
            end = follow_precisely(member[0], start, rates)
            if end.solution is not None:
                is_point = is_degenerate(end.solution[None], _DEGENERATE)[0]
                fate = DEGENERATE if is_point else REGULAR
                ends.solutions[row], ends.fates[row], ends.windings[row] = end.solution, fate, 1
            elif end.is_infinite:
                ends.solutions[row], ends.fates[row], ends.windings[row] = np.nan, INFINITE, 0
            else:
                continue
            break


def has_more_digits() -> bool:
    """Whether the package is installed in whose numbers paths to far solutions are followed."""
    return find_spec("flint") is not None


def _is_single_end(
    ends: ComplexArray, is_singular: npt.NDArray[np.bool_], windings: npt.NDArray[np.int64]
) -> npt.NDArray[np.bool_]:
    """Whether a path's limit is singular though the paths that would meet there do not: of w in a cycle all end there.

    One alone is no cycle, so that only digits are missing, or the limit is not isolated.
    """
    rows = np.flatnonzero(is_singular)
    single = np.zeros(len(ends), dtype=bool)
    if len(rows):
        table = keys(ends[rows])
        n_there = (np.abs(table[:, None] - table).max(axis=2) < _MEET).sum(axis=1)
        single[rows] = n_there < np.maximum(windings[rows], 2)
    return single


def _arrive(
    solutions: ComplexArray, start: ComplexArray, rates: ComplexArray, attempts: tuple[_Attempt, ...]
) -> tuple[ComplexArray, npt.NDArray[np.bool_]]:
    """Where solutions arrive, one of each class, and whether they do, each at another class.

    A path that does not arrive, or arrives where another one does, is followed again with smaller steps and from other
    cognates, which lie elsewhere.
    """
    members = cognates(solutions)
    found = np.full_like(solutions, np.nan)
    todo = np.arange(len(solutions))
    is_good = np.zeros(len(solutions), dtype=bool)
    for wanted, member, most_steps, least_step in attempts:
        found[todo], arrived = follow(members[member][todo], start, rates, wanted, most_steps, least_step)
        good = arrived & ~is_degenerate(found[todo], _DEGENERATE) & (residuals(found[todo], start + rates) < _RESIDUAL)
        is_good[todo] = good & np.isfinite(keys(found[todo])).all(axis=1)
        repeated = is_repeated(found, is_good)
        todo = np.flatnonzero(~is_good | repeated)
        if not len(todo):
            break
    is_good[todo] = False
    return found, is_good


def _follow_on(
    solutions: ComplexArray, start: ComplexArray, rates: ComplexArray
) -> tuple[ComplexArray, npt.NDArray[np.bool_]]:
    """Follow solutions to a smaller circle."""
    return follow(solutions, start, rates, 1e-6, 2_000, 1e-6)


def follow(
    solutions: ComplexArray,
    start: ComplexArray,
    rates: ComplexArray,
    wanted: float,
    most_steps: int,
    least_step: float,
) -> tuple[ComplexArray, npt.NDArray[np.bool_]]:
    """Follow solutions on all cores, and tell which arrive; see `track`."""
    ends = np.ascontiguousarray(solutions)
    ends = ends.copy() if ends is solutions else ends
    arrived = np.zeros(len(ends), dtype=bool)

    def run(first: int) -> None:
        part = slice(first, first + _CHUNK)
        track(ends[part], start, rates, wanted, most_steps, least_step, arrived[part])

    with ThreadPoolExecutor(cpu_count()) as pool:
        list(pool.map(run, range(0, len(ends), _CHUNK)))
    return ends, arrived


def is_repeated(found: ComplexArray, is_good: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether another path arrived at the same class: one of both changed over to the other."""
    from scipy.spatial import cKDTree

    rows = np.flatnonzero(is_good)
    repeated = np.zeros(len(found), dtype=bool)
    if len(rows):
        pairs = cKDTree(keys(found[rows])).query_pairs(SAME, output_type="ndarray")
        repeated[rows[pairs.ravel()]] = True
    return repeated
