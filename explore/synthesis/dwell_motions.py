"""Motions of sliders that a link ties to coupler points, with their slopes, of many linkages at once.

Nine numbers describe a linkage with its slider, with lengths in cranks, the crank's pivot as the origin and the
rocker's pivot along the real axis: coupler, rocker and ground; the coupler point along and across the coupler from the
pin of the crank; the crank angle at which the dwell begins; direction of the guide, the link, and the offset of the
guide, by which it passes the crank's pivot on the left.
"""

from typing import NamedTuple

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.dwell_points import couplers

COUPLER, ROCKER, GROUND, ALONG, ACROSS, START, DIRECTION, LINK, OFFSET = range(9)
N_NUMBERS = 9
#: Square of the cosine of the pressure angle below which the link does not reach the guide.
_LEAST_REACH = 1e-4


class Motions(NamedTuple):
    """Motions of sliders at k crank angles.

    Positions along the guides, (n, k), as if the link were a little longer where it does not reach the guide; sines of
    the angles between link and guide, (n, k), beyond 1 there; slopes of both by the nine numbers, (n, 9, k).
    """

    positions: FloatArray
    sines: FloatArray
    position_slopes: FloatArray
    sine_slopes: FloatArray


def slider_motions(numbers: FloatArray, sides: FloatArray, turned: FloatArray) -> Motions:
    """Motions of linkages, shape (n, 9), at crank angles from the begin of the dwell, rad, shape (k,).

    `sides` are 1 where the slider is ahead of the coupler point on its guide, else -1, shape (n,).
    """
    angles = numbers[:, START, None] + turned
    place = couplers(numbers[:, :3], angles)
    arm = (numbers[:, ALONG] + 1j * numbers[:, ACROSS])[:, None] * place.directions
    guide = np.exp(-1j * numbers[:, DIRECTION])[:, None]
    own = (place.pins + arm) * guide
    link, heights = numbers[:, LINK, None], own.imag - numbers[:, OFFSET, None]
    sines = heights / link
    reach = np.sqrt(np.maximum(1.0 - sines**2, _LEAST_REACH))
    positions = own.real + sides[:, None] * link * reach
    # A + b u = g + r v with the rocker's direction v: its real part against v' gives how the coupler turns.
    rockers = (place.pins + numbers[:, COUPLER, None] * place.directions - numbers[:, GROUND, None]) / numbers[
        :, ROCKER, None
    ]
    own_direction = place.directions * rockers.conj()
    turning = np.empty((len(numbers), 4, angles.shape[1]))
    turning[:, 0], turning[:, 1], turning[:, 2] = -own_direction.real, 1.0, rockers.real
    turning[:, 3] = (place.pins * rockers.conj()).imag
    turning /= (-numbers[:, COUPLER, None] * own_direction.imag)[:, None]
    points = np.zeros((len(numbers), N_NUMBERS, angles.shape[1]), dtype=np.complex128)
    rotated = (1j * arm * guide)[:, None]
    points[:, [COUPLER, ROCKER, GROUND, START]] = rotated * turning
    points[:, START] += 1j * place.pins * guide
    points[:, ALONG] = place.directions * guide
    points[:, ACROSS] = 1j * points[:, ALONG]
    points[:, DIRECTION] = -1j * own
    by_heights = points.imag
    by_heights[:, OFFSET] -= 1.0
    slopes = points.real - (sides[:, None] * sines / reach)[:, None] * by_heights
    slopes[:, LINK] += sides[:, None] / reach
    by_sines = by_heights / link[:, None]
    by_sines[:, LINK] -= sines / link
    return Motions(positions, sines, slopes, by_sines)
