"""The oscillating-torque test rig, compiled: closed-form metrics, windows, and the constants of its forces.

The load is what acts on the rocker besides the coupler, counter-clockwise positive::

    M = M0 - Mo sign(w3) - k (theta_3 - phi0) - c w3,    phi0 the mid-angle

Its forces are in `explore.mechanisms.test_rig_forces`.
"""

import math

import numpy as np

from explore.compiling import PIECES_SIGNATURE, compiled
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.arctangent import arctangent
from explore.mechanisms.rocking import ROCKING_SIZE

# Columns of the parameters: the load after the four lengths, the speed last.
(
    CONSTANT_TORQUE, OPPOSING_TORQUE, STIFFNESS, DAMPING, INERTIA,
    CRANK_MASS, COUPLER_MASS, ROCKER_MASS, CRANK_CENTROID, COUPLER_CENTROID, ROCKER_CENTROID,
    COUPLER_INERTIA, ROCKER_INERTIA, GRAVITY, SPEED,
) = range(4, 19)  # fmt: skip

# Kernel row: what `rocking` needs, then the load in SI units, the links in m, which rows of the four-bar the load needs
# and a sine near the rocker's velocity.
LOAD = ROCKING_SIZE
COUPLER, ROCKER, GROUND, MIDDLE, LEVER, MASSES, LEVEL, COSINE, SINE = range(LOAD + 15, LOAD + 24)
KERNEL_SIZE = LOAD + 24

CYCLE, OVERLAPPED_TO_EXTENDED, EXTENDED_TO_OVERLAPPED = range(3)

_DEGREES = 180.0 / math.pi
#: By how much of itself each end of a stroke is moved inwards where the load jumps there: more than the rounding of a
#: node, so that every node is on its own side.
_INWARDS = 64.0 * float(np.finfo(np.float64).eps)


@compiled("void(float64, float64, float64, float64, float64[:, ::1], int64)")
def _sensitivities(crank, coupler, rocker, ground, metrics, i):
    """Change of the swing with each length, rad per length, into ``metrics[7:11, i]``.

    The swing is psi_extended - psi_overlapped of the triangles with sides AC, ground, rocker. Where the two terms of a
    derivative nearly cancel their difference is taken from that of their squares, which is a product.
    """
    extended, overlapped = coupler + crank, coupler - crank
    e, o = extended * extended, overlapped * overlapped
    sum_of_two, difference = ground + rocker, ground - rocker
    # Four times the area of each triangle, by Heron; sums of three lengths and more are exact.
    area_e = math.sqrt(
        four_bar.exact_sum(ground, rocker, -crank, -coupler) * (sum_of_two + extended)
        * four_bar.exact_sum(coupler, crank, rocker, -ground) * four_bar.exact_sum(coupler, crank, ground, -rocker)
    )  # fmt: skip
    area_o = math.sqrt(
        four_bar.exact_sum(ground, rocker, crank, -coupler) * four_bar.exact_sum(ground, rocker, coupler, -crank)
        * four_bar.exact_sum(coupler, -crank, rocker, -ground) * four_bar.exact_sum(coupler, -crank, ground, -rocker)
    )  # fmt: skip
    both = area_e * area_o
    at_e, at_o = 2.0 * extended / area_e, 2.0 * overlapped / area_o
    metrics[7, i] = at_e + at_o
    # e o - (ground^2 - rocker^2)^2 as a product of two differences of squares.
    centric = (coupler - ground) * (coupler + ground) + (rocker - crank) * (rocker + crank)
    other = (coupler - rocker) * (coupler + rocker) + (ground - crank) * (ground + crank)
    product = 4.0 * crank * coupler * centric * other / (both * both)
    metrics[8, i] = 4.0 * product / (at_e + at_o)
    squares = difference * sum_of_two
    for k in range(2):
        side, m = (rocker, squares) if k == 0 else (ground, -squares)
        term_e, term_o = (e - m) / (side * area_e), (o - m) / (side * area_o)
        same = (term_e > 0.0) == (term_o > 0.0)
        metrics[9 + k, i] = -(4.0 * product / (term_e + term_o) if same else term_e - term_o)


