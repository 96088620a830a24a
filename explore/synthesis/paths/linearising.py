"""Normal equations of a linkage's numbers at its angles, and the blocks of points that share an angle."""

from explore.base.subroutines import subroutine
from explore.synthesis.paths.limits import add_limits, log_slopes
from explore.synthesis.paths.normal_equations import add_points, eliminate, hold_number
from explore.synthesis.paths.numbers import BODY, GROUND, N_NUMBERS, outward_slopes, place_and_slopes
from explore.synthesis.paths.placed_pivots import change_coordinates, slopes_by_pivots, to_pivots
from explore.synthesis.paths.problems import ORDERED, TIMED, UNORDERED, turn_error

#: Number that keeps quotients finite.
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
