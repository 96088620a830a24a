"""Distance of the nearest complex zero of the functions of a turn, from their values and slopes at its nodes.

A zero of a function f at the angle theta, the distance delta above the real axis, is a pole of 1/f, whose Fourier
coefficients of high orders k are sums of powers z^k of z = exp(i theta), |z| = exp(-delta): there the nearest poles
prevail (theorem of König). Four coefficients in a row tell the two z whose powers they are (method of Prony). One would
not do: zeros stand in pairs where a linkage is symmetric, and close together beside change points.

Nothing needs to be known of where zeros stand: those below a branch point of f belong to no minimum on the real axis.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import NODES
from explore.mechanisms.linkages.harmonics import amplitude_ratio, zero_tangent

#: Number of nodes of half a turn, each counted once.
_HALF = NODES - 1
#: Number of nodes of a quarter of a turn.
_QUARTER = _HALF // 2
#: Lowest order of the coefficients: in lower ones farther poles count, in higher ones rounding errors.
_LOWEST = 12
#: Number of coefficients, two fours in a row.
_COUNT = 5
#: Least share of one pole in a coefficient, over that of the other: below, it is made of rounding errors.
_LEAST_SHARE = 0.3
#: Least coefficient that is no rounding error, relative to the mean of 1/f.
_LEAST_COEFFICIENT = 1e-13
#: Largest exp(-delta) of a function with smaller coefficients.
_FAR = math.exp(-2.4)
#: Largest error of a slope by which a function is a first harmonic, relative to its mean.
_HARMONIC = 1e-10
#: Share of the half-tangent of a distance that is relied on, unless it is that of a first harmonic.
_RELIED = 0.94
#: Smallest divisor.
_TINY = 1e-300
#: First row of the samples at two nodes in the work space, behind the real and imaginary parts of the coefficients.
_SAMPLES = 2 * _COUNT
#: Row of the mean of 1/f.
_MEAN = _SAMPLES + 4
#: Row of the largest error of a slope.
_ERROR = _SAMPLES + 5
#: Row that tells, by 1, lanes whose function is no first harmonic.
_IS_OTHER = _SAMPLES + 6
#: Number of rows of the work space.
WORK_ROWS = _SAMPLES + 7
#: Orders times the angle, node after node of half a turn, order after order.
_ANGLES = [order * math.pi * j / _HALF for order in range(_LOWEST, _LOWEST + _COUNT) for j in range(_HALF)]
#: Cosines of these angles.
_COSINES = tuple(map(math.cos, _ANGLES))
#: Sines of these angles.
_SINES = tuple(map(math.sin, _ANGLES))
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"void({_F1}, int64, int64, {_F1}, {_F1})", no_alias=True)
def locate(values, factors, functions, distances, work):
    """Fill the half-tangent of the distance of the nearest complex zero of all functions, tanh(delta/2).

    `values` has the rows of all nodes of a turn; see `turning`. `work` has WORK_ROWS rows.
    """
    size, slopes = (2 * functions + factors) * LANES, functions * LANES
    for lane in range(LANES):
        distances[lane] = 1.0
    for s in range(functions):
        function = values[s * LANES :]
        if _locate_harmonic(function, size, slopes, distances, work) > 0:
            _sum_coefficients(function, size, slopes, work)
            _locate_pole(distances, work)


@subroutine(contract=True, no_alias=True)
def _locate_harmonic(function, size, slopes, distances, work):
    """Take the zero of a first harmonic a - b cos(theta - phi), cosh(delta) = a/b; return the number of other lanes."""
    after, opposite = function[_QUARTER * size :], function[(_HALF + 1) * size :]
    before = function[(_HALF + 1 + _QUARTER) * size :]
    error, is_other = work[_ERROR * LANES :], work[_IS_OTHER * LANES :]
    for lane in range(LANES):
        error[lane] = 0.0
    for j in range(2 * _HALF):
        # the slope of a first harmonic is by how much its value a quarter of a turn later exceeds the mean
        later = (j + _QUARTER) % (2 * _HALF)
        slope, value = function[(j + j // _HALF) * size + slopes :], function[(later + later // _HALF) * size :]
        for lane in range(LANES):
            own = abs(slope[lane] - value[lane] + 0.5 * (function[lane] + opposite[lane]))
            error[lane] = own if own > error[lane] else error[lane]
    others = 0
    for lane in range(LANES):
        mean = 0.5 * (function[lane] + opposite[lane])
        tangent = zero_tangent(amplitude_ratio(function[lane], after[lane], opposite[lane], before[lane]))
        is_harmonic = error[lane] <= _HARMONIC * abs(mean)
        distances[lane] = tangent if is_harmonic & (tangent < distances[lane]) else distances[lane]
        is_other[lane] = 0.0 if is_harmonic else 1.0
        others += 0 if is_harmonic else 1
    return others


@subroutine(contract=True, no_alias=True)
def _sum_coefficients(function, size, slopes, work):
    """Fill the coefficients of 1/f, times the square of the number n of nodes, and the mean, times the same.

    Sums of h exp(i k theta), h = 1/f, and of those of its slope h' have coefficients of the orders k and n - k in them;
    from ((n - k) h + i h') exp(i k theta) the latter drop out.
    """
    mean, sums, differences = work[_MEAN * LANES :], work[_SAMPLES * LANES :], work[(_SAMPLES + 2) * LANES :]
    for k in range(2 * _COUNT * LANES):
        work[k] = 0.0
    for lane in range(LANES):
        mean[lane] = 0.0
    for j in range(_HALF):
        here, there = function[j * size :], function[(j + _HALF + 1) * size :]
        for lane in range(LANES):
            one, other = 1.0 / here[lane], 1.0 / there[lane]
            slope, opposite = -here[slopes + lane] * one * one, -there[slopes + lane] * other * other
            # half a turn later exp(i k theta) is the same for even k, the opposite for odd k
            sums[lane], sums[LANES + lane] = one + other, slope + opposite
            differences[lane], differences[LANES + lane] = one - other, slope - opposite
            mean[lane] += (one + other) * (2.0 * _HALF)
        for k in range(_COUNT):
            samples = sums if (_LOWEST + k) % 2 == 0 else differences
            cosine, sine, weight = _COSINES[k * _HALF + j], _SINES[k * _HALF + j], 2.0 * _HALF - _LOWEST - k
            real, imaginary = work[2 * k * LANES :], work[(2 * k + 1) * LANES :]
            for lane in range(LANES):
                real[lane] += weight * cosine * samples[lane] - sine * samples[LANES + lane]
                imaginary[lane] += weight * sine * samples[lane] + cosine * samples[LANES + lane]


@subroutine(contract=True, no_alias=True)
def _locate_pole(distances, work):
    """Take the nearest pole of which the coefficients tell, in lanes whose function is no first harmonic."""
    mean, is_other = work[_MEAN * LANES :], work[_IS_OTHER * LANES :]
    for lane in range(LANES):
        scale = 1.0 / mean[lane]
        ax, ay = work[lane] * scale, work[LANES + lane] * scale
        bx, by = work[2 * LANES + lane] * scale, work[3 * LANES + lane] * scale
        cx, cy = work[4 * LANES + lane] * scale, work[5 * LANES + lane] * scale
        dx, dy = work[6 * LANES + lane] * scale, work[7 * LANES + lane] * scale
        ex, ey = work[8 * LANES + lane] * scale, work[9 * LANES + lane] * scale
        one = _largest_base(ax, ay, bx, by, cx, cy, dx, dy)
        other = _largest_base(bx, by, cx, cy, dx, dy, ex, ey)
        # a pole that only rounding errors make is nearer in one of the two
        square = one if one < other else other
        modulus = math.sqrt(square) if square < 1.0 else 1.0
        modulus = _FAR if ax * ax + ay * ay < _LEAST_COEFFICIENT * _LEAST_COEFFICIENT else modulus
        tangent = _RELIED * (1.0 - modulus) / (1.0 + modulus)
        is_nearer = (is_other[lane] == 1.0) & (tangent < distances[lane])
        distances[lane] = tangent if is_nearer else distances[lane]


@subroutine(contract=True, inlined=True)
def _largest_base(ax, ay, bx, by, cx, cy, dx, dy):
    """Square of the larger modulus of z and w, where a, b, c, d are A z^n + B w^n, n = 0 ... 3.

    These are the roots of p z^2 + q z + r. One with a small share in a does not count.
    """
    px, py = ax * cx - ay * cy - bx * bx + by * by, ax * cy + ay * cx - 2.0 * bx * by
    qx, qy = bx * cx - by * cy - ax * dx + ay * dy, bx * cy + by * cx - ax * dy - ay * dx
    rx, ry = bx * dx - by * dy - cx * cx + cy * cy, bx * dy + by * dx - 2.0 * cx * cy
    # the square root of q^2 - 4 p r
    x, y = qx * qx - qy * qy - 4.0 * (px * rx - py * ry), 2.0 * qx * qy - 4.0 * (px * ry + py * rx)
    large = math.sqrt(0.5 * (math.sqrt(x * x + y * y) + abs(x)))
    small = 0.5 * abs(y) / (large + _TINY)
    x, y = large if x >= 0.0 else small, (small if x >= 0.0 else large) * (1.0 if y >= 0.0 else -1.0)
    # 2 p z and 2 p w, then A and B times 2 p (z - w)
    zx, zy, wx, wy = x - qx, y - qy, -x - qx, -y - qy
    ex, ey = 2.0 * (px * bx - py * by), 2.0 * (px * by + py * bx)
    ux, uy, vx, vy = ex - wx * ax + wy * ay, ey - wx * ay - wy * ax, zx * ax - zy * ay - ex, zx * ay + zy * ax - ey
    of_z, of_w = ux * ux + uy * uy, vx * vx + vy * vy
    z, w = zx * zx + zy * zy, wx * wx + wy * wy
    largest = z if of_z > _LEAST_SHARE * _LEAST_SHARE * of_w else 0.0
    largest = w if (of_w > _LEAST_SHARE * _LEAST_SHARE * of_z) & (w > largest) else largest
    square = 0.25 * largest / (px * px + py * py)
    # p, q and r of a single pole may all be 0
    return square if square > 0.0 else (bx * bx + by * by) / (ax * ax + ay * ay)
