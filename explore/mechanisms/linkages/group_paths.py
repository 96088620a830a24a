"""A group of links followed along the crank angle, each step of which is proved (test of Krawczyk).

A step goes from one assembly along the parabola that touches its path. It is sure if a square about the parabola holds
one assembly at each crank angle: with the inverse P of the slopes at the start, what the parabola misses, times P, and
by how much P times the slopes differs from 1 in the square, times its half width r, are less than r together. All
derivatives are bounded by the sizes of the terms of ties. A path that ends does so where two assemblies meet (a fold).
"""

import math

import numpy as np

from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.group_ties import (
    BY_ALPHA,
    BY_BETA,
    BY_THETA,
    CURVING,
    INVERSE,
    PAIR_SIZE,
    ROUNDED,
    SIZES,
    STATE_SIZE,
    TERM_SIZE,
    TIE_SIZE,
    VALUE,
    correct_angles,
    derive_angles,
    evaluate_ties,
    rate_by_alpha,
    rate_by_beta,
    rate_of_determinant,
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
#: Rounding error of a tie, relative to the sizes of its terms.
_ROUNDING = 1e-14
#: Rounding error of a tie at a fold, relative to the same: a few units.
_FEW_UNITS = 1e-15
#: Steps of Newton's method.
_MOST_STEPS = 12
#: Smallest change of an angle that is no rounding error, rad.
_SAME = 1e-14
#: Largest last change of angles by Newton's method, whose square is what they are off by then, rad.
_NEARLY_SAME = 1e-9
#: Numbers of the work space of the test.
_WORK_SIZE = 12


@subroutine(allocates=True)
def follow_path(ties, path, count, sense, end):
    """Follow a path from its last state to the crank angle `end`; return the number of states and how it ends.

    The angles of a path have the sense 1 or -1. A fold is its last state, without rates.
    """
    pair, other, work = np.empty(PAIR_SIZE), np.empty(PAIR_SIZE), np.empty(_WORK_SIZE)
    trial, length = np.empty(STATE_SIZE), _LONGEST
    while count < MOST_STATES:
        state = path[(count - 1) * STATE_SIZE :]
        determinant = evaluate_ties(ties, state, pair)
        derive_angles(pair, state)
        state[5] = _unique_radius(ties, pair)
        if not sense * (end - state[0]) > 0.0:
            return count, REACHED
        distance = -0.5 * sense * determinant / rate_of_determinant(pair, 1.0, state[3], state[4])
        if distance > 0.0 and distance < _NEAR_FOLD and _find_fold(ties, state, sense * distance, trial):
            for k in range(STATE_SIZE):
                path[count * STATE_SIZE + k] = trial[k]
            return count + 1, FOLDED
        corner = _next_corner(state[0], sense)
        target = end if sense * (end - corner) < 0.0 else corner
        length = min(1.5 * length, _LONGEST)
        while not _take_step(ties, pair, state, sense * length, target, trial, other, work):
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
def _take_step(ties, pair, state, step, target, trial, other, work):
    """Fill the state that a step leads to, at the target where that is nearer, if the step is sure."""
    is_whole = abs(step) >= abs(target - state[0])
    step = target - state[0] if is_whole else step
    if not _is_sure(ties, pair, state, step, work):
        return False
    trial[0] = target if is_whole else state[0] + step
    for k in range(2):
        trial[1 + k] = state[1 + k] + step * (state[3 + k] + 0.5 * step * pair[CURVING + k])
    alpha, beta, change, steps = trial[1], trial[2], 1.0, 0
    while change > _NEARLY_SAME and steps < _MOST_STEPS:
        evaluate_ties(ties, trial, other)
        change, steps = correct_angles(other, trial), steps + 1
    return abs(trial[1] - alpha) <= state[5] and abs(trial[2] - beta) <= state[5] and change <= _NEARLY_SAME


@subroutine(inlined=True)
def _bends(sizes):
    """The sum of bounds of the second derivatives of a tie by alpha and beta."""
    return sizes[1] + sizes[2] + sizes[3] + sizes[4] + 4.0 * sizes[5]


@subroutine()
def _unique_radius(ties, pair):
    """Half the width of a square of angles in which slopes change by a share of themselves."""
    first, second = 0.0, 0.0
    for i in range(2):
        bends = _bends(ties[i * TIE_SIZE + SIZES :])
        first += abs(pair[INVERSE + i]) * bends
        second += abs(pair[INVERSE + 2 + i]) * bends
    return min(_SHARE / max(first, second), 0.5)


@subroutine()
def _is_sure(ties, pair, state, step, work):
    """Whether a step is sure; the square has the half width of the state."""
    radius, size, curve = state[5], abs(step), pair[CURVING:]
    for k in range(_WORK_SIZE):
        work[k] = 0.0
    slopes, rest, rates = work, work[4:], work[6:]
    # bounds of the rates that the terms turn at along the parabola; their changes are the second derivatives
    alpha, beta, between = abs(curve[0]), abs(curve[1]), abs(curve[1] - curve[0])
    rates[0], rates[1], rates[2] = 1.0, abs(state[3]) + size * alpha, abs(state[4]) + size * beta
    rates[3], rates[4] = abs(state[3] - 1.0) + size * alpha, abs(state[4] - 1.0) + size * beta
    rates[5] = abs(state[4] - state[3]) + size * between
    for i in range(2):
        tie, terms = ties[i * TIE_SIZE :], pair[i * TERM_SIZE :]
        sizes = tie[SIZES:]
        third, change = 0.0, radius * _bends(sizes)
        for k in range(6):
            rate, of_term = rates[k], sizes[k]
            turning = 0.0 if k == 0 else between if k == 5 else alpha if k % 2 == 1 else beta
            third += of_term * rate * (rate * rate + 3.0 * turning)
            # by how much slopes change but for their rates at the start; the last term is in both
            share = 0.0 if k == 0 else 2.0 if k == 5 else 1.0
            change += 0.5 * size * size * share * of_term * (rate * rate + turning)
        miss = abs(terms[VALUE]) + _ROUNDING * tie[ROUNDED] + size * size * size / 6.0 * third
        of_alpha = rate_by_alpha(terms, 1.0, state[3], state[4])
        of_beta = rate_by_beta(terms, 1.0, state[3], state[4])
        for k in range(2):
            inverse = pair[INVERSE + 2 * k + i]
            slopes[2 * k] += inverse * of_alpha
            slopes[2 * k + 1] += inverse * of_beta
            rest[k] += abs(inverse) * (miss / radius + change)
    one = rest[0] + size * (abs(slopes[0]) + abs(slopes[1]))
    other = rest[1] + size * (abs(slopes[2]) + abs(slopes[3]))
    return one <= _SURE and other <= _SURE


@subroutine(allocates=True)
def _find_fold(ties, state, distance, fold):
    """Fill the fold at about a distance, by Newton's method for both ties and the determinant; return if it is.

    Its last number is the error of its crank angle, rad.
    """
    pair, moved, change, steps = np.empty(PAIR_SIZE), np.empty(STATE_SIZE), 1.0, 0
    fold[0] = state[0] + distance
    for k in range(2):
        # angles go as the root of the distance
        fold[1 + k], fold[3 + k] = state[1 + k] + 2.0 * distance * state[3 + k], math.nan
    while change > _SAME and steps < _MOST_STEPS:
        determinant = evaluate_ties(ties, fold, pair)
        change, steps = _correct_fold(pair, determinant, fold, moved), steps + 1
    fold[5] = _fold_error(ties, pair)
    away, is_own = (fold[0] - state[0]) / distance, True
    expected = abs(2.0 * (fold[0] - state[0]) * state[3]) + abs(2.0 * (fold[0] - state[0]) * state[4])
    for k in range(2):
        # a fold of other assemblies near by is not where this path leads
        off = fold[1 + k] - state[1 + k] - 2.0 * (fold[0] - state[0]) * state[3 + k]
        is_own = is_own and abs(off) < 0.5 * expected
    return is_own and change <= 10.0 * _SAME and away > 0.0 and away < 3.0


@subroutine()
def _fold_error(ties, pair):
    """The error of the crank angle of a fold, rad: what rounding errors of the ties move it by."""
    other = pair[TERM_SIZE:]
    first = abs(pair[BY_ALPHA]) + abs(other[BY_ALPHA]) > abs(pair[BY_BETA]) + abs(other[BY_BETA])
    # multiples of both ties whose sum does not change with alpha and beta
    one, two = (other[BY_ALPHA], -pair[BY_ALPHA]) if first else (other[BY_BETA], -pair[BY_BETA])
    error = _FEW_UNITS * (abs(one) * ties[ROUNDED] + abs(two) * ties[TIE_SIZE + ROUNDED])
    return error / abs(one * pair[BY_THETA] + two * other[BY_THETA]) + _FEW_UNITS


@subroutine(allocates=True)
def _correct_fold(pair, determinant, fold, moved):
    """Take a step of Newton's method by theta, alpha and beta; return its length."""
    other, gradient = pair[TERM_SIZE:], np.empty(3)
    for k in range(3):
        # the derivative by one angle is that along a path on which the others rest
        for m in range(3):
            moved[m] = 1.0 if m == k else 0.0
        gradient[k] = rate_of_determinant(pair, moved[0], moved[1], moved[2])
    rows = (
        (pair[BY_THETA], pair[BY_ALPHA], pair[BY_BETA]),
        (other[BY_THETA], other[BY_ALPHA], other[BY_BETA]),
        (gradient[0], gradient[1], gradient[2]),
    )
    misses, whole = (pair[VALUE], other[VALUE], determinant), _determinant_of(rows[0], rows[1], rows[2])
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


@subroutine(inlined=True)
def _determinant_of(a, b, c):
    """The determinant of three rows."""
    first = a[0] * (b[1] * c[2] - b[2] * c[1])
    return first - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
