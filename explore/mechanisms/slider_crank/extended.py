"""The extended kernel of the slider-crank, compiled: its motion, forces under load, points of the rod."""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.floating_link import fill_places, fill_point_on_crank
from explore.mechanisms.slider_crank.columns import (
    EXTENDED_SIGNAL_ROWS,
    FIRST_POINT,
    FORCES,
    POINTS,
    ROD_ACCELERATION,
    ROD_RATES,
    ROD_VELOCITY,
    SLIDER,
    SLIDER_ACCELERATION,
    ExtendedRow,
    Row,
)
from explore.mechanisms.slider_crank.forces import fill_forces, fill_load_constants
from explore.mechanisms.slider_crank.kernel import GUIDE_LOCKED, close_design, fill_motion, sums
from explore.model.points import MOST_POINTS, POINT_ROWS, RATES
from explore.model.status import Status

#: Number of rows by which the lengths are further down than in `Row`.
_LENGTHS = ExtendedRow.CRANK - Row.CRANK
#: Number of rows by which the metrics are further down than in `Row`.
_METRICS = ExtendedRow.STROKE - Row.STROKE

_OK = float(Status.OK)


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


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill what `kernel.close` does, and constants of forces and points; see `explore.model.mechanism.Mechanism`."""
    lengths, metrics = record[_LENGTHS * LANES :], record[_METRICS * LANES :]
    for lane in range(LANES):
        status = close_design(record, lengths, metrics, lane)
        fill_places(record, lane, ExtendedRow.PLACES, ExtendedRow.POINT_1_ALONG)
        can_lock = fill_load_constants(record, lane)
        record[ExtendedRow.STATUS * LANES + lane] = 1.0 * GUIDE_LOCKED if can_lock & (status == _OK) else status


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, _variant, count, needs, out):
    """Fill the signals of the motion, forces and torques, and of points; see `explore.model.mechanism.Mechanism`."""
    motion = needs
    if needs & FORCES:
        motion |= SLIDER | SLIDER_ACCELERATION | ROD_RATES
    if needs // POINTS & RATES:
        motion |= ROD_RATES
    fill_motion(constants, tangents, anchor, count, motion, EXTENDED_SIGNAL_ROWS, out)
    if needs & FORCES:
        for j in range(count):
            signals = out[j * EXTENDED_SIGNAL_ROWS * LANES :]
            fill_forces(constants, tangents[j * LANES :], anchor, law, signals)
    if needs >= POINTS:
        for j in range(count):
            fill_points(constants, tangents[j * LANES :], anchor, needs, out[j * EXTENDED_SIGNAL_ROWS * LANES :])
