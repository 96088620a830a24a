"""Extremes of a signal over the panels of a tile: samples, then Brent's method from each local minimum that may win."""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.brent import (
    ACTIVE,
    AT_BEST,
    AT_SECOND,
    AT_THIRD,
    BEST,
    BRENT_ROWS,
    SECOND,
    STEP,
    THIRD,
    TRIAL,
    fill_trial_tangents,
    minimise,
    start_lane,
)
from explore.evaluation.quadrature.equispaced import abscissa
from explore.evaluation.quadrature.hidden_extremes import (
    BEFORE,
    BEHIND,
    BOTH,
    is_near_end,
    is_open,
    mark_hidden,
    mark_hidden_near_end,
    neighbours,
)
from explore.evaluation.quadrature.tiles import TILE_CENTRE, TILE_HALF, TILE_SCALE, sample_abscissa

#: Factor on the largest drop of a parabola below a local minimum, which may win if this reaches the least sample.
_DROP_MARGIN = 64.0
#: Slope at an end, over curvature times distance to the next sample, below which the extreme may be inside.
_DOUBTFUL = 0.1
#: Distances of looks from a candidate, over the distance to the next sample: extremes may be ever nearer to it.
_LOOKS = (0.5, *(8.0**-k for k in range(1, 7)))
#: Rise to both neighbours of a sample, over its size, up to which a minimum is one of rounding.
_CONSTANT = 2.0**-46
#: Value of ACTIVE of a lane whose candidate is a sample beside which the least value may be.
BESIDE = 2.0

# Rows of the state after those of Brent's method: least sample, next sample to look at, result.
LEAST, NEXT, RESULT = ((BRENT_ROWS + row) * LANES for row in range(3))
STATE_SIZE = (BRENT_ROWS + 3) * LANES


@subroutine(no_alias=True)
def _mark_end(at_0, at_1, at_2, at_3, at_4, x1, x2, x3, x4, number, following, marks):
    """Fill the number of an end that is not above the sample next to it where the least value may be inside, or go on.

    The samples are those from the end on, and their distances from it in abscissas. The slope at the end is the least
    by five samples: what the fifth changes in the slope of four is at least what more would.
    """
    # Newton's divided differences, and the derivatives of the interpolant at the end.
    for lane in range(len(at_0)):
        f0, f1, f2, f3, f4 = at_0[lane], at_1[lane], at_2[lane], at_3[lane], at_4[lane]
        d01, d12, d23, d34 = (f1 - f0) / x1, (f2 - f1) / (x2 - x1), (f3 - f2) / (x3 - x2), (f4 - f3) / (x4 - x3)
        d02, d13, d24 = (d12 - d01) / x2, (d23 - d12) / (x3 - x1), (d34 - d23) / (x4 - x2)
        d03, d14 = (d13 - d02) / x3, (d24 - d13) / (x4 - x1)
        d04 = (d14 - d03) / x4
        slope = d01 - x1 * (d02 - x2 * (d03 - x3 * d04)) - x1 * x2 * x3 * abs(d04)
        curvature = 2.0 * (d02 - (x1 + x2) * d03 + (x1 * x2 + x1 * x3 + x2 * x3) * d04)
        starts = (f0 <= f1) & (f0 < math.inf) & (slope < _DOUBTFUL * x1 * abs(curvature))
        marks[lane] = number if starts else following[lane]


@subroutine(inlined=True)
def _neighbours(is_turn, count, table, rule, j):
    """Abscissas of a sample between the ends, and of those before and after it."""
    if is_turn:
        return abscissa(count, j - 2), abscissa(count, j - 1), abscissa(count, j)
    return (
        sample_abscissa(table, rule, count, j - 1), sample_abscissa(table, rule, count, j),
        sample_abscissa(table, rule, count, j + 1),
    )  # fmt: skip


@subroutine(no_alias=True)
def _mark_inside(values, far_before, far_behind, j, a, x, b, least, following, marks, width):
    """Fill the number of the next sample that may win from sample j on, by its neighbours.

    Return whether in some lane a minimum may be hidden beside the sample, by the ones next to its neighbours too.

    Only a local minimum may, by `_DROP_MARGIN` times what a parabola of the curvature there drops below it at most, in
    the middle of the wider distance; the slope does not tell, for at a sample beside the minimum it may seem to be 0.
    At a tolerance of 1e-6, whose nodes are few, a factor of 8 missed two of 3.4 million extremes.
    """
    to_left, to_right, both = 1.0 / (x - a), 1.0 / (b - x), 1.0 / (b - a)
    share = 0.25 * _DROP_MARGIN * max(x - a, b - x) ** 2
    count = 0
    for lane in range(width):
        left, value, right = values[lane], values[LANES + lane], values[2 * LANES + lane]
        before, after = (value - left) * to_left, (right - value) * to_right
        curvature = (after - before) * both
        reaches = value - least[lane] <= share * curvature
        rise = (left if left > right else right) - value  # 0 on a plateau
        is_lowest = (value <= left) & (value <= right) & (rise > _CONSTANT * abs(value))
        marks[lane] = 1.0 * j if is_lowest & reaches else following[lane]
        open_here = is_open(value, left, right, far_before[lane], far_behind[lane], least[lane])
        count += 1 if open_here | (is_lowest & reaches) else 0
    return count > 0


