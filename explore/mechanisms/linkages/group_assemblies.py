"""All assemblies of a group of links at a crank angle, and the one that a sketch is nearest to.

At given alpha the ties are linear in cos(beta) and sin(beta), which follow from both; that the sum of their squares
is 1 leaves a trigonometric polynomial of third order in alpha, so there are at most six assemblies. Its zeros are
found by halving cells until bounds of its derivatives show that there is none, or that it passes through 0 once.
"""

import math

import numpy as np

from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.group_ties import (
    PAIR_SIZE,
    STATE_SIZE,
    TIE_SIZE,
    correct_angles,
    evaluate_ties,
    exchange_links,
)

#: Order of the polynomial.
_ORDER = 3
#: Number of values that tell it.
_VALUES = 8
#: Number of the first cells of alpha.
_CELLS = 32
#: Overlap of cells, rad: a zero at a border is inside of one of them.
_OVERLAP = 1e-9
#: Half the width of the narrowest cell that is halved, rad.
_NARROWEST = 1e-7
#: Rounding error of the polynomial, relative to the sum of its coefficients.
_ROUNDING = 1e-13
#: Least determinant that cos(beta) and sin(beta) follow from, relative to the sum of its terms.
_LEAST_DETERMINANT = 1e-6
#: Least difference of two assemblies in how near they are to a sketch, which is between -2 and 2.
_LEAST_DIFFERENCE = 1e-6
#: Steps of Newton's method.
_STEPS = 8
#: Largest last step, rad.
_SETTLED = 1e-11


@subroutine(allocates=True)
def find_assembly(ties, angle, alpha, beta, state):
    """Fill the state that is nearest to alpha and beta at a crank angle.

    Return 1 if there is one, -1 if the group does not assemble there, and 0 if that is not decided. Where the search by
    alpha does not decide, that by beta mostly does: assemblies with the same alpha are double zeros of the polynomial.
    """
    found = _find_by_first(ties, angle, alpha, beta, state)
    if found == 0:
        exchanged = np.empty(2 * TIE_SIZE)
        for i in range(2):
            exchange_links(ties[i * TIE_SIZE :], exchanged[i * TIE_SIZE :])
        found = _find_by_first(exchanged, angle, beta, alpha, state)
        state[1], state[2] = state[2], state[1]
    return found


@subroutine(allocates=True)
def _find_by_first(ties, angle, alpha, beta, state):
    """`find_assembly` by the zeros of the polynomial in alpha."""
    coefficients, roots, best, second = np.empty(2 * _ORDER + 1), np.empty(2 * _ORDER + 1), -3.0, -3.0
    _find_coefficients(ties, angle, coefficients)
    count = _find_zeros(coefficients, roots)
    trial = np.empty(STATE_SIZE)
    for k in range(count):
        if not _complete(ties, angle, roots[k], trial):
            return 0
        nearness = math.cos(trial[1] - alpha) + math.cos(trial[2] - beta)
        if nearness > best:
            best, second = nearness, best
            for m in range(STATE_SIZE):
                state[m] = trial[m]
        elif nearness > second:
            second = nearness
    if count < 0 or (count > 1 and best - second < _LEAST_DIFFERENCE):
        return 0
    return 1 if count > 0 else -1


@subroutine()
def _solve_second(ties, cz, sz, alpha):
    """Cosine and sine of beta times their determinant, the determinant, and the sum of its terms."""
    cu, su = math.cos(alpha), math.sin(alpha)
    m1 = n1 = k1 = m2 = n2 = k2 = 0.0
    for i in range(2):
        tie = ties[i * TIE_SIZE :]
        cd, sd = cu * cz + su * sz, su * cz - cu * sz
        m1, n1, k1 = m2, n2, k2
        # the factor of w, whose cosine is beta's
        m2 = tie[5] + tie[9] * cz + tie[10] * sz + tie[11] * cu + tie[12] * su
        n2 = tie[9] * sz - tie[10] * cz + tie[11] * su - tie[12] * cu - tie[6]
        k2 = -(tie[0] + tie[1] * cz - tie[2] * sz + tie[3] * cu - tie[4] * su + tie[7] * cd - tie[8] * sd)
    determinant = m1 * n2 - n1 * m2
    return k1 * n2 - n1 * k2, m1 * k2 - k1 * m2, determinant, abs(m1 * n2) + abs(n1 * m2)


