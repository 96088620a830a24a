"""Chords that the motion of a link consists of, more where it is curved, and the distances of poses to them."""

import math
from typing import NamedTuple

import numpy as np

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE_SIZE, TURN, fill_rows, take_row
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN, divide, place_of
from explore.mechanisms.targets.pose_errors.link import (
    ANGLE,
    ANGLE_1,
    LINK_SIZE,
    X_1,
    Y_1,
    X,
    Y,
    fill_link,
    wrap,
)
from explore.model.quantities import FloatArray

#: Number of chords of a motion at first.
FEW_CHORDS = 256
#: Largest number of chords of a motion.
MOST_CHORDS = 512
#: Crank angle of a chord at first, rad.
_STEP = TURN / FEW_CHORDS
#: Distance of a chord's end from the tangent at its start, over the length of all chords, above which it is divided.
_CURVED = 2e-3
#: Largest number of times that chords are divided.
_MOST_DIVISIONS = 8

# Rows of chords: their starts (mm, mm, rad), and how far they go along each (mm), by the angle at the end of the lever.
START_X, START_Y, START_ANGLE, ALONG_X, ALONG_Y, ALONG_ANGLE = range(6)
# Rows of corners: the crank angle over that of a chord at first, the pose of the link, and its derivatives.
_PART, _X, _Y, _ANGLE, _X_1, _Y_1, _ANGLE_1 = range(7)

_TINY = 1e-300


class Chords(NamedTuple):
    """Arrays of the chords of a motion: `corners` (7, n + 1) in their order, `laid` (6, n) at their places in a row.

    `rays` (2, FEW_CHORDS) are cosines and sines of equal angles. `bends` (n,) are squared distances of ends of chords
    from tangents. `spare` is room for corners, `out` for the curve, `link` for the pose of the link; `rows` and
    `shapes` for the curve at the rays.
    """

    rays: FloatArray
    corners: FloatArray
    laid: FloatArray
    bends: FloatArray
    spare: FloatArray
    out: FloatArray
    link: FloatArray
    rows: FloatArray
    shapes: FloatArray


@subroutine(allocates=True)
def make_chords(shape_size):
    """Room for chords."""
    angles, size = np.arange(FEW_CHORDS) * _STEP, MOST_CHORDS + 1
    return Chords(
        np.stack((np.cos(angles), np.sin(angles))), np.empty((7, size)), np.empty((6, size)), np.empty(size),
        np.empty((7, size)), np.empty(CURVE_SIZE), np.empty(LINK_SIZE), np.empty(FEW_CHORDS * CURVE_SIZE),
        np.empty(shape_size * LANES),
    )  # fmt: skip


@subroutine()
def _fill_corner(part, link, corners, k):
    """Fill a corner from the pose of the link."""
    corners[_PART, k] = part
    corners[_X, k], corners[_Y, k], corners[_ANGLE, k] = link[X], link[Y], link[ANGLE]
    corners[_X_1, k], corners[_Y_1, k], corners[_ANGLE_1, k] = link[X_1], link[Y_1], link[ANGLE_1]


@subroutine(no_alias=True)
def _fill_angles(rows, angles, rates):
    """Fill angles of the link and their derivatives from rows of the curve."""
    for lane in range(len(angles)):
        ux, uy = rows[6 * LANES + lane], rows[7 * LANES + lane]
        angles[lane] = arctangent(uy, ux)
        rates[lane] = ux * rows[9 * LANES + lane] - uy * rows[8 * LANES + lane]  # u = exp(i phi), so phi' = u x u'


@subroutine(fast=True, no_alias=True)
def _measure(corners, count, lever, along_x, along_y, along_angle, bends):
    """Fill how far so many chords go along each coordinate, and their bends; return their length."""
    length = 0.0
    for k in range(count):
        step = (corners[_PART, k + 1] - corners[_PART, k]) * _STEP
        x, y = corners[_X, k + 1] - corners[_X, k], corners[_Y, k + 1] - corners[_Y, k]
        angle = lever * wrap(corners[_ANGLE, k + 1] - corners[_ANGLE, k])
        along_x[k], along_y[k], along_angle[k] = x, y, angle
        length += math.sqrt(x * x + y * y + angle * angle)
        bend = _bend(corners, k, step, lever, x, y, angle)
        other = _bend(corners, k + 1, step, lever, x, y, angle)
        bends[k] = bend if bend > other else other
    return length


@subroutine(fast=True, inlined=True)
def _bend(corners, end, step, lever, x, y, angle):
    """The squared distance of the end of a chord from the tangent at one of its ends."""
    dx, dy = step * corners[_X_1, end] - x, step * corners[_Y_1, end] - y
    turned = step * lever * corners[_ANGLE_1, end] - angle
    return dx * dx + dy * dy + turned * turned


