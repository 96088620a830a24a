"""The slider-crank: cancellation-free dead centres, position, velocity and acceleration, for many lanes at once.

The crank turns about the origin, its pin is at r (cos(theta), sin(theta)); the slider is at (x, e), e the offset. The
rod of length l spans y along and -h across the slider's line, h = r sin(theta) - e, y^2 = (l - h)(l + h), and

    x = r cos(theta) + y.

All signals have their singularities where y = 0, above theta = +-90 degrees: the anchor is there. With u the
half-tangent from the anchor at 90 degrees, w = 1 + u^2, cos(theta) = -2 u/w, and the exactly rounded sums

    a = l - r - e,  b = l - r + e,  p = l + r + e,  q = l + r - e,

which are positive if the crank turns, R = y w = sqrt((b + p u^2)(q + a u^2)) is a root of sums of positive terms. The
opposite anchor is the mirror image: e and u change their signs, a and b as well as p and q their places.

With P = b + p u^2 and Q = q + a u^2, R^2 = P Q and the rates by theta are

    x' = -r (x sin(theta) - e cos(theta))/y,
    x'' = (2 r u + r R ((b - p u^4)/P^2 - (q - a u^4)/Q^2)/2 - 2 r^2 u^2/R)/w,

those of the angle of the rod -r cos(theta)/y and r w (b q - a p u^4)/R^3.

Before the anchor, u <= 0, x w = T = 2 r |u| + R. Behind it, large terms of x, and of x'', cancel where the rod is as
long as the crank and the slider rests. There x = M/T, the product of the roots of the loop equation over the other
root, and x'' = w^2 x_uu/4 + u x' with the second derivative by u as a difference of two sums of positive terms,

    M = b q + a p u^2,    V = T - u T_u = (b q - a p u^4)/R,    R_u = u (p Q + a P)/R,
    R_uu = (b q g + 6 a b p q u^2 + 3 a p g u^4 + 2 (a p)^2 u^6)/R^3,    g = a b + p q,
    x_uu = 2 (b q T_u^2 + a p V^2)/T^3 - M R_uu/T^2.
"""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import exact_sum, spacing
from explore.base.subroutines import subroutine
from explore.mechanisms.slider_crank.columns import (
    ACCELERATION,
    ANGLE,
    POSITION,
    ROD_ACCELERATION,
    ROD_ANGLE,
    ROD_RATES,
    ROD_VELOCITY,
    SIGNAL_ROWS,
    SLIDER,
    SLIDER_ACCELERATION,
    VELOCITY,
    Row,
)
from explore.model.status import OwnStatus, Status

# Codes of the statuses of designs whose crank does not turn, and of designs under load whose slider locks.
CANNOT_ASSEMBLE, CRANK_BLOCKED, CHANGE_POINT, GUIDE_LOCKED = 2, 3, 4, 20
STATUSES = {
    CANNOT_ASSEMBLE: OwnStatus("cannot_assemble", "the offset is out of reach: longer than crank and rod together"),
    CRANK_BLOCKED: OwnStatus("crank_blocked", "the crank cannot turn fully: the rod is shorter than crank plus offset"),
    CHANGE_POINT: OwnStatus(
        "change_point",
        "the rod is as long as crank plus offset: where they line up the slider may continue in either direction",
    ),
    GUIDE_LOCKED: OwnStatus(
        "guide_locked",
        "friction can lock the slider in its guide: at the largest pressure angle, whose tangent times the coefficient "
        "of friction is at least 1, no force of the rod moves it",
    ),
}
_OK = float(Status.OK)
_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(inlined=True)
def sums(constants, anchor, lane):
    """a, b, p, q and the offset as they are seen from the anchor."""
    minus_minus, minus_plus = constants[Row.MINUS_MINUS * LANES + lane], constants[Row.MINUS_PLUS * LANES + lane]
    plus_plus, plus_minus = constants[Row.PLUS_PLUS * LANES + lane], constants[Row.PLUS_MINUS * LANES + lane]
    offset = constants[Row.MOVING_OFFSET * LANES + lane]
    if anchor == 0:
        return minus_minus, minus_plus, plus_plus, plus_minus, offset
    return minus_plus, minus_minus, plus_minus, plus_plus, -offset


