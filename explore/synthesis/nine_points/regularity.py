"""The equations of nine points by plain arithmetic, and whether a solution is a regular one."""

from typing import Any

import numpy as np
import numpy.typing as npt

from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.equations import N_POINTS, N_UNKNOWNS

#: Largest ratio of least to largest singular value of a singular solution, 1e-15; regular ones have 1e-13 and more.
_SINGULAR = 1e-14
#: Largest Cramer determinant over its terms of a linkage at a dead point.
_DEAD = 1e-9


def evaluate(z: Any, d: Any, dh: Any) -> tuple[Any, list[Any], Any]:
    """The equations' values, derivatives by the eight unknowns, and Cramer's determinants, by plain arithmetic.

    `z` holds eight numbers of any kind, `d` and `dh` the coordinates of a point; see `equations.linearise`, which is
    the same in compiled code.
    """
    x, xh, a, ah, y, yh, b, bh = z
    a_left, a_right, b_left, b_right = ah - dh, a - d, bh - dh, b - d
    a1, b1, c1 = a_left * x, a_right * xh, d * (ah - xh) + dh * (a_right - x)
    a2, b2, c2 = b_left * y, b_right * yh, d * (bh - yh) + dh * (b_right - y)
    g, h, e = b1 * c2 - b2 * c1, c1 * a2 - c2 * a1, a1 * b2 - a2 * b1
    by_g, by_h, by_e = h + e, g + e, g + h
    by_a1, by_a2 = by_e * b2 - by_h * c2, by_h * c1 - by_e * b1
    by_b1, by_b2 = by_g * c2 - by_e * a2, by_e * a1 - by_g * c1
    by_c1, by_c2 = by_h * a2 - by_g * b2, by_g * b1 - by_h * a1
    row = [
        by_a1 * a_left - by_c1 * dh,
        by_b1 * a_right - by_c1 * d,
        by_b1 * xh + by_c1 * dh,
        by_a1 * x + by_c1 * d,
        by_a2 * b_left - by_c2 * dh,
        by_b2 * b_right - by_c2 * d,
        by_b2 * yh + by_c2 * dh,
        by_a2 * y + by_c2 * d,
    ]
    return g * h + e * by_e, row, e


def determinant_terms(z: Any, d: Any, dh: Any) -> Any:
    """The size of the terms of Cramer's determinant, which cancel where it vanishes; see `evaluate`."""
    x, xh, a, ah, y, yh, b, bh = z
    left, left_h, right, right_h = (abs(u) + abs(v) for u, v in ((a, d), (ah, dh), (b, d), (bh, dh)))
    return abs(x * yh) * left_h * right + abs(xh * y) * left * right_h


def is_regular(solutions: ComplexArray, parameters: ComplexArray) -> npt.NDArray[np.bool_]:
    """Whether the equations' derivatives are independent at solutions, shape (n,).

    They are not where a Cramer determinant is zero: at a dead point of the linkage, or with a pivot at a point, the
    coupler's rotation has two values, and two paths meet.
    """
    z = [solutions[:, [k]] for k in range(N_UNKNOWNS)]
    d, dh = parameters[:N_POINTS], parameters[N_POINTS:]
    with np.errstate(all="ignore"):
        _, row, determinants = evaluate(z, d, dh)
        is_dead = (np.abs(determinants) < _DEAD * determinant_terms(z, d, dh)).any(axis=1)
        jacobian = np.stack(row, axis=-1) * solutions[:, None, :]
        jacobian /= np.abs(jacobian).max(axis=2, keepdims=True)
    usable = np.isfinite(jacobian).all(axis=(1, 2))
    values = np.zeros((len(solutions), N_UNKNOWNS))
    values[usable] = np.linalg.svd(jacobian[usable], compute_uv=False)
    return np.asarray(usable & ~is_dead & (values[:, -1] > _SINGULAR * values[:, 0]))
