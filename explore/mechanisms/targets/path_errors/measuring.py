"""Path errors of designs: the best crank angles of the given points, and their distances there."""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.arcs import (
    MOST_ARCS,
    Arcs,
    angle_on_arc,
    divide_arcs,
    fill_arcs,
    fill_distances,
    make_arcs,
)
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE, LEAST_BEND, ROWS, TURN
from explore.mechanisms.targets.path_errors.ordering import (
    IntArray,
    Search,
    ascend_from,
    follows_forwards,
    make_search,
    search_order,
)
from explore.mechanisms.targets.path_errors.polishing import Room, make_room, polish
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN, place_of
from explore.mechanisms.targets.rounding import ROUNDING, SHARE, curve_nearby, disturb
from explore.model.quantities import FloatArray

# Measures of a design: weighted rms distance, largest distance, and the turn of the crank, rad; the bounds of their
# rounding; and the size of what distances are differences of.
RMS, LARGEST, SPAN, RMS_ROUNDING, LARGEST_ROUNDING, SPAN_ROUNDING, SIZE = range(7)
N_MEASURES = 7

# What tells the crank angles of points: each by itself, all together, or nothing.
EACH, TOGETHER, FIXED = range(3)

_TINY = 1e-300

#: Margin of other orders: the part of the sum of squares by which theirs may be lower.
_SETTLED = 1e-3
#: Largest number of searches in a sense.
_MOST_SEARCHES = 12

#: Number of coordinates, mm, and angle, deg, of the linkage in the plane that end a row of designs.
POSE_SIZE = 3

_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@subroutine()
def place_points(points, pose, placed):
    """Fill points of the plane as the linkage has them in its own frame, from its pose: x, y and angle, deg."""
    angle = math.radians(pose[2])
    cosine, sine = math.cos(angle), math.sin(angle)
    for i in range(len(points)):
        x, y = points[i, 0] - pose[0], points[i, 1] - pose[1]
        placed[i, 0], placed[i, 1] = cosine * x + sine * y, cosine * y - sine * x


class Place(NamedTuple):
    """Arrays for what rounding does at a crank angle: a disturbed shape, and the curve of a shape and of this."""

    disturbed: FloatArray
    out: FloatArray
    near: FloatArray


@subroutine(allocates=True)
def make_place(size):
    """Room for shapes of a size."""
    return Place(np.empty(size), np.empty(CURVE_SIZE), np.empty(CURVE_SIZE))


@subroutine()
def _round_at(curve, shape, x, y, angle, pose, place):
    """What rounding moves the distance of a point by, and the slope of half its square; then this slope and its bend.

    The place of the point follows from the pose of the linkage.
    """
    out, near, cosine, sine = place.out, place.near, math.cos(angle), math.sin(angle)
    curve(shape, cosine, sine, out)
    curve_nearby(curve, place.disturbed, angle, cosine, sine, near)
    dx, dy, own = out[0] - x, out[1] - y, math.hypot(x, y)
    size = math.hypot(out[0], out[1]) + own * (1.0 + abs(math.radians(pose[2]))) + math.hypot(pose[0], pose[1])
    square, slope = out[2] * out[2] + out[3] * out[3], dx * out[2] + dy * out[3]
    change = (near[0] - x) * near[2] + (near[1] - y) * near[3] - slope
    rounding = SHARE * math.hypot(near[0] - out[0], near[1] - out[1]) + ROUNDING * size
    return rounding, SHARE * abs(change) + rounding * math.sqrt(square), slope, square + dx * out[4] + dy * out[5]


@subroutine()
def measure(curve, shape, points, weights, angles, given, pose, place, measures):
    """Fill the distances of points at crank angles and their roundings.

    What tells the angles is `given`; rounding moves them, and both ends of the span, unless they are fixed.
    """
    disturb(shape, place.disturbed)
    total, weight, largest, roundings, size, span, widest = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, TURN
    changes, bends, most, fastest, n = 0.0, _TINY, 0.0, 0.0, len(points)
    for i in range(n):
        x, y, w, out = points[i, 0], points[i, 1], weights[i], place.out
        rounding, change, slope, bend = _round_at(curve, shape, x, y, angles[i], pose, place)
        dx, dy, speed = out[0] - x, out[1] - y, math.hypot(out[2], out[3])
        square = dx * dx + dy * dy
        # of a block of points not each has a bend
        move = min(change / (bend if bend > 0.0 else LEAST_BEND * speed * speed + _TINY), TURN)
        total, weight, largest = total + w * square, weight + w, max(largest, square)
        roundings, size = roundings + w * rounding * rounding, max(size, math.hypot(out[0], out[1]), math.hypot(x, y))
        changes, bends, fastest = changes + w * change, bends + w * bend, max(fastest, speed)
        # the distance changes by its slope, and by that of what rounding moves it by
        steepness = min(speed, (abs(slope) + 1.5 * change) / (math.sqrt(square) + _TINY))
        most = max(most, rounding + (move * steepness if given == EACH else 0.0))
        span, widest = span + (move if i == 0 or i == n - 1 else 0.0), max(widest, abs(angles[i]))
    measures[RMS], measures[LARGEST] = math.sqrt(total / weight), math.sqrt(largest)
    measures[SIZE] = size + math.hypot(pose[0], pose[1])
    measures[RMS_ROUNDING] = math.sqrt(roundings / weight)
    measures[LARGEST_ROUNDING] = most + (fastest * min(changes / bends, TURN) if given == TOGETHER else 0.0)
    measures[SPAN_ROUNDING] = (span if given == EACH else 0.0) + ROUNDING * widest


