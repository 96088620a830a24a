"""Path errors of designs for points with crank angles, which count from the frame or from any angle."""

import math

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE, LEAST_BEND, SURE_STEP, TURN
from explore.mechanisms.targets.path_errors.measuring import (
    FIXED,
    POSE_SIZE,
    SPAN,
    TOGETHER,
    make_place,
    measure,
    place_points,
)

#: Number of evenly spread shifts of all angles that are tried.
_N_SHIFTS = 96
#: Largest number of Newton's steps from a shift that is better than its neighbours.
_MOST_STEPS = 40
#: Longest step that is the last, because the next would be of the size of its square, rad.
_SHORT = 1e-9

_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@subroutine()
def _sum_at(curve, shape, points, weights, given, shift, out, slopes):
    """The weighted sum of squares at shifted angles; `slopes` receives halves of its derivatives by the shift.

    They are the first one, the second one, and the part of the second that is never negative.
    """
    total, slope, bend, square = 0.0, 0.0, 0.0, 0.0
    for i in range(len(points)):
        angle = given[i] + shift
        curve(shape, math.cos(angle), math.sin(angle), out)
        dx, dy, w = out[0] - points[i, 0], out[1] - points[i, 1], weights[i]
        total += w * (dx * dx + dy * dy)
        slope += w * (dx * out[2] + dy * out[3])
        square += w * (out[2] * out[2] + out[3] * out[3])
        bend += w * (dx * out[4] + dy * out[5])
    slopes[0], slopes[1], slopes[2] = slope, bend + square, square
    return total


@subroutine()
def _improve(curve, shape, points, weights, given, shift, out, slopes):
    """The least sum near a shift, and where it is."""
    least = _sum_at(curve, shape, points, weights, given, shift, out, slopes)
    for _ in range(_MOST_STEPS):
        step = -slopes[0] / (slopes[1] if slopes[1] > LEAST_BEND * slopes[2] else slopes[2])
        step = min(max(step, -TURN / _N_SHIFTS), TURN / _N_SHIFTS)
        found = _sum_at(curve, shape, points, weights, given, shift + step, out, slopes)
        while found > least and abs(step) > SURE_STEP:
            step *= 0.25
            found = _sum_at(curve, shape, points, weights, given, shift + step, out, slopes)
        shift, least = shift + step, found
        if abs(step) <= _SHORT:
            break
    return least, shift


@subroutine()
def _fill_corners(curve, shape, rays, out, corners):
    """Fill places of the curve at the shifts, and their derivatives over one, of two turns."""
    for k in range(_N_SHIFTS):
        curve(shape, rays[0, k], rays[1, k], out)
        for row in range(4):
            corners[row, k] = corners[row, k + _N_SHIFTS] = out[row] * (1.0 if row < 2 else TURN / _N_SHIFTS)


@subroutine(fast=True, no_alias=True)
def _add_squares(x, y, weight, part, begin, corners, sums):
    """Add the squares of a point at all shifts, at the same part of the arc behind each: the cubics of their ends."""
    rest = 1.0 - part
    start, stop = rest * rest * (1.0 + 2.0 * part), part * part * (1.0 + 2.0 * rest)
    leaving, arriving = part * rest * rest, -part * part * rest
    for k in range(_N_SHIFTS):
        j = begin + k
        dx = start * corners[0, j] + stop * corners[0, j + 1] + leaving * corners[2, j] + arriving * corners[2, j + 1]
        dy = start * corners[1, j] + stop * corners[1, j + 1] + leaving * corners[3, j] + arriving * corners[3, j + 1]
        sums[k] += weight * ((dx - x) ** 2 + (dy - y) ** 2)


@subroutine()
def _best_shift(curve, shape, points, weights, given, rays, corners, out, slopes, sums):
    """The shift of the least sum: the best of those near the local minima among evenly spread ones.

    At these, cubics between the shifts stand for the curve.
    """
    _fill_corners(curve, shape, rays, out, corners)
    sums[:] = 0.0
    for i in range(len(points)):
        place = given[i] * (_N_SHIFTS / TURN)
        first = math.floor(place)
        _add_squares(points[i, 0], points[i, 1], weights[i], place - first, int(first) % _N_SHIFTS, corners, sums)
    least, best = math.inf, 0.0
    for k in range(_N_SHIFTS):
        if sums[k] <= sums[k - 1] and sums[k] <= sums[(k + 1) % _N_SHIFTS]:
            found, shift = _improve(curve, shape, points, weights, given, k * (TURN / _N_SHIFTS), out, slopes)
            if found < least:
                least, best = found, shift
    return best


@compiled(types.void(CURVE, _F2, _F2, _F1, _F1, types.boolean, _F2, _F2), allocates=True)
def measure_timed(curve, designs, points, weights, given, is_free, measures, angles):
    """Measure designs against points with crank angles, `given` (m,), rad.

    If `is_free`, all of them may be shifted by the same; else they count from the frame. The other arguments are those
    of `measure_ordered`.
    """
    m, out, slopes, sums = len(points), np.empty(CURVE_SIZE), np.empty(3), np.empty(_N_SHIFTS)
    placed, corners, size = np.empty((m, 2)), np.empty((4, 2 * _N_SHIFTS)), designs.shape[1] - POSE_SIZE
    place, given_by = make_place(size), TOGETHER if is_free else FIXED
    turns = np.arange(_N_SHIFTS) * (TURN / _N_SHIFTS)
    rays = np.stack((np.cos(turns), np.sin(turns)))
    for k in range(len(designs)):
        if math.isnan(designs[k, 0]):
            measures[k], angles[k] = math.nan, math.nan
            continue
        shape, pose = designs[k, :size], designs[k, size:]
        place_points(points, pose, placed)
        shift = 0.0
        if is_free:
            shift = _best_shift(curve, shape, placed, weights, given, rays, corners, out, slopes, sums)
        for i in range(m):
            angles[k, i] = given[i] + shift
        measure(curve, shape, placed, weights, angles[k], given_by, pose, place, measures[k])
        measures[k, SPAN] = given.max() - given.min()
