"""A group of four links followed along the crank angle, each step of which is proved (test of Krawczyk).

A step goes from one assembly along the parabola that touches its path. It is sure if a square about the parabola holds
one assembly at each crank angle: with the inverse P of the slopes at the start, what the parabola misses, times P, and
by how much P times the slopes differs from 1 in the square, times its half width r, are less than r together. All
derivatives are bounded by the lengths of the chains. A path that ends does so where two assemblies meet (a fold).
"""

import math

import numpy as np

from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.group_chains import (
    CHAIN_SIZE,
    CURVING,
    INVERSE,
    PAIR_SIZE,
    STATE_SIZE,
    TERM_SIZE,
    correct_angles,
    derive_angles,
    evaluate_chains,
    length_of,
)

#: Largest number of states of a path.
MOST_STATES = 4096
#: The path goes on: it has the crank angle that it was followed to.
REACHED = 1
#: The path ends in a fold.
FOLDED = 2
#: The path is lost: two assemblies are nearer to each other than steps can tell.
LOST = 0
#: Longest step, rad.
_LONGEST = 0.25
#: Shortest step, rad.
_SHORTEST = 1e-12
#: Distance of a fold from where it is looked for, rad.
_NEAR_FOLD = 1e-7
#: Share of the square that the terms of the test may take.
_SURE = 0.9
#: Share of the slopes that their change within the square may take.
_SHARE = 0.25
#: Rounding error of V.V, relative to the square of the sum of the lengths.
_ROUNDING = 1e-14
#: Rounding error of V, relative to the sum of the lengths: a few units.
_FEW_UNITS = 1e-15
#: Steps of Newton's method.
_MOST_STEPS = 12
#: Smallest change of an angle that is no rounding error, rad.
_SAME = 1e-14
#: Largest last change of angles by Newton's method, whose square is what they are off by then, rad.
_NEARLY_SAME = 1e-9
#: Numbers of the work space of the test.
_WORK_SIZE = 6


@subroutine(allocates=True)
def follow_path(chains, path, count, sense, end):
    """Follow a path from its last state to the crank angle `end`; return the number of states and how it ends.

    The angles of a path have the sense 1 or -1. A fold is its last state, without rates.
    """
    pair, other, work = np.empty(PAIR_SIZE), np.empty(PAIR_SIZE), np.empty(_WORK_SIZE)
    trial, length = np.empty(STATE_SIZE), _LONGEST
    while count < MOST_STATES:
        state = path[(count - 1) * STATE_SIZE :]
        determinant = evaluate_chains(chains, state, pair)
        derive_angles(pair, state)
        state[5] = _unique_radius(chains, pair)
        if not sense * (end - state[0]) > 0.0:
            return count, REACHED
        distance = -0.5 * sense * determinant / _determinant_slope(pair, state)
        if distance > 0.0 and distance < _NEAR_FOLD and _find_fold(chains, state, sense * distance, trial):
            for k in range(STATE_SIZE):
                path[count * STATE_SIZE + k] = trial[k]
            return count + 1, FOLDED
        corner = _next_corner(state[0], sense)
        target = end if sense * (end - corner) < 0.0 else corner
        length = min(1.5 * length, _LONGEST)
        while not _take_step(chains, pair, state, sense * length, target, trial, other, work):
            length *= 0.7
            if length < _SHORTEST:
                return count, LOST
        for k in range(STATE_SIZE):
            path[count * STATE_SIZE + k] = trial[k]
        count += 1
    return count, LOST


@subroutine(inlined=True)
def _next_corner(angle, sense):
    """The next odd multiple of a quarter of a turn, at which the anchor of half-tangents changes."""
    quarters = sense * angle / math.pi + 0.5
    return sense * math.pi * (math.floor(quarters + 1e-9) + 0.5)


