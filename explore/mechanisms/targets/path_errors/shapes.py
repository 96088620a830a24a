"""How far the curve that is traced and the polygon of a path are apart: distances of either from the other.

Both are lines of chords: the curve between the crank angles of the first and the last point, or the whole turn for a
closed path, and the polygon, each of whose sides is divided. Of each chord's middle the distance to the nearest chord
of the other line counts, in means by the chord's length. The largest is often that of a corner of the path or of an end
of the curve, which count in it, too.

The nearest chord is looked for in blocks of chords, most of which are farther than one that is known already: that of
the place before.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from explore.base.compiling import LANES, compiled
from explore.base.lanes.elementary import cosine, sine
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE_SIZE, ROWS, TURN, fill_rows
from explore.mechanisms.targets.path_errors.measuring import POSE_SIZE, place_points
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN, least_of
from explore.model.quantities import FloatArray

# Measures: the largest distance of either line from the other, and half the sum of the two mean distances.
HAUSDORFF, CHAMFER = range(2)
N_SHAPES = 2

#: Number of chords of the curve, and of the polygon at least.
N_PARTS = 256
#: Number of chords of a block.
_BLOCK = LANES

# Rows of chords: where they start, how far they go along each coordinate, and 1 over the square of their length.
_X, _Y, _ALONG_X, _ALONG_Y, _INVERSE = range(5)
# Rows of blocks: a circle that their chords are in.
_CENTRE_X, _CENTRE_Y, _RADIUS = range(3)

_TINY = 1e-300
_F1, _F2 = types.float64[::1], types.float64[:, ::1]


class _Line(NamedTuple):
    """Arrays of a line of n chords: `corners` (2, n + 1), `chords` (5, n), `blocks` (3, n / _BLOCK).

    `distances` (_BLOCK,) is room for those of a place from the chords of a block, squared.
    """

    corners: FloatArray
    chords: FloatArray
    blocks: FloatArray
    distances: FloatArray


@subroutine(allocates=True)
def _make_line(most):
    """Room for a line of so many chords."""
    blocks = (most + _BLOCK - 1) // _BLOCK
    return _Line(
        np.empty((2, blocks * _BLOCK + 1)), np.empty((5, blocks * _BLOCK)), np.empty((3, blocks)), np.empty(_BLOCK)
    )


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
            corners[0, count], corners[1, count] = points[i, 0] + dx * k / parts, points[i, 1] + dy * k / parts
            count += 1
    last = 0 if is_closed else n - 1
    corners[0, count], corners[1, count] = points[last, 0], points[last, 1]
    return count


@subroutine(fast=True)
def _fill_line(line, count):
    """Fill chords and blocks from so many chords' corners; return the number of blocks.

    The last block is filled up by chords of length 0 at the last corner.
    """
    corners, chords, blocks = line.corners, line.chords, (count + _BLOCK - 1) // _BLOCK
    corners[0, count + 1 : blocks * _BLOCK + 1] = corners[0, count]
    corners[1, count + 1 : blocks * _BLOCK + 1] = corners[1, count]
    for k in range(blocks * _BLOCK):
        tx, ty = corners[0, k + 1] - corners[0, k], corners[1, k + 1] - corners[1, k]
        chords[_X, k], chords[_Y, k], chords[_ALONG_X, k], chords[_ALONG_Y, k] = corners[0, k], corners[1, k], tx, ty
        chords[_INVERSE, k] = 1.0 / (tx * tx + ty * ty + _TINY)
    for block in range(blocks):
        first, stop, square = block * _BLOCK, (block + 1) * _BLOCK, 0.0
        x, y = 0.5 * (corners[0, first] + corners[0, stop]), 0.5 * (corners[1, first] + corners[1, stop])
        for k in range(first, stop + 1):
            square = max(square, (corners[0, k] - x) ** 2 + (corners[1, k] - y) ** 2)
        line.blocks[_CENTRE_X, block], line.blocks[_CENTRE_Y, block] = x, y
        line.blocks[_RADIUS, block] = math.sqrt(square)
    return blocks


@subroutine(fast=True, no_alias=True)
def _fill_distances(x, y, chords, first, distances):
    """Fill the squared distances of a place from the chords of a block."""
    starts_x, starts_y, inverses = chords[_X, first:], chords[_Y, first:], chords[_INVERSE, first:]
    along_x, along_y = chords[_ALONG_X, first:], chords[_ALONG_Y, first:]
    for lane in range(len(distances)):
        ex, ey, tx, ty = x - starts_x[lane], y - starts_y[lane], along_x[lane], along_y[lane]
        part = (ex * tx + ey * ty) * inverses[lane]
        part = part if part > 0.0 else 0.0
        part = part if part < 1.0 else 1.0
        dx, dy = ex - part * tx, ey - part * ty
        distances[lane] = dx * dx + dy * dy


@subroutine()
def _distance(x, y, line, blocks, near):
    """The distance of a place from a line, and the block of its nearest chord; that of `near` is known first."""
    root = _distance_of_block(x, y, line, near)
    for block in range(blocks):
        dx, dy = x - line.blocks[_CENTRE_X, block], y - line.blocks[_CENTRE_Y, block]
        reach = line.blocks[_RADIUS, block] + root
        if dx * dx + dy * dy < reach * reach:
            own = _distance_of_block(x, y, line, block)
            root, near = (own, block) if own < root else (root, near)
    return root, near


@subroutine()
def _distance_of_block(x, y, line, block):
    """The distance of a place from a block of a line."""
    _fill_distances(x, y, line.chords, block * _BLOCK, line.distances)
    return math.sqrt(least_of(line.distances, _BLOCK // LANES_OF_TURN))


@subroutine()
def _measure(line, count, other, blocks, result):
    """Fill the largest and the mean distance of the middles of a line's chords from another line."""
    largest, total, length, near, x, y = 0.0, 0.0, 0.0, 0, line.corners[0], line.corners[1]
    for i in range(count):
        distance, near = _distance(0.5 * (x[i] + x[i + 1]), 0.5 * (y[i] + y[i + 1]), other, blocks, near)
        own = math.hypot(x[i + 1] - x[i], y[i + 1] - y[i])
        largest, total, length = max(largest, distance), total + own * distance, length + own
    result[HAUSDORFF], result[CHAMFER] = largest, total / (length + _TINY)


