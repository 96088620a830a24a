"""The curve of a point of a floating link: how it is called, and chords of it with the points' distances to these."""

import math

from explore.base.compiling import function_type
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN, place_of

# ``curve(shape, cosine, sine, out)`` fills the point at a crank angle and both derivatives by it, ``x, y, x', y', x'',
# y''``, in the frame of the linkage; then the same of the unit vector of its link, which only poses read.
#: Signature of the curve of a mechanism.
CURVE_SIGNATURE = "void(float64[::1], float64, float64, float64[::1])"
#: Type of the curve of a mechanism.
CURVE = function_type(CURVE_SIGNATURE)
#: Number of the numbers that a curve fills.
CURVE_SIZE = 12
#: Number of chords of a curve at first.
FEW_CHORDS = 128
#: Number of chords where fewer do not settle the order of the points.
MANY_CHORDS = 512

TURN = 2.0 * math.pi
_TINY = 1e-300


@subroutine()
def fill_corners(curve, shape, rays, count, out, xs, ys):
    """Fill the corners of so many chords, the first ones of chords as `rows` places them; return the arcs' mean height.

    The last corners of lanes follow the others. `rays` has the cosines and sines of MANY_CHORDS angles.
    """
    stride, parts = MANY_CHORDS // count, count // LANES_OF_TURN
    for lane in range(LANES_OF_TURN):
        for part in range(parts):
            ray, place = (lane * parts + part) * stride, part * LANES_OF_TURN + lane
            curve(shape, rays[0, ray], rays[1, ray], out)
            xs[place], ys[place] = out[0], out[1]
    for lane in range(LANES_OF_TURN):
        xs[count + lane], ys[count + lane] = xs[(lane + 1) % LANES_OF_TURN], ys[(lane + 1) % LANES_OF_TURN]
    height, before = 0.0, count - 1
    for lane in range(LANES_OF_TURN):
        for k in range(lane, count, LANES_OF_TURN):
            after = k + LANES_OF_TURN
            bx, by = xs[after] - 2.0 * xs[k] + xs[before], ys[after] - 2.0 * ys[k] + ys[before]
            height, before = height + math.sqrt(bx * bx + by * by), k
    return 0.125 * height / count


@subroutine(fast=True, no_alias=True)
def _fill_row(x, y, weight, xs, ys, count, row):
    for k in range(count):
        ex, ey = x - xs[k], y - ys[k]
        tx, ty = xs[k + LANES_OF_TURN] - xs[k], ys[k + LANES_OF_TURN] - ys[k]
        part = (ex * tx + ey * ty) / (tx * tx + ty * ty + _TINY)
        part = min(max(part, 0.0), 1.0)
        dx, dy = ex - part * tx, ey - part * ty
        row[k] = weight * (dx * dx + dy * dy)


@subroutine()
def fill_distances(points, weights, xs, ys, count, distances):
    """Fill the weighted squared distances of points, (n, 2), to so many chords of a turn."""
    for i in range(len(points)):
        _fill_row(points[i, 0], points[i, 1], weights[i], xs, ys, count, distances[i])


@subroutine()
def place_on_chord(x, y, xs, ys, count, chord):
    """The crank angle of the place on a chord that is nearest to a point, linear between its corners."""
    k = place_of(chord % count, count // LANES_OF_TURN)
    ex, ey = x - xs[k], y - ys[k]
    tx, ty = xs[k + LANES_OF_TURN] - xs[k], ys[k + LANES_OF_TURN] - ys[k]
    part = (ex * tx + ey * ty) / (tx * tx + ty * ty + _TINY)
    return (chord + min(max(part, 0.0), 1.0)) * (TURN / count)
