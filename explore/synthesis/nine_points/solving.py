"""All linkages through nine points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.nine_points.classes import N_CLASSES, SAME, distinct
from explore.synthesis.nine_points.endgame import DEGENERATE, INFINITE, LOST, SINGULAR
from explore.synthesis.nine_points.equations import N_POINTS
from explore.synthesis.nine_points.four_bars import distance_from_real, linkages_of
from explore.synthesis.nine_points.homotopy import solve

#: Largest relative distance of hats from conjugates in real solutions.
_REAL = 1e-6


@dataclass(frozen=True)
class NinePointSolutions:
    """What was found through nine points.

    Attributes
    ----------
    points
        The points, complex, shape (9,).
    size
        Their mean distance to the first.
    solutions
        The regular ones, one of each class, shape (n, 8), from the first point in units of `size`.
    real
        Rows of those that are real.
    singular
        Those where several paths meet or that are not isolated, one of each class, (n, 8), to about six digits: among
        them linkages at a dead point, or with a pivot, at one of the points.
    n_singular, n_degenerate, n_infinite, n_lost
        Numbers of the other paths: to singular solutions, to linkages with a link that is a point, to linkages with a
        pivot at infinity, as sliders have, and those that no endgame could classify. Together with the regular ones,
        1442.
    linkages
        The linkages of the real ones with their cognates, three to a class; each with both orders of its dyads is one.
    """

    points: ComplexArray
    size: float
    solutions: ComplexArray
    real: npt.NDArray[np.intp]
    singular: ComplexArray
    n_singular: int
    n_degenerate: int
    n_infinite: int
    n_lost: int
    linkages: tuple[FourBar, ...]

    @property
    def is_complete(self) -> bool:
        """Whether it is known where all paths lead, so that no other isolated linkage exists."""
        return self.n_lost == 0


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
    ends = solve(parameters, 0)
    found = ends.regular
    if ends.count(LOST):
        other = solve(parameters, 1)
        both = np.concatenate([found, other.regular])
        found = both[distinct(both, SAME)]
        ends = min(ends, other, key=lambda each: each.count(LOST))
    n_singular, n_degenerate, n_infinite = (ends.count(fate) for fate in (SINGULAR, DEGENERATE, INFINITE))
    n_lost = N_CLASSES - len(found) - n_singular - n_degenerate - n_infinite
    real = np.flatnonzero(distance_from_real(found) < _REAL)
    linkages = [linkage for row in real for linkage in linkages_of(found[row], points[0], size)]
    return NinePointSolutions(
        points, size, found, real, ends.singular, n_singular, n_degenerate, n_infinite, max(n_lost, 0), tuple(linkages)
    )