@subroutine(allocates=True)
def _find_coefficients(ties, angle, coefficients):
    """Fill the mean, and the coefficients of cosines and sines, of the polynomial."""
    cz, sz = math.cos(angle), math.sin(angle)
    for k in range(2 * _ORDER + 1):
        coefficients[k] = 0.0
    for j in range(_VALUES):
        alpha = 2.0 * math.pi * j / _VALUES
        c, s, d, _ = _solve_second(ties, cz, sz, alpha)
        value = (c * c + s * s - d * d) / _VALUES
        coefficients[0] += value
        for k in range(1, _ORDER + 1):
            coefficients[2 * k - 1] += 2.0 * value * math.cos(k * alpha)
            coefficients[2 * k] += 2.0 * value * math.sin(k * alpha)


@subroutine()
def _value(coefficients, alpha):
    """The polynomial and its derivative."""
    value, slope = coefficients[0], 0.0
    for k in range(1, _ORDER + 1):
        c, s = math.cos(k * alpha), math.sin(k * alpha)
        value += coefficients[2 * k - 1] * c + coefficients[2 * k] * s
        slope += k * (coefficients[2 * k] * c - coefficients[2 * k - 1] * s)
    return value, slope


@subroutine(allocates=True)
def _find_zeros(coefficients, roots):
    """Fill the zeros of the polynomial; return their number, -1 if it is not decided."""
    total, bend, count, waiting = abs(coefficients[0]), 0.0, 0, 0
    for k in range(1, _ORDER + 1):
        size = math.hypot(coefficients[2 * k - 1], coefficients[2 * k])
        total, bend = total + size, bend + k * k * size
    tiny, starts, widths = _ROUNDING * total, np.empty(128), np.empty(128)
    for j in range(_CELLS):
        starts[j], widths[j] = 2.0 * math.pi * j / _CELLS - _OVERLAP, math.pi / _CELLS + _OVERLAP
    waiting = _CELLS
    while waiting > 0:
        waiting -= 1
        start, half = starts[waiting], widths[waiting]
        middle = start + half
        value, slope = _value(coefficients, middle)
        if abs(value) > abs(slope) * half + 0.5 * bend * half * half + tiny:
            continue
        least = abs(slope) - bend * half
        if least > tiny:
            first, last = _value(coefficients, start)[0], _value(coefficients, start + 2.0 * half)[0]
            is_doubtful = min(abs(first), abs(last)) <= tiny and tiny > 0.5 * _OVERLAP * least
            if is_doubtful or count > 2 * _ORDER:
                return -1
            if (first >= 0.0) != (last >= 0.0):
                roots[count] = _zero_between(coefficients, start, start + 2.0 * half, slope > 0.0)
                count += 0 if _is_known(roots, count) else 1
            continue
        if half < _NARROWEST or waiting > 120:
            return -1
        for side in range(2):
            starts[waiting], widths[waiting] = start + side * half - _OVERLAP, 0.5 * half + _OVERLAP
            waiting += 1
    return count


@subroutine()
def _is_known(roots, count):
    """Whether a zero, behind the others, is one of them, found in the cell beside."""
    nearest = 1.0
    for k in range(count):
        nearest = min(nearest, abs(math.sin(0.5 * (roots[count] - roots[k]))))
    return nearest < 4.0 * _OVERLAP


@subroutine()
def _zero_between(coefficients, low, high, rises):
    """The zero of a function that rises or falls between two angles."""
    middle = 0.5 * (low + high)
    for _ in range(60):
        value, slope = _value(coefficients, middle)
        if (value > 0.0) == rises:
            high = middle
        else:
            low = middle
        moved = middle - value / slope
        middle = moved if moved > low and moved < high else 0.5 * (low + high)
    return middle


@subroutine(allocates=True)
def _complete(ties, angle, alpha, state):
    """Fill the state at a crank angle and about alpha; return whether it is one."""
    c, s, determinant, size = _solve_second(ties, math.cos(angle), math.sin(angle), alpha)
    if not abs(determinant) > _LEAST_DETERMINANT * size:
        return False
    state[0], state[1], state[2] = angle, alpha, math.atan2(s / determinant, c / determinant)
    pair, change = np.empty(PAIR_SIZE), 1.0
    for _ in range(_STEPS):
        evaluate_ties(ties, state, pair)
        change = correct_angles(pair, state)
    return change < _SETTLED and abs(state[1] - alpha) < 1e-3