@subroutine()
def _take_step(chains, pair, state, step, target, trial, other, work):
    """Fill the state that a step leads to, at the target where that is nearer, if the step is sure."""
    is_whole = abs(step) >= abs(target - state[0])
    step = target - state[0] if is_whole else step
    if not _is_sure(chains, pair, state, step, work):
        return False
    trial[0] = target if is_whole else state[0] + step
    for k in range(2):
        trial[1 + k] = state[1 + k] + step * (state[3 + k] + 0.5 * step * pair[CURVING + k])
    alpha, beta, change, steps = trial[1], trial[2], 1.0, 0
    while change > _NEARLY_SAME and steps < _MOST_STEPS:
        evaluate_chains(chains, trial, other)
        change, steps = correct_angles(other, trial), steps + 1
    return abs(trial[1] - alpha) <= state[5] and abs(trial[2] - beta) <= state[5] and change <= _NEARLY_SAME


@subroutine()
def _unique_radius(chains, pair):
    """Half the width of a square of angles in which slopes change by a share of themselves."""
    first, second = 0.0, 0.0
    for i in range(2):
        chain = chains[i * CHAIN_SIZE :]
        arms = length_of(chain[4], chain[5]) + length_of(chain[6], chain[7])
        first += abs(pair[INVERSE + i]) * arms * (chain[8] + arms)
        second += abs(pair[INVERSE + 2 + i]) * arms * (chain[8] + arms)
    return min(_SHARE / max(first, second), 0.5)


@subroutine()
def _is_sure(chains, pair, state, step, work):
    """Whether a step is sure; the square has the half width of the state."""
    radius, size, curve = state[5], abs(step), pair[CURVING:]
    for k in range(_WORK_SIZE):
        work[k] = 0.0
    slopes, rest = work, work[4:]
    for i in range(2):
        chain, terms = chains[i * CHAIN_SIZE :], pair[i * TERM_SIZE :]
        g, a, b = length_of(chain[2], chain[3]), length_of(chain[4], chain[5]), length_of(chain[6], chain[7])
        # bounds of the rates of the angles, and of V and its first three derivatives, along the parabola
        alpha, beta = abs(state[3]) + size * abs(curve[0]), abs(state[4]) + size * abs(curve[1])
        v1 = g + a * alpha + b * beta
        first, second = alpha * alpha + abs(curve[0]), beta * beta + abs(curve[1])
        v2 = g + a * first + b * second
        v3 = g + a * alpha * (first + 2.0 * abs(curve[0])) + b * beta * (second + 2.0 * abs(curve[1]))
        v0 = chain[8] + size * v1
        total = length_of(chain[0], chain[1]) + g + a + b
        miss = abs(terms[8]) + _ROUNDING * total * total + size * size * size / 6.0 * (3.0 * v1 * v2 + v0 * v3)
        # by how much slopes change in the square and, but for their rates at the start, along the parabola
        far = v0 + (a + b) * radius
        bends = a * (first * v0 + 2.0 * alpha * v1 + v2) + b * (second * v0 + 2.0 * beta * v1 + v2)
        change = 0.5 * size * size * bends + radius * (a + b) * (far + a + b)
        of_alpha, of_beta = _slope_rate(terms, 4, state[3], state), _slope_rate(terms, 6, state[4], state)
        for k in range(2):
            inverse = pair[INVERSE + 2 * k + i]
            slopes[2 * k] += inverse * of_alpha
            slopes[2 * k + 1] += inverse * of_beta
            rest[k] += abs(inverse) * (miss / radius + change)
    one = rest[0] + size * (abs(slopes[0]) + abs(slopes[1]))
    other = rest[1] + size * (abs(slopes[2]) + abs(slopes[3]))
    return one <= _SURE and other <= _SURE


@subroutine()
def _slope_rate(terms, arm, rate, state):
    """The derivative along a path of the slope that belongs to the arm a u or b w of a chain; `rate` is its angle's."""
    x, y = terms[arm], terms[arm + 1]
    wx = terms[2] + terms[4] * state[3] + terms[6] * state[4]
    wy = terms[3] + terms[5] * state[3] + terms[7] * state[4]
    return x * wx + y * wy - rate * (x * terms[0] + y * terms[1])


@subroutine()
def _determinant_slope(pair, state):
    """The derivative of the determinant along a path."""
    other = pair[TERM_SIZE:]
    p, q = _slope_rate(pair, 4, state[3], state), _slope_rate(pair, 6, state[4], state)
    r, s = _slope_rate(other, 4, state[3], state), _slope_rate(other, 6, state[4], state)
    return p * other[10] + pair[9] * s - q * other[9] - pair[10] * r


