"""Distance of the nearest complex zero of the functions of a turn, from their values and slopes at its nodes.

A zero of a function f at the angle theta, the distance delta above the real axis, is a pole of 1/f, whose Fourier
coefficients of high orders k are sums of powers z^k of z = exp(i theta), |z| = exp(-delta): there the nearest poles
prevail (theorem of König). Four coefficients, of orders that are equally far apart, tell the two powers of z that they
are sums of (method of Prony). One would not do: zeros stand in pairs where a linkage is symmetric, and close together
beside change points.

Where f repeats after half a turn or a third, or nearly so, there are two or three times as many poles, but no more of
their squares or cubes, which orders two or three apart tell. Of the three distances the least counts.

Nothing needs to be known of where zeros stand: those below a branch point of f belong to no minimum on the real axis.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.lanes.elementary import exponential, logarithm
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import NODES
from explore.mechanisms.linkages.harmonics import MOST_HARMONICS, amplitude_ratio, zero_tangent

#: Number of nodes of half a turn, each counted once.
_HALF = NODES - 1
#: Number of nodes of a quarter of a turn.
_QUARTER = _HALF // 2
#: Orders of the coefficients: in lower ones farther poles count, in higher ones rounding errors.
_ORDERS = (12, 13, 14, 15, 16, 6, 9, 10, 18)
#: Number of coefficients.
_COUNT = len(_ORDERS)
#: Number of the first coefficients, which are in a row.
_IN_A_ROW = 5
#: Two fours of coefficients one, two and three orders apart.
_FOURS = (((0, 1, 2, 3), (1, 2, 3, 4)), ((7, 0, 2, 4), (0, 2, 4, 8)), ((5, 6, 0, 3), (6, 0, 3, 8)))
#: Least share of one pole in a coefficient, over that of the other: below, it is made of rounding errors.
_LEAST_SHARE = 0.3
#: Least coefficient that is no rounding error, relative to the mean of 1/f.
_LEAST_COEFFICIENT = 1e-13
#: Distance of a function with smaller coefficients.
_FAR = 2.4
#: Least coefficient of a pole at the distance delta that all fours may miss, relative to exp(-k delta).
_LEAST_RESIDUE = 0.5
#: Least distance at which it counts: coefficients of nearer poles are no rounding errors.
_LEAST_ROUNDED = 1.3
#: Least coefficient of a pole for whose sake more fours are tried, relative to exp(-k delta).
_LEAST_TRIED = 0.5
#: Largest difference of two equal distances, relative.
_SAME = 3e-4
#: Distance below which the nearer of two differing ones is taken; beyond it a pole may be made of rounding errors.
_NEAR = 0.22
#: Largest error of a slope by which a function is a first harmonic, relative to its mean.
_HARMONIC = 1e-10
#: Share of the half-tangent of a distance that is relied on, unless it is that of a first harmonic.
_RELIED = 0.94
#: Smallest divisor.
_TINY = 1e-300
#: First row of the samples in the work space, behind the real and imaginary parts of the coefficients.
_SAMPLES = 2 * _COUNT
#: Rows of the samples of a node of a quarter of a turn.
_SAMPLE_ROWS = 8
#: Row of the mean of 1/f.
_MEAN = _SAMPLES + _SAMPLE_ROWS * (_QUARTER + 1)
#: Row of the largest error of a slope.
_ERROR = _MEAN + 1
#: Row that tells, by 1, lanes whose function is no first harmonic.
_IS_OTHER = _MEAN + 2
#: Row of the logarithm of the square of the largest of three coefficients.
_LARGEST = _MEAN + 3
#: Row that tells, by 1, lanes in doubt.
_DOUBT = _MEAN + 4
#: Row of the distance.
_DISTANCE = _MEAN + 5
#: First of two rows of the distances of two fours.
_TWO = _MEAN + 6
#: Number of rows of the work space.
WORK_ROWS = _TWO + 2
#: Orders times the angle, node after node of a quarter of a turn, order after order.
_ANGLES = [order * math.pi * j / _HALF for order in _ORDERS for j in range(_QUARTER + 1)]
#: Cosines of these angles.
_COSINES = tuple(map(math.cos, _ANGLES))
#: Sines of these angles.
_SINES = tuple(map(math.sin, _ANGLES))
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"void({_F1}, int64, int64, int64, {_F1}, {_F1}, {_F1})", no_alias=True)
def locate(values, factors, functions, harmonics, verdicts, distances, work):
    """Fill the half-tangent of the distance of the nearest complex zero of all functions, tanh(delta/2).

    `values` has the rows of all nodes of a turn, and `verdicts` the verdict of each lane; see `turning`. That of a lane
    that is blocked is 0. `harmonics` are the bits of functions that are known to be first harmonics; `work` has
    WORK_ROWS rows.
    """
    size, slopes = (2 * functions + factors) * LANES, functions * LANES
    for lane in range(LANES):
        distances[lane] = 1.0 if verdicts[lane] >= 0.0 else 0.0
    for s in range(functions):
        function = values[s * LANES :]
        is_known = s < MOST_HARMONICS and harmonics >> s & 1 == 1
        if _locate_harmonic(function, size, slopes, is_known, verdicts, distances, work) > 0:
            _fold_samples(function, size, slopes, work)
            _locate_pole(distances, work)


@subroutine(contract=True, no_alias=True)
def _locate_harmonic(function, size, slopes, is_known, verdicts, distances, work):
    """Take the zero of a first harmonic a - b cos(theta - phi), cosh(delta) = a/b; return the number of other lanes.

    Lanes that are blocked are no others, nor is any lane of a function that is known to be one.
    """
    after, opposite = function[_QUARTER * size :], function[(_HALF + 1) * size :]
    before = function[(_HALF + 1 + _QUARTER) * size :]
    error, is_other = work[_ERROR * LANES :], work[_IS_OTHER * LANES :]
    for lane in range(LANES):
        error[lane] = 0.0 if verdicts[lane] >= 0.0 else math.inf
    for j in range(0 if is_known else 2 * _HALF):
        # the slope of a first harmonic is by how much its value a quarter of a turn later exceeds the mean
        later, others = (j + _QUARTER) % (2 * _HALF), 0
        slope, value = function[(j + j // _HALF) * size + slopes :], function[(later + later // _HALF) * size :]
        for lane in range(LANES):
            mean = 0.5 * (function[lane] + opposite[lane])
            own = abs(slope[lane] - value[lane] + mean)
            error[lane] = own if own > error[lane] else error[lane]
            others += 0 if error[lane] <= _HARMONIC * abs(mean) else 1
        if others == LANES:
            break
    others = 0
    for lane in range(LANES):
        mean = 0.5 * (function[lane] + opposite[lane])
        tangent = zero_tangent(amplitude_ratio(function[lane], after[lane], opposite[lane], before[lane]))
        is_harmonic = error[lane] <= _HARMONIC * abs(mean)
        distances[lane] = tangent if is_harmonic & (tangent < distances[lane]) else distances[lane]
        is_other[lane] = 0.0 if is_harmonic | (error[lane] == math.inf) else 1.0
        others += 1 if is_other[lane] == 1.0 else 0
    return others


@subroutine(contract=True, no_alias=True)
def _fold_samples(function, size, slopes, work):
    """Fill the samples of 1/f and of its slope, of four angles together, and the mean, times n^2 for n nodes.

    From the angle to its opposite exp(i k theta) changes its sign for odd orders k, and to half a turn less the angle
    its cosine does for odd and its sine for even ones. The rows of a node are, for even orders and then for odd ones,
    what cosines and sines are multiplied by, of 1/f and of the slope.
    """
    mean = work[_MEAN * LANES :]
    for lane in range(LANES):
        mean[lane] = 0.0
    for j in range(_QUARTER + 1):
        first, second = function[j * size :], function[(j + _HALF + 1) * size :]
        third, fourth = function[(_HALF - j) * size :], function[(2 * _HALF + 1 - j) * size :]
        slope1, slope2, slope3, slope4 = first[slopes:], second[slopes:], third[slopes:], fourth[slopes:]
        # the first and the last are two angles, each twice
        share, to = 0.5 if j % _QUARTER == 0 else 1.0, work[(_SAMPLES + _SAMPLE_ROWS * j) * LANES :]
        for lane in range(LANES):
            f1, f2, f3, f4 = 1.0 / first[lane], 1.0 / second[lane], 1.0 / third[lane], 1.0 / fourth[lane]
            g1, g2 = -slope1[lane] * f1 * f1, -slope2[lane] * f2 * f2
            g3, g4 = -slope3[lane] * f3 * f3, -slope4[lane] * f4 * f4
            f1, f2, f3, f4 = f1 + f2, f1 - f2, f3 + f4, f3 - f4
            g1, g2, g3, g4 = g1 + g2, g1 - g2, g3 + g4, g3 - g4
            to[lane], to[LANES + lane] = share * (f1 + f3), share * (f1 - f3)
            to[2 * LANES + lane], to[3 * LANES + lane] = share * (g1 + g3), share * (g1 - g3)
            to[4 * LANES + lane], to[5 * LANES + lane] = share * (f2 - f4), share * (f2 + f4)
            to[6 * LANES + lane], to[7 * LANES + lane] = share * (g2 - g4), share * (g2 + g4)
            mean[lane] += share * (f1 + f3)
    for lane in range(LANES):
        mean[lane] *= 2.0 * _HALF


@subroutine(contract=True, no_alias=True)
def _sum_coefficients(first, last, work):
    """Fill some of the coefficients of 1/f, relative to its mean.

    Sums of h exp(i k theta), h = 1/f, and of those of its slope h' have coefficients of the orders k and n - k in them;
    from ((n - k) h + i h') exp(i k theta) the latter drop out.
    """
    mean = work[_MEAN * LANES : (_MEAN + 1) * LANES]
    for k in range(first, last):
        real, imaginary, weight = work[2 * k * LANES :], work[(2 * k + 1) * LANES :], 2.0 * _HALF - _ORDERS[k]
        for lane in range(LANES):
            real[lane] = imaginary[lane] = 0.0
        for j in range(0, _QUARTER + 1, 3):
            at = k * (_QUARTER + 1) + j
            c0, c1, c2 = _COSINES[at], _COSINES[at + 1], _COSINES[at + 2]
            s0, s1, s2 = _SINES[at], _SINES[at + 1], _SINES[at + 2]
            one = work[(_SAMPLES + _SAMPLE_ROWS * j + _SAMPLE_ROWS // 2 * (_ORDERS[k] % 2)) * LANES :]
            two, three = one[_SAMPLE_ROWS * LANES :], one[2 * _SAMPLE_ROWS * LANES :]
            for lane in range(LANES):
                of_cosines = c0 * one[lane] + c1 * two[lane] + c2 * three[lane]
                of_sines = s0 * one[LANES + lane] + s1 * two[LANES + lane] + s2 * three[LANES + lane]
                slopes = c0 * one[2 * LANES + lane] + c1 * two[2 * LANES + lane] + c2 * three[2 * LANES + lane]
                others = s0 * one[3 * LANES + lane] + s1 * two[3 * LANES + lane] + s2 * three[3 * LANES + lane]
                real[lane] += weight * of_cosines - others
                imaginary[lane] += weight * of_sines + slopes
        for lane in range(len(mean)):
            scale = 1.0 / mean[lane]
            real[lane], imaginary[lane] = real[lane] * scale, imaginary[lane] * scale


@subroutine(contract=True, no_alias=True)
def _locate_pole(distances, work):
    """Take the nearest pole of which the coefficients tell, in lanes whose function is no first harmonic."""
    _sum_coefficients(0, _IN_A_ROW, work)
    _find_largest(work)
    _try_fours(0, work)
    if _count_doubtful(distances, work) > 0:
        _sum_coefficients(_IN_A_ROW, _COUNT, work)
        _try_fours(1, work)
        _try_fours(2, work)
    largest, is_other = work[_LARGEST * LANES :], work[_IS_OTHER * LANES :]
    found, doubt = work[_DISTANCE * LANES :], work[_DOUBT * LANES :]
    for lane in range(LANES):
        rounded = -0.5 / _ORDERS[0] * largest[lane] + math.log(_LEAST_RESIDUE) / _ORDERS[0]
        rounded = rounded if rounded > _LEAST_ROUNDED else _LEAST_ROUNDED
        distance = rounded if (doubt[lane] == 1.0) & (rounded < found[lane]) else found[lane]
        distance = _FAR if largest[lane] < 2.0 * math.log(_LEAST_COEFFICIENT) else distance
        modulus = exponential(-distance)
        # in each coefficient is a part of one that is as many orders above as there are nodes, here of half of them
        power = modulus * modulus * modulus * modulus
        power = power * power * power * power
        power = power if doubt[lane] == 1.0 else power * power
        tangent = _RELIED * (1.0 - power) * (1.0 - modulus) / (1.0 + modulus)
        is_nearer = (is_other[lane] == 1.0) & (tangent < distances[lane])
        distances[lane] = tangent if is_nearer else distances[lane]


@subroutine(contract=True, no_alias=True)
def _find_largest(work):
    """Fill the logarithm of the square of the largest of three coefficients in a row: one at least is no small one."""
    largest, doubt = work[_LARGEST * LANES :], work[_DOUBT * LANES :]
    for lane in range(LANES):
        one = work[lane] * work[lane] + work[LANES + lane] * work[LANES + lane]
        two = work[2 * LANES + lane] * work[2 * LANES + lane] + work[3 * LANES + lane] * work[3 * LANES + lane]
        three = work[4 * LANES + lane] * work[4 * LANES + lane] + work[5 * LANES + lane] * work[5 * LANES + lane]
        square = one if one > two else two
        square = three if three > square else square
        largest[lane], doubt[lane] = logarithm(square if square > _TINY else _TINY), 1.0


@subroutine(contract=True, no_alias=True)
def _try_fours(number, work):
    """Take the distance of two fours of coefficients in lanes in doubt, if it is less or the first."""
    two, found, doubt = work[_TWO * LANES :], work[_DISTANCE * LANES :], work[_DOUBT * LANES :]
    for which in range(2):
        a, b, c, d = _FOURS[number][which]
        first, second, distance = work[2 * a * LANES :], work[2 * b * LANES :], two[which * LANES :]
        third, fourth = work[2 * c * LANES :], work[2 * d * LANES :]
        for lane in range(LANES):
            square = _largest_base(
                first[lane], first[LANES + lane], second[lane], second[LANES + lane],
                third[lane], third[LANES + lane], fourth[lane], fourth[LANES + lane],
            )  # fmt: skip
            square = square if square < 1.0 else 1.0
            distance[lane] = -0.5 / (1.0 + number) * logarithm(square if square > _TINY else _TINY)
    for lane in range(LANES):
        one, other = two[lane], two[LANES + lane]
        nearer, farther = one if one < other else other, other if one < other else one
        distance = nearer if farther < _NEAR else farther
        is_taken = (number == 0) | ((doubt[lane] == 1.0) & (distance < found[lane]))
        found[lane] = distance if is_taken else found[lane]


@subroutine(contract=True, no_alias=True)
def _count_doubtful(distances, work):
    """Tell the lanes in which two fours differ and that may be nearer than other functions; return their number."""
    two, found, doubt = work[_TWO * LANES :], work[_DISTANCE * LANES :], work[_DOUBT * LANES :]
    largest, is_other, doubtful = work[_LARGEST * LANES :], work[_IS_OTHER * LANES :], 0
    for lane in range(LANES):
        nearest = -0.5 / _ORDERS[0] * largest[lane] + math.log(_LEAST_TRIED) / _ORDERS[0]
        modulus = exponential(-nearest)
        differs = abs(two[lane] - two[LANES + lane]) > _SAME * found[lane]
        is_doubtful = differs & (is_other[lane] == 1.0) & (1.0 - modulus < distances[lane] * (1.0 + modulus))
        doubt[lane] = 1.0 if is_doubtful else 0.0
        doubtful += 1 if is_doubtful else 0
    return doubtful


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
