"""Pose errors of designs: the best crank angles of the given poses, and how far the link is from them there."""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.base.lanes.disturbance import DISTURBANCE
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE, LEAST_BEND, ROWS, TURN
from explore.mechanisms.targets.path_errors.measuring import place_points
from explore.mechanisms.targets.path_errors.ordering import (
    IntArray,
    Search,
    ascend_from,
    choose_order,
    make_search,
    nearest_chord,
)
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN, place_of
from explore.mechanisms.targets.pose_errors.chords import (
    MOST_CHORDS,
    Chords,
    angle_of_start,
    angle_on_chord,
    fill_chords,
    fill_distances,
    fill_distances_of_starts,
    make_chords,
)
from explore.mechanisms.targets.pose_errors.link import ANGLE, ANGLE_1, LINK_SIZE, X_1, Y_1, X, Y, fill_link, wrap
from explore.mechanisms.targets.pose_errors.polishing import polish_each, polish_in_order, sum_of_squares
from explore.mechanisms.targets.rounding import ROUNDING, SHARE, disturb
from explore.model.quantities import FloatArray

# Measures of a design: largest distance, largest error of the angle, rad, the root mean square of distances and angles
# at the lever, and the turn of the crank, rad; the bounds of their rounding; and the size of what distances are
# differences of.
PLACE, TURNED, RMS, SPAN, PLACE_ROUNDING, TURNED_ROUNDING, RMS_ROUNDING, SPAN_ROUNDING, SIZE = range(9)
N_MEASURES = 9

#: Number of coordinates, mm, and angles, deg, of the linkage and of the body on its link, that end a row of designs.
POSE_SIZE = 4
#: Part of the sum of squares by which that over chords may be lower before other angles are compared.
_SETTLED = 1e-3

_F1, _F2 = types.float64[::1], types.float64[:, ::1]


class _Buffers(NamedTuple):
    """Arrays for one design after another: of the link, of chords, of the search for the order, of the angles, and of
    the link of a disturbed shape.
    """

    out: FloatArray
    link: FloatArray
    slopes: FloatArray
    chords: Chords
    search: Search
    angles: FloatArray
    starts: IntArray
    spare_order: IntArray
    spare_angles: FloatArray
    disturbed: FloatArray
    near: FloatArray
    near_slopes: FloatArray


@subroutine(allocates=True)
def _allocate_buffers(n, size):
    return _Buffers(
        np.empty(CURVE_SIZE), np.empty(LINK_SIZE), np.empty(3), make_chords(size), make_search(n, MOST_CHORDS),
        np.empty(n), np.empty(n + 1, np.int64), np.empty(n, np.int64), np.empty(n), np.empty(size),
        np.empty(LINK_SIZE), np.empty(3),
    )  # fmt: skip


@subroutine()
def _place_poses(poses, pose, placed):
    """Fill poses of the plane as the link has them in the linkage's own frame: place, and angle of the link, rad."""
    place_points(poses, pose, placed)
    for i in range(len(poses)):
        placed[i, 2] = poses[i, 2] - math.radians(pose[2]) - math.radians(pose[3])


@subroutine()
def _choose_chords(count, is_ordered, search):
    """Fill the order of the poses and their chords: the best in either sense, or of each pose alone; return the sum."""
    parts, total = count // LANES_OF_TURN, 0.0
    if is_ordered:
        return choose_order(count, math.inf, search)
    for i in range(len(search.order)):
        search.order[i], search.chords[i] = i, nearest_chord(search.distances[i], parts)
        total += search.distances[i, place_of(search.chords[i], parts)]
    return total


@subroutine()
def _polish(curve, shape, poses, lever, is_ordered, buffers):
    """Improve the angles of poses, and return the sum of squares there."""
    order, angles = buffers.search.order, buffers.angles
    if is_ordered:
        polish_in_order(curve, shape, poses, lever, order, angles, buffers)
    else:
        polish_each(curve, shape, poses, lever, order, angles, buffers)
    return _sum_squares(curve, shape, poses, lever, buffers)


@subroutine()
def _sum_squares(curve, shape, poses, lever, buffers):
    """The sum of squares at the angles of poses."""
    total = 0.0
    for i in range(len(poses)):
        fill_link(curve, shape, buffers.angles[i], buffers.out, buffers.link)
        total += sum_of_squares(buffers.link, poses, lever, buffers.search.order, i, i + 1, buffers.slopes)
    return total


@subroutine()
def _find_angles(curve, rows_of_curve, shape, poses, lever, is_ordered, buffers, own):
    """Fill the best crank angles of poses, by their numbers.

    The sum of squares over chords is nearly below that of all angles. Where it is below that of those that are found,
    angles at which chords start are compared, which no angles between may be near.
    """
    chords, search = buffers.chords, buffers.search
    count = fill_chords(curve, rows_of_curve, shape, lever, chords)
    fill_distances(poses, lever, chords, count, search.distances)
    bound, leader = _choose_chords(count, is_ordered, search), search.order[0]
    for i in range(len(poses)):
        buffers.angles[i] = angle_on_chord(poses[search.order[i]], lever, chords, count, search.chords[i])
    total = _polish(curve, shape, poses, lever, is_ordered, buffers)
    ascend_from(leader, search.order, buffers.angles, own)
    if is_ordered and total * (1.0 - _SETTLED) > bound:
        fill_distances_of_starts(poses, lever, chords, count, search.distances)
        if choose_order(count, total, search) < total:
            _start_at_chords(curve, shape, poses, lever, count, total, buffers, own)