class _Buffers(NamedTuple):
    """Arrays for one design after another: of arcs, of the search for their order, and of points."""

    arcs: Arcs
    search: Search
    angles: FloatArray
    on: IntArray
    room: Room


@subroutine(allocates=True)
def _allocate_buffers(n, size):
    return _Buffers(make_arcs(size), make_search(n, MOST_ARCS), np.empty(n), np.empty(n, np.int64), make_room(n))


@subroutine()
def _start_on_arcs(points, count, buffers):
    """Fill the crank angles of points in the order found, where they are nearest on their arcs."""
    order, chords = buffers.search.order, buffers.search.chords
    for i in range(len(points)):
        point = order[i]
        buffers.on[point] = chords[i] % count
        buffers.angles[i] = angle_on_arc(points[point, 0], points[point, 1], buffers.arcs, count, chords[i])


@subroutine()
def _sum_squares(curve, shape, points, weights, count, buffers):
    """The sum of squares at the angles of points; fill what of it is missing in the sum over each arc."""
    arcs, order, angles, total = buffers.arcs, buffers.search.order, buffers.angles, 0.0
    arcs.excess[:count] = 0.0
    for i in range(len(points)):
        point = order[i]
        curve(shape, math.cos(angles[i]), math.sin(angles[i]), arcs.out)
        dx, dy = arcs.out[0] - points[point, 0], arcs.out[1] - points[point, 1]
        square, arc = weights[point] * (dx * dx + dy * dy), buffers.on[point]
        arcs.excess[arc] += square - buffers.search.distances[point, place_of(arc, count // LANES_OF_TURN)]
        total += square
    return total


@subroutine()
def _search_sense(curve, shape, points, weights, count, order, least, buffers, own):
    """Lower the least sum of squares by crank angles in an order, `own`; return it, and the number of arcs.

    Sums over arcs are nearly bounds from below: points on one arc have no order, and cubics stand for the curve. Arcs
    where the bound is below the sum are divided.
    """
    arcs, search = buffers.arcs, buffers.search
    for _ in range(_MOST_SEARCHES):
        bound = search_order(count, order, least * (1.0 - _SETTLED), search)
        if bound == math.inf:
            break
        for i in range(len(points)):
            search.order[i] = order[i]
        _start_on_arcs(points, count, buffers)
        polish(curve, shape, points, weights, search.order, buffers.angles, buffers.room)
        total = _sum_squares(curve, shape, points, weights, count, buffers)
        if total < least:
            least = total
            ascend_from(order[0], search.order, buffers.angles, own)
        if total - bound <= _SETTLED * total:
            break
        more = divide_arcs(curve, shape, count, _SETTLED * total / len(points), arcs)
        if more == 0:
            break
        count = more
        fill_distances(points, weights, arcs, count, search)
    return least, count


@subroutine()
def _order_points(curve, rows_of_curve, shape, points, weights, buffers, own):
    """Fill the crank angles of points of the least sum of squares in either sense; return the sense, 1 or -1."""
    search, own[:] = buffers.search, math.nan
    count = fill_arcs(curve, rows_of_curve, shape, buffers.arcs)
    fill_distances(points, weights, buffers.arcs, count, search)
    is_forwards = follows_forwards(count, search)
    first, second = (search.forwards, search.backwards) if is_forwards else (search.backwards, search.forwards)
    least, count = _search_sense(curve, shape, points, weights, count, first, math.inf, buffers, own)
    other, _ = _search_sense(curve, shape, points, weights, count, second, least, buffers, own)
    return 1.0 if (other < least) != is_forwards else -1.0


@compiled(types.void(CURVE, ROWS, _F2, _F2, _F1, types.boolean, _F2, _F2), allocates=True)
def measure_ordered(curve, rows_of_curve, designs, points, weights, is_closed, measures, angles):
    """Measure designs against points that the crank passes in order, in the better sense.

    `designs` (n, p) have what the mechanism's compiled `curve` takes, then the pose; one whose first number is NaN has
    no measures. The path has `points` (m, 2) in the plane with `weights` (m,); `is_closed` means that the span is the
    whole turn. Filled are `measures` (n, N_MEASURES), and `angles` (n, m), the crank angles from the frame, rad, which
    ascend or descend.
    """
    m, size = len(points), designs.shape[1] - POSE_SIZE
    buffers, placed, place = _allocate_buffers(m, size), np.empty((m, 2)), make_place(size)
    for k in range(len(designs)):
        own = angles[k]
        if math.isnan(designs[k, 0]):
            measures[k], own[:] = math.nan, math.nan
            continue
        shape, pose = designs[k, :size], designs[k, size:]
        place_points(points, pose, placed)
        sense = _order_points(curve, rows_of_curve, shape, placed, weights, buffers, own)
        measure(curve, shape, placed, weights, own, EACH, pose, place, measures[k])
        measures[k, SPAN] = TURN if is_closed else sense * (own[m - 1] - own[0])
        if is_closed:
            measures[k, SPAN_ROUNDING] = ROUNDING * TURN
