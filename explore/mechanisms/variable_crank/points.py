"""Points of the variable crank's rod, from the crank's pin in the groove, for many lanes."""

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.floating_link import fill_place, fill_rates
from explore.mechanisms.variable_crank.columns import (
    ACCELERATION,
    CRANK_LENGTH,
    CRANK_RATE,
    CRANK_SECOND_RATE,
    FIRST_POINT,
    POINTS,
    POSITION,
    VELOCITY,
    Row,
)
from explore.model.points import MOST_POINTS, POINT_ROWS


@subroutine(fast=True)
def _fill_point(constants, tangents, anchor, number, out):
    """Fill the rows of one point from those of slider and crank, at one node of each lane."""
    mirror = 1.0 if anchor == 0 else -1.0
    along_row, first = Row.PLACES + 2 * number, FIRST_POINT + number * POINT_ROWS
    for lane in range(LANES):
        tangent = tangents[lane]
        one_over_w = mirror / (1.0 + tangent * tangent)
        cosine, sine = (1.0 - tangent * tangent) * one_over_w, 2.0 * tangent * one_over_w
        along, across = constants[along_row * LANES + lane], constants[(along_row + 1) * LANES + lane]
        rod, speed = constants[Row.LENGTH * LANES + lane], constants[Row.CRANK_SPEED * LANES + lane]
        crank, crank_rate = out[CRANK_LENGTH * LANES + lane], out[CRANK_RATE * LANES + lane]
        second_rate = out[CRANK_SECOND_RATE * LANES + lane]
        bx, by = crank * cosine, crank * sine
        ux, uy = (out[POSITION * LANES + lane] - bx) / rod, -by / rod
        rx, ry = along * ux - across * uy, along * uy + across * ux
        reach = abs(along) + abs(across)
        fill_place(out, first, lane, bx, by, rx, ry, crank + reach * (1.0 + crank / rod))
        turning = speed * crank
        bvx, bvy = crank_rate * cosine - turning * sine, crank_rate * sine + turning * cosine
        inward, sideways = second_rate - speed * turning, 2.0 * speed * crank_rate
        bax, bay = inward * cosine - sideways * sine, inward * sine + sideways * cosine
        # The part across the rod of the slider's rates less those of the pin is by the rod's turning.
        rate = (-uy * (out[VELOCITY * LANES + lane] - bvx) - ux * bvy) / rod
        rate_of_rate = (-uy * (out[ACCELERATION * LANES + lane] - bax) - ux * bay) / rod
        velocity_terms = speed * (crank + rod) + abs(crank_rate)
        acceleration_terms = abs(second_rate) + speed * (velocity_terms + abs(crank_rate))
        fill_rates(
            out, first, lane, bvx, bvy, bax, bay, rx, ry, rate, rate_of_rate, velocity_terms * (1.0 + reach / rod),
            acceleration_terms * (1.0 + reach / rod) + rate * rate * reach,
        )  # fmt: skip


@subroutine()
def fill_points(constants, tangents, anchor, needs, out):
    """Fill the rows of the points that are needed."""
    for number in range(MOST_POINTS):
        if needs & (3 * POINTS << 2 * number):
            _fill_point(constants, tangents, anchor, number, out)
