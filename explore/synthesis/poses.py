"""Dyads that carry a body through poses: a fixed pivot, and a pivot on the body that stays on a circle around it.

The body's pose j takes a point z of pose 1 to e^{i t_j} z + d_j. A point z on the body keeps its distance from w if,
for each j after the first::

    w' ((e^{i t_j} - 1) z + d_j) + w ((e^{-i t_j} - 1) z' + d'_j) = d'_j e^{i t_j} z + d_j e^{-i t_j} z' + |d_j|^2

with ' for the conjugate: bilinear in the two pivots (L. Burmester, Lehrbuch der Kinematik, 1888). Three poses leave the
moving pivot free, four leave one parameter, and five have at most four dyads.
"""

from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray

#: Largest relative imaginary part of a real root.
_REAL = 1e-6
#: Largest relative residual of a root.
_RESIDUAL = 1e-9
#: Distance of poses, or of moving pivots, up to which they are the same, relative to the task.
_SAME = 1e-7
#: Number of Newton's steps on roots that are already close.
_N_STEPS = 8


@dataclass(frozen=True)
class Poses:
    """Poses of a body in the plane: places of a point of it, complex, and angles, rad, each (n,)."""

    points: ComplexArray
    angles: FloatArray

    def displacements(self) -> tuple[ComplexArray, ComplexArray]:
        """Rotations e^{i t_j} and shifts d_j from pose 1 to each later pose, each (n - 1,)."""
        rotations = np.exp(1j * (self.angles[1:] - self.angles[0]))
        return rotations, self.points[1:] - rotations * self.points[0]


@dataclass(frozen=True)
class Dyad:
    """A fixed pivot, and a pivot on the body in its first pose."""

    fixed: complex
    moving: complex


def fixed_pivots(poses: Poses, moving: ComplexArray) -> ComplexArray:
    """The fixed pivots that moving pivots, (n,), need for three poses: centres of the circles through three points.

    The moving pivots are on the body in its first pose. NaN where the three points lie on a line.
    """
    rotations, shifts = poses.displacements()
    places = rotations[:, None] * moving + shifts[:, None] - moving
    first, second = places
    area = (first.conjugate() * second).imag
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = 1j * (second * np.abs(first) ** 2 - first * np.abs(second) ** 2) / (-2.0 * area)
    return np.where(area == 0.0, np.nan, moving + centre)