@subroutine()
def _trace(rows_of_curve, shape, first, span, rays, shapes, rows, corners):
    """Fill corners of the curve of a shape from a crank angle on."""
    for i in range(rays.shape[1]):
        angle = first + span * min(i, N_PARTS) / N_PARTS
        rays[0, i], rays[1, i] = cosine(angle), sine(angle)
    fill_rows(rows_of_curve, shape, rays, shapes, rows)
    for i in range(N_PARTS + 1):
        at = i // LANES * LANES * CURVE_SIZE + i % LANES
        corners[0, i], corners[1, i] = rows[at], rows[at + LANES]


@compiled(types.void(ROWS, _F2, _F2, types.boolean, _F2, _F2), allocates=True)
def measure_shapes(rows_of_curve, designs, points, is_closed, angles, shapes):
    """Measure how far traced curves are from the polygon of a path: fill `shapes` (n, N_SHAPES).

    The other arguments are those of `measure_ordered`, which fills the angles.
    """
    m, size, placed = len(points), designs.shape[1] - POSE_SIZE, np.empty((len(points), 2))
    polygon, traced, spare = _make_line(N_PARTS + m + 1), _make_line(N_PARTS), np.empty(size * LANES)
    n_rays = N_PARTS + LANES  # whole rows, of which the first of the last one is the end
    rays, rows = np.empty((2, n_rays)), np.empty(n_rays * CURVE_SIZE)
    there, back = np.empty(N_SHAPES), np.empty(N_SHAPES)
    for k in range(len(designs)):
        if math.isnan(designs[k, 0]):
            shapes[k] = math.nan
            continue
        own = angles[k]
        place_points(points, designs[k, size:], placed)
        count = _divide_polygon(placed, is_closed, polygon.corners)
        span = TURN if is_closed else own.max() - own.min()
        _trace(rows_of_curve, designs[k, :size], own.min(), span, rays, spare, rows, traced.corners)
        blocks, of_curve, near, largest = _fill_line(polygon, count), _fill_line(traced, N_PARTS), 0, 0.0
        _measure(polygon, count, traced, of_curve, there)
        _measure(traced, N_PARTS, polygon, blocks, back)
        for i in range(m):
            distance, near = _distance(placed[i, 0], placed[i, 1], traced, of_curve, near)
            largest = max(largest, distance)
        for i in range(0, N_PARTS + 1, N_PARTS):
            distance, _ = _distance(traced.corners[0, i], traced.corners[1, i], polygon, blocks, 0)
            largest = max(largest, distance)
        shapes[k, HAUSDORFF] = max(largest, there[HAUSDORFF], back[HAUSDORFF])
        shapes[k, CHAMFER] = 0.5 * (there[CHAMFER] + back[CHAMFER])
