"""Proofs that solutions exist, are regular, differ from each other, and are or are not real.

Krawczyk's test: if the map z - Y F(z), with any matrix Y, takes the polydisc of centre c and radii r into its interior
by the enclosure c - Y F(c) + (I - Y F'(polydisc)) (polydisc - c), then F has exactly one zero in it, a regular one (R.
Krawczyk, Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken, Computing 4 (1969) 187-201; A.
Neumaier, Interval methods for systems of equations, 1990, section 5.1). It has one for all parameters of their discs.

A real solution is one whose hats are its conjugates. The polydisc of a candidate is made symmetric under that exchange.
The points are symmetric, so the exchanged zero is a zero in the same polydisc, hence the same: the solution is real.

Discs in double precision prove all but the ill-conditioned solutions; for those there are balls of more digits, where
python-flint is installed.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.discs import EPSILON, Discs, exact, product, stack
from explore.synthesis.nine_points.equations import HATS, N_POINTS, N_UNKNOWNS, NEARLY_REAL
from explore.synthesis.nine_points.regularity import evaluate

Bools = npt.NDArray[np.bool_]
#: Radii of polydiscs, in units of the last correction by Newton's method.
_RADII = (2.0, 16.0)
#: Number of Newton's corrections before the test.
_N_CORRECTIONS = 3


@dataclass(frozen=True)
class Certificates:
    """What is proved of solutions.

    A solution is proved that exists in its polydisc, centres and radii (n, 8), alone in a neighbourhood, regular, and
    one of a linkage: no link is without length, and it is at no dead point at the points. Beside that, (n,): whether it
    is proved to be real, not to be real, and of another class than all other proved ones.
    """

    centres: ComplexArray
    radii: FloatArray
    is_proved: Bools
    is_real: Bools
    is_not_real: Bools
    is_distinct: Bools

    @property
    def n_proved(self) -> int:
        """Number of solutions that are proved, and to differ from all others."""
        return int((self.is_proved & self.is_distinct).sum())

    def of(self, rows: npt.NDArray[np.intp]) -> Certificates:
        """Those of some solutions, which need to differ from each other only."""
        proved = self.is_proved[rows]
        return Certificates(
            self.centres[rows], self.radii[rows], proved, self.is_real[rows], self.is_not_real[rows],
            _are_distinct(self.centres[rows], self.radii[rows], proved),
        )  # fmt: skip


def certify(solutions: ComplexArray, points: ComplexArray, size: float) -> Certificates:
    """Prove what can be proved of approximate solutions, from the first of the exact points in units of `size`."""
    n = len(solutions)
    centres, radii = solutions.copy(), np.full(solutions.shape, np.inf)
    proved, real = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    parameters = _parameters(points, size)
    todo = np.flatnonzero(np.isfinite(solutions).all(axis=1))
    with np.errstate(all="ignore"):
        for factor in _RADII:
            if len(todo):
                centre, radius, symmetric, good = _test(centres[todo], parameters, factor)
                rows = todo[good]
                centres[rows], radii[rows], proved[rows], real[rows] = centre[good], radius[good], True, symmetric[good]
                todo = todo[~good]
        if len(todo) and find_spec("flint"):
            from explore.synthesis.nine_points.ball_certificates import certify_in_balls

            for row in todo:
                found = certify_in_balls(solutions[row], points, size)
                if found is not None:
                    centres[row], radii[row], real[row] = found
                    proved[row] = True
        gap = np.abs(centres.conj() - centres[:, HATS]) - (radii + radii[:, HATS]) * (1.0 + 8.0 * EPSILON)
        not_real = proved & (gap > 8.0 * EPSILON * np.abs(centres)).any(axis=1)
        distinct = _are_distinct(centres, radii, proved)
    return Certificates(centres, radii, proved, real, not_real, distinct)


def _parameters(points: ComplexArray, size: float) -> Discs:
    """Discs of d_1 … d_8 and of their hats, (16,): a difference and a quotient round twice."""
    vectors = (points[1:] - points[0]) / size
    both = np.concatenate([vectors, vectors.conj()])
    return Discs(both, 4.0 * EPSILON * np.abs(both))


def _test(solutions: ComplexArray, parameters: Discs, factor: float) -> tuple[ComplexArray, FloatArray, Bools, Bools]:
    """Centres and radii of polydiscs, whether they are symmetric, and whether Krawczyk's test holds in them."""
    centres = solutions
    for _ in range(_N_CORRECTIONS):
        steps = product(_inverse(centres, parameters), _values(exact(centres), parameters))
        centres = centres - steps.centre[..., 0]
    distance = np.abs(centres.conj() - centres[:, HATS]).max(axis=1)
    symmetric = distance < NEARLY_REAL * np.abs(centres).max(axis=1)
    centres = np.where(symmetric[:, None], 0.5 * (centres + centres[:, HATS].conj()), centres)
    # A sum of conjugates rounds like the sum, so that hats of symmetric centres are exactly the conjugates.
    inverse = _inverse(centres, parameters)
    steps = product(inverse, _values(exact(centres), parameters))
    moved = ((np.abs(steps.centre) + steps.radius) * (1.0 + 8.0 * EPSILON))[..., 0]
    kinds = np.stack([moved[:, 0::2].max(axis=1), moved[:, 1::2].max(axis=1)], axis=1)
    radii = factor * np.tile(kinds, (1, N_UNKNOWNS // 2)) + 4.0 * EPSILON * np.abs(centres)
    radii = np.where(symmetric[:, None], np.maximum(radii, radii[:, HATS]), radii)
    box = Discs(centres, radii)
    slopes = product(inverse, _slopes(box, parameters))
    rest = np.abs(np.eye(N_UNKNOWNS) - slopes.centre) + slopes.radius
    reach = (moved + (rest @ radii[..., None])[..., 0]) * (1.0 + 64.0 * EPSILON)
    return centres, radii, symmetric, (reach < radii).all(axis=1) & _is_linkage(box, parameters)


def _terms(box: Discs, parameters: Discs) -> tuple[Discs, list[Discs], Discs]:
    """Values, derivatives and determinants at all points, each of shape (n, 8)."""
    z = [box[:, [k]] for k in range(N_UNKNOWNS)]
    values, row, determinants = evaluate(z, parameters[:N_POINTS], parameters[N_POINTS:])
    return values, row, determinants


def _values(box: Discs, parameters: Discs) -> Discs:
    """The equations' values, shape (n, 8, 1)."""
    return _terms(box, parameters)[0][..., None]


def _slopes(box: Discs, parameters: Discs) -> Discs:
    """Their derivatives, shape (n, 8 equations, 8 unknowns)."""
    return stack(_terms(box, parameters)[1], axis=-1)


def _inverse(centres: ComplexArray, parameters: Discs) -> ComplexArray:
    """Approximate inverses of the derivatives at the centres; NaN where there is none."""
    jacobian = _slopes(exact(centres), parameters).centre
    scales = 1.0 / np.abs(jacobian).max(axis=2, keepdims=True)
    scaled = jacobian * scales
    usable = np.isfinite(scaled).all(axis=(1, 2))
    usable[usable] = np.abs(np.linalg.det(scaled[usable])) > 0.0
    inverse = np.full_like(jacobian, np.nan)
    inverse[usable] = np.linalg.inv(scaled[usable]) * np.swapaxes(scales, 1, 2)[usable]
    return inverse


def _is_linkage(box: Discs, parameters: Discs) -> Bools:
    """Whether it is proved that no length and no Cramer determinant is zero."""
    good = _terms(box, parameters)[2].excludes_zero().all(axis=1)
    for o in (0, 1):
        x, a, y, b = (box[:, k + o] for k in (0, 2, 4, 6))
        for length in (x, y, x - y, x - a, y - b, a - b):
            good &= length.excludes_zero()
    return np.asarray(good)


@np.errstate(all="ignore")  # invariants of large solutions overflow, and prove nothing
def _are_distinct(centres: ComplexArray, radii: FloatArray, is_proved: Bools) -> Bools:
    """Whether each proved solution is proved to be of another class than all others: some invariant differs."""
    solutions, rows = Discs(centres, radii)[is_proved], np.flatnonzero(is_proved)
    first, second = np.triu_indices(len(rows), 1)
    for o in (0, 1):
        x, a, y, b = (solutions[:, k + o] for k in (0, 2, 4, 6))
        apart = (x - y).reciprocal()
        other = (x - a) * y * apart
        third = (b * x - a * y) * apart
        last = (other - third) * (a - x) * (other - a + x).reciprocal()
        invariants = [
            a + b + third,
            a * b + b * third + third * a,
            x * y + other * (a - x) + last * (third - other),
        ]
        for value in invariants:
            gaps = np.abs(value.centre[first] - value.centre[second]) * (1.0 - 8.0 * EPSILON)
            is_apart = gaps > (value.radius[first] + value.radius[second]) * (1.0 + 8.0 * EPSILON)
            first, second = first[~is_apart], second[~is_apart]
    distinct = is_proved.copy()
    distinct[rows[first]] = distinct[rows[second]] = False
    return distinct