def burmester_curves(poses: Poses, angles: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Fixed and moving pivots for four poses, each (2, n): points of the two Burmester curves.

    The angles, (n,), by which the link turns from pose 1 to pose 2, rad, are free; each has two pivots, NaN where there
    are none.

    With W the link and Z the vector from its moving pivot to the point of the body, each in pose 1, W (e^{i b_j} - 1) +
    Z (e^{i t_j} - 1) = P_j - P_1. Three equations for two unknowns: their determinant vanishes, which closes a loop of
    four vectors like that of a four-bar, with b_2 as its input (G. N. Sandor, A. G. Erdman, Advanced Mechanism Design,
    1984, chapter 3).
    """
    rotations, _ = poses.displacements()
    moved, turned = poses.points[1:] - poses.points[0], rotations - 1.0
    # The determinant of (e^{i b_j} - 1, turned_j, moved_j) by its first column.
    minors = np.array([
        turned[1] * moved[2] - turned[2] * moved[1],
        turned[2] * moved[0] - turned[0] * moved[2],
        turned[0] * moved[1] - turned[1] * moved[0],
    ])  # fmt: skip
    second = np.exp(1j * np.asarray(angles))
    rest = minors[0] * (second - 1.0) - minors[1] - minors[2]
    # minors[1] e^{i b_3} + minors[2] e^{i b_4} = -rest: a triangle with sides of known lengths.
    length, one, two = np.abs(rest), abs(minors[1]), abs(minors[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        corner = np.arccos((length**2 + one**2 - two**2) / (2.0 * length * one))
        third = -rest / length * (abs(minors[1]) / minors[1]) * np.exp(1j * np.array([corner, -corner]))
        # W and Z from the equations of poses 2 and 3
        a, c = np.broadcast_to(second, third.shape) - 1.0, third - 1.0
        determinant = a * turned[1] - c * turned[0]
        links = (moved[0] * turned[1] - moved[1] * turned[0]) / determinant
        bodies = (a * moved[1] - c * moved[0]) / determinant
    moving = poses.points[0] - bodies
    return moving - links, moving


def find_dyads(poses: Poses) -> list[Dyad]:
    """All real dyads of five poses, at most four.

    The four equations are linear in (1, w, w') with coefficients linear in z and z'. Multiplied by 1, y and y^2, with z
    = x + i y, they are twelve equations for twelve products of powers of y with (1, w, w'), a generalised eigenvalue
    problem in x. Two of its six roots lie at infinity. Newton's method takes the others to the last digits. Raises
    `RequestError` if the poses are not five, two are alike, or all have the same angle, so that every point may be a
    pivot.
    """
    if len(poses.points) != 5:
        raise RequestError(f"five poses determine the dyads, not {len(poses.points)}")
    centre = poses.points.mean()
    # Poses about one point have no size of their own.
    scale = float(np.abs(poses.points - centre).max()) or 1.0
    if reason := problem_of(poses, scale):
        raise RequestError(reason)
    small = Poses((poses.points - centre) / scale, poses.angles)
    # A turned frame, so that no root has the same x as another by symmetry.
    turn = np.exp(0.7j)
    small = Poses(small.points * turn, small.angles)
    coefficients = _coefficients(small)
    found: list[Dyad] = []
    for root in _eigenvalues(coefficients):
        pivots = _polish(coefficients, root)
        if pivots is None:
            continue
        moving, fixed = pivots
        dyad = Dyad(complex(fixed / turn * scale + centre), complex(moving / turn * scale + centre))
        size = scale + abs(dyad.moving - centre)
        if all(abs(dyad.moving - other.moving) > _SAME * size for other in found):
            found.append(dyad)
    return found


def problem_of(poses: Poses, scale: float, same: float = _SAME) -> str:
    """Why poses determine no isolated dyads, empty if they do; `same` is the difference of equal ones over scale."""
    turns = np.exp(1j * poses.angles)
    for one in range(len(turns)):
        for other in range(one):
            apart = abs(poses.points[one] - poses.points[other]) / scale
            if max(apart, abs(turns[one] - turns[other])) <= same:
                return f"poses {other + 1} and {one + 1} are alike; remove one or move it"
    if np.abs(turns - turns[0]).max() <= same:
        return "all poses have the same angle: translations single out no pivots; turn one of them"
    return ""


def _coefficients(poses: Poses) -> FloatArray:
    """Coefficients [j, k, m] of the equations: m over (1, x, y) of the moving, k over (1, u, v) of the fixed pivot."""
    rotations, shifts = poses.displacements()
    turned = rotations - 1.0
    turning = shifts.conjugate() * rotations
    table = np.empty((len(rotations), 3, 3))
    table[:, 0] = -np.column_stack([np.abs(shifts) ** 2 / 2.0, turning.real, -turning.imag])
    table[:, 1] = np.column_stack([shifts.real, turned.real, -turned.imag])
    table[:, 2] = np.column_stack([shifts.imag, turned.imag, turned.real])
    return table


def _eigenvalues(coefficients: FloatArray) -> ComplexArray:
    """Roots of the moving pivot, complex, (n, 2)."""
    from scipy.linalg import eig

    constant, of_x, of_y = (coefficients[:, :, m] for m in range(3))
    left, right = np.zeros((12, 12)), np.zeros((12, 12))
    for power in range(3):  # columns are the powers of y, each times (1, u, v)
        rows = slice(4 * power, 4 * power + 4)
        left[rows, 3 * power : 3 * power + 3] = constant
        left[rows, 3 * power + 3 : 3 * power + 6] = of_y
        right[rows, 3 * power : 3 * power + 3] = -of_x
    x, vectors = eig(left, right)
    with np.errstate(divide="ignore", invalid="ignore"):
        y = vectors[3] / vectors[0]
    roots = np.column_stack([x, y])
    return np.asarray(roots[np.isfinite(roots).all(axis=1)])


def _polish(coefficients: FloatArray, root: ComplexArray) -> tuple[complex, complex] | None:
    """Moving and fixed pivot of a real root, by Newton's method; None for one at infinity or not real."""
    x, y = root
    if abs(root.imag).max() > _REAL * (1.0 + abs(root).max()):
        return None
    place = np.array([1.0, x.real, y.real])
    matrix = coefficients @ place
    fixed = np.linalg.lstsq(matrix[:, 1:], -matrix[:, 0], rcond=None)[0]
    for _ in range(_N_STEPS):
        other = np.array([1.0, *fixed])
        residual = np.einsum("jkm,k,m->j", coefficients, other, place)
        jacobian = np.column_stack([
            np.einsum("jkm,k->jm", coefficients, other)[:, 1:], (coefficients @ place)[:, 1:],
        ])  # fmt: skip
        try:
            step = np.linalg.solve(jacobian, residual)
        except np.linalg.LinAlgError:
            return None
        place[1:] -= step[:2]
        fixed = fixed - step[2:]
    terms = np.abs(coefficients) * np.abs(other)[:, None] * np.abs(place)
    if not (np.abs(residual) <= _RESIDUAL * terms.sum(axis=(1, 2))).all():
        return None
    return complex(place[1], place[2]), complex(fixed[0], fixed[1])
