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
from explore.mechanisms.targets.path_errors.curve import CURVE, TURN
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
from explore.model.quantities import FloatArray

# Measures of a design: weighted rms distance, largest distance, and the turn of the crank, rad.
RMS, LARGEST, SPAN = range(3)
N_MEASURES = 3

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


@subroutine()
def measure(curve, shape, points, weights, angles, out, measures):
    """Fill the distances of points at crank angles, all but the span."""
    total, weight, largest = 0.0, 0.0, 0.0
    for i in range(len(points)):
        curve(shape, math.cos(angles[i]), math.sin(angles[i]), out)
        dx, dy = out[0] - points[i, 0], out[1] - points[i, 1]
        square = dx * dx + dy * dy
        total, weight, largest = total + weights[i] * square, weight + weights[i], max(largest, square)
    measures[RMS], measures[LARGEST] = math.sqrt(total / weight), math.sqrt(largest)


class _Buffers(NamedTuple):
    """Arrays for one design after another: of arcs, of the search for their order, and of points."""

    arcs: Arcs
    search: Search
    angles: FloatArray
    on: IntArray
    room: Room


@subroutine(allocates=True)
def _allocate_buffers(n):
    return _Buffers(make_arcs(), make_search(n, MOST_ARCS), np.empty(n), np.empty(n, np.int64), make_room(n))


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
def _order_points(curve, shape, points, weights, buffers, own):
    """Fill the crank angles of points of the least sum of squares in either sense; return the sense, 1 or -1."""
    search, own[:] = buffers.search, math.nan
    count = fill_arcs(curve, shape, buffers.arcs)
    fill_distances(points, weights, buffers.arcs, count, search)
    is_forwards = follows_forwards(count, search)
    first, second = (search.forwards, search.backwards) if is_forwards else (search.backwards, search.forwards)
    least, count = _search_sense(curve, shape, points, weights, count, first, math.inf, buffers, own)
    other, _ = _search_sense(curve, shape, points, weights, count, second, least, buffers, own)
    return 1.0 if (other < least) != is_forwards else -1.0


@compiled(types.void(CURVE, _F2, _F2, _F1, types.boolean, _F2, _F2), allocates=True)
def measure_ordered(curve, designs, points, weights, is_closed, measures, angles):
    """Measure designs against points that the crank passes in order, in the better sense.

    `designs` (n, p) have what the mechanism's compiled `curve` takes, then the pose; one whose first number is NaN has
    no measures. The path has `points` (m, 2) in the plane with `weights` (m,); `is_closed` means that the span is the
    whole turn. Filled are `measures` (n, N_MEASURES), and `angles` (n, m), the crank angles from the frame, rad, which
    ascend or descend.
    """
    m, buffers, placed = len(points), _allocate_buffers(len(points)), np.empty((len(points), 2))
    for k in range(len(designs)):
        own = angles[k]
        if math.isnan(designs[k, 0]):
            measures[k], own[:] = math.nan, math.nan
            continue
        shape = designs[k, : designs.shape[1] - POSE_SIZE]
        place_points(points, designs[k, designs.shape[1] - POSE_SIZE :], placed)
        sense = _order_points(curve, shape, placed, weights, buffers, own)
        measure(curve, shape, placed, weights, own, buffers.arcs.out, measures[k])
        measures[k, SPAN] = TURN if is_closed else sense * (own[m - 1] - own[0])
