"""Arcs that a curve consists of, longer and shorter ones, and the distances of points to them."""

import math
from typing import NamedTuple

import numpy as np

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE_SIZE, TURN, fill_rows, take_row
from explore.mechanisms.targets.path_errors.ordering import fill_least
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN, divide, place_of
from explore.model.quantities import FloatArray

#: Number of arcs of a curve at first.
FEW_ARCS = 64
#: Largest number of arcs of a curve.
MOST_ARCS = 512
#: Largest size of the term of third order of an arc, relative to its chord, both squared.
_CURLED = 2e-3
#: Largest number of times that curled arcs are divided.
_MOST_DIVISIONS = 5

# Rows of corners.
ANGLE, X, Y, SLOPE_X, SLOPE_Y = range(5)
# Rows of arcs. An arc is `start + s along + s (1 - s) (bend - s twist)` for s from 0 to 1: the cubic with the curve's
# places and derivatives at both ends.
START_X, START_Y, ALONG_X, ALONG_Y, BEND_X, BEND_Y, TWIST_X, TWIST_Y = range(8)

_TINY = 1e-300


class Arcs(NamedTuple):
    """Arrays of the arcs of a curve: `corners` (5, n + 1) in their order, `laid` (8, n) at their places in a row.

    `rays` (2, FEW_ARCS) are cosines and sines of equal angles. `excess` (n,) tells which arcs are divided: squared
    sizes of curls, or what is missing in the sums of squares over arcs. `spare` is room for corners, `out` for the
    curve, `rows` and `shapes` for it at the rays.
    """

    rays: FloatArray
    corners: FloatArray
    laid: FloatArray
    excess: FloatArray
    spare: FloatArray
    out: FloatArray
    rows: FloatArray
    shapes: FloatArray


@subroutine(allocates=True)
def make_arcs(shape_size):
    """Room for arcs."""
    angles, size = np.arange(FEW_ARCS) * (TURN / FEW_ARCS), MOST_ARCS + 1
    return Arcs(
        np.stack((np.cos(angles), np.sin(angles))), np.empty((5, size)), np.empty((8, size)), np.empty(size),
        np.empty((5, size)), np.empty(CURVE_SIZE), np.empty(FEW_ARCS * CURVE_SIZE), np.empty(shape_size * LANES),
    )  # fmt: skip


@subroutine()
def _fill_corner(angle, out, corners, k):
    """Fill a corner from the curve: its angle, place and derivatives."""
    corners[ANGLE, k] = angle
    corners[X, k], corners[Y, k], corners[SLOPE_X, k], corners[SLOPE_Y, k] = out[0], out[1], out[2], out[3]


@subroutine()
def fill_arcs(curve, rows_of_curve, shape, arcs):
    """Fill arcs of equal turns of the crank, divided where the curve is not nearly their cubic; return their number."""
    fill_rows(rows_of_curve, shape, arcs.rays, arcs.shapes, arcs.rows)
    for k in range(FEW_ARCS):
        arcs.corners[ANGLE, k] = k * (TURN / FEW_ARCS)
    for row in range(4):
        take_row(arcs.rows, row, arcs.corners[X + row, :FEW_ARCS])
    for row in range(5):
        arcs.corners[row, FEW_ARCS] = arcs.corners[row, 0]
    arcs.corners[ANGLE, FEW_ARCS] = TURN
    _lay(arcs.corners, FEW_ARCS, arcs.laid)
    count = FEW_ARCS
    for _ in range(_MOST_DIVISIONS):
        _measure_curls(count, arcs)
        more = divide_arcs(curve, shape, count, _CURLED, arcs)
        if more == 0:
            break
        count = more
    return count


@subroutine()
def _measure_curls(count, arcs):
    """Fill the squared sizes of the terms of third order of arcs, relative to their chords, as their excess."""
    laid, parts = arcs.laid, count // LANES_OF_TURN
    for lane in range(LANES_OF_TURN):
        for part in range(parts):
            place = part * LANES_OF_TURN + lane
            twist = laid[TWIST_X, place] ** 2 + laid[TWIST_Y, place] ** 2
            chord = laid[ALONG_X, place] ** 2 + laid[ALONG_Y, place] ** 2
            arcs.excess[lane * parts + part] = twist / (chord + _TINY)


