"""Crank angles of points in order: the least sum of squared distances to the exact curve near given angles.

Points that share an angle are a block, whose sum depends on the angle as that of their mean does. Each block is moved
by Newton's method; blocks that meet are joined, and a block that its points pull apart is divided, until none of
this happens (pooling of adjacent violators, for functions that are convex near their least value). The order is cyclic:
the last angle is at most a turn beyond the first.
"""

import math

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import FEW_CHORDS, TURN

#: Largest number of Newton's steps of a block.
_MOST_STEPS = 40
#: Largest number of rounds of moving, joining and dividing.
_MOST_ROUNDS = 60
#: Longest step that is the last, because the next would be of the size of its square, rad.
_SHORT = 1e-8
#: Least pull by which a block is divided, relative to the pulls of all its points.
_PULL = 1e-9
#: Longest step of a block, rad.
_STEP = TURN / FEW_CHORDS

_TINY = 1e-300


@subroutine()
def _excess(curve, shape, angle, weight, x, y, out):
    """What a block adds to its sum by not being at its mean (x, y); `out` receives the curve."""
    curve(shape, math.cos(angle), math.sin(angle), out)
    dx, dy = out[0] - x, out[1] - y
    return weight * (dx * dx + dy * dy)


@subroutine()
def _move(curve, shape, angle, weight, x, y, out):
    """The angle near a given one that is best for a block of this weight and mean."""
    cost = _excess(curve, shape, angle, weight, x, y, out)
    for _ in range(_MOST_STEPS):
        dx, dy = out[0] - x, out[1] - y
        slope = dx * out[2] + dy * out[3]
        square = out[2] * out[2] + out[3] * out[3] + _TINY
        bend = square + dx * out[4] + dy * out[5]
        step = -slope / (bend if bend > 0.1 * square else square)
        step = min(max(step, -_STEP), _STEP)
        found = _excess(curve, shape, angle + step, weight, x, y, out)
        while found > cost and abs(step) > _SHORT:
            step *= 0.25
            found = _excess(curve, shape, angle + step, weight, x, y, out)
        if found > cost:
            break  # rounding
        angle, cost = angle + step, found
        if abs(step) <= _SHORT:
            break
    return angle


@subroutine()
def _fill_mean(order, points, weights, first, stop, sums):
    """Fill the weight of a block of points and their mean."""
    weight, x, y = 0.0, 0.0, 0.0
    for i in range(first, stop):
        w = weights[order[i]]
        weight, x, y = weight + w, x + w * points[order[i], 0], y + w * points[order[i], 1]
    sums[0], sums[1], sums[2] = weight, x / weight, y / weight


@subroutine()
def rotate(order, angles, count, spare_order, spare_angles):
    """Move the last `count` points to the front of the order, a turn back."""
    n = len(order)
    for i in range(n):
        spare_order[i], spare_angles[i] = order[i], angles[i]
    for i in range(n):
        k = i - count
        order[i] = spare_order[k]
        angles[i] = spare_angles[k] - (TURN if k < 0 else 0.0)


@subroutine()
def _bring_in_order(order, weights, angles, starts):
    """Join neighbours that are out of order at their mean angle; fill the first points of blocks, return their count.

    Points of equal angles are one block.
    """
    n, m = len(order), 0
    for i in range(n):
        starts[m] = i
        m += 1
        while m > 1 and angles[starts[m - 2]] >= angles[starts[m - 1]]:
            left, right, stop = starts[m - 2], starts[m - 1], i + 1
            own, other = 0.0, 0.0
            for k in range(left, right):
                own += weights[order[k]]
            for k in range(right, stop):
                other += weights[order[k]]
            mean = (own * angles[left] + other * angles[right]) / (own + other)
            for k in range(left, stop):
                angles[k] = mean
            m -= 1
    starts[m] = n
    return m


@subroutine()
def _divide(curve, shape, order, points, weights, angles, starts, m, out):
    """Part the blocks that their points pull apart, by a little; return whether there is one."""
    is_divided = False
    for block in range(m):
        first, stop = starts[block], starts[block + 1]
        if stop - first < 2:
            continue
        angle = angles[first]
        curve(shape, math.cos(angle), math.sin(angle), out)
        pull, size, largest, place = 0.0, _TINY, 0.0, 0
        for i in range(first, stop):
            p, w = order[i], weights[order[i]]
            own = w * ((out[0] - points[p, 0]) * out[2] + (out[1] - points[p, 1]) * out[3])
            pull, size = pull + own, size + abs(own)
            if i < stop - 1 and pull > largest:
                largest, place = pull, i + 1
        if largest > _PULL * size:
            is_divided = True
            # so little that all other angles stay where they are
            for i in range(first, place):
                angles[i] = angle - _SHORT * _STEP
            for i in range(place, stop):
                angles[i] = angle + _SHORT * _STEP
    return is_divided


@subroutine()
def polish(curve, shape, points, weights, order, angles, starts, spare_order, spare_angles, sums, out):
    """Improve the `angles` (n,), rad, of points in an `order` (n,), both in place; the order may be rotated.

    The points (n, 2) have weights (n,). `starts`, `spare_order`, `spare_angles`, `sums` and `out` are room for n + 1
    and n integers, n and 3 numbers, and what the curve fills.
    """
    n = len(order)
    for _ in range(_MOST_ROUNDS):
        m = _bring_in_order(order, weights, angles, starts)
        is_changed = False
        while m > 1 and angles[n - 1] >= angles[0] + TURN:  # the ends meet
            rotate(order, angles, n - starts[m - 1], spare_order, spare_angles)
            m = _bring_in_order(order, weights, angles, starts)
        for block in range(m):
            first, stop = starts[block], starts[block + 1]
            _fill_mean(order, points, weights, first, stop, sums)
            angle = _move(curve, shape, angles[first], sums[0], sums[1], sums[2], out)
            for i in range(first, stop):
                angles[i] = angle
        for block in range(1, m):
            is_changed |= angles[starts[block]] < angles[starts[block - 1]]
        is_changed |= angles[n - 1] > angles[0] + TURN
        if not is_changed and not _divide(curve, shape, order, points, weights, angles, starts, m, out):
            break
    _bring_in_order(order, weights, angles, starts)
