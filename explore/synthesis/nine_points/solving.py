"""All linkages through nine points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.model.progress import ReportProgress
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.certificates import Certificates, certify
from explore.synthesis.nine_points.classes import N_CLASSES, SAME, distinct, has_point, shortest_link
from explore.synthesis.nine_points.endgame import DEGENERATE, INFINITE, LOST, REGULAR, SINGULAR
from explore.synthesis.nine_points.equations import N_POINTS
from explore.synthesis.nine_points.four_bars import distance_from_real
from explore.synthesis.nine_points.homotopy import Ends, has_more_digits, is_repeated, solve

#: Largest relative distance of hats from conjugates in real solutions.
_REAL = 1e-6
#: Longest link, in units of the points' size, that is a point where no linkage is proved: limits have 1e-9 there.
_POINT = 1e-8


@dataclass(frozen=True)
class NinePointSolutions:
    """What was found through nine points.

    Attributes
    ----------
    size
        Mean distance of the points to the first.
    solutions
        The regular ones, one of each class, shape (n, 8), from the first point in units of `size`; first those that are
        proved.
    certificates
        What is proved of them.
    real
        Rows of those that are real.
    singular
        Those where several paths meet or that are not isolated, one of each class, (n, 8), to about six digits: among
        them linkages at a dead point, or with a pivot, at one of the points.
    n_singular, n_degenerate, n_infinite
        Numbers of the other paths, of the start system that leaves most unknown: to singular solutions, to linkages
        with a link that is a point, shorter than 1e-8 of `size` and without a proof, and to linkages with a pivot at
        infinity, as sliders have.
    is_interrupted
        Whether the user stopped before all paths were followed.
    is_consistent
        Whether no start system leads more paths elsewhere than the proved solutions leave.
    """

    size: float
    solutions: ComplexArray
    certificates: Certificates
    real: npt.NDArray[np.intp]
    singular: ComplexArray
    n_singular: int
    n_degenerate: int
    n_infinite: int
    is_interrupted: bool
    is_consistent: bool

    @property
    def n_unproved(self) -> int:
        """Number of regular solutions that are not proved to exist and to differ from all others."""
        return len(self.solutions) - self.certificates.n_proved

    @property
    def n_lost(self) -> int:
        """Number of paths that are not known to lead to a proved solution or elsewhere."""
        n_others = self.n_singular + self.n_degenerate + self.n_infinite
        return max(N_CLASSES - self.certificates.n_proved - n_others, 0)

    @property
    def is_complete(self) -> bool:
        """Whether it is known where all paths lead, so that no other isolated linkage without such a point exists.

        Each regular solution is the end of one path. With 1442 that are proved to differ there is no other; with fewer,
        two start systems have to leave no room for one, and more digits to tell short links from points.
        """
        is_known = has_more_digits() or not self.n_degenerate
        return self.is_consistent and is_known and not (self.n_lost or self.is_interrupted)


def find_all(points: ComplexArray, report: ReportProgress | None = None) -> NinePointSolutions:
    """All linkages through nine points, complex; what was found so far, once a path arrived, if the user stops it.

    `report` is called with the number of paths whose ends are known, of each start system anew. Raises `RequestError`
    if the points are not nine or two are equal.
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
    systems = [with_short_links(solve(parameters, 0, report), points, size)]
    found = merge(systems, points, size)
    if found.is_interrupted or found.certificates.n_proved == N_CLASSES:
        return found
    try:
        systems.append(with_short_links(solve(parameters, 1, report), points, size))
    except KeyboardInterrupt:
        systems[0] = replace(systems[0], is_interrupted=True)
    return merge(systems, points, size)


def merge(systems: Sequence[Ends], points: ComplexArray, size: float) -> NinePointSolutions:
    """What start systems say together of where all paths lead."""
    certificates = certify(np.concatenate([each.regular for each in systems]), points, size)
    # The centres of proofs, where Newton's method led: two ends may be of one solution.
    order = np.argsort(~certificates.is_proved, kind="stable")
    certificates = certificates.of(order[distinct(certificates.centres[order], SAME)])
    rooms = [N_CLASSES - certificates.n_proved - each.n_others for each in systems]
    # One system alone may take a path that is lost for one elsewhere.
    ends = systems[int(np.argmax(np.abs(rooms)))]
    # Where all paths are known, what is not proved is no solution.
    if not any(rooms):
        certificates = certificates.of(np.flatnonzero(certificates.is_proved & certificates.is_distinct))
    found = certificates.centres
    real = np.flatnonzero(distance_from_real(found) < _REAL)
    n_singular, n_degenerate, n_infinite = (ends.count(fate) for fate in (SINGULAR, DEGENERATE, INFINITE))
    return NinePointSolutions(
        size, found, certificates, real, ends.singular, n_singular, n_degenerate, n_infinite,
        any(each.is_interrupted for each in systems), min(rooms) >= 0,
    )  # fmt: skip


def with_short_links(ends: Ends, points: ComplexArray, size: float) -> Ends:
    """The ends, of which those at a link that seems to be a point are regular or lost where it is a short one."""
    rows = np.flatnonzero((ends.fates == DEGENERATE) & np.isfinite(ends.solutions).all(axis=1))
    fates = ends.fates.copy()
    proofs = certify(ends.solutions[rows], points, size)
    fates[rows[proofs.is_proved & ~has_point(proofs.centres)]] = REGULAR
    fates[rows[~proofs.is_proved & (shortest_link(proofs.centres) > _POINT)]] = LOST
    fates[is_repeated(ends.solutions, fates == REGULAR)] = LOST
    return replace(ends, fates=fates)
