"""The variable crank: the regular position, dead centres and shares of the turn, for many lanes.

The slider is on the crank's axis, X from its pivot, and moves at constant speed V between its reversals: X' = -c per
radian, c = V/w. A crank of length L, which a groove varies, and a rod of length l satisfy

    L = X cos(phi) -+ sqrt(l^2 - X^2 sin^2(phi)).

Where crank and rod are perpendicular the two signs change places, and the groove has no influence on the speed. There a
continuous motion needs (angle, length and position called regular)

    tan(phi*) = l/L*,    X*^2 = L*^2 + l^2,    L*^2 = 2 c^2 l/(l + sqrt(l^2 + 4 c^2)),

so the length at the start is not free: X = X* - c (phi - phi*) off the reversals.
"""

import math

from explore.base.compiling import CLOSE_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.variable_crank.blend import lag_of, shares, slope_of
from explore.mechanisms.variable_crank.columns import LOAD_SIZE, Row
from explore.mechanisms.variable_crank.floating_link import fill_places
from explore.model.status import OwnStatus, Status

# Codes of the statuses of designs without a motion.
REVERSAL_TOO_LONG, SHAFT_REACHED = 20, 21
STATUSES = {
    REVERSAL_TOO_LONG: OwnStatus(
        "reversal_too_long",
        "the reversals last beyond the angle where crank and rod are perpendicular, so no start length is regular",
    ),
    SHAFT_REACHED: OwnStatus("shaft_reached", "the slider would reach the crank's shaft: the rod is too short"),
}
_OK, _NOT_FINITE = float(Status.OK), float(Status.NOT_FINITE)
#: Width of a reversal, rad, below which rounding does not tell its ends apart.
_SHORTEST_REVERSAL = 1e-11
#: Half-tangent of half a turn: its square is a double.
_HALF_TURN = 1e150

_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(inlined=True)
def _fill_marks(record, lane, width):
    """Fill the half-tangents of dead centres and ends of the reversals, from the anchor at the outer dead centre."""
    reversal = math.tan(0.25 * width)
    record[Row.OUTER * LANES + lane], record[Row.INNER * LANES + lane] = 0.0, _HALF_TURN
    record[Row.STEADY_START * LANES + lane], record[Row.STEADY_STOP * LANES + lane] = reversal, 1.0 / reversal
    record[Row.BACK_START * LANES + lane], record[Row.BACK_STOP * LANES + lane] = -1.0 / reversal, -reversal


@subroutine(inlined=True)
def _fill_constants(record, lane, travel, width):
    """Fill the regular position and what else `fill` reads; return the regular angle, rad, and the crank there."""
    rod = record[Row.ROD * LANES + lane]
    root = math.sqrt(rod * rod + 4.0 * travel * travel)
    crank = travel * math.sqrt(2.0 * rod / (rod + root))
    position = math.sqrt(crank * crank + rod * rod)
    offset = -arctangent(crank, rod)
    record[Row.LENGTH * LANES + lane], record[Row.TRAVEL * LANES + lane] = rod, travel
    record[Row.REGULAR_OFFSET * LANES + lane] = offset
    record[Row.REGULAR_SINE * LANES + lane] = rod / position
    record[Row.REGULAR_COSINE * LANES + lane] = crank / position
    record[Row.REGULAR_POSITION * LANES + lane] = position
    record[Row.REGULAR_EXCESS * LANES + lane] = crank * crank / (position + rod)
    record[Row.WIDTH * LANES + lane], record[Row.ORDER * LANES + lane] = width, record[Row.BLEND_ORDER * LANES + lane]
    record[Row.CRANK_SPEED * LANES + lane] = record[Row.SPEED * LANES + lane]
    for k in range(LOAD_SIZE):
        record[(Row.LOAD_MASS + k) * LANES + lane] = record[(Row.MASS + k) * LANES + lane]
    fill_places(record, lane, Row.PLACES, Row.POINT_1_ALONG)
    return 0.5 * math.pi + offset, crank


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill the regular position, marks and metrics; see `explore.model.mechanism.Mechanism`.

    Metrics are in declared units, NaN where undefined.
    """
    for lane in range(LANES):
        rod, speed = record[Row.ROD * LANES + lane], record[Row.SPEED * LANES + lane]
        order, time = record[Row.BLEND_ORDER * LANES + lane], record[Row.REVERSAL_TIME * LANES + lane]
        wanted = record[Row.SLIDER_SPEED * LANES + lane]
        travel, width = wanted / speed, speed * time
        angle, crank = _fill_constants(record, lane, travel, width)
        _fill_marks(record, lane, width)
        lag = travel * width * lag_of(order)
        excess = record[Row.REGULAR_EXCESS * LANES + lane]
        # The dead centres are where crank and rod are in line: X = l + L and X = l - L.
        outer = excess + travel * angle - lag
        inner = travel * (math.pi - angle) - excess - lag
        record[Row.MIDDLE * LANES + lane] = rod + 0.5 * (outer - inner)
        status = 1.0 * SHAFT_REACHED if inner >= rod else _OK
        status = 1.0 * REVERSAL_TOO_LONG if 0.5 * width > angle else status
        status = _NOT_FINITE if width < _SHORTEST_REVERSAL else status
        moves = status == _OK
        one, two, five = shares(order, width)
        record[Row.STATUS * LANES + lane] = status
        record[Row.STROKE * LANES + lane] = outer + inner if moves else _NAN
        record[Row.REGULAR_ANGLE * LANES + lane] = angle * _DEGREES
        record[Row.REGULAR_CRANK * LANES + lane] = crank
        record[Row.CRANK_OUTER * LANES + lane] = outer if moves else _NAN
        record[Row.CRANK_INNER * LANES + lane] = inner if moves else _NAN
        record[Row.SLIDER_ACCELERATION_MAX * LANES + lane] = slope_of(order) * wanted / time if moves else _NAN
        record[Row.STEADY_SHARE * LANES + lane] = 1.0 - width / math.pi if moves else _NAN
        record[Row.SPEED_SHARE_1 * LANES + lane] = one if moves else _NAN
        record[Row.SPEED_SHARE_2 * LANES + lane] = two if moves else _NAN
        record[Row.SPEED_SHARE_5 * LANES + lane] = five if moves else _NAN
