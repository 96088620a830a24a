"""The oscillating-torque test rig, compiled: closed-form metrics, windows, and the constants of its forces.

The load is the torque on the rocker besides that of the coupler, counter-clockwise positive::

    M = M0 - Mo sign(w3) - k (theta_3 - phi0) - c w3,    phi0 the mid-angle

Its forces are in `explore.mechanisms.rig.forces`.
"""

import math

import numpy as np

from explore.compiling import PIECES_SIGNATURE, compiled
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.arctangent import arctangent
from explore.mechanisms.rig.columns import (
    CYCLE,
    LOAD_SIZE,
    OVERLAPPED_TO_EXTENDED,
    KernelColumn,
    MetricColumn,
    ParameterColumn,
)

_DEGREES = 180.0 / math.pi
#: Relative shift of the ends of a stroke inwards where the load jumps there: more than the rounding of a node, so that
#: every node is on the side of its own stroke.
_INWARDS = 64.0 * float(np.finfo(np.float64).eps)


@compiled("void(float64, float64, float64, float64, float64[:, ::1], int64)")
def _fill_sensitivities(crank, coupler, rocker, ground, metrics, i):
    """Fill the derivatives of the swing by the lengths, rad per length, into the metrics of design i.

    The swing is psi_extended - psi_overlapped of the triangles with sides AC, ground, rocker. Where the two terms of a
    derivative nearly cancel, their difference follows from that of their squares, which is a product.
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
    area_product = area_e * area_o
    at_e, at_o = 2.0 * extended / area_e, 2.0 * overlapped / area_o
    metrics[MetricColumn.SWING_SENSITIVITY_CRANK, i] = at_e + at_o
    # e o - (ground^2 - rocker^2)^2 as a product of two differences of squares.
    square_excess = (coupler - ground) * (coupler + ground) + (rocker - crank) * (rocker + crank)
    other_excess = (coupler - rocker) * (coupler + rocker) + (ground - crank) * (ground + crank)
    product = 4.0 * crank * coupler * square_excess * other_excess / (area_product * area_product)
    metrics[MetricColumn.SWING_SENSITIVITY_COUPLER, i] = 4.0 * product / (at_e + at_o)
    squares = difference * sum_of_two
    for k in (MetricColumn.SWING_SENSITIVITY_ROCKER, MetricColumn.SWING_SENSITIVITY_GROUND):
        side, m = (rocker, squares) if k == MetricColumn.SWING_SENSITIVITY_ROCKER else (ground, -squares)
        term_e, term_o = (e - m) / (side * area_e), (o - m) / (side * area_o)
        same = (term_e > 0.0) == (term_o > 0.0)
        metrics[k, i] = -(4.0 * product / (term_e + term_o) if same else term_e - term_o)


@compiled("void(float64[:, ::1], int64, float64[::1])")
def _fill_load_constants(parameters, i, row):
    """Fill the constants of the forces into the row."""
    for k in range(LOAD_SIZE):
        row[KernelColumn.CONSTANT_TORQUE + k] = parameters[i, ParameterColumn.CONSTANT_TORQUE + k]
    row[KernelColumn.COUPLER_LENGTH] = 1e-3 * parameters[i, ParameterColumn.COUPLER]
    row[KernelColumn.ROCKER_LENGTH] = 1e-3 * parameters[i, ParameterColumn.ROCKER]
    row[KernelColumn.GROUND_LENGTH] = 1e-3 * parameters[i, ParameterColumn.GROUND]
    # Coupler force over the torque about the rocker's pivot is coupler / (2 area), the area sqrt(p q)/2 in mm^2.
    row[KernelColumn.LEVER] = 2.0e3 * parameters[i, ParameterColumn.COUPLER]
    masses = row[KernelColumn.CRANK_MASS] + row[KernelColumn.COUPLER_MASS]
    masses = masses + row[KernelColumn.ROCKER_MASS] + row[KernelColumn.COUPLER_INERTIA]
    row[KernelColumn.MASSES] = masses
    needs = 0
    if row[KernelColumn.STIFFNESS] != 0.0:
        needs |= four_bar.ANGLES
    if row[KernelColumn.DAMPING] != 0.0:
        needs |= four_bar.VELOCITIES
    if masses != 0.0 or row[KernelColumn.INERTIA] != 0.0 or row[KernelColumn.ROCKER_INERTIA] != 0.0:
        needs |= four_bar.VELOCITIES | four_bar.ACCELERATIONS
    row[KernelColumn.MOTION_NEEDS] = needs


@compiled("void(float64[:, ::1], float64[:, ::1], int8[::1], float64[:, ::1], float64[:, ::1], float64[::1])")
def closed_form(parameters, metrics, status, kernel, singular, noise):
    """Fill class, margins, limit positions, sensitivities and load of a block of designs.

    See `explore.model.mechanism.Mechanism` for the arguments. Metrics are in the declared order and units, NaN where
    undefined.
    """
    for i in range(parameters.shape[0]):
        crank, coupler = parameters[i, ParameterColumn.CRANK], parameters[i, ParameterColumn.COUPLER]
        rocker, ground = parameters[i, ParameterColumn.ROCKER], parameters[i, ParameterColumn.GROUND]
        metrics[:, i] = np.nan
        metrics[MetricColumn.SIZE, i] = coupler + rocker
        row = kernel[i]
        linkage_class, margin, turns = rocking.prepare(
            crank, coupler, rocker, ground, 1.0, row, singular, noise, status, i
        )
        metrics[MetricColumn.LINKAGE_CLASS, i] = linkage_class
        metrics[MetricColumn.GRASHOF_MARGIN, i] = margin
        if turns == 0.0:
            continue
        _fill_load_constants(parameters, i, row)
        four_crank_ground, p_min, q_min = row[four_bar.FOUR_CRANK_GROUND], row[four_bar.E1_E2], row[four_bar.E3_E4]
        smallest = 2.0 * arctangent(math.sqrt(p_min), math.sqrt(q_min + four_crank_ground))
        from_straight = 2.0 * arctangent(math.sqrt(q_min), math.sqrt(p_min + four_crank_ground))
        metrics[MetricColumn.TRANSMISSION_ANGLE_WORST, i] = min(smallest, from_straight) * _DEGREES
        if linkage_class == four_bar.DOUBLE_CRANK:
            continue
        swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, 1.0, row)
        row[KernelColumn.MID_ANGLE] = middle
        # A sine with the swing and the mean phase of the limit positions is close to the fundamental of the velocity.
        phase = math.atan(row[rocking.TAN_EXTENDED]) + math.atan(row[rocking.TAN_OVERLAPPED])
        row[KernelColumn.COSINE] = -0.5 * swing * math.sin(phase)
        row[KernelColumn.SINE] = 0.5 * swing * math.cos(phase)
        metrics[MetricColumn.SWING_ANGLE, i] = swing * _DEGREES
        metrics[MetricColumn.MID_ANGLE, i] = middle * _DEGREES
        metrics[MetricColumn.TIME_RATIO, i] = time_ratio
        _fill_sensitivities(crank, coupler, rocker, ground, metrics, i)
        for k in range(MetricColumn.SWING_SENSITIVITY_CRANK, MetricColumn.SWING_SENSITIVITY_GROUND + 1):
            metrics[k, i] *= _DEGREES


@compiled(PIECES_SIGNATURE)
def pieces(row, window, _drive, _start, _stop, out):
    """Fill the smooth pieces of a window: a load that opposes the motion jumps between the strokes."""
    count, length = 0, 0.0
    inwards = 1.0 - _INWARDS if row[KernelColumn.OPPOSING_TORQUE] != 0.0 else 1.0
    for k in range(2):
        if window == CYCLE or (window == OVERLAPPED_TO_EXTENDED) == (k == 0):
            first, last = rocking.stroke_ends(row, k == 0)
            length += 2.0 * (math.atan(last) - math.atan(first))
            out[count, 0], out[count, 1], out[count, 2] = k, inwards * first, inwards * last
            count += 1
    out[3, 0] = 2.0 * math.pi if window == CYCLE else length
    out[3, 1] = 0.0
    return count
