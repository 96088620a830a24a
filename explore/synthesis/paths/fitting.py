"""Least squares of a linkage's numbers to points, with free crank angles in the order of the points.

Levenberg and Marquardt's method on the nine numbers. The angle of each point is eliminated: to first order it removes
the part of the error along the path. Steps that would bring angles out of order are pooled (adjacent violators), and
points that share an angle move together until their errors part them.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from explore.compiling import compiled
from explore.model.quantities import FloatArray
from explore.subroutines import subroutine
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.paths.normal_equations import (
    add_points,
    bound,
    eliminate,
    hold,
    keep_within,
    solve,
)
from explore.synthesis.paths.numbers import (
    FRAME,
    LARGEST,
    N_CONSTANTS,
    N_NUMBERS,
    close_shape,
    outward_slopes,
    point_and_slopes,
    point_at,
)

IntArray = npt.NDArray[np.int64]

#: How the angles may move: each, in order; not at all; or all by the same.
ORDERED, TIMED, SHIFTED = 0, 1, 2
#: Largest change of an angle, and of the numbers that are angles or logarithms, in one step.
_LARGEST_TURN, _LARGEST_CHANGE = 0.5, 1.0
#: Steps of little progress in a row that end the search.
_MOST_SLOW = 3
_LEAST_DAMPING, _LARGEST_DAMPING = 1e-12, 1e8
_TINY = 1e-300


@subroutine(allocates=False)
def _cost(points, weights, numbers, constants, angles, branch):
    total = 0.0
    for i in range(len(points)):
        error = point_at(numbers, constants, branch, angles[i]) - points[i]
        total += weights[i] * (error.real * error.real + error.imag * error.imag)
    return total


@subroutine()
def _pool(angles, weights, sense, least_span, values, sums, counts):
    """Bring angles in order, nondecreasing in the sense, the nearest in weighted least squares; at most one turn apart.

    The first and the last are at least `least_span` apart.
    """
    n, m = len(angles), 0
    for i in range(n):
        values[m], sums[m], counts[m] = sense * angles[i], weights[i], 1
        m += 1
        while m > 1 and values[m - 2] > values[m - 1]:
            total = sums[m - 2] + sums[m - 1]
            values[m - 2] = (values[m - 2] * sums[m - 2] + values[m - 1] * sums[m - 1]) / total
            sums[m - 2] = total
            counts[m - 2] += counts[m - 1]
            m -= 1
    missing = least_span - (values[m - 1] - values[0])
    if missing > 0.0 and m > 1:
        total = sums[0] + sums[m - 1]
        values[m - 1] += missing * sums[0] / total
        values[0] -= missing * sums[m - 1] / total
    i = 0
    last = values[0] + 2.0 * math.pi
    for block in range(m):
        for _ in range(counts[block]):
            angles[i] = sense * min(values[block], last)
            i += 1


@subroutine()
def _find_blocks(angles, sense, tangents, errors, starts):
    """First points of the blocks of equal angles; a block is parted where its errors pull it apart. Their number."""
    n, m = len(angles), 0
    for i in range(n):
        is_new = True
        if i > 0 and angles[i] == angles[i - 1]:
            t, e, o, f = tangents[i], errors[i], tangents[i - 1], errors[i - 1]
            own = -sense * (t.real * e.real + t.imag * e.imag) / (t.real * t.real + t.imag * t.imag + _TINY)
            before = -sense * (o.real * f.real + o.imag * f.imag) / (o.real * o.real + o.imag * o.imag + _TINY)
            is_new = own >= before
        if is_new:
            starts[m] = i
            m += 1
    starts[m] = n
    return m


@subroutine()
def _pulls_together(first, last, sense, weights, tangents, errors):
    """Whether the errors pull the first angles on and the last ones back."""
    own, other = 0.0, 0.0
    for i in range(first):
        own -= sense * weights[i] * (tangents[i].real * errors[i].real + tangents[i].imag * errors[i].imag)
    for i in range(last, len(errors)):
        other -= sense * weights[i] * (tangents[i].real * errors[i].real + tangents[i].imag * errors[i].imag)
    return own > 0.0 or other < 0.0


class Task(NamedTuple):
    """What is fitted.

    Attributes
    ----------
    points
        Complex, shape (n,).
    weights
        Of the squared distances, shape (n,).
    mode
        How the angles may move: `ORDERED`, `TIMED` or `SHIFTED`.
    lower, upper
        Bounds of the nine numbers; equal ones hold a number.
    least_span
        Angle that the crank turns at least from the first to the last point, rad.
    shortest, longest
        Bounds of crank and ground.
    """

    points: ComplexArray
    weights: FloatArray
    mode: int
    lower: FloatArray
    upper: FloatArray
    least_span: float
    shortest: float
    longest: float


class _Problem(NamedTuple):
    """A task for one kind of linkage."""

    points: ComplexArray
    weights: FloatArray
    branch: float
    sense: float
    is_ground_longer: bool
    mode: int
    lower: FloatArray
    upper: FloatArray
    least_span: float
    shortest: float
    longest: float


class _Work(NamedTuple):
    """Arrays of a search: of the normal equations, of the points, of the angles' own terms, and of pooling."""

    matrix: FloatArray
    factor: FloatArray
    right: FloatArray
    step: FloatArray
    normals: FloatArray
    reach: FloatArray
    slopes: ComplexArray
    shares: FloatArray
    tangents: ComplexArray
    errors: ComplexArray
    own: FloatArray
    pulls: FloatArray
    values: FloatArray
    sums: FloatArray
    counts: IntArray
    starts: IntArray


