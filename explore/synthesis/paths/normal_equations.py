"""Normal equations of the ten numbers: added up point by point, without the angles, and solved within bounds."""

import math

from explore.base.subroutines import subroutine
from explore.synthesis.paths.numbers import LARGEST, LEAST, LOG_COUPLER, LOG_ROCKER, N_NUMBERS, longer_and_shorter

#: Least difference of the two transmission angles, rad.
_LEAST_GAP = 1e-3
#: Number that keeps quotients finite.
_TINY = 1e-300


@subroutine()
def solve(matrix, right, damping, factor, solution):
    """Solve (matrix + damping diagonal) solution = -right by Cholesky's method; the lower triangle is used."""
    n = N_NUMBERS
    for i in range(n):
        for j in range(i + 1):
            factor[i, j] = matrix[i, j]
        factor[i, i] = matrix[i, i] * (1.0 + damping) + _TINY
    for j in range(n):
        pivot = factor[j, j]
        for k in range(j):
            pivot -= factor[j, k] * factor[j, k]
        if not pivot > 1e-16 * factor[j, j]:
            pivot = 1e-16 * factor[j, j] + _TINY
        root = math.sqrt(pivot)
        factor[j, j] = root
        for i in range(j + 1, n):
            value = factor[i, j]
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            factor[i, j] = value / root
    for i in range(n):
        value = -right[i]
        for k in range(i):
            value -= factor[i, k] * solution[k]
        solution[i] = value / factor[i, i]
    for i in range(n - 1, -1, -1):
        value = solution[i]
        for k in range(i + 1, n):
            value -= factor[k, i] * solution[k]
        solution[i] = value / factor[i, i]


@subroutine()
def hold_number(matrix, right, number):
    """Leave a number as it is."""
    right[number] = 0.0
    for k in range(N_NUMBERS):
        if k < number:
            matrix[number, k] = 0.0
        elif k > number:
            matrix[k, number] = 0.0
    matrix[number, number] = 1.0


@subroutine()
def keep_within(matrix, normal, damping, factor, reach, step):
    """Take the part of a step away that leaves a linear bound, where the step would: `normal` is zero without one."""
    outward, is_bounded = 0.0, False
    for j in range(N_NUMBERS):
        outward += normal[j] * step[j]
        is_bounded = is_bounded or normal[j] != 0.0
    if not is_bounded or outward <= 0.0:
        return
    solve(matrix, normal, damping, factor, reach)  # the negative of the inverse times the normal
    length = 0.0
    for j in range(N_NUMBERS):
        length += normal[j] * reach[j]
    for j in range(N_NUMBERS):
        step[j] -= reach[j] * outward / length


@subroutine()
def bound_angles(numbers, lower, upper):
    """Bring numbers within their bounds, and the transmission angles apart."""
    for j in range(N_NUMBERS):
        numbers[j] = min(max(numbers[j], lower[j]), upper[j])
    numbers[LEAST] = min(numbers[LEAST], upper[LARGEST] - _LEAST_GAP)
    numbers[LARGEST] = max(numbers[LARGEST], numbers[LEAST] + _LEAST_GAP)


@subroutine()
def bound(numbers, lower, upper, shortest, longest):
    """Bring numbers within their bounds, and crank and ground to lengths allowed."""
    bound_angles(numbers, lower, upper)
    longer, shorter = longer_and_shorter(numbers)
    growth = min(max(math.log(shortest / shorter), 0.0), math.log(longest / longer))
    if growth != 0.0:
        for j in (LOG_COUPLER, LOG_ROCKER):
            numbers[j] = min(max(numbers[j] + growth, lower[j]), upper[j])


@subroutine()
def add_points(first, last, weights, lever, work, owner):
    """Add points that share an angle to the normal equations, and to the sums of that angle."""
    matrix, right, shares, sums = work.matrix, work.right, work.shares[owner], work.own[owner]
    for i in range(first, last):
        w, t, e = weights[i], work.tangents[i], work.errors[i]
        sums[0] += w * (t.real * t.real + t.imag * t.imag)
        sums[1] += work.gains[i]
        for j in range(N_NUMBERS):
            s = work.slopes[i, j]
            shares[j] += w * (t.real * s.real + t.imag * s.imag)
            right[j] += w * (s.real * e.real + s.imag * e.imag)
            for k in range(j + 1):
                o = work.slopes[i, k]
                matrix[j, k] += w * (s.real * o.real + s.imag * o.imag)
        if lever != 0.0:
            spin, turned = work.spins[i], work.turn_errors[i]
            sums[0] += w * spin * spin
            for j in range(N_NUMBERS):
                turn = work.turns[i, j]
                shares[j] += w * spin * turn
                right[j] += w * turn * turned
                for k in range(j + 1):
                    matrix[j, k] += w * turn * work.turns[i, k]


@subroutine()
def eliminate(matrix, right, shares, sums):
    """Take the part of an angle out of the normal equations."""
    for j in range(N_NUMBERS):
        right[j] -= shares[j] * sums[1] / sums[0]
        for k in range(j + 1):
            matrix[j, k] -= shares[j] * shares[k] / sums[0]
