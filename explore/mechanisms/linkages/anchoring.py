"""The angle above which the nearest singularity of a turn stands, and the distance of all others.

The function f whose zero it is has a minimum near that angle. About there it is like c + q (1 - cos(theta - phi)), with
a zero at the distance delta above phi, cosh(delta) = 1 + c/q.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import NODES, node_angle, place_angle
from explore.mechanisms.linkages.harmonics import amplitude_ratio, zero_tangent

#: Half-tangent of the distance of singularities whose angle is looked for: equal steps do for farther ones.
NEAR = 0.3
#: Number of rounds that improve the angle of a minimum.
ROUNDS = 6
#: Step over which the slope of a slope is taken, rad.
STEP = 1e-4
#: Half-tangent of a distance over that of the nearest zero, up to which both are of one zero.
_SAME = 1.3
# Rows of the search: the function, -1 for none; both ends of the cell of its minimum, rad; the best angle and the one
# before, and the slope there; the excesses of the nearest minimum and of the next one.
_FUNCTION, _LOW, _HIGH, _ANGLE, _BEFORE, _SLOPE_BEFORE, _NEAREST, _SECOND = (row * LANES for row in range(8))
#: Size of the search.
SEARCH_SIZE = 8 * LANES
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"void({_F1}, int64, int64, float64, {_F1}, {_F1}, {_F1})")
def anchor_harmonics(values, factors, functions, farthest, distances, angles, others):
    """Fill the angle of the nearest zero of lanes where it is not the farthest, and the distance of the others.

    All functions are first harmonics; `values` are those of `harmonics.decide_harmonics`.
    """
    size = (2 * functions + factors) * LANES
    for lane in range(LANES):
        if not 0.0 < distances[lane] < farthest:
            continue
        nearest = others[lane] = 1.0
        for s in range(functions):
            first, second, third, fourth = (
                values[s * LANES + lane], values[size + s * LANES + lane], values[2 * size + s * LANES + lane],
                values[3 * size + s * LANES + lane],
            )  # fmt: skip
            tangent = zero_tangent(amplitude_ratio(first, second, third, fourth))
            others[lane] = min(others[lane], max(tangent, nearest))
            if tangent < nearest:
                # the nodes begin a quarter of a turn before the anchor
                nearest, angles[lane] = tangent, math.atan2(first - third, fourth - second)


@compiled(f"int64({_F1}, int64, int64, float64, {_F1}, {_F1}, {_F1})")
def begin_search(values, factors, functions, start, distances, others, search):
    """Begin at the minimum with the nearest zero of each lane with a near one; return the number of these lanes.

    Fill the half-tangents of the distances of the zeros above all other minima, at most `NEAR`.
    """
    size, found = (2 * functions + factors) * LANES, 0
    for lane in range(LANES):
        search[_FUNCTION + lane], search[_NEAREST + lane], search[_SECOND + lane] = -1.0, math.inf, math.inf
        search[_ANGLE + lane] = search[_BEFORE + lane] = start
    for s in range(functions):
        for cell in range(2 * (NODES - 1)):
            j = cell + cell // (NODES - 1)
            at, below = j * size + s * LANES, j * size + (functions + s) * LANES
            slopes, following = values[below : below + LANES], values[below + size : below + size + LANES]
            if _count_rises(slopes, following) == 0:
                continue
            for lane in range(LANES):
                if 0.0 < distances[lane] < NEAR and slopes[lane] < 0.0 <= following[lane]:
                    f0, f1, low = values[at + lane], values[at + size + lane], node_angle(start, 2.0 * math.pi, j)
                    _take_minimum(f0, f1, slopes[lane], following[lane], s, low, lane, search)
    for lane in range(LANES):
        second = search[_SECOND + lane]
        others[lane] = min(math.sqrt(second / (2.0 + second)) if second < math.inf else 1.0, NEAR)
        others[lane] = others[lane] if second > 0.0 else 0.0
        found += 1 if search[_FUNCTION + lane] >= 0.0 else 0
    return found


@subroutine(no_alias=True)
def _count_rises(slopes, following):
    """Number of lanes whose function falls at a node and rises at the next one."""
    count = 0
    for lane in range(len(slopes)):
        count += 1 if (slopes[lane] < 0.0) & (following[lane] >= 0.0) else 0
    return count


@subroutine()
def _take_minimum(f0, f1, d0, d1, function, low, lane, search):
    """Take the minimum of a function in a cell, from values and slopes at both ends, if it is the nearest so far."""
    width = math.pi / (NODES - 1)
    excess = _least(f0, f1, d0, d1, width) * width / (d1 - d0)
    search[_SECOND + lane] = min(search[_SECOND + lane], max(excess, search[_NEAREST + lane]))
    if excess < search[_NEAREST + lane]:
        search[_NEAREST + lane], search[_FUNCTION + lane] = excess, 1.0 * function
        search[_LOW + lane], search[_HIGH + lane] = low, low + width
        search[_BEFORE + lane], search[_SLOPE_BEFORE + lane] = low, d0
        search[_ANGLE + lane] = low + width * d0 / (d0 - d1)


@subroutine(inlined=True)
def _least(f0, f1, d0, d1, width):
    """Value of the cubic over a cell where a linear slope is 0."""
    share = d0 / (d0 - d1)
    rest = 1.0 - share
    values = (1.0 + 2.0 * share) * rest * rest * f0 + (1.0 + 2.0 * rest) * share * share * f1
    return values + width * share * rest * (rest * d0 - share * d1)


@compiled(f"void({_F1}, float64, {_F1}, {_F1})")
def place_search(search, step, tangents, anchors):
    """Fill half-tangents and anchors of the angles of the lanes, a step on."""
    for lane in range(LANES):
        tangents[lane], anchors[lane] = place_angle(search[_ANGLE + lane] + step)


@compiled(f"void({_F1}, int64, {_F1})")
def improve_search(marks, functions, search):
    """Improve the angles by the secant of the slopes, whose values are among the marks of a node."""
    for lane in range(LANES):
        if search[_FUNCTION + lane] < 0.0:
            continue
        angle, slope = search[_ANGLE + lane], marks[(functions + int(search[_FUNCTION + lane])) * LANES + lane]
        before, slope_before = search[_BEFORE + lane], search[_SLOPE_BEFORE + lane]
        search[_LOW + lane] = angle if slope < 0.0 else search[_LOW + lane]
        search[_HIGH + lane] = angle if slope >= 0.0 else search[_HIGH + lane]
        search[_BEFORE + lane], search[_SLOPE_BEFORE + lane] = angle, slope
        better = angle - slope * (angle - before) / (slope - slope_before) if slope != slope_before else angle
        inside = search[_LOW + lane] <= better <= search[_HIGH + lane]
        search[_ANGLE + lane] = better if inside else 0.5 * (search[_LOW + lane] + search[_HIGH + lane])


@compiled(f"void({_F1}, {_F1}, int64, {_F1}, {_F1}, {_F1})")
def end_search(here, beside, functions, search, distances, angles):
    """Fill the angles of minima above which the nearest zero stands; `beside` are the marks a `STEP` beside them."""
    for lane in range(LANES):
        if search[_FUNCTION + lane] >= 0.0:
            own = int(search[_FUNCTION + lane]) * LANES + lane
            curvature = (beside[own + functions * LANES] - here[own + functions * LANES]) / STEP
            if 0.0 < here[own] < curvature:
                excess = here[own] / curvature
                is_nearest = math.sqrt(excess / (2.0 + excess)) <= _SAME * distances[lane]
                angles[lane] = search[_ANGLE + lane] if is_nearest else math.nan