@subroutine(allocates=True)
def _make_work(n):
    return _Work(
        np.empty((N_NUMBERS, N_NUMBERS)), np.empty((N_NUMBERS, N_NUMBERS)), np.empty(N_NUMBERS), np.empty(N_NUMBERS),
        np.empty((2, N_NUMBERS)), np.empty(N_NUMBERS),
        np.empty((n, N_NUMBERS), np.complex128), np.empty((n, N_NUMBERS)), np.empty(n, np.complex128),
        np.empty(n, np.complex128), np.empty((n, 2)), np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int64),
        np.empty(n + 1, np.int64),
    )  # fmt: skip


@subroutine(allocates=True)
def _linearise(problem, work, numbers, constants, angles):
    """Fill the normal equations of the numbers; return the number of blocks, and whether the first and last are one."""
    n = len(angles)
    weights, tangents, errors = problem.weights, work.tangents, work.errors
    for i in range(n):
        place, tangents[i] = point_and_slopes(
            numbers, constants, problem.branch, problem.is_ground_longer, angles[i], work.slopes[i]
        )
        errors[i] = place - problem.points[i]
        work.pulls[i] = weights[i] * (tangents[i].real ** 2 + tangents[i].imag ** 2) + _TINY
    m, starts = 1, work.starts
    starts[0], starts[1] = 0, n
    if problem.mode == ORDERED:
        m = _find_blocks(angles, problem.sense, tangents, errors, starts)
    is_tied = (
        problem.mode == ORDERED
        and m > 1
        and problem.sense * (angles[n - 1] - angles[0]) <= problem.least_span
        and _pulls_together(starts[1], starts[m - 1], problem.sense, weights, tangents, errors)
    )
    work.matrix[:], work.right[:], work.shares[:], work.own[:] = 0.0, 0.0, 0.0, 0.0
    for block in range(m):
        owner = 0 if is_tied and block == m - 1 else block
        work.own[owner, 0] += _TINY
        add_points(
            starts[block], starts[block + 1], weights, work.slopes, tangents, errors, work.matrix, work.right,
            work.shares[owner], work.own[owner],
        )  # fmt: skip
    if problem.mode != TIMED:
        for block in range(m - 1 if is_tied else m):
            eliminate(work.matrix, work.right, work.shares[block], work.own[block])
    outward_slopes(constants, problem.shortest, problem.longest, work.normals)
    for j in range(N_NUMBERS):
        right = work.right[j]
        if (numbers[j] <= problem.lower[j] and right > 0.0) or (numbers[j] >= problem.upper[j] and right < 0.0):
            hold(work.matrix, work.right, j)
            work.normals[:, j] = 0.0
    return m, is_tied