@compiled("void(float64[:, ::1], int64, float64[::1])")
def _load(parameters, i, row):
    """Constants of the forces into the row."""
    for k in range(15):
        row[LOAD + k] = parameters[i, CONSTANT_TORQUE + k]
    row[COUPLER], row[ROCKER], row[GROUND] = 1e-3 * parameters[i, 1], 1e-3 * parameters[i, 2], 1e-3 * parameters[i, 3]
    # Coupler force over the torque about the rocker's pivot is coupler / (2 area), the area sqrt(p q)/2 in mm^2.
    row[LEVER] = 2.0e3 * parameters[i, 1]
    masses = 0.0
    for k in (CRANK_MASS, COUPLER_MASS, ROCKER_MASS, COUPLER_INERTIA):
        masses += parameters[i, k]
    row[MASSES] = masses
    level = 0
    if parameters[i, STIFFNESS] != 0.0:
        level |= four_bar.ANGLES
    if parameters[i, DAMPING] != 0.0:
        level |= four_bar.VELOCITIES
    if masses != 0.0 or parameters[i, INERTIA] != 0.0 or parameters[i, ROCKER_INERTIA] != 0.0:
        level |= four_bar.VELOCITIES | four_bar.ACCELERATIONS
    row[LEVEL] = level


@compiled("void(float64[:, ::1], float64[:, ::1], int8[::1], float64[:, ::1], float64[:, ::1], float64[::1])")
def closed_form(parameters, metrics, status, kernel, singular, noise):
    """Class, margins, limit positions, sensitivities and the load of a block of designs.

    See `explore.vocabulary.Mechanism` for the arguments; metrics are in the declared order and units, NaN where
    undefined.
    """
    for i in range(parameters.shape[0]):
        crank, coupler, rocker, ground = parameters[i, 0], parameters[i, 1], parameters[i, 2], parameters[i, 3]
        metrics[:, i] = np.nan
        metrics[6, i] = coupler + rocker
        row = kernel[i]
        metrics[0, i], metrics[1, i], turns = rocking.prepare(
            crank, coupler, rocker, ground, 1.0, row, singular, noise, status, i
        )
        if turns == 0.0:
            continue
        _load(parameters, i, row)
        four_products, p0, q0 = row[four_bar.FOUR_CRANK_GROUND], row[four_bar.E1_E2], row[four_bar.E3_E4]
        least = 2.0 * arctangent(math.sqrt(p0), math.sqrt(q0 + four_products))
        beyond = 2.0 * arctangent(math.sqrt(q0), math.sqrt(p0 + four_products))
        metrics[5, i] = min(least, beyond) * _DEGREES
        if metrics[0, i] == four_bar.DOUBLE_CRANK:
            continue
        swing, middle, time_ratio = rocking.limits(crank, coupler, rocker, ground, 1.0, row)
        row[MIDDLE] = middle
        # A sine with the swing and the mean phase of the limit positions: nearly the fundamental of the velocity.
        phase = math.atan(row[rocking.TAN_EXTENDED]) + math.atan(row[rocking.TAN_OVERLAPPED])
        row[COSINE], row[SINE] = -0.5 * swing * math.sin(phase), 0.5 * swing * math.cos(phase)
        metrics[2, i] = swing * _DEGREES
        metrics[3, i] = middle * _DEGREES
        metrics[4, i] = time_ratio
        _sensitivities(crank, coupler, rocker, ground, metrics, i)
        for k in range(7, 11):
            metrics[k, i] *= _DEGREES


@compiled(PIECES_SIGNATURE)
def pieces(row, window, _drive, _start, _stop, out):
    """A window as smooth pieces: a load that opposes the motion jumps where one stroke ends and the other begins."""
    count, length = 0, 0.0
    inwards = 1.0 - _INWARDS if row[LOAD + OPPOSING_TORQUE - CONSTANT_TORQUE] != 0.0 else 1.0
    for k in range(2):
        if window == CYCLE or (window == OVERLAPPED_TO_EXTENDED) == (k == 0):
            first, last = rocking.stroke(row, k == 0)
            length += 2.0 * (math.atan(last) - math.atan(first))
            out[count, 0], out[count, 1], out[count, 2] = k, inwards * first, inwards * last
            count += 1
    out[3, 0] = 2.0 * math.pi if window == CYCLE else length
    out[3, 1] = 0.0
    return count
