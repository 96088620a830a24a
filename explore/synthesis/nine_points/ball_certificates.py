"""Krawczyk's test in balls of as many digits as a solution needs; see `certificates`."""

from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, ctx

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.discs import EPSILON
from explore.synthesis.nine_points.equations import HATS, N_POINTS, N_UNKNOWNS, NEARLY_REAL
from explore.synthesis.nine_points.regularity import evaluate

#: Precisions of the first and of further attempts, bits.
_PRECISIONS = (160, 320)
#: Number of Newton's corrections before the test.
_N_CORRECTIONS = 6


def certify_in_balls(
    solution: ComplexArray, points: ComplexArray, size: float
) -> tuple[ComplexArray, FloatArray, bool] | None:
    """Centre and radii of a polydisc that holds exactly one solution, and whether it is real; None without proof.

    The solution is approximate, (8,); points and size as of `certificates.certify`.
    """
    before = ctx.prec
    try:
        for precision in _PRECISIONS:
            ctx.prec = precision
            found = _test(solution, points, size)
            if found is not None:
                return found
    finally:
        ctx.prec = before
    return None


def _test(solution: ComplexArray, points: ComplexArray, size: float) -> tuple[ComplexArray, FloatArray, bool] | None:
    first = acb(complex(points[0]))
    vectors = [(acb(complex(point)) - first) / acb(size) for point in points[1:]]
    parameters = vectors + [vector.conjugate() for vector in vectors]
    centre = [acb(complex(value)) for value in solution]
    inverse = None
    for _ in range(_N_CORRECTIONS):
        values, slopes, _ = _terms(centre, parameters)
        try:
            inverse = _middle(slopes.inv())
        except ZeroDivisionError:
            return None
        steps = inverse * values
        centre = [(c - steps[k, 0]).mid() for k, c in enumerate(centre)]
    distance = max(float((c.conjugate() - centre[k]).abs_upper()) for k, c in zip(HATS, centre, strict=True))
    is_symmetric = distance < NEARLY_REAL * max(float(c.abs_upper()) for c in centre)
    if is_symmetric:
        for k in range(0, N_UNKNOWNS, 2):
            centre[k] = ((centre[k] + centre[k + 1].conjugate()) / 2).mid()
            centre[k + 1] = centre[k].conjugate()
    values, _, _ = _terms(centre, parameters)
    steps = inverse * values
    radius = max(float(steps[k, 0].abs_upper()) for k in range(N_UNKNOWNS)) * 4.0 + 1e-300
    spread = arb(0.0, radius)
    rest = acb(spread, spread)
    box = [c + rest for c in centre]
    _, slopes, determinants = _terms(box, parameters)
    shift = (
        acb_mat(N_UNKNOWNS, N_UNKNOWNS, [int(i == k) for i in range(8) for k in range(8)]) - inverse * slopes
    ) * acb_mat(N_UNKNOWNS, 1, [rest] * N_UNKNOWNS)
    inside = all(box[k].contains_interior(centre[k] - steps[k, 0] + shift[k, 0]) for k in range(N_UNKNOWNS))
    if not inside or not _is_linkage(box, determinants):
        return None
    rounded = np.array([complex(c) for c in centre])
    # The corner of a square of that half side, and the rounding of its middle.
    return rounded, 2.0 * radius + 2.0 * EPSILON * np.abs(rounded), is_symmetric


def _terms(z: list[Any], parameters: list[Any]) -> tuple[Any, Any, list[Any]]:
    """Values, derivatives and determinants at all points."""
    terms = [evaluate(z, parameters[j], parameters[N_POINTS + j]) for j in range(N_POINTS)]
    slopes = acb_mat(N_POINTS, N_UNKNOWNS, [each for _, row, _ in terms for each in row])
    return acb_mat(N_POINTS, 1, [value for value, _, _ in terms]), slopes, [each for _, _, each in terms]


def _middle(matrix: Any) -> Any:
    """The midpoints of a matrix: any matrix is as good for the test."""
    return acb_mat(N_UNKNOWNS, N_UNKNOWNS, [matrix[i, k].mid() for i in range(N_UNKNOWNS) for k in range(N_UNKNOWNS)])


def _is_linkage(box: list[Any], determinants: list[Any]) -> bool:
    """Whether it is proved that no length and no Cramer determinant is zero."""
    numbers = list(determinants)
    for o in (0, 1):
        x, a, y, b = (box[k + o] for k in (0, 2, 4, 6))
        numbers += [x, y, x - y, x - a, y - b, a - b]
    return all(not number.contains(0) for number in numbers)
