"""A four-bar whose crank turns and whose rocker swings: class, limit positions and strokes, compiled.

Limit positions (C on the line AB) come from the half-angle form of the triangles at A and D with sides (AC, ground,
rocker), AC = coupler - crank ("overlapped") and coupler + crank ("extended"); all sums of lengths are exact, and no
arccos is used. Formulas are for branch +1; branch -1 is the mirror image, its motion at theta that of branch +1 at
-theta.
"""

import math

import numpy as np

from explore.compiling import compiled
from explore.mechanisms import four_bar
from explore.mechanisms.arctangent import arctangent
from explore.mechanisms.four_bar import FOUR_BAR_SIZE, exact_sum
from explore.model.status import Status

# Columns of a kernel row after those of the four-bar: tan(A/2) of the two limit positions, and whether the slow stroke
# passes crank angle 0.
TAN_EXTENDED, TAN_OVERLAPPED, SLOW_PASSES_ZERO = range(FOUR_BAR_SIZE, FOUR_BAR_SIZE + 3)
ROCKING_SIZE = FOUR_BAR_SIZE + 3

_OK, _CANNOT_ASSEMBLE, _CRANK_BLOCKED = int(Status.OK), int(Status.CANNOT_ASSEMBLE), int(Status.CRANK_BLOCKED)
_CHANGE_POINT, _NO_STROKE = int(Status.CHANGE_POINT), int(Status.NO_STROKE)


@compiled(
    "UniTuple(float64, 3)(float64, float64, float64, float64, float64, "
    "float64[::1], float64[:, ::1], float64[::1], int8[::1], int64)"
)
def prepare(crank, coupler, rocker, ground, branch, row, singular, noise, status, i):
    """Class and Grashof margin of design i, and, where the crank turns, the constants of its motion.

    Fills ``status[i]``, ``row[:FOUR_BAR_SIZE]``, ``singular[i]`` and ``noise[i]``; see
    `explore.model.mechanism.Mechanism`.

    Returns
    -------
    tuple
        Class, margin, and 1 where the crank turns or 0.
    """
    linkage_class, margin = four_bar.classify(crank, coupler, rocker, ground)
    if linkage_class == four_bar.CANNOT_ASSEMBLE:
        status[i] = _CANNOT_ASSEMBLE
        return linkage_class, margin, 0.0
    if linkage_class == four_bar.CHANGE_POINT:
        status[i] = _CHANGE_POINT
        return linkage_class, margin, 0.0
    if linkage_class != four_bar.CRANK_ROCKER and linkage_class != four_bar.DOUBLE_CRANK:
        status[i] = _CRANK_BLOCKED
        return linkage_class, margin, 0.0
    four_bar.prepare(crank, coupler, rocker, ground, branch, row)
    four_crank_ground, p_min, q_min = row[four_bar.FOUR_CRANK_GROUND], row[four_bar.E1_E2], row[four_bar.E3_E4]
    # tanh(distance/2) of p = 0 and q = 0 from the real axis, and of d = 0 (a pole beside p = 0).
    singular[i, 0] = math.sqrt(p_min / (p_min + four_crank_ground))
    singular[i, 1] = math.sqrt(q_min / (q_min + four_crank_ground))
    singular[i, 2] = abs(ground - crank) / (ground + crank)
    # The largest d.B/d^2: where d is short the two terms of the velocities are large and may cancel.
    noise[i] = crank / abs(ground - crank)
    status[i] = _NO_STROKE if linkage_class == four_bar.DOUBLE_CRANK else _OK
    return linkage_class, margin, 1.0


@compiled("UniTuple(float64, 3)(float64, float64, float64, float64, float64, float64[::1])")
def solve_limit_positions(crank, coupler, rocker, ground, branch, row):
    """Fill the limit positions and the slow stroke, three columns of the row.

    Returns
    -------
    tuple
        Swing and mid-angle of the rocker, rad, and time ratio.
    """
    sum_of_all = exact_sum(crank, coupler, rocker, ground)
    less_crank = exact_sum(coupler, rocker, ground, -crank)
    less_coupler = exact_sum(rocker, ground, crank, -coupler)
    less_rocker = exact_sum(crank, coupler, ground, -rocker)
    less_ground = exact_sum(crank, coupler, rocker, -ground)
    e1 = exact_sum(ground, -crank, -coupler, rocker)
    e2 = exact_sum(ground, -crank, coupler, -rocker)
    e3 = exact_sum(coupler, rocker, -ground, -crank)
    # tan(A/2) at the crank pivot, and tan(psi/2) at the rocker pivot, in both limit positions.
    extended = math.sqrt(e1 * less_ground / (sum_of_all * less_rocker))
    overlapped = math.sqrt(less_coupler * e3 / (less_crank * e2))
    psi_extended = math.sqrt(less_ground * less_rocker / (sum_of_all * e1))
    psi_overlapped = math.sqrt(e2 * e3 / (less_crank * less_coupler))
    # Half the swing is half the difference of the two psi. The law of sines gives its sine without cancellation.
    scale = math.sqrt((1.0 + psi_extended * psi_extended) * (1.0 + psi_overlapped * psi_overlapped))
    sine_half_swing = crank * coupler * scale / (rocker * ground * (psi_extended + psi_overlapped))
    swing = 2.0 * arctangent(sine_half_swing, (1.0 + psi_extended * psi_overlapped) / scale)
    half_sum = arctangent(psi_extended + psi_overlapped, 1.0 - psi_extended * psi_overlapped)
    imbalance = 2.0 * abs(arctangent(extended - overlapped, 1.0 + extended * overlapped))
    row[TAN_EXTENDED] = extended
    row[TAN_OVERLAPPED] = overlapped
    # r2^2 + r3^2 - r1^2 - r4^2: negative when the stroke through crank angle 0 is the slow one.
    square_excess = (coupler - ground) * (coupler + ground) + (rocker - crank) * (rocker + crank)
    tie = 4.0 * np.spacing(max(coupler * coupler, rocker * rocker, ground * ground))
    row[SLOW_PASSES_ZERO] = 1.0 if square_excess < -tie else 0.0
    return swing, branch * (math.pi - half_sum), (math.pi + imbalance) / (math.pi - imbalance)


@compiled("UniTuple(float64, 2)(float64[::1], boolean)")
def stroke_ends(row, through_zero):
    """Half-tangents of a stroke's ends, measured from crank angle 0 for the stroke through it, else from 180 deg."""
    if through_zero:
        first, last = -1.0 / row[TAN_OVERLAPPED], row[TAN_EXTENDED]
    else:
        first, last = -1.0 / row[TAN_EXTENDED], row[TAN_OVERLAPPED]
    if row[four_bar.BRANCH] > 0.0:
        return first, last
    return -last, -first
