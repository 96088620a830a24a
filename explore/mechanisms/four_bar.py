"""The four-bar linkage: cancellation-free position, velocity and acceleration in closed form.

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
"""

import math

import numpy as np

from explore.compiling import FILL_SIGNATURE, compiled
from explore.mechanisms.arctangent import arctangent

# Columns of a kernel row.
GROUND_MINUS_CRANK_SQUARED, FOUR_CRANK_GROUND, E1_E2, E3_E4, SQUARES, CRANK_TIMES_DIFFERENCE, BRANCH = range(7)
CRANK, GROUND_MINUS_CRANK, COUPLER_EXCESS, ROCKER_EXCESS = 7, 8, 9, 10
FOUR_BAR_SIZE = 11

# Rows of the signal array, and the bits of `needs` that request them.
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


@compiled("float64(float64, float64, float64, float64)")
def exact_sum(a, b, c, d):
    """Sum of four numbers with compensated rounding errors (Ogita, Rump & Oishi 2005, Sum2).

    The result is as if summed in twice the precision and rounded once; plain summation loses the margin of a
    linkage near the change point.
    """
    total = a
    compensation = 0.0
    for term in (b, c, d):
        new_total = total + term
        added = new_total - total
        compensation += (total - (new_total - added)) + (term - added)
        total = new_total
    return total + compensation


@compiled("Tuple((int64, float64))(float64, float64, float64, float64)")
def classify(crank, coupler, rocker, ground):
    """Class of the linkage and Grashof margin, the two middle lengths minus shortest and longest, summed exactly."""
    longest = max(crank, coupler, rocker, ground)
    shortest = min(crank, coupler, rocker, ground)
    if longest == shortest:
        return CHANGE_POINT, 0.0
    longest_index = 0 if crank == longest else 1 if coupler == longest else 2 if rocker == longest else 3
    shortest_index = 0 if crank == shortest else 3 if ground == shortest else 1 if coupler == shortest else 2
    a = -crank if longest_index == 0 else crank
    b = -coupler if longest_index == 1 else coupler
    c = -rocker if longest_index == 2 else rocker
    d = -ground if longest_index == 3 else ground
    others_minus_longest = exact_sum(a, b, c, d)
    a = -crank if shortest_index == 0 else a
    b = -coupler if shortest_index == 1 else b
    c = -rocker if shortest_index == 2 else c
    d = -ground if shortest_index == 3 else d
    margin = exact_sum(a, b, c, d)
    if others_minus_longest <= 0.0:
        return CANNOT_ASSEMBLE, margin
    # Decimal lengths at a change point have a margin of a few units in the last place of the longest link.
    if abs(margin) <= 4.0 * np.spacing(longest):
        return CHANGE_POINT, margin
    if margin < 0.0:
        return NON_GRASHOF, margin
    if shortest_index == 0:
        return CRANK_ROCKER, margin
    if shortest_index == 3:
        return DOUBLE_CRANK, margin
    if shortest_index == 1:
        return DOUBLE_ROCKER, margin
    return ROCKER_CRANK, margin


@compiled("void(float64, float64, float64, float64, float64, float64[::1])")
def prepare(crank, coupler, rocker, ground, branch, row):
    """Fill the constants that `fill` needs, ``row[:FOUR_BAR_SIZE]``."""
    row[GROUND_MINUS_CRANK_SQUARED] = (ground - crank) * (ground - crank)
    row[FOUR_CRANK_GROUND] = 4.0 * crank * ground
    row[E1_E2] = exact_sum(ground, -crank, -coupler, rocker) * exact_sum(ground, -crank, coupler, -rocker)
    row[E3_E4] = exact_sum(coupler, rocker, -ground, -crank) * exact_sum(crank, coupler, rocker, ground)
    row[SQUARES] = (coupler - rocker) * (coupler + rocker)
    row[CRANK_TIMES_DIFFERENCE] = crank * (ground - crank)
    row[BRANCH] = branch
    row[CRANK] = crank
    row[GROUND_MINUS_CRANK] = ground - crank
    row[COUPLER_EXCESS] = 2.0 * coupler * (coupler - rocker)
    row[ROCKER_EXCESS] = 2.0 * rocker * (coupler - rocker)


