"""Least squares of a linkage's numbers to points or poses, with free crank angles in their order, within bounds.

Levenberg and Marquardt's method on the ten numbers. The angle of each point is eliminated: to first order it removes
the part of the error along the path. Steps that would bring angles out of order are pooled (adjacent violators), and
points that share an angle move together until their errors part them. Bounds of numbers hold exactly: those that a step
would leave are its active set. Where both pivots have bounds they are numbers themselves, and lengths are limited by a
price (`explore.synthesis.paths.limits`).
"""

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.synthesis.levenberg_marquardt import (
    FIRST_DAMPING,
    LARGEST_DAMPING,
    LEAST_DAMPING,
    LOWER,
    MOST_SLOW,
    RAISE,
)
from explore.synthesis.paths.limits import add_limits, log_slopes
from explore.synthesis.paths.normal_equations import (
    add_points,
    bound,
    bound_angles,
    eliminate,
    hold_number,
    keep_within,
    solve,
)
from explore.synthesis.paths.numbers import (
    BODY,
    FRAME,
    GROUND,
    LARGEST,
    N_CONSTANTS,
    N_NUMBERS,
    close_shape,
    outward_slopes,
    place_and_slopes,
)
from explore.synthesis.paths.placed_pivots import change_coordinates, from_pivots, slopes_by_pivots, to_pivots
from explore.synthesis.paths.problems import ORDERED, TIMED, UNORDERED, Problem, cost_of, make_arrays, turn_error
from explore.synthesis.pooling import pool

#: Largest change of an angle in one step, rad.
_LARGEST_TURN = 0.5
#: Largest change of a number that is an angle or a logarithm in one step.
_LARGEST_CHANGE = 1.0
#: Cost at which a search ends.
_TINY = 1e-300


@subroutine()
def _find_blocks(angles, sense, gains, pulls, starts):
    """First points of the blocks of equal angles; a block is parted where its errors pull it apart. Their number."""
    n, m = len(angles), 0
    for i in range(n):
        is_new = True
        if i > 0 and angles[i] == angles[i - 1]:
            is_new = -sense * gains[i] / pulls[i] >= -sense * gains[i - 1] / pulls[i - 1]
        if is_new:
            starts[m] = i
            m += 1
    starts[m] = n
    return m


@subroutine()
def _pulls_together(first, last, sense, gains):
    """Whether the errors pull the first angles on and the last ones back."""
    own, other = 0.0, 0.0
    for i in range(first):
        own -= sense * gains[i]
    for i in range(last, len(gains)):
        other -= sense * gains[i]
    return own > 0.0 or other < 0.0


@subroutine(allocates=True)
def _linearise_points(problem, work, numbers, constants, angles):
    """Fill errors and slopes of the points, and what the angles of each gain."""
    task, lever = problem.task, problem.task.lever
    for i in range(len(angles)):
        place, coupler, work.tangents[i], spin = place_and_slopes(
            numbers, constants, problem.branch, problem.is_ground_longer, angles[i], work.slopes[i], work.turns[i]
        )
        t, e = work.tangents[i], place - task.points[i]
        work.errors[i], work.spins[i] = e, lever * spin
        work.turn_errors[i] = turn_error(task, i, coupler, numbers[BODY])
        work.turns[i] *= lever
        w, s = task.weights[i], work.spins[i]
        work.pulls[i] = w * (t.real * t.real + t.imag * t.imag + s * s) + _TINY
        work.gains[i] = w * (t.real * e.real + t.imag * e.imag + s * work.turn_errors[i])


@subroutine(allocates=True)
def linearise(problem, work, numbers, constants, angles):
    """Fill the normal equations of the numbers; return the number of blocks, and whether the first and last are one."""
    task, n, m, starts = problem.task, len(angles), 1, work.starts
    _linearise_points(problem, work, numbers, constants, angles)
    starts[0], starts[1] = 0, n
    if task.mode == ORDERED:
        m = _find_blocks(angles, problem.sense, work.gains, work.pulls, starts)
    elif task.mode == UNORDERED:
        m = n
        for i in range(n + 1):
            starts[i] = i
    is_tied = (
        task.mode == ORDERED
        and m > 1
        and problem.sense * (angles[n - 1] - angles[0]) <= task.least_span
        and _pulls_together(starts[1], starts[m - 1], problem.sense, work.gains)
    )
    work.matrix[:], work.right[:], work.shares[:], work.own[:] = 0.0, 0.0, 0.0, 0.0
    for block in range(m):
        owner = 0 if is_tied and block == m - 1 else block
        work.own[owner, 0] += _TINY
        add_points(starts[block], starts[block + 1], task.weights, task.lever, work, owner)
    if task.mode != TIMED:
        for block in range(m - 1 if is_tied else m):
            eliminate(work.matrix, work.right, work.shares[block], work.own[block])
    add_limits(task.limits, numbers, constants, problem.is_ground_longer, work.reach, work.matrix, work.right)
    work.coordinates[:], work.normals[:] = numbers, 0.0
    if task.is_placed:
        work.reach[:] = 0.0
        log_slopes(constants, GROUND, problem.is_ground_longer, 1.0, work.reach)
        slopes_by_pivots(numbers, constants, work.reach, work.change)
        change_coordinates(work.change, work.matrix, work.right, work.factor, work.step)
        to_pivots(numbers, constants, work.coordinates)
    else:
        outward_slopes(constants, task.shortest, task.longest, work.normals)
    for j in range(N_NUMBERS):
        at, right = work.coordinates[j], work.right[j]
        if (at <= task.lower[j] and right > 0.0) or (at >= task.upper[j] and right < 0.0):
            hold_number(work.matrix, work.right, j)
            work.normals[:, j] = 0.0
    return m, is_tied


