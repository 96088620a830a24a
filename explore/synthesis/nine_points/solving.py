"""All linkages through nine points: the solutions of a generic problem, followed to that of the points."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from os import cpu_count

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.nine_points.classes import (
    N_CLASSES,
    cognate,
    distinct,
    exchange,
    is_degenerate,
    keys,
    residuals,
)
from explore.synthesis.nine_points.equations import N_POINTS
from explore.synthesis.nine_points.tracking import ARRIVED, FATE, N_FACTS, track

#: Attempts at a path: error of the predictor, which cognate is followed, most steps, and least step.
_ATTEMPTS = (
    (1e-4, 0, 5_000, 1e-12),
    (1e-5, 1, 10_000, 1e-14),
    (1e-5, 2, 10_000, 1e-14),
    (1e-6, 0, 30_000, 1e-15),
    (1e-6, 1, 30_000, 1e-15),
    (1e-6, 2, 30_000, 1e-15),
    (1e-7, 0, 60_000, 1e-15),
    (1e-7, 2, 60_000, 1e-15),
)
#: Paths of one task of a thread.
_CHUNK = 32
#: Largest relative distance of hats from conjugates in real solutions, and largest relative residual of a solution.
_REAL, _RESIDUAL = 1e-6, 1e-5
_SAME = 1e-7


@dataclass(frozen=True)
class NinePointSolutions:
    """What was found through nine points.

    Attributes
    ----------
    solutions
        One of each class that was found, shape (n, 8), from the first point in units of the points' mean distance to
        it.
    real
        Rows of those that are real.
    missing
        Number of classes of a generic problem less those found: 0 when all were found.
    linkages
        The linkages of the real ones with their cognates, three to a class; each with both orders of its dyads is one.
    """

    solutions: ComplexArray
    real: npt.NDArray[np.intp]
    missing: int
    linkages: tuple[FourBar, ...]

    @property
    def is_complete(self) -> bool:
        """Whether all classes of a generic problem were found, so that no other linkage exists."""
        return self.missing == 0


@lru_cache(maxsize=2)
def start_system(number: int) -> tuple[ComplexArray, ComplexArray]:
    """Solutions, one of each class, and parameters of a generic problem; see `tests/reference/make_nine_points.py`."""
    with files("explore").joinpath("data/nine_points.npz").open("rb") as stream, np.load(stream) as data:
        return data[f"solutions_{number}"], data[f"parameters_{number}"]


def find_all(points: ComplexArray) -> NinePointSolutions:
    """All linkages through nine points.

    Parameters
    ----------
    points
        Shape (9,), complex.

    Raises
    ------
    RequestError
        If the points are not nine or two are equal.
    """
    if len(points) != N_POINTS + 1:
        raise RequestError(f"nine points determine all linkages, not {len(points)}")
    vectors = points[1:] - points[0]
    size = float(np.abs(vectors).mean())
    gaps = np.abs(points[:, None] - points)
    np.fill_diagonal(gaps, np.inf)
    if not gaps.min() > 1e-9 * size:
        one, other = sorted(np.argwhere(gaps == gaps.min())[0].tolist())
        raise RequestError(f"points {one + 1} and {other + 1} are equal; remove one or move it")
    parameters = np.concatenate([vectors, vectors.conj()]).astype(np.complex128) / size
    found = solve(parameters, 0)
    if len(found) < N_CLASSES:
        both = np.concatenate([found, solve(parameters, 1)])
        found = both[distinct(both, _SAME)]
    real = np.flatnonzero(_distance_from_real(found) < _REAL)
    linkages = [linkage for row in real for linkage in _linkages(found[row], points[0], size)]
    return NinePointSolutions(found, real, N_CLASSES - len(found), tuple(linkages))


def solve(parameters: ComplexArray, number: int) -> ComplexArray:
    """The solutions that the paths from a start system lead to, one of each class.

    A path that does not arrive, or arrives where another one does, is followed again with smaller steps and from other
    cognates, which lie elsewhere.
    """
    solutions, start = start_system(number)
    second = cognate(solutions)
    members = [solutions, second, cognate(second)]
    rates = parameters - start
    found = np.full_like(solutions, np.nan)
    todo = np.arange(len(solutions))
    is_good = np.zeros(len(solutions), dtype=bool)
    for wanted, member, most_steps, least_step in _ATTEMPTS:
        found[todo], facts = follow(members[member][todo], start, rates, wanted, most_steps, least_step)
        arrived = facts[:, FATE] == ARRIVED
        good = arrived & ~is_degenerate(found[todo], 1e-11) & (residuals(found[todo], parameters) < _RESIDUAL)
        is_good[todo] = good & np.isfinite(keys(found[todo])).all(axis=1)
        todo = np.flatnonzero(~is_good | _is_repeated(found, is_good))
        if not len(todo):
            break
    return found[is_good][distinct(found[is_good], _SAME)]


def follow(
    solutions: ComplexArray, start: ComplexArray, rates: ComplexArray, wanted: float, most_steps: int, least_step: float
) -> tuple[ComplexArray, FloatArray]:
    """Follow solutions on all cores; see `track`."""
    ends = np.ascontiguousarray(solutions)
    ends = ends.copy() if ends is solutions else ends
    facts = np.zeros((len(ends), N_FACTS))

    def run(first: int) -> None:
        part = slice(first, first + _CHUNK)
        track(ends[part], start, rates, wanted, most_steps, least_step, facts[part])

    with ThreadPoolExecutor(cpu_count()) as pool:
        list(pool.map(run, range(0, len(ends), _CHUNK)))
    return ends, facts


def _is_repeated(found: ComplexArray, is_good: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether another path arrived at the same class: one of both changed over to the other."""
    from scipy.spatial import cKDTree

    rows = np.flatnonzero(is_good)
    repeated = np.zeros(len(found), dtype=bool)
    if len(rows):
        pairs = cKDTree(keys(found[rows])).query_pairs(_SAME, output_type="ndarray")
        repeated[rows[pairs.ravel()]] = True
    return repeated


def _distance_from_real(solutions: ComplexArray) -> FloatArray:
    """The largest difference of a hat and a conjugate, relative to the largest unknown, (n,)."""
    plain, hatted = solutions[:, 0::2], solutions[:, 1::2]
    return np.asarray(np.abs(plain.conj() - hatted).max(axis=1) / np.abs(solutions).max(axis=1))


def _linkages(solution: ComplexArray, origin: complex, size: float) -> list[FourBar]:
    """The three cognates of a real solution, each with the shorter of its turning links as its crank."""
    found = []
    member = solution[None]
    for _ in range(3):
        ordered = min((member, exchange(member)), key=lambda rows: abs(rows[0, 0] - rows[0, 2]))
        x, a, y, b = (complex(ordered[0, k]) * size for k in (0, 2, 4, 6))
        branch = 1 if ((b - x).conjugate() * (y - x)).imag > 0.0 else -1
        found.append(FourBar(origin + a, origin + b, abs(x - a), abs(y - x), abs(y - b), -x / (y - x), branch))
        member = cognate(member)
    return found