@subroutine()
def _start_at_chords(curve, shape, poses, lever, count, total, buffers, own):
    """Fill angles whose sum of squares is below a total: those improved from the starts of chords, or these."""
    order, first = buffers.search.order, buffers.search.trial
    for i in range(len(poses)):
        first[i] = order[i]
    for is_polished in (True, False):
        for i in range(len(poses)):
            order[i], buffers.angles[i] = first[i], angle_of_start(buffers.chords, count, buffers.search.chords[i])
        if is_polished:
            found = _polish(curve, shape, poses, lever, True, buffers)
        else:
            found = _sum_squares(curve, shape, poses, lever, buffers)
        if found < total:
            ascend_from(first[0], order, buffers.angles, own)
            return


@subroutine()
def _measure(curve, shape, poses, lever, angles, pose, buffers, measures):
    """Fill the errors of poses at crank angles and their roundings; the places follow from the pose of the linkage."""
    link, near, order = buffers.link, buffers.near, buffers.search.forwards
    slopes, near_slopes = buffers.slopes, buffers.near_slopes
    disturb(shape, buffers.disturbed)
    measures[:] = 0.0
    for i in range(len(poses)):
        fill_link(curve, shape, angles[i], buffers.out, link)
        total = sum_of_squares(link, poses, lever, order, i, i + 1, slopes)
        fill_link(curve, buffers.disturbed, angles[i] * (1.0 + DISTURBANCE), buffers.out, near)
        sum_of_squares(near, poses, lever, order, i, i + 1, near_slopes)
        own, ground = math.hypot(poses[i, 0], poses[i, 1]), abs(math.radians(pose[2]))
        size = max(math.hypot(link[X], link[Y]), own) + math.hypot(pose[0], pose[1])
        place = SHARE * math.hypot(near[X] - link[X], near[Y] - link[Y]) + ROUNDING * (size + ground * own)
        turned = TURN + ground + abs(math.radians(pose[3])) + abs(poses[i, 2])
        turn = SHARE * abs(wrap(near[ANGLE] - link[ANGLE])) + ROUNDING * turned
        root = place * place + lever * lever * turn * turn
        # the angle is where the slope is 0, and moves with it; of a block of poses not each has a bend
        change = SHARE * abs(near_slopes[0] - slopes[0]) + math.sqrt(root * slopes[2])
        move = min(change / (slopes[1] if slopes[1] > 0.0 else LEAST_BEND * slopes[2]), TURN)
        measures[PLACE] = max(measures[PLACE], math.hypot(link[X] - poses[i, 0], link[Y] - poses[i, 1]))
        measures[TURNED] = max(measures[TURNED], abs(wrap(link[ANGLE] - poses[i, 2])))
        measures[RMS], measures[RMS_ROUNDING] = measures[RMS] + total, measures[RMS_ROUNDING] + root
        place, turn = place + move * math.hypot(link[X_1], link[Y_1]), turn + move * abs(link[ANGLE_1])
        measures[PLACE_ROUNDING] = max(measures[PLACE_ROUNDING], place)
        measures[TURNED_ROUNDING] = max(measures[TURNED_ROUNDING], turn)
        measures[SIZE] = max(measures[SIZE], size)
        measures[SPAN_ROUNDING] = max(measures[SPAN_ROUNDING], 2.0 * move + ROUNDING * TURN)
    measures[RMS] = math.sqrt(measures[RMS] / len(poses))
    measures[RMS_ROUNDING] = math.sqrt(measures[RMS_ROUNDING] / len(poses))


@compiled(types.void(CURVE, ROWS, _F2, _F2, types.float64, types.boolean, _F2, _F2), allocates=True)
def measure_poses(curve, rows_of_curve, designs, poses, lever, is_ordered, measures, angles):
    """Measure designs against poses that the crank takes the body through.

    `designs` (n, p) have what the mechanism's compiled `curve` takes, then the pose; one whose first number is NaN has
    no measures. `poses` (m, 3) are places, and angles of the body, rad, in the plane; the angle counts as a distance at
    the end of `lever`. If `is_ordered` the crank passes them in their order, in the better sense, within a turn. Filled
    are `measures` (n, N_MEASURES), and `angles` (n, m), the crank angles from the frame, rad, of the least sum of
    squares.
    """
    m, size = len(poses), designs.shape[1] - POSE_SIZE
    buffers, placed = _allocate_buffers(m, size), np.empty((m, 3))
    for k in range(len(designs)):
        own = angles[k]
        if math.isnan(designs[k, 0]):
            measures[k], own[:] = math.nan, math.nan
            continue
        shape, pose = designs[k, :size], designs[k, size:]
        _place_poses(poses, pose, placed)
        _find_angles(curve, rows_of_curve, shape, placed, lever, is_ordered, buffers, own)
        _measure(curve, shape, placed, lever, own, pose, buffers, measures[k])
        measures[k, SPAN] = own.max() - own.min()