@subroutine()
def _lay(count, lever, chords):
    """Fill so many chords from their corners, each at its place in a row, and their bends; return their length."""
    corners, laid, spare = chords.corners, chords.laid, chords.spare
    length, parts = _measure(corners, count, lever, spare[0], spare[1], spare[2], chords.bends), count // LANES_OF_TURN
    for lane in range(LANES_OF_TURN):
        for part in range(parts):
            k, place = lane * parts + part, part * LANES_OF_TURN + lane
            for row, corner in ((START_X, _X), (START_Y, _Y), (START_ANGLE, _ANGLE)):
                laid[row, place], laid[ALONG_X + row - START_X, place] = corners[corner, k], spare[row - START_X, k]
    return length


@subroutine()
def fill_chords(curve, rows_of_curve, shape, lever, chords):
    """Fill chords of equal turns of the crank, divided where they are far from the motion; return their number."""
    corners = chords.corners
    fill_rows(rows_of_curve, shape, chords.rays, chords.shapes, chords.rows)
    for first in range(0, FEW_CHORDS, LANES):
        stop = first + LANES
        _fill_angles(chords.rows[first * CURVE_SIZE :], corners[_ANGLE, first:stop], corners[_ANGLE_1, first:stop])
    for row, number in ((_X, 0), (_Y, 1), (_X_1, 2), (_Y_1, 3)):
        take_row(chords.rows, number, corners[row, :FEW_CHORDS])
    for row in range(7):
        corners[row, FEW_CHORDS] = corners[row, 0]
    for k in range(FEW_CHORDS + 1):
        corners[_PART, k] = k
    count, length = FEW_CHORDS, _lay(FEW_CHORDS, lever, chords)
    for _ in range(_MOST_DIVISIONS):
        more = _divide(curve, shape, count, (_CURVED * length) ** 2, chords)
        if more == 0:
            break
        count, length = more, _lay(more, lever, chords)
    return count


@subroutine()
def _divide(curve, shape, count, limit, chords):
    """Divide the chords whose bend is above a limit; return the number of all, or 0 if none is or there is no room."""
    corners, total = chords.corners, divide(chords.corners, chords.spare, chords.bends, count, limit, MOST_CHORDS)
    for k in range(total):
        if corners[_X, k] == math.inf:
            fill_link(curve, shape, corners[_PART, k] * _STEP, chords.out, chords.link)
            _fill_corner(corners[_PART, k], chords.link, corners, k)
    return total


@subroutine(fast=True)
def _find_part(x, y, angle, lever, laid, k):
    """Where on the chord at a place the link is nearest to a pose, from 0 to 1, and the squared distance there."""
    ex, ey, et = x - laid[START_X, k], y - laid[START_Y, k], lever * wrap(angle - laid[START_ANGLE, k])
    tx, ty, tt = laid[ALONG_X, k], laid[ALONG_Y, k], laid[ALONG_ANGLE, k]
    part = (ex * tx + ey * ty + et * tt) / (tx * tx + ty * ty + tt * tt + _TINY)
    part = min(max(part, 0.0), 1.0)
    dx, dy, dt = ex - part * tx, ey - part * ty, et - part * tt
    return part, dx * dx + dy * dy + dt * dt


@subroutine(fast=True, no_alias=True)
def _fill_row(x, y, angle, lever, laid, count, row):
    for k in range(count):
        row[k] = _find_part(x, y, angle, lever, laid, k)[1]


@subroutine()
def fill_distances(poses, lever, chords, count, distances):
    """Fill the squared distances of poses, (n, 3), to so many chords."""
    for i in range(len(poses)):
        _fill_row(poses[i, 0], poses[i, 1], poses[i, 2], lever, chords.laid, count, distances[i])


@subroutine()
def fill_distances_of_starts(poses, lever, chords, count, distances):
    """Fill the squared distances of poses to the starts of so many chords; none is below that to the chord."""
    laid = chords.laid
    for i in range(len(poses)):
        for k in range(count):
            dx, dy = poses[i, 0] - laid[START_X, k], poses[i, 1] - laid[START_Y, k]
            turned = lever * wrap(poses[i, 2] - laid[START_ANGLE, k])
            distances[i, k] = dx * dx + dy * dy + turned * turned


@subroutine()
def angle_of_start(chords, count, chord):
    """The crank angle at which a chord starts, of this turn or the next."""
    return (chords.corners[_PART, chord % count] + FEW_CHORDS * (chord // count)) * _STEP


@subroutine()
def angle_on_chord(pose, lever, chords, count, chord):
    """The crank angle of the place on a chord, of this turn or the next, that is nearest to a pose."""
    k, corners = chord % count, chords.corners
    part, _ = _find_part(pose[0], pose[1], pose[2], lever, chords.laid, place_of(k, count // LANES_OF_TURN))
    width = corners[_PART, k + 1] - corners[_PART, k]
    return (corners[_PART, k] + FEW_CHORDS * (chord // count) + part * width) * _STEP
