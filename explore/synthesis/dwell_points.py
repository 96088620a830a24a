"""Points of couplers that lie on a circle in five positions: where to look for arcs over which a slider rests.

Lengths are in cranks, the crank's pivot is the origin, and the rocker's pivot lies along the real axis.
"""

from typing import NamedTuple

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray


class Couplers(NamedTuple):
    """Places of couplers: the crank's pins, and unit vectors from there to the rocker's pins, complex, (n, k)."""

    pins: ComplexArray
    directions: ComplexArray


def couplers(lengths: FloatArray, angles: FloatArray) -> Couplers:
    """Places at angles of the crank, rad, shape (n, k), of crank-rockers with couplers, rockers and grounds (n, 3)."""
    coupler, rocker, ground = lengths.T[..., None]
    pins = np.exp(1j * angles)
    diagonal = ground - pins
    square = np.abs(diagonal) ** 2
    along = (square + coupler**2 - rocker**2) / (2.0 * square)
    across = np.sqrt(np.maximum(coupler**2 / square - along**2, 0.0))
    return Couplers(pins, diagonal * (along + 1j * across) / coupler)


def five_position_points(lengths: FloatArray, angles: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """The points of each coupler that five positions hold on a circle, beside its two pins.

    For couplers, rockers and grounds, (n, 3), and five angles of each crank, rad, (n, 5), it returns the points, from
    the pin of the crank along and across the coupler, and the centres of their circles, each (n, 2); NaN where they are
    not real.

    The pin A, the direction u, the point q of the coupler and the centre c satisfy |A + u q - c|^2 = R^2, so that Re(A'
    u q) - Re(A' c) - Re(u' q' c) is the same in all positions: four equations, linear in q, c and w = q' c. They have a
    plane of solutions, which the pins lie in: q = c = 0, and the coupler with the ground. w = q' c singles out four, of
    which the pins are two; the imaginary part is linear without them, and the real part quadratic.
    """
    place = couplers(lengths, angles)
    turning = place.pins.conj() * place.directions
    turning, pins, directions = (each[:, 1:] - each[:, :1] for each in (turning, place.pins, place.directions))
    columns = (-turning.imag, -pins.real, -pins.imag, -directions.real, -directions.imag)
    matrix = np.stack(columns[1:], axis=2)
    # A second solution, whose q has no part along the coupler: i, by the equations' other four columns.
    solved = np.linalg.solve(matrix, -columns[0][..., None])[..., 0]
    one_q, one_c = lengths[:, 0], lengths[:, 2]
    c, w = solved[:, 0] + 1j * solved[:, 1], solved[:, 2] + 1j * solved[:, 3]
    # w a + w2 b = (q1 a + i b)' (c1 a + c b) for the shares a and b of the two solutions.
    mixed, square = one_q * c - 1j * one_c, -1j * c
    with np.errstate(divide="ignore", invalid="ignore"):
        # Imaginary part: a = rise - slope b.
        rise, slope = w.imag / mixed.imag, square.imag / mixed.imag
        own = one_q * one_c
        quadratic = -own * slope**2 + mixed.real * slope - square.real
        linear = -own * slope + w.real + 2.0 * own * rise * slope - mixed.real * rise
        constant = own * rise - own * rise**2
        root = np.sqrt(linear**2 - 4.0 * quadratic * constant)
        b = (-linear[:, None] + np.stack([root, -root], axis=1)) / (2.0 * quadratic[:, None])
        a = rise[:, None] - slope[:, None] * b
    return one_q[:, None] * a + 1j * b, one_c[:, None] * a + c[:, None] * b
