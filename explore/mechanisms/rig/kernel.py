"""The oscillating-torque test rig, compiled: closed-form metrics, the constants of its forces, and its signals."""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.lanes.elementary import exact_sum
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar, four_bar_forces, rocking
from explore.mechanisms.four_bar_forces import FORCES, TORQUE, Load
from explore.mechanisms.rig.columns import DEVIATION, DEVIATION_COSINE, DEVIATION_SINE, HARMONICS, SIGNAL_ROWS, Row

_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(inlined=True)
def _sensitivities(crank, coupler, rocker, ground):
    """Derivatives of the swing by crank, coupler, rocker and ground, rad per length.

    The swing is psi_extended - psi_overlapped of the triangles with sides AC, ground, rocker. Where the two terms of a
    derivative nearly cancel, their difference follows from that of their squares, which is a product.
    """
    extended, overlapped = coupler + crank, coupler - crank
    e, o = extended * extended, overlapped * overlapped
    sum_of_two, difference = ground + rocker, ground - rocker
    # Four times the area of each triangle, by Heron; sums of three lengths and more are exact.
    area_e = math.sqrt(
        exact_sum(ground, rocker, -crank, -coupler) * (sum_of_two + extended)
        * exact_sum(coupler, crank, rocker, -ground) * exact_sum(coupler, crank, ground, -rocker)
    )  # fmt: skip
    area_o = math.sqrt(
        exact_sum(ground, rocker, crank, -coupler) * exact_sum(ground, rocker, coupler, -crank)
        * exact_sum(coupler, -crank, rocker, -ground) * exact_sum(coupler, -crank, ground, -rocker)
    )  # fmt: skip
    area_product = area_e * area_o
    at_e, at_o = 2.0 * extended / area_e, 2.0 * overlapped / area_o
    # e o - (ground^2 - rocker^2)^2 as a product of two differences of squares.
    square_excess = (coupler - ground) * (coupler + ground) + (rocker - crank) * (rocker + crank)
    other_excess = (coupler - rocker) * (coupler + rocker) + (ground - crank) * (ground + crank)
    product = 4.0 * crank * coupler * square_excess * other_excess / (area_product * area_product)
    squares = difference * sum_of_two
    term_e, term_o = (e - squares) / (rocker * area_e), (o - squares) / (rocker * area_o)
    of_rocker = -(4.0 * product / (term_e + term_o) if (term_e > 0.0) == (term_o > 0.0) else term_e - term_o)
    term_e, term_o = (e + squares) / (ground * area_e), (o + squares) / (ground * area_o)
    of_ground = -(4.0 * product / (term_e + term_o) if (term_e > 0.0) == (term_o > 0.0) else term_e - term_o)
    return at_e + at_o, 4.0 * product / (at_e + at_o), of_rocker, of_ground


