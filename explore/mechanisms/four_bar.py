"""The four-bar linkage: cancellation-free position, velocity and acceleration in closed form, for many lanes at once.

Ground pivots A = (0, 0) and D = (ground, 0); crank AB at theta_1, coupler BC at theta_2, rocker DC at theta_3::

    r1 e^{i theta_1} + r2 e^{i theta_2} = r4 + r3 e^{i theta_3}

Everything follows from d = D - B. With the four exactly rounded sums of lengths e1 … e4 both factors of the
discriminant are sums of non-negative terms for a crank that turns, so they keep full relative accuracy up to the
change point::

    p = d^2 - (r2 - r3)^2 = e1 e2 + 4 r1 r4 sin^2(theta_1/2)
    q = (r2 + r3)^2 - d^2 = e3 e4 + 4 r1 r4 cos^2(theta_1/2)
    x = branch sqrt(p q) / 2                        (twice the area of the triangle BCD)

Velocities per unit crank velocity are written with f = r1 r4 sin(theta_1) / x, the rate of the transmission angle,
and g = d.B / d^2, the rate at which d turns: theta_3' = k f - g and theta_2' = (k - 1) f - g; accelerations are the
derivatives of these. In this form, unlike the usual one with vectors, no two large terms cancel where d is short (crank
near ground, coupler near rocker). k and 1 - k are the projections of coupler and rocker on d over its length::

    k = (p + 2 r2 (r2 - r3)) / (2 d^2),    1 - k = (p - 2 r3 (r2 - r3)) / (2 d^2)

The form k = (1 + (r2^2 - r3^2)/d^2)/2 would lose a short link in rounding.

In u = tan((theta_1 - anchor)/2) and w = 1 + u^2 the products P = p w, Q = q w and D = d^2 w are polynomials with
non-negative terms, and the velocities and accelerations are rational in u, P, Q, D and sqrt(P Q).
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import exact_sum, spacing
from explore.base.subroutines import subroutine

# Rows of the constants. Each factor has its least value at one anchor and its largest at the other.
P_LEAST, P_LARGEST, Q_LEAST, Q_LARGEST, D_LEAST, D_LARGEST = range(6)
CRANK, GROUND_MINUS_CRANK, GROUND_PLUS_CRANK, FOUR_CRANK_GROUND = 6, 7, 8, 9
SQUARES, COUPLER_EXCESS, ROCKER_EXCESS, BRANCH = 10, 11, 12, 13
FOUR_BAR_SIZE = 14

# Rows of the signals, and the bits of `needs` that request them.
COUPLER_VELOCITY, ROCKER_VELOCITY, COUPLER_ACCELERATION, ROCKER_ACCELERATION = range(4)
COUPLER_ANGLE, ROCKER_ANGLE, TRANSMISSION_ANGLE = 4, 5, 6
SIGNAL_ROWS = 7
VELOCITIES, ACCELERATIONS, ANGLES, TRANSMISSION = 1, 2, 4, 8

CRANK_ROCKER, DOUBLE_CRANK, DOUBLE_ROCKER, ROCKER_CRANK, NON_GRASHOF, CHANGE_POINT, CANNOT_ASSEMBLE = range(7)
CLASS_LABELS = (
    "crank_rocker",
    "double_crank",
    "double_rocker",
    "rocker_crank",
    "non_grashof",
    "change_point",
    "cannot_assemble",
)


@subroutine(inlined=True)
def classify(crank, coupler, rocker, ground):
    """Class of the linkage and Grashof margin, the two middle lengths minus shortest and longest, summed exactly.

    Without branches, so that loops over linkages vectorise.
    """
    first, second = crank if crank > coupler else coupler, rocker if rocker > ground else ground
    longest = first if first > second else second
    first, second = crank if crank < coupler else coupler, rocker if rocker < ground else ground
    shortest = first if first < second else second
    crank_longest = crank == longest
    coupler_longest = (not crank_longest) & (coupler == longest)
    rocker_longest = (not crank_longest) & (not coupler_longest) & (rocker == longest)
    ground_longest = not (crank_longest | coupler_longest | rocker_longest)
    crank_shortest = crank == shortest
    ground_shortest = (not crank_shortest) & (ground == shortest)
    coupler_shortest = (not crank_shortest) & (not ground_shortest) & (coupler == shortest)
    rocker_shortest = not (crank_shortest | ground_shortest | coupler_shortest)
    a, b = -crank if crank_longest else crank, -coupler if coupler_longest else coupler
    c, d = -rocker if rocker_longest else rocker, -ground if ground_longest else ground
    others_minus_longest = exact_sum(a, b, c, d)
    a, b = -crank if crank_shortest else a, -coupler if coupler_shortest else b
    c, d = -rocker if rocker_shortest else c, -ground if ground_shortest else d
    margin = exact_sum(a, b, c, d)
    linkage_class = 1.0 * DOUBLE_CRANK if ground_shortest else 1.0 * ROCKER_CRANK
    linkage_class = 1.0 * DOUBLE_ROCKER if coupler_shortest else linkage_class
    linkage_class = 1.0 * CRANK_ROCKER if crank_shortest else linkage_class
    linkage_class = 1.0 * NON_GRASHOF if margin < 0.0 else linkage_class
    # Decimal lengths at a change point have a margin of a few units in the last place of the longest link.
    linkage_class = 1.0 * CHANGE_POINT if abs(margin) <= 4.0 * spacing(longest) else linkage_class
    linkage_class = 1.0 * CANNOT_ASSEMBLE if others_minus_longest <= 0.0 else linkage_class
    equal = longest == shortest
    return 1.0 * CHANGE_POINT if equal else linkage_class, 0.0 if equal else margin


@subroutine(contract=True, inlined=True)
def prepare(crank, coupler, rocker, ground, branch, constants, lane):
    """Fill the constants that `fill` needs, the first FOUR_BAR_SIZE rows, of one lane."""
    four_crank_ground = 4.0 * crank * ground
    p_least = exact_sum(ground, -crank, -coupler, rocker) * exact_sum(ground, -crank, coupler, -rocker)
    q_least = exact_sum(coupler, rocker, -ground, -crank) * exact_sum(crank, coupler, rocker, ground)
    constants[P_LEAST * LANES + lane] = p_least
    constants[P_LARGEST * LANES + lane] = p_least + four_crank_ground
    constants[Q_LEAST * LANES + lane] = q_least
    constants[Q_LARGEST * LANES + lane] = q_least + four_crank_ground
    constants[D_LEAST * LANES + lane] = (ground - crank) * (ground - crank)
    constants[D_LARGEST * LANES + lane] = (ground + crank) * (ground + crank)
    constants[CRANK * LANES + lane] = crank
    constants[GROUND_MINUS_CRANK * LANES + lane] = ground - crank
    constants[GROUND_PLUS_CRANK * LANES + lane] = ground + crank
    constants[FOUR_CRANK_GROUND * LANES + lane] = four_crank_ground
    constants[SQUARES * LANES + lane] = (coupler - rocker) * (coupler + rocker)
    constants[COUPLER_EXCESS * LANES + lane] = 2.0 * coupler * (coupler - rocker)
    constants[ROCKER_EXCESS * LANES + lane] = 2.0 * rocker * (coupler - rocker)
    constants[BRANCH * LANES + lane] = branch


@subroutine(contract=True, inlined=True)
def factors(constants, anchor, lane, square):
    """P, Q and D at one node, and w; `square` is u^2."""
    p_least, p_largest = constants[P_LEAST * LANES + lane], constants[P_LARGEST * LANES + lane]
    q_least, q_largest = constants[Q_LEAST * LANES + lane], constants[Q_LARGEST * LANES + lane]
    d_least, d_largest = constants[D_LEAST * LANES + lane], constants[D_LARGEST * LANES + lane]
    p_here, p_there = (p_least, p_largest) if anchor == 0 else (p_largest, p_least)
    q_here, q_there = (q_largest, q_least) if anchor == 0 else (q_least, q_largest)
    d_here, d_there = (d_least, d_largest) if anchor == 0 else (d_largest, d_least)
    return p_here + p_there * square, q_here + q_there * square, d_here + d_there * square, 1.0 + square


@subroutine(contract=True, inlined=True)
def transmission_angle(p, q):
    """Twice the angle whose tangent is the root of p/q, rad, by one root."""
    return arctangent(2.0 * math.sqrt(p * q), q - p)


@subroutine(fast=True, no_alias=True)
def _fill_rates(constants, tangents, anchor, needs, out):
    """Fill velocities, and accelerations if needed, at one node of each lane."""
    sign = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        square = u * u
        p, q, d, w = factors(constants, anchor, lane, square)
        root = constants[BRANCH * LANES + lane] * math.sqrt(p * q)
        reciprocal = 1.0 / (d * root)
        one_over_d, one_over_root = root * reciprocal, d * reciprocal
        four_crank_ground = constants[FOUR_CRANK_GROUND * LANES + lane]
        half_over_d = 0.5 * one_over_d
        f = sign * four_crank_ground * u * one_over_root
        k_less_one = (constants[ROCKER_EXCESS * LANES + lane] * w - p) * half_over_d
        k = (constants[COUPLER_EXCESS * LANES + lane] * w + p) * half_over_d
        minus, plus = constants[GROUND_MINUS_CRANK * LANES + lane], constants[GROUND_PLUS_CRANK * LANES + lane]
        along = minus - plus * square if anchor == 0 else minus * square - plus
        g = constants[CRANK * LANES + lane] * along * one_over_d
        out[COUPLER_VELOCITY * LANES + lane] = k_less_one * f - g
        out[ROCKER_VELOCITY * LANES + lane] = k * f - g
        if needs & ACCELERATIONS:
            # d_log = (d^2)'/d^2, k' = -(r2^2 - r3^2)/(2 d^2) d_log, 1/2 + g = (r4^2 - r1^2)/(2 d^2), and
            # f' = r1 r4 (e1 e2 cos^2(theta_1/2) q - e3 e4 sin^2(theta_1/2) p)/(4 x^3): no terms cancel.
            d_log = sign * four_crank_ground * u * one_over_d
            p_least, q_least = constants[P_LEAST * LANES + lane], constants[Q_LEAST * LANES + lane]
            p_part, q_part = (p_least, q_least * square) if anchor == 0 else (p_least * square, q_least)
            f_rate = (
                0.5 * four_crank_ground * w * (p_part * q - q_part * p) * one_over_root * one_over_root * one_over_root
            )
            common = d_log * half_over_d * w * (minus * plus - constants[SQUARES * LANES + lane] * f)
            out[COUPLER_ACCELERATION * LANES + lane] = k_less_one * f_rate + common
            out[ROCKER_ACCELERATION * LANES + lane] = k * f_rate + common


@subroutine(fast=True, no_alias=True)
def _fill_angles(constants, tangents, anchor, out):
    """Fill the angles of coupler and rocker, rad, at one node of each lane."""
    for lane in range(LANES):
        u = tangents[lane]
        square = u * u
        p, q, _, w = factors(constants, anchor, lane, square)
        across = constants[BRANCH * LANES + lane] * math.sqrt(p * q)
        minus, plus = constants[GROUND_MINUS_CRANK * LANES + lane], constants[GROUND_PLUS_CRANK * LANES + lane]
        dx = minus + plus * square if anchor == 0 else plus + minus * square
        dy = (-2.0 if anchor == 0 else 2.0) * constants[CRANK * LANES + lane] * u
        along = constants[COUPLER_EXCESS * LANES + lane] * w + p
        out[COUPLER_ANGLE * LANES + lane] = arctangent(along * dy + across * dx, along * dx - across * dy)
        along = constants[ROCKER_EXCESS * LANES + lane] * w - p
        out[ROCKER_ANGLE * LANES + lane] = arctangent(along * dy + across * dx, along * dx - across * dy)


@subroutine(fast=True, no_alias=True)
def _fill_transmission(constants, tangents, anchor, out):
    """Fill the transmission angle, rad, at one node of each lane."""
    for lane in range(LANES):
        p, q, _, _ = factors(constants, anchor, lane, tangents[lane] * tangents[lane])
        out[TRANSMISSION_ANGLE * LANES + lane] = transmission_angle(p, q)


@subroutine()
def fill_motion(constants, tangents, anchor, count, needs, rows, out):
    """Fill the signals for unit crank velocity, in rad, 1, 1/rad; `rows` is the number of rows of `out`.

    The other arguments are those of `explore.model.mechanism.Mechanism.fill`.
    """
    for j in range(count):
        node, signals = tangents[j * LANES :], out[j * rows * LANES :]
        if needs & (VELOCITIES | ACCELERATIONS):
            _fill_rates(constants, node, anchor, needs, signals)
        if needs & ANGLES:
            _fill_angles(constants, node, anchor, signals)
        if needs & TRANSMISSION:
            _fill_transmission(constants, node, anchor, signals)