@subroutine(allocates=True)
def _move_numbers(problem, work, constants, trial):
    """Fill the numbers after the step; return the share of the full step that it is."""
    task, moved = problem.task, work.moved
    moved[:] = work.step
    if task.is_placed:
        for j in range(N_NUMBERS):
            moved[j] = 0.0
            for k in range(N_NUMBERS):
                moved[j] += work.change[j, k] * work.step[k]
    change = 0.0
    for j in range(FRAME, LARGEST + 1):
        change = max(change, abs(moved[j]))
    scale = 1.0 if change <= _LARGEST_CHANGE else _LARGEST_CHANGE / change
    for j in range(N_NUMBERS):
        moved[j] *= scale
        trial[j] = work.coordinates[j] + scale * work.step[j]
    _bring_within(problem, work, constants, trial)
    return scale


@subroutine(allocates=True)
def _bring_within(problem, work, constants, trial):
    """Bring coordinates within their bounds and turn them into numbers."""
    task = problem.task
    if task.is_placed:
        bound_angles(trial, task.lower, task.upper)
        work.reach[:] = trial
        from_pivots(work.reach, problem.is_ground_longer, constants, trial)
    else:
        bound(trial, task.lower, task.upper, task.shortest, task.longest)


@subroutine(allocates=True)
def _take_step(problem, work, angles, m, is_tied, damping, trial, trial_constants, turned):
    """Fill the numbers and angles after a step; return the share of the full step that it is."""
    task = problem.task
    solve(work.matrix, work.right, damping, work.factor, work.step)
    for normal in work.normals:
        keep_within(work.matrix, normal, damping, work.factor, work.reach, work.step)
    scale = _move_numbers(problem, work, trial_constants, trial)
    turned[:] = angles
    if task.mode == TIMED:
        return scale
    for block in range(m):
        owner = 0 if is_tied and block == m - 1 else block
        turn = work.own[owner, 1] * scale
        for j in range(N_NUMBERS):
            turn += work.shares[owner, j] * work.moved[j]
        turn = min(max(-turn / work.own[owner, 0], -_LARGEST_TURN), _LARGEST_TURN)
        for i in range(work.starts[block], work.starts[block + 1]):
            turned[i] += turn
    if task.mode == ORDERED:
        pool(turned, work.pulls, problem.sense, task.least_span, work.values, work.sums, work.counts)
    return scale


@subroutine(allocates=True)
def _fit(problem, work, numbers, angles, most_steps, tolerance):
    """Improve numbers and angles in place; return the weighted sum of squares."""
    task = problem.task
    constants, trial_constants = np.empty(N_CONSTANTS), np.empty(N_CONSTANTS)
    trial, turned = np.empty(N_NUMBERS), np.empty(len(angles))
    if task.is_placed:
        close_shape(numbers, problem.is_ground_longer, constants)
        to_pivots(numbers, constants, work.coordinates)
        numbers[:] = work.coordinates
    _bring_within(problem, work, constants, numbers)
    if task.mode == ORDERED:
        work.pulls[:] = 1.0
        pool(angles, work.pulls, problem.sense, task.least_span, work.values, work.sums, work.counts)
    close_shape(numbers, problem.is_ground_longer, constants)
    cost = cost_of(problem, numbers, constants, angles)
    damping, steps, slow, is_better = FIRST_DAMPING, 0, 0, True
    while is_better and steps < most_steps and slow < MOST_SLOW and cost > _TINY:
        m, is_tied = linearise(problem, work, numbers, constants, angles)
        is_better = False
        while not is_better and steps < most_steps and damping < LARGEST_DAMPING:
            steps += 1
            scale = _take_step(problem, work, angles, m, is_tied, damping, trial, trial_constants, turned)
            close_shape(trial, problem.is_ground_longer, trial_constants)
            found = cost_of(problem, trial, trial_constants, turned)
            is_better = found < cost
            if not is_better:
                damping = damping * RAISE + LEAST_DAMPING
            elif scale == 1.0:
                damping = max(damping * LOWER, LEAST_DAMPING)
        if is_better:
            slow = slow + 1 if cost - found < tolerance * cost else 0
            numbers[:], angles[:], constants[:] = trial, turned, trial_constants
            cost = found
    return cost


@compiled(allocates=True)
def fit(task, branches, senses, are_grounds_longer, numbers, angles, most_steps, tolerance, costs):
    """Improve linkages, numbers (n, 10) and angles (n, k), in place, each by at most so many steps.

    A search ends after three steps in a row that gain less than the tolerance, relatively. Branch and sense of each are
    1.0 or -1.0; of ground and crank, the ground is the longer or not. `costs` receives the weighted sums of squares.
    """
    work = make_arrays(len(task.points))
    for k in range(len(branches)):
        problem = Problem(task, branches[k], senses[k], are_grounds_longer[k])
        costs[k] = _fit(problem, work, numbers[k], angles[k], most_steps, tolerance)