@subroutine(inlined=True)
def _rest_acceleration(u, r, a, b, p, q, first, second, one_over_root, one_over_total, rate):
    """Acceleration behind the anchor, where the slider of a short rod almost rests."""
    square = u * u
    w = 1.0 + square
    ap, bq, g = a * p, b * q, a * b + p * q
    bend = bq * g + square * (6.0 * ap * bq + square * ap * (3.0 * g + 2.0 * ap * square))
    bend *= one_over_root * one_over_root * one_over_root
    slope = (2.0 * r + u * (p * second + a * first) * one_over_root) * one_over_total
    rest = (bq - ap * square * square) * one_over_root * one_over_total
    second_derivative = 2.0 * (bq * slope * slope + ap * rest * rest) - (bq + ap * square) * bend * one_over_total
    return 0.25 * w * w * second_derivative * one_over_total + u * rate


@subroutine(fast=True, no_alias=True)
def _fill_slider(constants, tangents, anchor, needs, out):
    """Fill position and velocity of the slider, and its acceleration if needed, at one node of each lane."""
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = mirror * tangents[lane]
        square = u * u
        a, b, p, q, e = sums(constants, anchor, lane)
        r = constants[Row.MOVING_CRANK * LANES + lane]
        first, second = b + p * square, q + a * square
        root = math.sqrt(first * second)
        one_over_root, one_over_w = 1.0 / root, 1.0 / (1.0 + square)
        total = 2.0 * r * abs(u) + root
        one_over_total = 1.0 / total
        x = total * one_over_w if u <= 0.0 else (b * q + a * p * square) * one_over_total
        rate = -r * (x * (1.0 - square) + 2.0 * e * u) * one_over_root
        out[POSITION * LANES + lane] = x
        out[VELOCITY * LANES + lane] = mirror * rate
        if needs & SLIDER_ACCELERATION:
            one_over_product = one_over_root * one_over_root
            one_over_first, one_over_second = second * one_over_product, first * one_over_product
            above = (b - p * square * square) * one_over_first * one_over_first
            below = (q - a * square * square) * one_over_second * one_over_second
            moving = r * (2.0 * u + 0.5 * root * (above - below) - 2.0 * r * square * one_over_root) * one_over_w
            # a rod below four cranks
            is_short = a + p < 8.0 * r
            # about the nearer one of the anchor and its opposite, where the terms do not grow with u
            is_near, inverse = square <= 1.0, 1.0 / abs(u)
            scale, growth = 1.0 if is_near else inverse * inverse, 1.0 if is_near else square
            resting = _rest_acceleration(
                abs(u) if is_near else inverse, r, a if is_near else b, b if is_near else a, p if is_near else q,
                q if is_near else p, scale * (first if is_near else second), scale * (second if is_near else first),
                growth * one_over_root, growth * one_over_total, rate if is_near else -rate,
            )  # fmt: skip
            out[ACCELERATION * LANES + lane] = resting if (u > 0.0) & is_short else moving


@subroutine(fast=True, no_alias=True)
def _fill_angle(constants, tangents, anchor, out):
    """Fill the angle of the rod, rad, at one node of each lane."""
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        square = tangents[lane] * tangents[lane]
        a, b, p, q, e = sums(constants, anchor, lane)
        r = constants[Row.MOVING_CRANK * LANES + lane]
        across = mirror * ((e - r) + (e + r) * square)
        out[ROD_ANGLE * LANES + lane] = arctangent(across, math.sqrt((b + p * square) * (q + a * square)))


@subroutine(fast=True, no_alias=True)
def _fill_rod_rates(constants, tangents, anchor, out):
    """Fill velocity and acceleration of the rod at one node of each lane."""
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = mirror * tangents[lane]
        square = u * u
        w = 1.0 + square
        a, b, p, q, _ = sums(constants, anchor, lane)
        r = constants[Row.MOVING_CRANK * LANES + lane]
        one_over_root = 1.0 / math.sqrt((b + p * square) * (q + a * square))
        rest = (b * q - a * p * square * square) * one_over_root * one_over_root
        out[ROD_VELOCITY * LANES + lane] = 2.0 * r * u * one_over_root
        out[ROD_ACCELERATION * LANES + lane] = mirror * r * w * rest * one_over_root


