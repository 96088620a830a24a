"""Chords or arcs for points in order: the least sum of distances over nondecreasing ones within one turn.

Linear dynamic programming finds the best chords that begin in an interval of starts, if the end may lie up to a turn
beyond the last start. Where these are more than a turn apart, the interval is divided so that neither part allows them:
a branch and bound whose bounds are the sums that it looks for.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import TURN
from explore.mechanisms.targets.path_errors.rows import (
    LANES,
    LANES_OF_TURN,
    chord_at,
    fill_sums,
    least_of,
    make_rows,
    place_in_two,
)
from explore.model.quantities import FloatArray

IntArray = npt.NDArray[np.int64]

#: Number of points whose nearest chords tell the likely sense.
_ENOUGH = 64
#: Margin of bounds for the rounding of sums, relative.
_MARGIN = 1e-9


class Search(NamedTuple):
    """Arrays for the search of the order of n points: `distances` are those to the chords of a turn, see `rows`.

    Row i + 1 of `sums` and `entering` is of the points up to i in the order; the first row of `chords` receives the
    best chords of the points in the `order` found.
    """

    distances: FloatArray
    least: FloatArray
    sums: FloatArray
    entering: FloatArray
    waiting: IntArray
    trial: IntArray
    chords: IntArray
    forwards: IntArray
    backwards: IntArray
    order: IntArray


@subroutine(allocates=True)
def make_search(n, most):
    """Room for n points and at most so many chords of a turn."""
    # each division adds an interval, and an interval is divided less often than it is long
    return Search(
        make_rows(n, most), np.empty(n), make_rows(n + 1, 2 * most), make_rows(n + 1, LANES),
        np.empty((most + 2, 2), np.int64), np.empty(n, np.int64), np.empty(n, np.int64), np.arange(n),
        np.arange(n)[::-1].copy(), np.empty(n, np.int64),
    )  # fmt: skip


@subroutine()
def _fill_starts(parts, first, last, sums):
    """Fill the sums before the first point: 0 for the chords that it may be on."""
    for j in range(parts):
        for lane in range(LANES):
            k = lane * parts + j
            sums[j * LANES + lane] = 0.0 if first <= k < last else math.inf


@subroutine()
def _sum_up_to(chord, parts, sums, entering):
    """The least sum up to a chord of two turns."""
    lane = chord // parts
    return min(sums[(chord - lane * parts) * LANES + lane], entering[lane])


@subroutine()
def _trace(parts, first, end, n, search, chords):
    """Fill the chords of the points whose sum is that up to the end, each the first with its sum.

    Sums up to a chord do not ascend with it: the first is looked for in steps that double, then halve.
    """
    k = end
    for i in range(n, 0, -1):
        sums, entering = search.sums[i], search.entering[i]
        own, step = _sum_up_to(k, parts, sums, entering), 1
        while k - step >= first and _sum_up_to(k - step, parts, sums, entering) == own:
            k, step = k - step, 2 * step
        while step > 1:
            step //= 2
            if k - step >= first and _sum_up_to(k - step, parts, sums, entering) == own:
                k -= step
        chords[i - 1] = k


@subroutine()
def _find_chords(count, order, first, last, limit, search, chords):
    """Fill the best chords of the points in an order, the first between two starts; return the sum.

    It is infinity where the points so far and the least distances of the others show that it is not below the limit.
    """
    n, parts, end = len(order), count // LANES_OF_TURN, last - 1 + count
    sums, entering = search.sums, search.entering
    _fill_starts(parts, first, last, sums[0])
    entering[0, :] = math.inf
    place, lane, rest, total = place_in_two(end, parts), end // parts, 0.0, 0.0
    for i in range(n):
        rest += search.least[i]
    for i in range(n):
        point = order[i]
        fill_sums(search.distances[point], sums[i], entering[i], parts, sums[i + 1], entering[i + 1])
        rest -= search.least[point]
        total = min(sums[i + 1, place], entering[i + 1, lane])
        if (total + rest) * (1.0 - _MARGIN) >= limit:
            return math.inf
    _trace(parts, first, end, n, search, chords)
    return total


@subroutine()
def search_order(count, order, limit, search):
    """Fill the best chords of the points in an order, and return their sum; infinity if it is not below a limit."""
    n, best, found, chords, waiting = len(order), limit, math.inf, search.trial, search.waiting
    waiting[0, 0], waiting[0, 1], left = 0, count, 1
    while left > 0:
        left -= 1
        first, last = waiting[left, 0], waiting[left, 1]
        total = _find_chords(count, order, first, last, best, search, chords)
        if total >= best:
            continue
        excess = chords[n - 1] - chords[0] - count
        if excess <= 0:
            best, found = total, total
            for i in range(n):
                search.chords[i] = chords[i]
        else:
            # starts up to the first chord cannot reach the last one, later starts are not the first chord
            middle = chords[0] + 1 + (excess - 1) // 2
            waiting[left, 0], waiting[left, 1] = middle, last
            waiting[left + 1, 0], waiting[left + 1, 1] = first, middle
            left += 2
    return found


@subroutine()
def nearest_chord(row, parts):
    """The chord of the least number of the row of a turn."""
    least = least_of(row, parts)
    for place in range(parts * LANES_OF_TURN):
        if row[place] == least:
            return chord_at(place, parts)
    return 0


@subroutine()
def follows_forwards(count, search):
    """Whether the nearest chords of the points follow each other rather in the sense of the crank.

    Of very many points some are enough.
    """
    n, parts, balance, before = len(search.least), count // LANES_OF_TURN, 0, 0
    stride = 1 + n // _ENOUGH
    # the last point, for the step to the first one, then all
    for i in range(-1, n, stride):
        nearest = nearest_chord(search.distances[i], parts)
        if i >= 0:
            step = (nearest - before) % count
            balance += (1 if 2 * step < count else -1) if step > 0 else 0
        before = nearest
    return balance >= 0


@subroutine()
def fill_least(count, search):
    """Fill the least distance of each point."""
    for i in range(len(search.least)):
        search.least[i] = least_of(search.distances[i], count // LANES_OF_TURN)


@subroutine()
def choose_order(count, limit, search):
    """Fill the better order of points, and its chords, of so many of a turn; return its sum.

    It is infinity if it is not below a limit. The likely sense comes first, because the search in the other one ends
    where it cannot be better.
    """
    fill_least(count, search)
    is_forwards = follows_forwards(count, search)
    first, second = (search.forwards, search.backwards) if is_forwards else (search.backwards, search.forwards)
    total = search_order(count, first, limit, search)
    other = search_order(count, second, min(total, limit), search)
    for i in range(len(search.order)):
        search.order[i] = second[i] if other < total else first[i]
    return min(total, other)


@subroutine()
def ascend_from(leader, order, angles, own):
    """Fill the angles of points by number, ascending from the point that an order, perhaps rotated, began with."""
    n, begin = len(order), 0
    while order[begin] != leader:
        begin += 1
    for i in range(n):
        place = begin + i
        own[order[place % n]] = angles[place] if place < n else angles[place - n] + TURN
