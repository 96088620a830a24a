"""The output over a turn of the input, in pieces that are polynomials of degree five.

A polynomial has the output and its first two derivatives at both ends of a piece. Pieces are halved until the one of
a whole piece meets the output in its middle; both halves are kept, whose error is smaller by about 2^6.
"""

import math

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import TURN
from explore.mechanisms.targets.pose_errors.link import wrap

#: Ends of the first pieces, of which each may be halved.
N_ENDS = 49
#: Number of times that a piece may be halved.
_MOST_HALVINGS = 20
#: Largest number of pieces of a turn.
MOST_PIECES = 4096
#: Records that wait while pieces are halved, and two more.
STACK_SIZE = _MOST_HALVINGS + 3
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

# Numbers of the output at an angle: the angle, the place or angle of the output, both derivatives, and the difference
# that was found in the middle of the halved piece whose half ends there.
_AT, _PLACE, _FIRST_RATE, _SECOND_RATE, _MISSED = range(5)
RECORD_SIZE = 5


@subroutine()
def _record(output, shape, turns, angle, out, record):
    """Fill what the output is at an angle; `turns` tells whether it is a link, whose angle is within half a turn."""
    whole = angle == TURN  # the same numbers as at 0
    output(shape, 1.0 if whole else math.cos(angle), 0.0 if whole else math.sin(angle), out)
    record[_AT], record[_FIRST_RATE], record[_SECOND_RATE], record[_MISSED] = angle, out[2], out[3], 0.0
    record[_PLACE] = math.atan2(out[1], out[0]) if turns else out[0]


@subroutine()
def _copy(record, other):
    for k in range(RECORD_SIZE):
        other[k] = record[k]


@subroutine()
def _difference(turns, left, right):
    """What the output moves between two records; of a link within half a turn of what its rates say."""
    change = right[_PLACE] - left[_PLACE]
    if not turns:
        return change
    expected = 0.5 * (right[_AT] - left[_AT]) * (left[_FIRST_RATE] + right[_FIRST_RATE])
    return expected + wrap(change - expected)


@subroutine()
def _miss(turns, left, middle, right):
    """Difference of the polynomial of a whole piece from the output in its middle, or an eighth of that of the slopes.

    The former vanishes where the error is odd about the middle, the latter where it is even.
    """
    length, change = right[_AT] - left[_AT], _difference(turns, left, right)
    v, w = length * left[_FIRST_RATE], length * right[_FIRST_RATE]
    a, b = length * length * left[_SECOND_RATE], length * length * right[_SECOND_RATE]
    place = 0.5 * change + (5.0 / 32.0) * (v - w) + (a + b) / 64.0
    slope = 1.875 * change - 0.4375 * (v + w) + (b - a) / 32.0
    missed = abs(place - _difference(turns, left, middle))
    return max(missed, 0.125 * abs(slope - length * middle[_FIRST_RATE]))


@subroutine()
def _add(turns, left, right, place, piece):
    """Fill a piece whose output starts at a place, and give the place at its end."""
    length = right[_AT] - left[_AT]
    change = _difference(turns, left, right)
    v, w = length * left[_FIRST_RATE], length * right[_FIRST_RATE]
    a, b = length * length * left[_SECOND_RATE], length * length * right[_SECOND_RATE]
    rest, slope, bend = change - v - 0.5 * a, w - v - a, b - a
    piece[START], piece[LENGTH] = left[_AT], length
    piece[POWER], piece[POWER + 1], piece[POWER + 2] = place, v, 0.5 * a
    piece[POWER + 3] = 10.0 * rest - 4.0 * slope + 0.5 * bend
    piece[POWER + 4] = -15.0 * rest + 7.0 * slope - bend
    piece[POWER + 5] = 6.0 * rest - 3.0 * slope + 0.5 * bend
    return place + change


@subroutine()
def lay_pieces(output, shape, turns, pieces, ends, stack, out):
    """Fill `pieces` (MOST_PIECES, PIECE_SIZE); give their number, the bound of their errors and the place at the end.

    `ends` has the shape (N_ENDS, RECORD_SIZE), `stack` (STACK_SIZE, RECORD_SIZE), and `out` CURVE_SIZE
    numbers. The number of pieces is 0 where the output is not defined at an angle.
    """
    left, middle = stack[0], stack[1]
    _record(output, shape, turns, 0.0, out, ends[0])
    place = lowest = highest = ends[0, _PLACE]
    for k in range(1, N_ENDS):
        _record(output, shape, turns, TURN * k / (N_ENDS - 1), out, ends[k])
        place += _difference(turns, ends[k - 1], ends[k])
        lowest, highest = min(lowest, place), max(highest, place)
    size = max(abs(lowest), abs(highest))
    if not size < math.inf:
        return 0, math.nan, math.nan
    accepted, largest = max(_ACCEPTED * (highest - lowest), _ROUNDING * size), 0.0
    noise = max(_NOISE * (highest - lowest), accepted)
    place, count = ends[0, _PLACE], 0
    _copy(ends[0], left)
    for k in range(1, N_ENDS):
        top = 2
        _copy(ends[k], stack[top])
        while top >= 2:
            right = stack[top]
            _record(output, shape, turns, 0.5 * (left[_AT] + right[_AT]), out, middle)
            miss = _miss(turns, left, middle, right)
            if not miss < math.inf:
                return 0, math.nan, math.nan
            length = right[_AT] - left[_AT]
            falls = length > _LONG or miss < _FALL * right[_MISSED] or miss > noise
            # each record that waits, and the rest of the first pieces, takes two more
            has_room = top < STACK_SIZE - 1 and count + 2 * (top + N_ENDS - k) < MOST_PIECES
            if miss > accepted and falls and has_room:
                middle[_MISSED] = right[_MISSED] = max(miss, _ORDER * right[_MISSED])
                top += 1
                _copy(middle, stack[top])
                continue
            largest = max(largest, miss if miss > accepted else _OF_HALVES * miss)
            place = _add(turns, left, middle, place, pieces[count])
            place = _add(turns, middle, right, place, pieces[count + 1])
            _copy(right, left)
            count, top = count + 2, top - 1
    return count, largest + _ROUNDING * size, place


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