@subroutine(inlined=True)
def fill_motion(constants, tangents, anchor, count, needs, signal_rows, out):
    """Fill the signals of the motion for unit crank velocity, the first of `signal_rows` rows."""
    for j in range(count):
        node, signals = tangents[j * LANES :], out[j * signal_rows * LANES :]
        if needs & (SLIDER | SLIDER_ACCELERATION):
            _fill_slider(constants, node, anchor, needs, signals)
        if needs & ANGLE:
            _fill_angle(constants, node, anchor, signals)
        if needs & ROD_RATES:
            _fill_rod_rates(constants, node, anchor, signals)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, _law, _variant, count, needs, out):
    """Fill the signals of the motion; see `explore.model.mechanism.Mechanism`."""
    fill_motion(constants, tangents, anchor, count, needs, SIGNAL_ROWS, out)


@subroutine(inlined=True)
def _status(rod, margin, excess):
    """Whether the crank turns; without branches, so that loops over designs vectorise.

    `excess` is what the offset exceeds crank and rod by.
    """
    status = 1.0 * CRANK_BLOCKED if margin < 0.0 else _OK
    # Decimal lengths at a change point have a margin of a few units in the last place of the rod.
    status = 1.0 * CHANGE_POINT if abs(margin) <= 4.0 * spacing(rod) else status
    return 1.0 * CANNOT_ASSEMBLE if excess > 0.0 else status


@subroutine(inlined=True)
def close_designs(record, length_offset, metric_offset):
    """Fill sums, dead centres, margins, angles and status. Metrics are in declared units, NaN where undefined.

    The offsets are numbers of rows by which status and lengths, and the metrics, are further down than in `Row`. The
    loop over lanes is here, and the record one array, or it would not vectorise.
    """
    for lane in range(LANES):
        given, metric = length_offset * LANES + lane, metric_offset * LANES + lane
        crank, rod = record[Row.CRANK * LANES + given], record[Row.ROD * LANES + given]
        offset = record[Row.OFFSET * LANES + given]
        a, b = exact_sum(rod, -crank, -offset, 0.0), exact_sum(rod, -crank, offset, 0.0)
        p, q = exact_sum(rod, crank, offset, 0.0), exact_sum(rod, crank, -offset, 0.0)
        margin, width = a if a < b else b, p if p > q else q
        status = _status(rod, margin, exact_sum(abs(offset), -crank, -rod, 0.0))
        turns = status == _OK
        outer, inner = math.sqrt(p * q), math.sqrt(a * b)
        stroke = 4.0 * rod * crank / (outer + inner)
        imbalance = abs(arctangent(offset * stroke, outer * inner + offset * offset))
        reach, rise = crank + abs(offset), math.sqrt(margin * width)
        record[Row.MINUS_MINUS * LANES + lane], record[Row.MINUS_PLUS * LANES + lane] = a, b
        record[Row.PLUS_PLUS * LANES + lane], record[Row.PLUS_MINUS * LANES + lane] = p, q
        record[Row.MOVING_CRANK * LANES + lane], record[Row.MOVING_OFFSET * LANES + lane] = crank, offset
        record[Row.OUTER * LANES + lane], record[Row.INNER * LANES + lane] = -math.sqrt(q / p), math.sqrt(b / a)
        # tanh(distance/2) of l - h = 0, above the anchor, and of l + h = 0, above its opposite, from the real axis
        record[Row.SINGULAR_ABOVE * LANES + lane] = math.sqrt(b / p)
        record[Row.SINGULAR_BELOW * LANES + lane] = math.sqrt(a / q)
        # The terms of x' exceed it by at most twice r x/y, and x <= 2 y.
        record[Row.NOISE * LANES + lane] = 4.0 * crank / rod
        record[Row.STROKE * LANES + metric] = stroke if turns else _NAN
        record[Row.TIME_RATIO * LANES + metric] = (math.pi + imbalance) / (math.pi - imbalance) if turns else _NAN
        record[Row.OUTER_ANGLE * LANES + metric] = arctangent(offset, outer) * _DEGREES if turns else _NAN
        record[Row.INNER_ANGLE * LANES + metric] = 180.0 + arctangent(offset, inner) * _DEGREES if turns else _NAN
        record[Row.PRESSURE_ANGLE_MAX * LANES + metric] = arctangent(reach, rise) * _DEGREES if turns else _NAN
        record[Row.TRANSMISSION_ANGLE_MIN * LANES + metric] = arctangent(rise, reach) * _DEGREES if turns else _NAN
        record[Row.TURNING_MARGIN * LANES + metric] = margin
        record[Row.STATUS * LANES + given] = status


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill constants, status and metrics; see `explore.model.mechanism.Mechanism`."""
    close_designs(record, 0, 0)
