"""Points of the slider-crank's rod, from the joint of crank and rod, for many lanes."""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.floating_link import fill_point_on_crank
from explore.mechanisms.slider_crank.columns import (
    FIRST_POINT,
    POINTS,
    ROD_ACCELERATION,
    ROD_VELOCITY,
    ExtendedRow,
    Row,
)
from explore.mechanisms.slider_crank.kernel import sums
from explore.model.points import MOST_POINTS, POINT_ROWS


@subroutine(fast=True, no_alias=True)
def _fill_point(constants, tangents, anchor, number, with_rates, out):
    """Fill the rows of one point, its rates from those of the rod, at one node of each lane."""
    mirror = 1.0 if anchor == 0 else -1.0
    along_row, first = ExtendedRow.PLACES + 2 * number, FIRST_POINT + number * POINT_ROWS
    for lane in range(LANES):
        u = tangents[lane]
        square = u * u
        one_over_w = mirror / (1.0 + square)
        a, b, p, q, e = sums(constants, anchor, lane)
        crank = constants[Row.MOVING_CRANK * LANES + lane]
        # along and across the slider's line, times the rod and w
        ux = math.sqrt((b + p * square) * (q + a * square))
        uy = mirror * ((e - crank) + (e + crank) * square)
        one_over_length = 1.0 / math.sqrt(ux * ux + uy * uy)
        ux, uy = ux * one_over_length, uy * one_over_length
        bx, by = -2.0 * crank * u * one_over_w, crank * (1.0 - square) * one_over_w
        fill_point_on_crank(
            constants, out, along_row, first, lane, crank, bx, by, ux, uy, with_rates, ROD_VELOCITY,
            ROD_ACCELERATION,
        )  # fmt: skip


@subroutine()
def fill_points(constants, tangents, anchor, needs, out):
    """Fill the rows of the points that are needed."""
    for number in range(MOST_POINTS):
        bits = needs // (POINTS << 2 * number) & 3
        if bits:
            _fill_point(constants, tangents, anchor, number, bits >= 2, out)