@subroutine(allocates=True)
def _take_step(problem, work, numbers, angles, m, is_tied, damping, trial, turned):
    """Fill the numbers and angles after a step; return the share of the full step that it is."""
    solve(work.matrix, work.right, damping, work.factor, work.step)
    for normal in work.normals:
        keep_within(work.matrix, normal, damping, work.factor, work.reach, work.step)
    change = 0.0
    for j in range(FRAME, LARGEST + 1):
        change = max(change, abs(work.step[j]))
    scale = 1.0 if change <= _LARGEST_CHANGE else _LARGEST_CHANGE / change
    for j in range(N_NUMBERS):
        work.step[j] *= scale
        trial[j] = numbers[j] + work.step[j]
    bound(trial, problem.lower, problem.upper, problem.shortest, problem.longest)
    turned[:] = angles
    if problem.mode == TIMED:
        return scale
    for block in range(m):
        owner = 0 if is_tied and block == m - 1 else block
        turn = work.own[owner, 1] * scale
        for j in range(N_NUMBERS):
            turn += work.shares[owner, j] * work.step[j]
        turn = min(max(-turn / work.own[owner, 0], -_LARGEST_TURN), _LARGEST_TURN)
        for i in range(work.starts[block], work.starts[block + 1]):
            turned[i] += turn
    if problem.mode == ORDERED:
        _pool(turned, work.pulls, problem.sense, problem.least_span, work.values, work.sums, work.counts)
    return scale


@subroutine(allocates=True)
def _fit(problem, work, numbers, angles, most_steps, tolerance):
    """Improve numbers and angles in place; return the weighted sum of squares."""
    constants, trial_constants = np.empty(N_CONSTANTS), np.empty(N_CONSTANTS)
    trial, turned = np.empty(N_NUMBERS), np.empty(len(angles))
    bound(numbers, problem.lower, problem.upper, problem.shortest, problem.longest)
    if problem.mode == ORDERED:
        work.pulls[:] = 1.0
        _pool(angles, work.pulls, problem.sense, problem.least_span, work.values, work.sums, work.counts)
    close_shape(numbers, problem.is_ground_longer, constants)
    cost = _cost(problem.points, problem.weights, numbers, constants, angles, problem.branch)
    damping, steps, slow, is_better = 1e-2, 0, 0, True
    while is_better and steps < most_steps and slow < _MOST_SLOW and cost > _TINY:
        m, is_tied = _linearise(problem, work, numbers, constants, angles)
        is_better = False
        while not is_better and steps < most_steps and damping < _LARGEST_DAMPING:
            steps += 1
            scale = _take_step(problem, work, numbers, angles, m, is_tied, damping, trial, turned)
            close_shape(trial, problem.is_ground_longer, trial_constants)
            found = _cost(problem.points, problem.weights, trial, trial_constants, turned, problem.branch)
            is_better = found < cost
            if not is_better:
                damping = damping * 4.0 + _LEAST_DAMPING
            elif scale == 1.0:
                damping = max(damping * 0.2, _LEAST_DAMPING)
        if is_better:
            slow = slow + 1 if cost - found < tolerance * cost else 0
            numbers[:], angles[:], constants[:] = trial, turned, trial_constants
            cost = found
    return cost


@compiled(allocates=True)
def fit(task, branches, senses, are_grounds_longer, numbers, angles, most_steps, tolerance, costs):
    """Improve linkages and their angles in place, each by at most so many steps.

    A search ends after three steps in a row that gain less than the tolerance, relatively.

    Parameters
    ----------
    task
        A `Task`.
    branches, senses, are_grounds_longer
        Of each linkage: side of the rocker's pin and sense of the crank, 1.0 or -1.0, and whether the ground or the
        crank is the longer of both.
    numbers, angles
        Shapes (n, 9) and (n, k).
    costs
        Receives the weighted sums of squares, shape (n,).
    """
    work = _make_work(len(task.points))
    for k in range(len(branches)):
        problem = _Problem(
            task.points, task.weights, branches[k], senses[k], are_grounds_longer[k], task.mode, task.lower, task.upper,
            task.least_span, task.shortest, task.longest,
        )  # fmt: skip
        costs[k] = _fit(problem, work, numbers[k], angles[k], most_steps, tolerance)