@subroutine()
def _mark_candidates(is_turn, values, least, count, table, rule, marks):
    """Fill for each sample the number of the next one from it on at which a lane starts; behind the last for none."""
    width, last = len(least), count + 1
    marks[last * LANES : (last + 2) * LANES] = 1.0 * (last + 1)
    x1, x2 = 1.0 + sample_abscissa(table, rule, count, 1), 1.0 + sample_abscissa(table, rule, count, 2)
    x3, x4 = 1.0 + sample_abscissa(table, rule, count, 3), 1.0 + sample_abscissa(table, rule, count, 4)
    if not is_turn:
        _mark_end(
            values[last * LANES : (last + 1) * LANES], values[(last - 1) * LANES :], values[(last - 2) * LANES :],
            values[(last - 3) * LANES :], values[(last - 4) * LANES :], x1, x2, x3, x4, 1.0 * last,
            marks[(last + 1) * LANES :], marks[last * LANES :],
        )  # fmt: skip
    for j in range(count, 0, -1):
        a, x, b = _neighbours(is_turn, count, table, rule, j)
        far_before, far_behind = (j, j) if is_near_end(is_turn, count, j) else neighbours(count, j, 2)
        may_hide = _mark_inside(
            values[(j - 1) * LANES :], values[far_before * LANES :], values[far_behind * LANES :], j, a, x, b, least,
            marks[(j + 1) * LANES :], marks[j * LANES :], width,
        )  # fmt: skip
        if is_near_end(is_turn, count, j):
            mark_hidden_near_end(values, least, count, j, marks[j * LANES :])
        elif may_hide:
            mark_hidden(values, least, count, j, marks[j * LANES :])
    for lane in range(LANES):
        marks[lane] = marks[LANES + lane]
    if not is_turn:
        _mark_end(
            values[:LANES], values[LANES:], values[2 * LANES :], values[3 * LANES :], values[4 * LANES :],
            x1, x2, x3, x4, 0.0, marks[LANES:], marks,
        )  # fmt: skip


@subroutine()
def _start_inside(shape, is_turn, values, count, table, rule, state, lane, j):
    """Start the lane at a sample between the ends."""
    a, x, b = _neighbours(is_turn, count, table, rule, j)
    left, value, right = values[(j - 1) * LANES + lane], values[j * LANES + lane], values[(j + 1) * LANES + lane]
    half, centre = shape[TILE_HALF + lane], shape[TILE_CENTRE + lane]
    first, middle, last = centre + half * a, centre + half * x, centre + half * b
    start_lane(state, lane, first, middle, last, left, value, right, 2.0 * half * (b - a))


@subroutine()
def _start_at_end(shape, values, count, table, rule, state, lane, j):
    """Make an end of the panel the lane's candidate."""
    next_to_end = 1 if j == 0 else count
    direction = shape[TILE_HALF + lane] if j == 0 else -shape[TILE_HALF + lane]
    end, inner = shape[TILE_CENTRE + lane] - direction, 1.0 + sample_abscissa(table, rule, count, 1)
    _start_beside(state, lane, end, direction * inner, values[j * LANES + lane], values[next_to_end * LANES + lane])


@subroutine()
def _start_beside_node(shape, is_turn, values, count, table, rule, state, lane, j, is_before):
    """Make a node of a slope the lane's candidate, with a minimum hidden before or behind it."""
    a, x, b = _neighbours(is_turn, count, table, rule, j)
    half, other = shape[TILE_HALF + lane], j - 1 if is_before else j + 1
    step = half * (a - x) if is_before else half * (b - x)
    place = shape[TILE_CENTRE + lane] + half * x
    _start_beside(state, lane, place, step, values[j * LANES + lane], values[other * LANES + lane])


@subroutine(inlined=True)
def _start_beside(state, lane, place, step, value, next_value):
    """Make a sample the lane's candidate, beside which the least value is, up to the next sample a step away."""
    state[BEST + lane], state[AT_BEST + lane], state[STEP + lane] = place, value, step
    state[SECOND + lane], state[AT_SECOND + lane] = place + step, next_value
    state[ACTIVE + lane] = BESIDE


