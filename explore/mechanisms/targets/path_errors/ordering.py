"""Chords for points in order: the least sum of distances over nondecreasing chords within one turn.

Linear dynamic programming finds the best chords that begin in an interval of starts, if the end may lie up to a turn
beyond the last start. Where these are more than a turn apart, the interval is divided so that neither part allows them:
a branch and bound whose bounds are the sums that it looks for.
"""

import math

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import MANY_CHORDS, TURN

#: Largest number of waiting intervals: each division adds one, and an interval is divided less often than it is long.
MOST_WAITING = MANY_CHORDS + 2


@subroutine(no_alias=True)
def _sum_four(first, second, third, fourth, before, start, length, sums):
    """Fill four rows of sums from the row before: each the least up to its chord of its distance and the row's sum."""
    a, b, c, d = math.inf, math.inf, math.inf, math.inf
    for k in range(length):
        a = min(a, before[k] + first[start + k])
        b = min(b, a + second[start + k])
        c = min(c, b + third[start + k])
        d = min(d, c + fourth[start + k])
        sums[0, k], sums[1, k], sums[2, k], sums[3, k] = a, b, c, d


@subroutine(no_alias=True)
def _sum_one(row, before, start, length, sums):
    least = math.inf
    for k in range(length):
        least = min(least, before[k] + row[start + k])
        sums[k] = least


@subroutine()
def _find_chords(distances, count, order, first, last, sums, chords):
    """Fill the best chords of the points in an order, the first between two starts; return the sum.

    Row i + 1 of `sums` is of the points up to i in the order.
    """
    n, length = len(order), last - first + count
    for k in range(length):
        sums[0, k] = 0.0 if k < last - first else math.inf
    # the first point alone, because its chords are bounded
    _sum_one(distances[order[0]], sums[0], first, length, sums[1])
    i = 1
    while i + 4 <= n:
        _sum_four(
            distances[order[i]], distances[order[i + 1]], distances[order[i + 2]], distances[order[i + 3]], sums[i],
            first, length, sums[i + 1 : i + 5],
        )  # fmt: skip
        i += 4
    while i < n:
        _sum_one(distances[order[i]], sums[i], first, length, sums[i + 1])
        i += 1
    k = length - 1
    for i in range(n - 1, -1, -1):
        while k > 0 and sums[i + 1, k - 1] == sums[i + 1, k]:
            k -= 1
        chords[i] = first + k
    return sums[n, length - 1]


@subroutine()
def search_order(distances, count, order, limit, sums, waiting, chords, best_chords):
    """Fill the best chords of the points in an order, and return their sum; infinity if it is not below a limit.

    `distances` (n, 2 count) are those of the points to the chords of two turns; `sums`, `waiting` and `chords` are room
    for n + 1 rows of 2 count sums, for MOST_WAITING intervals, and for n chords.
    """
    n, best, found = len(order), limit, math.inf
    waiting[0, 0], waiting[0, 1], left = 0, count, 1
    while left > 0:
        left -= 1
        first, last = waiting[left, 0], waiting[left, 1]
        total = _find_chords(distances, count, order, first, last, sums, chords)
        if total >= best:
            continue
        excess = chords[n - 1] - chords[0] - count
        if excess <= 0:
            best, found = total, total
            for i in range(n):
                best_chords[i] = chords[i]
        else:
            # starts up to the first chord cannot reach the last one, later starts are not the first chord
            middle = chords[0] + 1 + (excess - 1) // 2
            waiting[left, 0], waiting[left, 1] = middle, last
            waiting[left + 1, 0], waiting[left + 1, 1] = first, middle
            left += 2
    return found


@subroutine()
def follows_forwards(distances, count):
    """Whether the nearest chords of the points follow each other rather in the sense of the crank."""
    balance, before = 0, 0
    # the last point, for the step to the first one, then all
    for i in range(-1, len(distances)):
        row, nearest = distances[i], 0
        for k in range(1, count):
            if row[k] < row[nearest]:
                nearest = k
        if i >= 0:
            step = (nearest - before) % count
            balance += (1 if 2 * step < count else -1) if step > 0 else 0
        before = nearest
    return balance >= 0


@subroutine()
def choose_order(distances, count, first, second, sums, waiting, chords, order):
    """Fill the better of two orders and, in the first row, its chords; return its sum, and whether it is first."""
    total = search_order(distances, count, first, math.inf, sums, waiting, chords[0], chords[1])
    other = search_order(distances, count, second, total, sums, waiting, chords[0], chords[2])
    is_first = total <= other
    for i in range(len(order)):
        order[i] = first[i] if is_first else second[i]
        chords[0, i] = chords[1, i] if is_first else chords[2, i]
    return min(total, other), is_first


@subroutine()
def ascend_from(leader, order, angles, own):
    """Fill the angles of points by number, ascending from the point that an order, perhaps rotated, began with."""
    n, begin = len(order), 0
    while order[begin] != leader:
        begin += 1
    for i in range(n):
        place = begin + i
        own[order[place % n]] = angles[place] if place < n else angles[place - n] + TURN