@subroutine(inlined=True)
def _fill_closed_form(record):
    """Fill the constants of the motion, status and metrics in declared units, NaN where undefined."""
    for lane in range(LANES):
        crank, coupler = record[Row.CRANK * LANES + lane], record[Row.COUPLER * LANES + lane]
        rocker, ground = record[Row.ROCKER * LANES + lane], record[Row.GROUND * LANES + lane]
        linkage_class, margin, status = rocking.prepare(crank, coupler, rocker, ground, 1.0, record, lane)
        swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, 1.0, record, lane)
        rocks, turns = linkage_class == four_bar.CRANK_ROCKER, linkage_class <= four_bar.DOUBLE_CRANK
        p_least, p_largest = record[four_bar.P_LEAST * LANES + lane], record[four_bar.P_LARGEST * LANES + lane]
        q_least, q_largest = record[four_bar.Q_LEAST * LANES + lane], record[four_bar.Q_LARGEST * LANES + lane]
        smallest = four_bar.transmission_angle(p_least, q_largest)
        from_straight = four_bar.transmission_angle(q_least, p_largest)
        worst = smallest if smallest < from_straight else from_straight
        record[Row.STATUS * LANES + lane] = status
        record[Load.MIDDLE * LANES + lane] = middle
        record[Row.LINKAGE_CLASS * LANES + lane] = linkage_class
        record[Row.GRASHOF_MARGIN * LANES + lane] = margin
        record[Row.SIZE * LANES + lane] = coupler + rocker
        record[Row.SWING_ANGLE * LANES + lane] = swing * _DEGREES if rocks else _NAN
        record[Row.MID_ANGLE * LANES + lane] = middle * _DEGREES if rocks else _NAN
        record[Row.TIME_RATIO * LANES + lane] = time_ratio if rocks else _NAN
        record[Row.TRANSMISSION_ANGLE_WORST * LANES + lane] = worst * _DEGREES if turns else _NAN
        # A sine with the swing and the mean phase of the limit positions is close to the fundamental of the velocity.
        extended, overlapped = record[rocking.EXTENDED * LANES + lane], -1.0 / record[rocking.OVERLAPPED * LANES + lane]
        amplitude = 0.5 * swing / math.sqrt((1.0 + extended * extended) * (1.0 + overlapped * overlapped))
        record[Row.COSINE * LANES + lane] = -amplitude * (extended + overlapped)
        record[Row.SINE * LANES + lane] = amplitude * (1.0 - extended * overlapped)
        of_crank, of_coupler, of_rocker, of_ground = _sensitivities(crank, coupler, rocker, ground)
        record[Row.SWING_SENSITIVITY_CRANK * LANES + lane] = of_crank * _DEGREES if rocks else _NAN
        record[Row.SWING_SENSITIVITY_COUPLER * LANES + lane] = of_coupler * _DEGREES if rocks else _NAN
        record[Row.SWING_SENSITIVITY_ROCKER * LANES + lane] = of_rocker * _DEGREES if rocks else _NAN
        record[Row.SWING_SENSITIVITY_GROUND * LANES + lane] = of_ground * _DEGREES if rocks else _NAN


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill class, margins, limit positions, sensitivities and load; see `explore.model.mechanism.Mechanism`."""
    _fill_closed_form(record)
    for lane in range(LANES):
        rocks = record[Row.LINKAGE_CLASS * LANES + lane] == four_bar.CRANK_ROCKER
        four_bar_forces.fill_load_constants(record, lane, Row.CRANK, Row.CONSTANT_TORQUE, Row.SPEED, rocks)


@subroutine(fast=True)
def _fill_deviations(constants, tangents, anchor, out):
    """Fill the deviation of the rocker's velocity from a sine, and its products with sine and cosine."""
    sign = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        tangent = tangents[lane]
        one_over_w = sign / (1.0 + tangent * tangent)
        cosine, sine = (1.0 - tangent * tangent) * one_over_w, 2.0 * tangent * one_over_w
        deviation = out[four_bar.ROCKER_VELOCITY * LANES + lane]
        deviation -= constants[Row.COSINE * LANES + lane] * cosine + constants[Row.SINE * LANES + lane] * sine
        out[DEVIATION * LANES + lane] = deviation
        out[DEVIATION_COSINE * LANES + lane], out[DEVIATION_SINE * LANES + lane] = (
            2.0 * deviation * cosine,
            2.0 * deviation * sine,
        )


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, variant, count, needs, out):
    """Fill the signals of a four-bar under load; see `explore.model.mechanism.Mechanism` for the arguments."""
    motion = four_bar_forces.motion_needs(needs, variant)
    if needs & HARMONICS:
        motion |= four_bar.VELOCITIES
    four_bar.fill_motion(constants, tangents, anchor, count, motion, SIGNAL_ROWS, out)
    for j in range(count):
        node, signals = tangents[j * LANES :], out[j * SIGNAL_ROWS * LANES :]
        if needs & (FORCES | TORQUE):
            four_bar_forces.fill_forces(constants, node, anchor, law, variant, needs, signals)
        if needs & HARMONICS:
            _fill_deviations(constants, node, anchor, signals)
