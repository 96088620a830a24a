"""The output over a turn of the input, in pieces that are polynomials of degree five.

A polynomial has the output and its first two derivatives at both ends of a piece. Pieces are halved until the one of
a whole piece meets the output in its middle; both halves are kept, whose error is smaller by about 2^6. The middles of
all pieces that are left are computed at once.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import cosine, sine
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE_SIZE, TURN, take_row
from explore.mechanisms.targets.pose_errors.link import wrap

#: Number of the first pieces.
_FEW = 48
#: Number of times that a piece may be halved.
_MOST_HALVINGS = 20
#: Largest number of pieces of a turn.
MOST_PIECES = 4096
#: Number of angles at once, of whole rows.
_BATCH = 128
#: Accepted difference in the middle of a piece, over the travel of the output.
_ACCEPTED = 3e-12
#: Difference over the travel below which one that hardly falls as a piece is halved is rounding.
_NOISE = 1e-9
#: Length of pieces, rad, above which a difference is no rounding: it may have been small by chance before.
_LONG = TURN / 384
#: Part of itself that a difference falls to where a piece is halved, by the order of the polynomials.
_ORDER = 2.0**-6
#: Part of itself that a difference falls to, at least, while it is not rounding.
_FALL = 0.25
#: Largest error of halves over the difference of the whole: 2^-6, and where that is small by chance up to a quarter.
_OF_HALVES = 0.5
#: Rounding of the output, over its size.
_ROUNDING = 4e-16

# Columns of pieces: where one starts, its length, and the six coefficients of powers of the part that is passed.
START, LENGTH, POWER = range(3)
PIECE_SIZE = 8

# Rows of ends of pieces: the angle, the place or angle of the output, both derivatives, and the difference that was
# found in the middle of the halved piece whose half starts there.
_AT, _PLACE, _FIRST_RATE, _SECOND_RATE, _MISSED = range(5)


class Ends(NamedTuple):
    """Ends of pieces: their numbers (5, n), the next one of each, and those at which pieces start that are left (2, n).

    `rays` (2, n) are cosines and sines of angles, `rows` and `shapes` room for the output there.
    """

    numbers: npt.NDArray[np.float64]
    following: npt.NDArray[np.int64]
    left: npt.NDArray[np.int64]
    rays: npt.NDArray[np.float64]
    rows: npt.NDArray[np.float64]
    shapes: npt.NDArray[np.float64]


@subroutine(allocates=True)
def make_ends(size):
    """Room for the ends of pieces of one design, whose output has a shape of so many numbers."""
    most = MOST_PIECES + _BATCH
    return Ends(
        np.zeros((5, most)), np.empty(most, np.int64), np.empty((2, most), np.int64), np.empty((2, _BATCH)),
        np.empty(CURVE_SIZE * _BATCH), np.empty(size * LANES),
    )  # fmt: skip


@subroutine(no_alias=True)
def _fill_rays(angles, cosines, sines):
    for lane in range(len(angles)):
        cosines[lane], sines[lane] = cosine(angles[lane]), sine(angles[lane])


@subroutine(no_alias=True)
def _turn_into_angles(sines, cosines):
    """Fill the angles of directions in place of their cosines."""
    for lane in range(len(cosines)):
        cosines[lane] = arctangent(sines[lane], cosines[lane])


@subroutine()
def _fill_numbers(output, turns, first, count, ends):
    """Fill what the output is at so many ends from a first one on, whose angles are known.

    `turns` tells whether it is a link, whose angle is within half a turn.
    """
    numbers, rays = ends.numbers, ends.rays
    for start in range(first, first + count, _BATCH):
        size = (min(first + count - start, _BATCH) + LANES - 1) // LANES * LANES
        stop = start + size
        _fill_rays(numbers[_AT, start:stop], rays[0, :size], rays[1, :size])
        output(ends.shapes, rays[0], rays[1], size // LANES, ends.rows)
        take_row(ends.rows, 0, numbers[_PLACE, start:stop])
        take_row(ends.rows, 2, numbers[_FIRST_RATE, start:stop])
        take_row(ends.rows, 3, numbers[_SECOND_RATE, start:stop])
        if turns:
            take_row(ends.rows, 1, rays[1, :size])
            _turn_into_angles(rays[1, :size], numbers[_PLACE, start:stop])


@subroutine()
def _difference(turns, ends, left, right):
    """What the output moves between two ends; of a link within half a turn of what its rates say."""
    change = ends[_PLACE, right] - ends[_PLACE, left]
    if not turns:
        return change
    expected = 0.5 * (ends[_AT, right] - ends[_AT, left]) * (ends[_FIRST_RATE, left] + ends[_FIRST_RATE, right])
    return expected + wrap(change - expected)


@subroutine()
def _miss(turns, ends, left, middle, right):
    """Difference of the polynomial of a whole piece from the output in its middle, or an eighth of that of the slopes.

    The former vanishes where the error is odd about the middle, the latter where it is even.
    """
    length, change = ends[_AT, right] - ends[_AT, left], _difference(turns, ends, left, right)
    v, w = length * ends[_FIRST_RATE, left], length * ends[_FIRST_RATE, right]
    a, b = length * length * ends[_SECOND_RATE, left], length * length * ends[_SECOND_RATE, right]
    place = 0.5 * change + (5.0 / 32.0) * (v - w) + (a + b) / 64.0
    slope = 1.875 * change - 0.4375 * (v + w) + (b - a) / 32.0
    missed = abs(place - _difference(turns, ends, left, middle))
    return max(missed, 0.125 * abs(slope - length * ends[_FIRST_RATE, middle]))


@subroutine()
def _add(turns, ends, left, right, place, piece):
    """Fill a piece whose output starts at a place, and give the place at its end."""
    length = ends[_AT, right] - ends[_AT, left]
    change = _difference(turns, ends, left, right)
    v, w = length * ends[_FIRST_RATE, left], length * ends[_FIRST_RATE, right]
    a, b = length * length * ends[_SECOND_RATE, left], length * length * ends[_SECOND_RATE, right]
    rest, slope, bend = change - v - 0.5 * a, w - v - a, b - a
    piece[START], piece[LENGTH] = ends[_AT, left], length
    piece[POWER], piece[POWER + 1], piece[POWER + 2] = place, v, 0.5 * a
    piece[POWER + 3] = 10.0 * rest - 4.0 * slope + 0.5 * bend
    piece[POWER + 4] = -15.0 * rest + 7.0 * slope - bend
    piece[POWER + 5] = 6.0 * rest - 3.0 * slope + 0.5 * bend
    return place + change


@subroutine()
def lay_pieces(output, shape, turns, ends, pieces):
    """Fill `pieces` (MOST_PIECES, PIECE_SIZE); give their number, the bound of their errors and the place at the end.

    The number of pieces is 0 where the output is not defined at an angle.
    """
    numbers, following = ends.numbers, ends.following
    for k in range(len(shape)):
        for lane in range(LANES):
            ends.shapes[k * LANES + lane] = shape[k]
    low, high, size = _lay_few(output, turns, ends)
    if not size < math.inf:
        return 0, math.nan, math.nan
    accepted = max(_ACCEPTED * (high - low), _ROUNDING * size)
    largest = _halve_pieces(output, turns, accepted, max(_NOISE * (high - low), accepted), ends)
    if not largest < math.inf:
        return 0, math.nan, math.nan
    place, count, left = numbers[_PLACE, 0], 0, 0
    while left != _FEW:
        place = _add(turns, numbers, left, following[left], place, pieces[count])
        left, count = following[left], count + 1
    return count, largest + _ROUNDING * size, place


@subroutine()
def _lay_few(output, turns, ends):
    """Lay the first pieces; the least and the greatest place of their ends, and the largest size of a place."""
    numbers = ends.numbers
    for k in range(_FEW):
        numbers[_AT, k], numbers[_MISSED, k], ends.following[k] = k * (TURN / _FEW), 0.0, k + 1
    _fill_numbers(output, turns, 0, _FEW, ends)
    for row in range(5):
        numbers[row, _FEW] = numbers[row, 0]
    numbers[_AT, _FEW] = TURN
    place = low = high = numbers[_PLACE, 0]
    for k in range(_FEW):
        place += _difference(turns, numbers, k, k + 1)
        low, high = min(low, place), max(high, place)
    return low, high, max(abs(low), abs(high)) if place - place == 0.0 else math.inf


@subroutine()
def _halve_pieces(output, turns, accepted, noise, ends):
    """Halve the first pieces until all are accepted; the bound of their errors, infinite if the output is not defined.

    Pieces are accepted, too, where a difference is rounding, and where there is no room for more.
    """
    numbers, following = ends.numbers, ends.following
    waiting, later, largest, count, n = ends.left[0], ends.left[1], 0.0, _FEW + 1, _FEW
    for k in range(n):
        waiting[k] = k
    for number in range(_MOST_HALVINGS + 1):
        for k in range(n):
            numbers[_AT, count + k] = 0.5 * (numbers[_AT, waiting[k]] + numbers[_AT, following[waiting[k]]])
        _fill_numbers(output, turns, count, n, ends)
        more = 0
        for k in range(n):
            left, middle, right = waiting[k], count + k, following[waiting[k]]
            miss, before = _miss(turns, numbers, left, middle, right), numbers[_MISSED, left]
            if not miss < math.inf:
                return math.inf
            following[left], following[middle] = middle, right
            falls = numbers[_AT, right] - numbers[_AT, left] > _LONG or miss < _FALL * before or miss > noise
            has_room = number < _MOST_HALVINGS and count + n + more + 2 <= MOST_PIECES
            if miss > accepted and falls and has_room:
                numbers[_MISSED, left] = numbers[_MISSED, middle] = max(miss, _ORDER * before)
                later[more], later[more + 1], more = left, middle, more + 2
            else:
                largest = max(largest, miss if miss > accepted else _OF_HALVES * miss)
        waiting, later, count, n = later, waiting, count + n, more
        if n == 0:
            break
    return largest


@subroutine()
def polynomial(piece, u):
    """The output where a part u of a piece is passed."""
    value = piece[POWER + 5]
    for power in range(4, -1, -1):
        value = value * u + piece[POWER + power]
    return value


@subroutine()
def note_cells(pieces, count, cells):
    """Fill the number of the piece in which each of equal parts of a turn starts, and at the end that of the last."""
    piece = 0
    for cell in range(len(cells) - 1):
        while piece + 1 < count and pieces[piece + 1, START] <= TURN * cell / (len(cells) - 1):
            piece += 1
        cells[cell] = piece
    cells[len(cells) - 1] = count - 1


@subroutine()
def value_at(pieces, cells, drift, angle):
    """The output at an angle, which moves by `drift` in each turn."""
    turn = math.floor(angle / TURN)
    angle -= TURN * turn
    cell = min(int(angle * ((len(cells) - 1) / TURN)), len(cells) - 2)
    low, high = cells[cell], cells[cell + 1]
    while low < high and pieces[low + 1, START] <= angle:
        low += 1
    return polynomial(pieces[low], (angle - pieces[low, START]) / pieces[low, LENGTH]) + drift * turn
