"""Four-bars through three points at given crank angles.

From a given origin, the pivot of the crank lies at the distance r1 in a direction alpha that is chosen, the crank of
length r2 has the given angles phi_j, and a side of the coupler of length r3 leads to the points. Without the unknown
angles of that side, with K1 = r1, K2 = r2, K3 = r3^2 - r1^2 - r2^2 and the points r e^{i delta}::

    2 r cos(alpha - delta) K1 + 2 r cos(phi - delta) K2 + K3 = r^2 + 2 cos(phi - alpha) K1 K2

Three points make it linear in K but for q = K1 K2, for which a quadratic equation remains. The other side of the
coupler and the rocker follow alike, from the angles of that side in place of the crank's, with its first angle and the
direction beta chosen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar


@dataclass(frozen=True)
class Chain:
    """Two links in a row from a fixed pivot to the points.

    Attributes
    ----------
    pivot
        The fixed pivot.
    first, second
        Lengths of the links; a negative first one points against its angle.
    angles
        Angles of the second link at the points, rad, shape (3,).
    """

    pivot: complex
    first: float
    second: float
    angles: FloatArray


def find_chains(points: ComplexArray, angles: FloatArray, direction: float) -> list[Chain]:
    """The chains, at most two, whose first link has these angles at three points.

    Parameters
    ----------
    points
        The points, from the origin on the line on which the pivot lies, shape (3,).
    angles
        Angles of the first link, rad, shape (3,).
    direction
        Of the line from the origin to the pivot, rad.

    Raises
    ------
    RequestError
        If the three equations are not independent.
    """
    distances, bearings = np.abs(points), np.angle(points)
    matrix = np.column_stack([
        2.0 * distances * np.cos(direction - bearings), 2.0 * distances * np.cos(angles - bearings), np.ones(3),
    ])  # fmt: skip
    if np.linalg.cond(matrix) > 1e12:
        raise RequestError("the three points and angles are not independent; move a point, an angle or the origin")
    right = np.column_stack([distances**2, 2.0 * np.cos(angles - direction)])
    constant, of_q = np.linalg.solve(matrix, right).T
    roots = np.roots([
        of_q[0] * of_q[1], constant[0] * of_q[1] + constant[1] * of_q[0] - 1.0, constant[0] * constant[1],
    ])  # fmt: skip
    chains = []
    for q in roots[np.abs(roots.imag) <= 1e-9 * np.abs(roots)].real:
        k1, k2, k3 = constant + q * of_q
        square = k3 + k1**2 + k2**2
        if square > 0.0:
            pivot = k1 * np.exp(1j * direction)
            ends = points - pivot - k2 * np.exp(1j * angles)
            chains.append(Chain(complex(pivot), float(k2), float(np.sqrt(square)), np.angle(ends)))
    return chains


def find_four_bars(
    points: ComplexArray, angles: FloatArray, alpha: float, beta: float, side_angle: float
) -> list[FourBar]:
    """The four-bars, at most four, whose coupler point is at three points at three crank angles.

    Parameters
    ----------
    points
        The points, from the origin, shape (3,).
    angles
        Angles of the crank, rad, shape (3,).
    alpha, beta
        Directions of the pivots of crank and rocker from the origin, rad: free choices.
    side_angle
        Angle of the coupler's side from the rocker's pin to the point, at the first point, rad: a free choice.
    """
    found = []
    for crank in find_chains(points, angles, alpha):
        turned = side_angle + crank.angles - crank.angles[0]
        # The side has the known angles here, and the rocker the unknown ones: the links change places.
        for rocker in find_chains(points, turned, beta):
            crank_pin = points[0] - crank.second * np.exp(1j * crank.angles[0])
            rocker_pin = points[0] - rocker.first * np.exp(1j * turned[0])
            coupler = rocker_pin - crank_pin
            diagonal = rocker.pivot - crank_pin
            branch = 1 if (diagonal.conjugate() * coupler).imag > 0.0 else -1
            ratio = (points[0] - crank_pin) / coupler
            lengths = abs(crank.first), abs(coupler), rocker.second
            found.append(FourBar(crank.pivot, rocker.pivot, *lengths, complex(ratio), branch))
    return found
