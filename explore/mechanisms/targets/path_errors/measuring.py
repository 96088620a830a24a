"""Path errors of designs: the best crank angles of the given points, and their distances there."""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import (
    CURVE,
    CURVE_SIZE,
    FEW_CHORDS,
    MANY_CHORDS,
    TURN,
    fill_corners,
    fill_distances,
    place_on_chord,
)
from explore.mechanisms.targets.path_errors.ordering import (
    Search,
    ascend_from,
    choose_order,
    follows_forwards,
    make_search,
)
from explore.mechanisms.targets.path_errors.polishing import Room, make_room, polish
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN
from explore.model.quantities import FloatArray

# Measures of a design: weighted rms distance, largest distance, and the turn of the crank, rad.
RMS, LARGEST, SPAN = range(3)
N_MEASURES = 3

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
    """Arrays for one design after another: of chords, of the search for their order, and of the angles."""

    xs: FloatArray
    ys: FloatArray
    out: FloatArray
    search: Search
    angles: FloatArray
    room: Room


@subroutine(allocates=True)
def _allocate_buffers(n):
    return _Buffers(
        np.empty(MANY_CHORDS + LANES_OF_TURN), np.empty(MANY_CHORDS + LANES_OF_TURN), np.empty(CURVE_SIZE),
        make_search(n, MANY_CHORDS), np.empty(n), make_room(n),
    )  # fmt: skip


@subroutine()
def _order_points(curve, shape, points, weights, rays, count, likely, buffers, own, measures):
    """Fill the best crank angles of points and their distances; return the sense, the chords' sum, the arcs' height.

    The `likely` sense is 1, -1, or 0 if it is not known.
    """
    n, xs, ys = len(points), buffers.xs, buffers.ys
    height = fill_corners(curve, shape, rays, count, buffers.out, xs, ys)
    fill_distances(points, weights, xs, ys, count, buffers.search.distances)
    is_likely = likely > 0.0 if likely != 0.0 else follows_forwards(count, buffers.search)
    total, is_forwards = choose_order(count, is_likely, buffers.search)
    order, angles, chords = buffers.search.order, buffers.angles, buffers.search.chords
    for i in range(n):
        angles[i] = place_on_chord(points[order[i], 0], points[order[i], 1], xs, ys, count, chords[0, i])
    leader = order[0]
    polish(curve, shape, points, weights, order, angles, buffers.room)
    ascend_from(leader, order, angles, own)
    measure(curve, shape, points, weights, own, buffers.out, measures)
    return 1.0 if is_forwards else -1.0, total, height


@compiled(types.void(CURVE, _F2, _F2, _F1, types.boolean, _F2, _F2, _F2), allocates=True)
def measure_ordered(curve, designs, points, weights, is_closed, rays, measures, angles):
    """Measure designs against points that the crank passes in order, in the better sense.

    `designs` (n, p) have what the mechanism's compiled `curve` takes, then the pose; one whose first number is NaN has
    no measures. The path has `points` (m, 2) in the plane with `weights` (m,); `is_closed` means that the span is the
    whole turn. `rays` are cosines and sines of MANY_CHORDS crank angles of a turn, from 0. Filled are `measures` (n,
    N_MEASURES), and `angles` (n, m), the crank angles from the frame, rad, which ascend or descend.
    """
    m, buffers, placed = len(points), _allocate_buffers(len(points)), np.empty((len(points), 2))
    finer, others, root = np.empty(m), np.empty(N_MEASURES), math.sqrt(weights.sum())
    for k in range(len(designs)):
        own = angles[k]
        if math.isnan(designs[k, 0]):
            measures[k], own[:] = math.nan, math.nan
            continue
        shape = designs[k, : designs.shape[1] - POSE_SIZE]
        place_points(points, designs[k, designs.shape[1] - POSE_SIZE :], placed)
        sense, bound, height = _order_points(
            curve, shape, placed, weights, rays, FEW_CHORDS, 0.0, buffers, own, measures[k]
        )
        if root * measures[k, RMS] - math.sqrt(bound) > height * root:
            other, _, _ = _order_points(curve, shape, placed, weights, rays, MANY_CHORDS, sense, buffers, finer, others)
            if others[RMS] < measures[k, RMS]:
                sense, own[:], measures[k] = other, finer, others
        measures[k, SPAN] = TURN if is_closed else sense * (own[m - 1] - own[0])
