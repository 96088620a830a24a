"""A four-bar whose crank turns and whose rocker swings: class, limit positions and singularities, for many lanes.

Limit positions (C on the line AB) come from the half-angle form of the triangles at A and D with sides (AC, ground,
rocker), AC = coupler - crank ("overlapped") and coupler + crank ("extended"); all sums of lengths are exact, and no
arccos is used. Formulas are for branch +1; branch -1 is the mirror image, its motion at theta that of branch +1 at
-theta.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import exact_sum
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar
from explore.mechanisms.four_bar import FOUR_BAR_SIZE
from explore.model.status import OwnStatus, Status

# Rows of the constants after those of the four-bar: the limit positions as half-tangents from crank angle 0, the
# distances of the singularities, and the amplification of rounding errors.
EXTENDED, OVERLAPPED, SINGULAR_P, SINGULAR_Q, SINGULAR_D, NOISE = range(FOUR_BAR_SIZE, FOUR_BAR_SIZE + 6)
ROCKING_SIZE = FOUR_BAR_SIZE + 6

# Codes of the statuses of designs whose crank does not turn or whose rocker does not swing.
CANNOT_ASSEMBLE, CRANK_BLOCKED, CHANGE_POINT, NO_STROKE = 2, 3, 4, 5
STATUSES = {
    CANNOT_ASSEMBLE: OwnStatus(
        "cannot_assemble", "the links cannot be assembled: the longest is at least as long as the others together"
    ),
    CRANK_BLOCKED: OwnStatus("crank_blocked", "the crank cannot turn fully: the linkage locks before a full turn"),
    CHANGE_POINT: OwnStatus(
        "change_point", "all links fall into one line, from where the motion may continue on either branch"
    ),
    NO_STROKE: OwnStatus(
        "no_stroke",
        "the output turns fully, so there are no strokes: only the window 'cycle' and intervals are defined",
        lacks_strokes=True,
    ),
}
_OK = float(Status.OK)


@subroutine(contract=True, inlined=True)
def prepare(crank, coupler, rocker, ground, branch, constants, lane):
    """Fill the rows of the four-bar, the singularities and the noise of one lane; return class, margin and status.

    The margin is Grashof's. The rows are NaN or meaningless where the crank does not turn.
    """
    linkage_class, margin = four_bar.classify(crank, coupler, rocker, ground)
    four_bar.prepare(crank, coupler, rocker, ground, branch, constants, lane)
    p_least, p_largest = constants[four_bar.P_LEAST * LANES + lane], constants[four_bar.P_LARGEST * LANES + lane]
    q_least, q_largest = constants[four_bar.Q_LEAST * LANES + lane], constants[four_bar.Q_LARGEST * LANES + lane]
    difference, total = abs(ground - crank), ground + crank
    over_p_and_q, over_lengths = 1.0 / (p_largest * q_largest), 1.0 / (difference * total)
    # tanh(distance/2) of p = 0 and q = 0 from the real axis, and of d = 0 (a pole beside p = 0).
    constants[SINGULAR_P * LANES + lane] = math.sqrt(p_least * q_largest * over_p_and_q)
    constants[SINGULAR_Q * LANES + lane] = math.sqrt(q_least * p_largest * over_p_and_q)
    constants[SINGULAR_D * LANES + lane] = difference * difference * over_lengths
    # The largest d.B/d^2: where d is short the two terms of the velocities are large and may cancel.
    constants[NOISE * LANES + lane] = crank * total * over_lengths
    status = 1.0 * CRANK_BLOCKED
    status = _OK if linkage_class == four_bar.CRANK_ROCKER else status
    status = 1.0 * NO_STROKE if linkage_class == four_bar.DOUBLE_CRANK else status
    status = 1.0 * CHANGE_POINT if linkage_class == four_bar.CHANGE_POINT else status
    status = 1.0 * CANNOT_ASSEMBLE if linkage_class == four_bar.CANNOT_ASSEMBLE else status
    return linkage_class, margin, status


@subroutine(contract=True, inlined=True)
def solve_limit_positions(crank, coupler, rocker, ground, branch, constants, lane):
    """Fill the limit positions of one lane; they are NaN where the rocker does not swing.

    Return swing and mid-angle of the rocker, rad, and time ratio.
    """
    sum_of_all = exact_sum(crank, coupler, rocker, ground)
    less_crank = exact_sum(coupler, rocker, ground, -crank)
    less_coupler = exact_sum(rocker, ground, crank, -coupler)
    less_rocker = exact_sum(crank, coupler, ground, -rocker)
    less_ground = exact_sum(crank, coupler, rocker, -ground)
    e1 = exact_sum(ground, -crank, -coupler, rocker)
    e2 = exact_sum(ground, -crank, coupler, -rocker)
    e3 = exact_sum(coupler, rocker, -ground, -crank)
    # tan(A/2) at the crank pivot, and tan(psi/2) at the rocker pivot, in both limit positions: with the square roots of
    # the products of all four sums, two roots and one division serve all.
    square = less_crank * e2 * (less_coupler * e3)
    root_extended, root = math.sqrt(sum_of_all * less_rocker * (e1 * less_ground)), math.sqrt(square)
    divisor = sum_of_all * less_rocker * e1
    inverse = 1.0 / (divisor * square)
    over_divisor, over_root = root_extended * (inverse * square), root * (inverse * divisor)
    extended, psi_extended = e1 * over_divisor, less_rocker * over_divisor
    overlapped, psi_overlapped = less_coupler * e3 * over_root, e2 * e3 * over_root
    # Half the swing is half the difference of the two psi. The law of sines gives its sine without cancellation.
    psi_sum, psi_product = psi_extended + psi_overlapped, psi_extended * psi_overlapped
    scale = (1.0 + psi_extended * psi_extended) * (1.0 + psi_overlapped * psi_overlapped)
    swing = 2.0 * arctangent(crank * coupler * scale, (1.0 + psi_product) * (rocker * ground * psi_sum))
    half_sum = arctangent(psi_sum, 1.0 - psi_product)
    imbalance = 2.0 * abs(arctangent(extended - overlapped, 1.0 + extended * overlapped))
    constants[EXTENDED * LANES + lane] = branch * extended
    constants[OVERLAPPED * LANES + lane] = -branch * (less_crank * e2 * over_root)
    return swing, branch * (math.pi - half_sum), (math.pi + imbalance) / (math.pi - imbalance)
