"""Points of a four-bar's coupler, from the joint of crank and coupler, for many lanes."""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar
from explore.mechanisms.floating_link import fill_point_on_crank
from explore.mechanisms.four_bar import (
    BRANCH,
    COUPLER_ACCELERATION,
    COUPLER_EXCESS,
    COUPLER_VELOCITY,
    CRANK,
    GROUND_MINUS_CRANK,
    GROUND_PLUS_CRANK,
    factors,
)
from explore.model.points import MOST_POINTS, POINT_ROWS, RATES


@subroutine(fast=True, no_alias=True)
def _fill_point(constants, tangents, anchor, along_row, first, with_rates, out):
    """Fill the rows of one point, its rates from those of the coupler, at one node of each lane."""
    sign = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        square = u * u
        p, q, _, w = factors(constants, anchor, lane, square)
        crank = constants[CRANK * LANES + lane]
        minus, plus = constants[GROUND_MINUS_CRANK * LANES + lane], constants[GROUND_PLUS_CRANK * LANES + lane]
        # the coupler's direction as in `four_bar`, its length divided out
        dx = minus + plus * square if anchor == 0 else plus + minus * square
        dy = -2.0 * sign * crank * u
        forward = constants[COUPLER_EXCESS * LANES + lane] * w + p
        sideways = constants[BRANCH * LANES + lane] * math.sqrt(p * q)
        ux, uy = forward * dx - sideways * dy, forward * dy + sideways * dx
        one_over_length, one_over_w = 1.0 / math.sqrt(ux * ux + uy * uy), sign / w
        ux, uy = ux * one_over_length, uy * one_over_length
        bx, by = crank * (1.0 - square) * one_over_w, 2.0 * crank * u * one_over_w
        fill_point_on_crank(
            constants, out, along_row, first, lane, crank, bx, by, ux, uy, with_rates, COUPLER_VELOCITY,
            COUPLER_ACCELERATION,
        )  # fmt: skip


@subroutine(inlined=True)
def motion_needs(needs, first_need):
    """What the rates of points need of the motion."""
    rates = needs // first_need & RATES
    return four_bar.VELOCITIES | four_bar.ACCELERATIONS if rates else 0


@subroutine()
def fill_points(constants, tangents, anchor, needs, first_need, places, first, out):
    """Fill the rows of the points that are needed.

    Of the first point, `first_need` is the bit of its position, `places` the constant of its place along the coupler,
    and `first` its first row.
    """
    for number in range(MOST_POINTS):
        bits = needs // (first_need << 2 * number) & 3
        if bits:
            _fill_point(constants, tangents, anchor, places + 2 * number, first + number * POINT_ROWS, bits >= 2, out)
