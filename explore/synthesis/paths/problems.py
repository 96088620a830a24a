"""What is fitted to a path, its modes and its cost, and the arrays of a search."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from explore.base.subroutines import subroutine
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.paths.limits import Limits, price_of_limits
from explore.synthesis.paths.numbers import BODY, N_NUMBERS, place_at

IntArray = npt.NDArray[np.int64]

#: Mode of a task whose angles move each, in order.
ORDERED = 0
#: Mode of a task whose angles do not move.
TIMED = 1
#: Mode of a task whose angles move all by the same.
SHIFTED = 2
#: Mode of a task whose angles move each, in any order.
UNORDERED = 3


class Task(NamedTuple):
    """What is fitted: points, complex, and weights of the squared errors, each (n,).

    Angles move as the mode says, by `least_span` in all, rad. Bounds are of the ten numbers, or of the numbers of
    `paths.placed_pivots` where both pivots are placed; equal ones hold a number. Where pivots are not placed, crank and
    ground have bounds. Limits of lengths have a price. The error of the body's direction at the points, which has unit
    vectors, counts at the end of the lever, 0 for a path.
    """

    points: ComplexArray
    weights: FloatArray
    mode: int
    lower: FloatArray
    upper: FloatArray
    least_span: float
    shortest: float
    longest: float
    is_placed: bool = False
    limits: Limits = Limits()
    directions: ComplexArray = np.zeros(0, dtype=np.complex128)
    lever: float = 0.0


class Problem(NamedTuple):
    """A task for one kind of linkage."""

    task: Task
    branch: float
    sense: float
    is_ground_longer: bool


class SearchArrays(NamedTuple):
    """Arrays of a search: of the normal equations and their coordinates, of the points, and of the angles."""

    matrix: FloatArray
    factor: FloatArray
    change: FloatArray
    right: FloatArray
    step: FloatArray
    moved: FloatArray
    coordinates: FloatArray
    reach: FloatArray
    normals: FloatArray
    slopes: ComplexArray
    turns: FloatArray
    shares: FloatArray
    tangents: ComplexArray
    errors: ComplexArray
    spins: FloatArray
    turn_errors: FloatArray
    own: FloatArray
    pulls: FloatArray
    gains: FloatArray
    values: FloatArray
    sums: FloatArray
    counts: IntArray
    starts: IntArray


@subroutine(allocates=True)
def make_arrays(n):
    """The arrays of a search for n points."""
    k = N_NUMBERS
    return SearchArrays(
        np.empty((k, k)), np.empty((k, k)), np.empty((k, k)), np.empty(k), np.empty(k), np.empty(k), np.empty(k),
        np.empty(k), np.empty((2, k)), np.empty((n, k), np.complex128), np.empty((n, k)), np.empty((n, k)),
        np.empty(n, np.complex128), np.empty(n, np.complex128), np.empty(n), np.empty(n), np.empty((n, 2)), np.empty(n),
        np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int64), np.empty(n + 1, np.int64),
    )  # fmt: skip


@subroutine()
def turn_error(task, i, coupler, body_angle):
    """The angle of the body less that of a pose, within half a turn, as a distance at the end of the lever."""
    if task.lever == 0.0:
        return 0.0
    apart = coupler * task.directions[i].conjugate()
    angle = math.atan2(apart.imag, apart.real) + body_angle
    return task.lever * (angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5))


@subroutine()
def square_of(task, i, place, coupler, body_angle):
    """The weighted squared error of a point."""
    error, turned = place - task.points[i], turn_error(task, i, coupler, body_angle)
    return task.weights[i] * (error.real * error.real + error.imag * error.imag + turned * turned)


@subroutine()
def cost_of(problem, numbers, constants, angles):
    """The weighted sum of squares, and the price of missed limits."""
    total = price_of_limits(problem.task.limits, numbers, constants)
    for i in range(len(angles)):
        place, coupler = place_at(numbers, constants, problem.branch, angles[i])
        total += square_of(problem.task, i, place, coupler, numbers[BODY])
    return total
