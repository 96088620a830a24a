"""How far the curve that is traced and the polygon of a path are apart: distances of either from the other.

Both are lines of chords: the curve between the crank angles of the first and the last point, or the whole turn for a
closed path, and the polygon, each of whose sides is divided. Of each chord's middle the distance to the nearest chord
of the other line counts, in means by the chord's length. The largest is often that of a corner of the path or of an end
of the curve, which count in it, too.
"""

import math

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE, TURN
from explore.mechanisms.targets.path_errors.measuring import POSE_SIZE, place_points

# Measures: the largest distance of either line from the other, and half the sum of the two mean distances.
HAUSDORFF, CHAMFER = range(2)
N_SHAPES = 2

#: Number of chords of the curve, and of the polygon at least.
N_PARTS = 256

_TINY = 1e-300
_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@subroutine()
def _divide_polygon(points, is_closed, corners):
    """Fill the corners of a polygon whose sides are divided; return the number of its chords."""
    n, total = len(points), 0.0
    sides = n if is_closed else n - 1
    for i in range(sides):
        j = (i + 1) % n
        total += math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
    count = 0
    for i in range(sides):
        j = (i + 1) % n
        dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        parts = 1 + int(N_PARTS * math.hypot(dx, dy) / total)
        for k in range(parts):
            corners[count, 0], corners[count, 1] = points[i, 0] + dx * k / parts, points[i, 1] + dy * k / parts
            count += 1
    last = 0 if is_closed else n - 1
    corners[count, 0], corners[count, 1] = points[last, 0], points[last, 1]
    return count


@subroutine(fast=True)
def _squared_distance(x, y, line, count):
    """The squared distance of a place from a line of chords."""
    least = math.inf
    for k in range(count):
        ex, ey = x - line[k, 0], y - line[k, 1]
        tx, ty = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        part = min(max((ex * tx + ey * ty) / (tx * tx + ty * ty + _TINY), 0.0), 1.0)
        dx, dy = ex - part * tx, ey - part * ty
        least = min(least, dx * dx + dy * dy)
    return least


@subroutine(fast=True)
def _distances(line, count, other, other_count, result):
    """Fill the largest and the mean distance of the middles of a line's chords from another line."""
    largest, total, length = 0.0, 0.0, 0.0
    for i in range(count):
        x, y = 0.5 * (line[i, 0] + line[i + 1, 0]), 0.5 * (line[i, 1] + line[i + 1, 1])
        least = _squared_distance(x, y, other, other_count)
        own = math.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])
        largest, total, length = max(largest, least), total + own * math.sqrt(least), length + own
    result[HAUSDORFF], result[CHAMFER] = math.sqrt(largest), total / (length + _TINY)


@compiled(types.void(CURVE, _F2, _F2, types.boolean, _F2, _F2), allocates=True)
def measure_shapes(curve, designs, points, is_closed, angles, shapes):
    """Measure how far traced curves are from the polygon of a path: fill `shapes` (n, N_SHAPES).

    The other arguments are those of `measure_ordered`, which fills the angles.
    """
    m, out, placed = len(points), np.empty(CURVE_SIZE), np.empty((len(points), 2))
    polygon, traced = np.empty((N_PARTS + m + 2, 2)), np.empty((N_PARTS + 1, 2))
    there, back = np.empty(N_SHAPES), np.empty(N_SHAPES)
    for k in range(len(designs)):
        if math.isnan(designs[k, 0]):
            shapes[k] = math.nan
            continue
        shape, own = designs[k, : designs.shape[1] - POSE_SIZE], angles[k]
        place_points(points, designs[k, designs.shape[1] - POSE_SIZE :], placed)
        count = _divide_polygon(placed, is_closed, polygon)
        first = own.min()
        span = TURN if is_closed else own.max() - first
        for i in range(N_PARTS + 1):
            angle = first + span * i / N_PARTS
            curve(shape, math.cos(angle), math.sin(angle), out)
            traced[i, 0], traced[i, 1] = out[0], out[1]
        _distances(polygon, count, traced, N_PARTS, there)
        _distances(traced, N_PARTS, polygon, count, back)
        largest = 0.0
        for i in range(m):
            largest = max(largest, _squared_distance(placed[i, 0], placed[i, 1], traced, N_PARTS))
        for i in range(0, N_PARTS + 1, N_PARTS):
            largest = max(largest, _squared_distance(traced[i, 0], traced[i, 1], polygon, count))
        shapes[k, HAUSDORFF] = max(math.sqrt(largest), there[HAUSDORFF], back[HAUSDORFF])
        shapes[k, CHAMFER] = 0.5 * (there[CHAMFER] + back[CHAMFER])
