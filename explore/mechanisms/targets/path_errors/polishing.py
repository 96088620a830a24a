"""Crank angles of points in order: the least sum of squared distances to the exact curve near given angles.

Points that share an angle are a block, whose sum depends on the angle as that of their mean does. One block after
another is moved by Newton's method and joined with those before that it does not pass, as in isotonic regression
(pooling of adjacent violators, for functions that are convex near their least value). A block that its points pull
apart is divided, until there is none. The order is cyclic: the last angle is at most a turn beyond the first.
"""

import math
from typing import NamedTuple

import numpy as np

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE_SIZE, LEAST_BEND, SURE_STEP, TURN
from explore.mechanisms.targets.path_errors.ordering import IntArray
from explore.model.quantities import FloatArray

#: Largest number of Newton's steps of a block.
_MOST_STEPS = 40
#: Largest number of rounds of moving, joining and dividing.
_MOST_ROUNDS = 60
#: Longest step that is the last, because the next would be of the size of its square, rad.
_SHORT = 1e-8
#: Least pull by which a block is divided, relative to the pulls of all its points.
_PULL = 1e-9
#: Longest step of a block, rad.
_STEP = TURN / 128

# Rows of `Room.settled`: ends of the blocks that are at their best angle, and of those that their points do not divide.
MOVED, WHOLE = range(2)

_TINY = 1e-300


class Room(NamedTuple):
    """Arrays that `polish` works in: of blocks their first points and sums of weights, a copy of the order, a mean, and
    the curve.
    """

    starts: IntArray
    sums: FloatArray
    settled: IntArray
    settled_angles: FloatArray
    spare_order: IntArray
    spare_angles: FloatArray
    mean: FloatArray
    out: FloatArray


@subroutine(allocates=True)
def make_room(n):
    """Room for n points."""
    return Room(
        np.empty(n + 1, np.int64), np.empty(n), np.empty((2, n), np.int64), np.empty(n), np.empty(n, np.int64),
        np.empty(n), np.empty(3), np.empty(CURVE_SIZE),
    )  # fmt: skip


@subroutine()
def _turn(cosine, sine, step):
    """Cosine and sine of an angle after a step of at most _STEP: series whose next terms are below rounding."""
    h = step * step
    across = step * (1.0 - h * (1.0 / 6.0 - h * (1.0 / 120.0 - h * (1.0 / 5040.0 - h * (1.0 / 362880.0)))))
    along = 1.0 - h * (0.5 - h * (1.0 / 24.0 - h * (1.0 / 720.0 - h * (1.0 / 40320.0))))
    return cosine * along - sine * across, sine * along + cosine * across


@subroutine()
def _excess(curve, shape, cosine, sine, weight, x, y, out):
    """What a block adds to its sum by not being at its mean (x, y); `out` receives the curve."""
    curve(shape, cosine, sine, out)
    dx, dy = out[0] - x, out[1] - y
    return weight * (dx * dx + dy * dy)


@subroutine()
def _move(curve, shape, angle, weight, x, y, out):
    """The angle near a given one that is best for a block of this weight and mean; whether its last step is short."""
    cosine, sine = math.cos(angle), math.sin(angle)
    cost = _excess(curve, shape, cosine, sine, weight, x, y, out)
    for _ in range(_MOST_STEPS):
        dx, dy = out[0] - x, out[1] - y
        slope = dx * out[2] + dy * out[3]
        square = out[2] * out[2] + out[3] * out[3] + _TINY
        bend = square + dx * out[4] + dy * out[5]
        step = -slope / (bend if bend > LEAST_BEND * square else square)
        step = min(max(step, -_STEP), _STEP)
        if abs(step) <= _SHORT:
            return angle + step, True
        near_cosine, near_sine = _turn(cosine, sine, step)
        found = _excess(curve, shape, near_cosine, near_sine, weight, x, y, out)
        while found > cost and abs(step) > SURE_STEP:
            step *= 0.25
            near_cosine, near_sine = _turn(cosine, sine, step)
            found = _excess(curve, shape, near_cosine, near_sine, weight, x, y, out)
        angle, cosine, sine, cost = angle + step, near_cosine, near_sine, found
    return angle, False


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
def _bring_in_order(order, weights, angles, room):
    """Join neighbours that are out of order at their mean angle; fill the first points of blocks, return their count.

    Points of equal angles are one block.
    """
    n, m, starts, sums = len(order), 0, room.starts, room.sums
    for i in range(n):
        starts[m], sums[m] = i, weights[order[i]]
        m += 1
        while m > 1 and angles[starts[m - 2]] >= angles[starts[m - 1]]:
            left, right, own, other = starts[m - 2], starts[m - 1], sums[m - 2], sums[m - 1]
            if angles[left] > angles[right]:
                angles[left] = (own * angles[left] + other * angles[right]) / (own + other)
            m -= 1
            sums[m - 1] = own + other
    starts[m] = n
    for block in range(m):
        for k in range(starts[block] + 1, starts[block + 1]):
            angles[k] = angles[starts[block]]
    return m