@subroutine()
def _lay(corners, count, laid):
    """Fill so many arcs from their corners, each at its place in a row."""
    parts = count // LANES_OF_TURN
    for lane in range(LANES_OF_TURN):
        for part in range(parts):
            place, k = part * LANES_OF_TURN + lane, lane * parts + part
            x, y, step = corners[X, k], corners[Y, k], corners[ANGLE, k + 1] - corners[ANGLE, k]
            along_x, along_y = corners[X, k + 1] - x, corners[Y, k + 1] - y
            bend_x, bend_y = step * corners[SLOPE_X, k] - along_x, step * corners[SLOPE_Y, k] - along_y
            laid[START_X, place], laid[START_Y, place] = x, y
            laid[ALONG_X, place], laid[ALONG_Y, place] = along_x, along_y
            laid[BEND_X, place], laid[BEND_Y, place] = bend_x, bend_y
            laid[TWIST_X, place] = bend_x + step * corners[SLOPE_X, k + 1] - along_x
            laid[TWIST_Y, place] = bend_y + step * corners[SLOPE_Y, k + 1] - along_y


@subroutine()
def divide_arcs(curve, shape, count, limit, arcs):
    """Divide the arcs whose excess is above a limit; return the number of all, or 0 if none is or there is no room."""
    corners, total = arcs.corners, divide(arcs.corners, arcs.spare, arcs.excess, count, limit, MOST_ARCS)
    for k in range(total):
        if corners[X, k] == math.inf:
            curve(shape, math.cos(corners[ANGLE, k]), math.sin(corners[ANGLE, k]), arcs.out)
            _fill_corner(corners[ANGLE, k], arcs.out, corners, k)
    _lay(corners, total, arcs.laid)
    return total


@subroutine(fast=True)
def _nearest(x, y, laid, k):
    """The place on an arc that is nearest to a point, from 0 to 1, and its squared distance.

    A step of Newton's method from the nearest place of the chord.
    """
    ex, ey, tx, ty = x - laid[START_X, k], y - laid[START_Y, k], laid[ALONG_X, k], laid[ALONG_Y, k]
    bend_x, bend_y, twist_x, twist_y = laid[BEND_X, k], laid[BEND_Y, k], laid[TWIST_X, k], laid[TWIST_Y, k]
    first = min(max((ex * tx + ey * ty) / (tx * tx + ty * ty + _TINY), 0.0), 1.0)
    product, slope = first * (1.0 - first), 1.0 - 2.0 * first
    gx, gy = bend_x - first * twist_x, bend_y - first * twist_y
    hx, hy = first * tx + product * gx - ex, first * ty + product * gy - ey
    vx, vy = tx + slope * gx - product * twist_x, ty + slope * gy - product * twist_y
    square = vx * vx + vy * vy + _TINY
    bent = square - 2.0 * (hx * (gx + slope * twist_x) + hy * (gy + slope * twist_y))
    place = first - (hx * vx + hy * vy) / (bent if bent > 0.1 * square else square)
    place = min(max(place, 0.0), 1.0)
    product = place * (1.0 - place)
    dx = place * tx + product * (bend_x - place * twist_x) - ex
    dy = place * ty + product * (bend_y - place * twist_y) - ey
    own, found = hx * hx + hy * hy, dx * dx + dy * dy
    return (place, found) if found < own else (first, own)


@subroutine(fast=True, no_alias=True)
def _fill_row(x, y, weight, laid, count, row):
    for k in range(count):
        row[k] = weight * _nearest(x, y, laid, k)[1]


@subroutine()
def fill_distances(points, weights, arcs, count, search):
    """Fill the weighted squared distances of points, (n, 2), to so many arcs of a turn, and the least of each point."""
    for i in range(len(points)):
        _fill_row(points[i, 0], points[i, 1], weights[i], arcs.laid, count, search.distances[i])
    fill_least(count, search)


@subroutine()
def angle_on_arc(x, y, arcs, count, arc):
    """The crank angle of the place on an arc, of this turn or the next, that is nearest to a point."""
    k = arc % count
    part, _ = _nearest(x, y, arcs.laid, place_of(k, count // LANES_OF_TURN))
    start, stop = arcs.corners[ANGLE, k], arcs.corners[ANGLE, k + 1]
    return start + part * (stop - start) + (TURN if arc >= count else 0.0)
