"""The best crank angles in the order of the points, by dynamic programming over samples of a turn, in either sense.

Steps of a search move angles a little; where the order of points along a curve changes, other angles far away may be
better, and only a search over all finds them.
"""

import math

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.synthesis.paths.numbers import BODY, N_CONSTANTS, close_shape, place_at
from explore.synthesis.paths.problems import UNORDERED, square_of


@subroutine()
def _fill_squares(task, numbers, constants, branch, sense, n_samples, squares):
    """Weighted squared errors of the points, a row each, at samples of two turns."""
    for k in range(n_samples):
        place, coupler = place_at(numbers, constants, branch, sense * 2.0 * math.pi * k / n_samples)
        for i in range(len(task.points)):
            square = square_of(task, i, place, coupler, numbers[BODY])
            squares[i, k] = square
            squares[i, k + n_samples] = square


@subroutine()
def _add_up(squares, first, n_samples, sums):
    """Least sums of the points up to each, with that one at most at each sample, in a turn from the first sample."""
    for i in range(len(squares)):
        least = np.inf
        for k in range(n_samples + 1):
            before = sums[i - 1, k] if i > 0 else 0.0
            least = min(least, before + squares[i, first + k])
            sums[i, k] = least
    return sums[len(squares) - 1, n_samples]


@subroutine()
def _trace_back(sums, first, n_samples, sense, angles):
    """Fill the angles of the least sum."""
    k = n_samples
    for i in range(len(sums) - 1, -1, -1):
        while k > 0 and sums[i, k - 1] == sums[i, k]:
            k -= 1
        angles[i] = sense * 2.0 * math.pi * (first + k) / n_samples


@subroutine()
def _choose_each(squares, n_samples, angles):
    """Fill the angle of the least square of each point; return their sum."""
    total = 0.0
    for i in range(len(angles)):
        best = 0
        for k in range(1, n_samples):
            if squares[i, k] < squares[i, best]:
                best = k
        angles[i] = 2.0 * math.pi * best / n_samples
        total += squares[i, best]
    return total


@compiled(allocates=True)
def order_angles(task, branches, are_grounds_longer, numbers, n_samples, stride, senses, angles, costs):
    """Fill the senses, angles and sums of squares of linkages that are best among samples of a turn.

    Of so many samples of a turn, `stride` lie between two that the first point is sought from. The last three arrays
    receive the results, (n,), (n, k) and (n,).
    """
    n = len(task.points)
    squares, sums = np.empty((n, 2 * n_samples + 1)), np.empty((n, n_samples + 1))
    constants = np.empty(N_CONSTANTS)
    squares[:, 2 * n_samples] = np.inf
    for row in range(len(branches)):
        close_shape(numbers[row], are_grounds_longer[row], constants)
        costs[row] = np.inf
        if task.mode == UNORDERED:
            _fill_squares(task, numbers[row], constants, branches[row], 1.0, n_samples, squares)
            costs[row], senses[row] = _choose_each(squares, n_samples, angles[row]), 1.0
            continue
        for turn in range(2):
            sense = 1.0 - 2.0 * turn
            _fill_squares(task, numbers[row], constants, branches[row], sense, n_samples, squares)
            best, least = -1, costs[row]
            for first in range(0, n_samples, stride):
                cost = _add_up(squares, first, n_samples, sums)
                if cost < least:
                    best, least = first, cost
            if best >= 0:
                costs[row], senses[row] = _add_up(squares, best, n_samples, sums), sense
                _trace_back(sums, best, n_samples, sense, angles[row])