@compiled(fast=True)
def _fill_angles(row, sin_half, cos_half, count, out):
    """Fill the angles of coupler and rocker at the nodes, rad; see `fill`."""
    four_crank_ground = row[FOUR_CRANK_GROUND]
    for j in range(count):
        sine_squared = sin_half[j] * sin_half[j]
        p = row[E1_E2] + four_crank_ground * sine_squared
        q = row[E3_E4] + four_crank_ground * cos_half[j] * cos_half[j]
        across = row[BRANCH] * math.sqrt(p * q)
        dx = row[GROUND_MINUS_CRANK] + 2.0 * row[CRANK] * sine_squared
        dy = -2.0 * row[CRANK] * sin_half[j] * cos_half[j]
        along = row[COUPLER_EXCESS] + p
        out[COUPLER_ANGLE, j] = arctangent(along * dy + across * dx, along * dx - across * dy)
        along = row[ROCKER_EXCESS] - p
        out[ROCKER_ANGLE, j] = arctangent(along * dy + across * dx, along * dx - across * dy)


@compiled(fast=True)
def _fill_transmission(row, sin_half, cos_half, count, out):
    """Fill the transmission angle at the nodes, rad; see `fill`."""
    for j in range(count):
        p = row[E1_E2] + row[FOUR_CRANK_GROUND] * sin_half[j] * sin_half[j]
        q = row[E3_E4] + row[FOUR_CRANK_GROUND] * cos_half[j] * cos_half[j]
        out[TRANSMISSION_ANGLE, j] = 2.0 * arctangent(math.sqrt(p), math.sqrt(q))


@compiled(FILL_SIGNATURE, fast=True)
def fill(row, sin_half, cos_half, count, needs, out):
    """Fill the signals at the nodes for unit crank velocity, in rad, 1, 1/rad.

    Parameters
    ----------
    row : (FOUR_BAR_SIZE,) array
        A row of the constants from `prepare`.
    sin_half, cos_half : (t,) arrays
        Sine and cosine of half the crank angle, each accurate relative to its own size.
    count : int
        The number of nodes to fill.
    needs : int
        VELOCITIES, ACCELERATIONS (with velocities), ANGLES (of the links), TRANSMISSION, or-ed.
    out : (SIGNAL_ROWS, t) array
        The rows that `needs` requests are filled.
    """
    # A function of its own for the loop over velocities costs about 5 % of the time (benchmarks/kernel.py).
    difference_squared, four_crank_ground = row[GROUND_MINUS_CRANK_SQUARED], row[FOUR_CRANK_GROUND]
    p_min, q_min, squares = row[E1_E2], row[E3_E4], row[SQUARES]
    g_numerator_at_zero, branch = row[CRANK_TIMES_DIFFERENCE], row[BRANCH]
    coupler_excess, rocker_excess = row[COUPLER_EXCESS], row[ROCKER_EXCESS]
    crank_ground = 0.25 * four_crank_ground
    if needs & (VELOCITIES | ACCELERATIONS):
        for j in range(count):
            sine_squared = sin_half[j] * sin_half[j]
            cosine_squared = cos_half[j] * cos_half[j]
            d_squared = difference_squared + four_crank_ground * sine_squared
            p = p_min + four_crank_ground * sine_squared
            q = q_min + four_crank_ground * cosine_squared
            x = 0.5 * branch * math.sqrt(p * q)
            reciprocal = 1.0 / (d_squared * x)
            one_over_d_squared = x * reciprocal
            one_over_x = d_squared * reciprocal
            crank_ground_sine = 2.0 * crank_ground * sin_half[j] * cos_half[j]
            f = crank_ground_sine * one_over_x
            half_over_d_squared = 0.5 * one_over_d_squared
            k_less_one, k = (rocker_excess - p) * half_over_d_squared, (coupler_excess + p) * half_over_d_squared
            g = (g_numerator_at_zero - 2.0 * crank_ground * sine_squared) * one_over_d_squared
            out[COUPLER_VELOCITY, j] = k_less_one * f - g
            out[ROCKER_VELOCITY, j] = k * f - g
            if needs & ACCELERATIONS:
                # d_log = (d^2)'/d^2, k' = -(r2^2 - r3^2)/(2 d^2) d_log, x' = crank_ground_sine (q - p)/(4 x)
                d_log = 2.0 * crank_ground_sine * one_over_d_squared
                f_rate = (crank_ground * (cosine_squared - sine_squared) - 0.25 * f * f * (q - p)) * one_over_x
                common = d_log * (0.5 + g - squares * half_over_d_squared * f)
                out[COUPLER_ACCELERATION, j] = k_less_one * f_rate + common
                out[ROCKER_ACCELERATION, j] = k * f_rate + common
    if needs & ANGLES:
        _fill_angles(row, sin_half, cos_half, count, out)
    if needs & TRANSMISSION:
        _fill_transmission(row, sin_half, cos_half, count, out)
