"""The crank angles of poses to the last digits, in their order: neighbours that would pass each other share one.

Each pose, or block of poses with one angle, is moved by Newton's method to where its sum of squares is least; a block
that would pass the one before is joined with it (pooling of adjacent violators).
"""

import math

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import LEAST_BEND, SURE_STEP, TURN
from explore.mechanisms.targets.path_errors.polishing import rotate
from explore.mechanisms.targets.pose_errors.link import (
    ANGLE,
    ANGLE_1,
    ANGLE_2,
    X_1,
    X_2,
    Y_1,
    Y_2,
    X,
    Y,
    fill_link,
    wrap,
)

#: Largest number of Newton's steps.
_MOST_STEPS = 40
#: Longest step, rad.
_STEP = TURN / 256
#: Longest step that is the last, because the next would be of the size of its square, rad.
_SHORT = 1e-8

_TINY = 1e-300


@subroutine()
def sum_of_squares(link, poses, lever, order, first, stop, slopes):
    """The sum of squares of a block of poses where the link is; `slopes` receives halves of its derivatives.

    They are the first one, the second one, and the part of the second that is never negative.
    """
    total, slope, bend, square = 0.0, 0.0, 0.0, lever * lever
    speed = link[X_1] * link[X_1] + link[Y_1] * link[Y_1] + square * link[ANGLE_1] * link[ANGLE_1]
    for i in range(first, stop):
        p = order[i]
        dx, dy, turn = link[X] - poses[p, 0], link[Y] - poses[p, 1], wrap(link[ANGLE] - poses[p, 2])
        total += dx * dx + dy * dy + square * turn * turn
        slope += dx * link[X_1] + dy * link[Y_1] + square * turn * link[ANGLE_1]
        bend += dx * link[X_2] + dy * link[Y_2] + square * turn * link[ANGLE_2]
    slopes[0], slopes[1], slopes[2] = slope, bend + (stop - first) * speed, (stop - first) * speed + _TINY
    return total


@subroutine()
def _move(curve, shape, poses, lever, order, first, stop, angle, buffers):
    """The angle near a given one that is best for a block."""
    fill_link(curve, shape, angle, buffers.out, buffers.link)
    least = sum_of_squares(buffers.link, poses, lever, order, first, stop, buffers.slopes)
    for _ in range(_MOST_STEPS):
        slope, bend, speed = buffers.slopes[0], buffers.slopes[1], buffers.slopes[2]
        step = -slope / (bend if bend > LEAST_BEND * speed else speed)
        step = min(max(step, -_STEP), _STEP)
        found = math.inf
        while True:
            fill_link(curve, shape, angle + step, buffers.out, buffers.link)
            found = sum_of_squares(buffers.link, poses, lever, order, first, stop, buffers.slopes)
            if found <= least or not abs(step) > SURE_STEP:
                break
            step *= 0.25
        angle, least = angle + step, found
        if abs(step) <= _SHORT:
            break
    return angle


@subroutine()
def _pool(curve, shape, poses, lever, order, angles, buffers):
    """Move all blocks, joined where they would pass each other; return their count."""
    m, starts = 0, buffers.starts
    for i in range(len(order)):
        first, angle = i, _move(curve, shape, poses, lever, order, i, i + 1, angles[i], buffers)
        while m > 0 and angles[starts[m - 1]] > angle:
            m -= 1
            before, own = first - starts[m], i + 1 - first
            mean = (before * angles[starts[m]] + own * angle) / (before + own)
            first = starts[m]
            angle = _move(curve, shape, poses, lever, order, first, i + 1, mean, buffers)
        starts[m] = first
        m += 1
        for k in range(first, i + 1):
            angles[k] = angle
    return m


@subroutine()
def polish_in_order(curve, shape, poses, lever, order, angles, buffers):
    """Improve the angles of poses in an order, both in place; the order may be rotated, a turn back."""
    n = len(order)
    for _ in range(n):
        m = _pool(curve, shape, poses, lever, order, angles, buffers)
        if m < 2 or angles[n - 1] <= angles[0] + TURN:
            break
        # the ends meet: the last block goes before the first
        rotate(order, angles, n - buffers.starts[m - 1], buffers.spare_order, buffers.spare_angles)


@subroutine()
def polish_each(curve, shape, poses, lever, order, angles, buffers):
    """Improve the angle of each pose, in place, in any order."""
    for i in range(len(order)):
        angles[i] = _move(curve, shape, poses, lever, order, i, i + 1, angles[i], buffers)