@subroutine(allocates=True)
def _find_fold(chains, state, distance, fold):
    """Fill the fold at about a distance, by Newton's method for both chains and the determinant; return if it is.

    Its last number is the error of its crank angle, rad.
    """
    pair, moved, change, steps = np.empty(PAIR_SIZE), np.empty(STATE_SIZE), 1.0, 0
    fold[0] = state[0] + distance
    for k in range(2):
        # angles go as the root of the distance
        fold[1 + k], fold[3 + k] = state[1 + k] + 2.0 * distance * state[3 + k], math.nan
    while change > _SAME and steps < _MOST_STEPS:
        determinant = evaluate_chains(chains, fold, pair)
        change, steps = _correct_fold(pair, determinant, fold, moved), steps + 1
    fold[5] = _fold_error(chains, pair)
    away, is_own = (fold[0] - state[0]) / distance, True
    expected = abs(2.0 * (fold[0] - state[0]) * state[3]) + abs(2.0 * (fold[0] - state[0]) * state[4])
    for k in range(2):
        # a fold of other assemblies near by is not where this path leads
        off = fold[1 + k] - state[1 + k] - 2.0 * (fold[0] - state[0]) * state[3 + k]
        is_own = is_own and abs(off) < 0.5 * expected
    return is_own and change <= 10.0 * _SAME and away > 0.0 and away < 3.0


@subroutine()
def _fold_error(chains, pair):
    """The error of the crank angle of a fold, rad: what rounding errors of the chains move it by."""
    other = pair[TERM_SIZE:]
    first = abs(pair[9]) + abs(other[9]) > abs(pair[10]) + abs(other[10])
    # multiples of both chains whose sum does not change with alpha and beta
    one, two = (other[9], -pair[9]) if first else (other[10], -pair[10])
    slope, error = one * pair[11] + two * other[11], 0.0
    for i in range(2):
        chain = chains[i * CHAIN_SIZE :]
        total = length_of(chain[0], chain[1]) + length_of(chain[2], chain[3])
        total += length_of(chain[4], chain[5]) + length_of(chain[6], chain[7])
        error += abs(one if i == 0 else two) * _FEW_UNITS * total * chain[8]
    return error / abs(slope) + _FEW_UNITS


@subroutine(allocates=True)
def _correct_fold(pair, determinant, fold, moved):
    """Take a step of Newton's method by theta, alpha and beta; return its length."""
    other, gradient = pair[TERM_SIZE:], np.empty(3)
    for k in range(3):
        # the derivative by one angle is that along a path on which the others rest
        for m in range(3):
            moved[m] = 1.0 if m == k else 0.0
        p, q = _slope_by(pair, 4, moved), _slope_by(pair, 6, moved)
        r, s = _slope_by(other, 4, moved), _slope_by(other, 6, moved)
        gradient[k] = p * other[10] + pair[9] * s - q * other[9] - pair[10] * r
    rows = ((pair[11], pair[9], pair[10]), (other[11], other[9], other[10]), (gradient[0], gradient[1], gradient[2]))
    misses, whole = (pair[8], other[8], determinant), _determinant_of(rows[0], rows[1], rows[2])
    length = 0.0
    for k in range(3):
        replaced = np.empty(9)
        for i in range(3):
            for m in range(3):
                replaced[3 * i + m] = -misses[i] if m == k else rows[i][m]
        change = _determinant_of(replaced[:3], replaced[3:6], replaced[6:]) / whole
        fold[k] += change
        length += abs(change)
    return length


@subroutine()
def _slope_by(terms, arm, rates):
    """The derivative of the slope of an arm at rates of theta, alpha and beta."""
    x, y = terms[arm], terms[arm + 1]
    wx = rates[0] * terms[2] + rates[1] * terms[4] + rates[2] * terms[6]
    wy = rates[0] * terms[3] + rates[1] * terms[5] + rates[2] * terms[7]
    return x * wx + y * wy - rates[(arm - 2) // 2] * (x * terms[0] + y * terms[1])


@subroutine(inlined=True)
def _determinant_of(a, b, c):
    """The determinant of three rows."""
    first = a[0] * (b[1] * c[2] - b[2] * c[1])
    return first - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