@subroutine()
def _next_candidate(shape, is_turn, values, marks, count, table, rule, state, lane):
    """Start the lane at its next marked sample from NEXT on; it rests if there is none.

    Where minima may be hidden on both sides of a sample, the lane starts there three times, with NEXT between samples.
    """
    following = state[NEXT + lane]
    mark = marks[int(following) * LANES + lane] if following == int(following) else following
    j = int(mark)
    next_one = 1.0 * min(j + 1, count + 2)
    if mark - j == BEFORE or mark - j == BEHIND:
        _start_beside_node(shape, is_turn, values, count, table, rule, state, lane, j, mark - j == BEFORE)
        next_one = j + BEHIND if following == j + BEFORE else next_one  # NEXT is between samples after BOTH alone
    elif 0 < j <= count:
        _start_inside(shape, is_turn, values, count, table, rule, state, lane, j)
        next_one = j + BEFORE if mark - j == BOTH else next_one
    elif j <= count + 1:
        _start_at_end(shape, values, count, table, rule, state, lane, j)
    else:
        state[ACTIVE + lane] = 0.0
        state[BEST + lane], state[AT_BEST + lane] = shape[TILE_CENTRE + lane], math.inf
    state[NEXT + lane] = next_one


@subroutine(no_alias=True)
def _take_sample(sample, sign, values, least):
    """Fill the values of a signal at one node, and lower the least ones to them."""
    # LLVM would unroll a loop of constant length instead of vectorising it.
    for lane in range(len(least)):
        value, lowest = sign * sample[lane], least[lane]
        values[lane] = value
        least[lane] = value if value < lowest else lowest


@subroutine()
def _look_inside(fill, anchor, law, variant, needs, row, sign, tile):
    """Look at points ever nearer to candidates with a minimum beside them, and start the lanes where one is below."""
    state = tile.state
    for look in _LOOKS:
        for lane in range(LANES):
            is_beside = state[ACTIVE + lane] == BESIDE
            state[TRIAL + lane] = state[BEST + lane] + (look * state[STEP + lane] if is_beside else 0.0)
        fill_trial_tangents(tile.shape, state, tile.node)
        fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.node_signals)
        for lane in range(LANES):
            _take_look(state, lane, state[TRIAL + lane], sign * tile.node_signals[row * LANES + lane])
    for lane in range(LANES):
        _take_look(state, lane, state[BEST + lane], state[AT_BEST + lane])
    for lane in range(LANES):
        state[ACTIVE + lane] = 1.0 if state[ACTIVE + lane] == 1.0 else 0.0


@subroutine()
def find_minimum(fill, rows, anchor, law, variant, needs, row, sign, count, table, rule, samples, tile):
    """Fill RESULT of the state of a tile with the least ``sign * signal`` over each panel, from its samples.

    The first and the last sample are the ends of the panel; of a turn, which has no ends, those before and after it.
    """
    state, shape, values, marks = tile.state, tile.shape, tile.values, tile.marks
    least = state[LEAST : LEAST + LANES]
    for lane in range(LANES):
        state[LEAST + lane], state[NEXT + lane] = math.inf, 0.0
    for j in range(count + 2):
        _take_sample(samples[(j * rows + row) * LANES :], sign, values[j * LANES :], least)
    is_turn = shape[TILE_SCALE] == 0.0
    _mark_candidates(is_turn, values, least, count, table, rule, marks)
    for lane in range(LANES):
        state[RESULT + lane] = state[LEAST + lane]
    while True:
        working, looks = False, False
        for lane in range(LANES):
            _next_candidate(shape, is_turn, values, marks, count, table, rule, state, lane)
            working = working or state[ACTIVE + lane] != 0.0
            looks = looks or state[ACTIVE + lane] == BESIDE
        if not working:
            return
        if looks:
            _look_inside(fill, anchor, law, variant, needs, row, sign, tile)
        minimise(
            fill, tile.constants, shape, anchor, law, variant, needs, row, sign, state, tile.node, tile.node_signals
        )  # fmt: skip
        for lane in range(LANES):
            state[RESULT + lane] = min(state[RESULT + lane], state[AT_BEST + lane])


@subroutine()
def _take_look(state, lane, place, value):
    """Start Brent's method of a lane at its last look, if below the candidate and not above this one, ever nearer."""
    if state[ACTIVE + lane] != BESIDE:
        return
    best, at_best, outer, at_outer = (
        state[SECOND + lane], state[AT_SECOND + lane], state[THIRD + lane], state[AT_THIRD + lane]
    )  # fmt: skip
    if value < at_best or at_best >= state[AT_BEST + lane]:
        state[THIRD + lane], state[AT_THIRD + lane] = best, at_best
        state[SECOND + lane], state[AT_SECOND + lane] = place, value
    elif place < outer:
        start_lane(state, lane, place, best, outer, value, at_best, at_outer, 2.0 * (outer - place))
    else:
        start_lane(state, lane, outer, best, place, at_outer, at_best, value, 2.0 * (outer - place))