@subroutine()
def _move_block(curve, shape, order, points, weights, angles, first, stop, room):
    """Move a block to its best angle, unless it is as it was after its last move."""
    settled = room.settled
    if settled[MOVED, first] == stop and room.settled_angles[first] == angles[first]:
        return
    _fill_mean(order, points, weights, first, stop, room.mean)
    weight, x, y = room.mean
    angle, is_least = _move(curve, shape, angles[first], weight, x, y, room.out)
    for i in range(first, stop):
        angles[i] = angle
    room.settled_angles[first] = angle
    settled[MOVED, first], settled[WHOLE, first] = stop if is_least else 0, 0


@subroutine()
def _pool(curve, shape, order, points, weights, angles, m, room):
    """Move m blocks one after another, each joined with those before that it does not pass; return how many are left.

    A joined block starts from the mean of the angles that its points are given at.
    """
    starts, given, count = room.starts, room.spare_angles, 0
    for k in range(len(order)):
        given[k] = angles[k]
    for block in range(m):
        first, stop = starts[block], starts[block + 1]
        _move_block(curve, shape, order, points, weights, angles, first, stop, room)
        while count > 0 and angles[first] <= angles[starts[count - 1]]:
            count -= 1
            first, weight, mean = starts[count], 0.0, 0.0
            for k in range(first, stop):
                weight, mean = weight + weights[order[k]], mean + weights[order[k]] * given[k]
            for k in range(first, stop):
                angles[k] = mean / weight
            room.settled[MOVED, first] = 0
            _move_block(curve, shape, order, points, weights, angles, first, stop, room)
        starts[count] = first
        count += 1
    starts[count] = len(order)
    return count


@subroutine()
def _divide(curve, shape, order, points, weights, angles, m, room):
    """Part the blocks that their points pull apart, by a little; return whether there is one."""
    is_divided, out = False, room.out
    for block in range(m):
        first, stop = room.starts[block], room.starts[block + 1]
        if stop - first < 2 or room.settled[WHOLE, first] == stop:
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
        if largest <= _PULL * size:
            room.settled[WHOLE, first] = stop
            continue
        is_divided = True
        # so little that all other angles stay where they are
        for i in range(first, place):
            angles[i] = angle - _SHORT * _STEP
        for i in range(place, stop):
            angles[i] = angle + _SHORT * _STEP
    return is_divided


@subroutine()
def polish(curve, shape, points, weights, order, angles, room):
    """Improve the `angles` (n,), rad, of points in an `order` (n,), both in place; the order may be rotated.

    The points (n, 2) have weights (n,).
    """
    n, starts = len(order), room.starts
    room.settled[:] = 0
    m = _bring_in_order(order, weights, angles, room)
    for _ in range(_MOST_ROUNDS):
        m = _pool(curve, shape, order, points, weights, angles, m, room)
        if angles[n - 1] >= angles[0] + TURN and m > 1:  # the ends meet
            while m > 1 and angles[n - 1] >= angles[0] + TURN:
                rotate(order, angles, n - starts[m - 1], room.spare_order, room.spare_angles)
                m = _bring_in_order(order, weights, angles, room)
            room.settled[:] = 0
        elif not _divide(curve, shape, order, points, weights, angles, m, room):
            break
        m = _bring_in_order(order, weights, angles, room)
    _bring_in_order(order, weights, angles, room)
