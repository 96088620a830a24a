"""Extremes of a signal over the panels of a tile: samples, then a search from each local minimum that may win."""

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
from explore.evaluation.quadrature.candidates import abscissa_of, abscissas_about, mark_candidates
from explore.evaluation.quadrature.fitted_minima import DISTANCES, FIT_ROWS, FITS, VALUES, fit_minimum
from explore.evaluation.quadrature.hidden_extremes import (
    BEFORE,
    BEHIND,
    BOTH,
    neighbours,
)
from explore.evaluation.quadrature.tiles import TILE_CENTRE, TILE_HALF, TILE_SCALE, four_nodes, sample_abscissa

#: Distances of looks from a candidate, over the distance to the next sample: extremes may be ever nearer to it.
_LOOKS = (0.5, *(8.0**-k for k in range(1, 7)))
#: Value of ACTIVE of a lane whose candidate is a sample beside which the least value may be.
BESIDE = 2.0

# Rows of the state after those of the searches: least sample, next sample to look at, result.
LEAST, NEXT, RESULT = ((BRENT_ROWS + FIT_ROWS + row) * LANES for row in range(3))
STATE_SIZE = (BRENT_ROWS + FIT_ROWS + 3) * LANES


@subroutine()
def _start_inside(shape, is_turn, values, count, table, rule, state, lane, j):
    """Start the lane at a sample between the ends."""
    a, x, b = abscissas_about(is_turn, count, table, rule, j)
    left, value, right = values[(j - 1) * LANES + lane], values[j * LANES + lane], values[(j + 1) * LANES + lane]
    half, centre = shape[TILE_HALF + lane], shape[TILE_CENTRE + lane]
    first, middle, last = centre + half * a, centre + half * x, centre + half * b
    start_lane(state, lane, first, middle, last, left, value, right, 2.0 * half * (b - a))
    _take_five(is_turn, values, count, table, rule, state, lane, j, half)


@subroutine()
def _take_five(is_turn, values, count, table, rule, state, lane, j, half):
    """Take a sample between the ends and four about it for the lane's polynomial."""
    a, x, b = abscissas_about(is_turn, count, table, rule, j)
    # beside an end the two further ones are on the other side
    before, behind = (j - 2, j + 2) if is_turn or 1 < j < count else ((j + 2, j + 3) if j == 1 else (j - 3, j - 2))
    c, d = abscissa_of(is_turn, count, table, rule, before), abscissa_of(is_turn, count, table, rule, behind)
    if is_turn:
        before, behind = neighbours(count, j, 2)
    state[DISTANCES + lane], state[DISTANCES + LANES + lane] = half * (a - x), half * (b - x)
    state[DISTANCES + 2 * LANES + lane], state[DISTANCES + 3 * LANES + lane] = half * (c - x), half * (d - x)
    state[VALUES + lane], state[VALUES + LANES + lane], state[VALUES + 2 * LANES + lane] = (
        values[j * LANES + lane], values[(j - 1) * LANES + lane], values[(j + 1) * LANES + lane]
    )  # fmt: skip
    state[VALUES + 3 * LANES + lane] = values[before * LANES + lane]
    state[VALUES + 4 * LANES + lane] = values[behind * LANES + lane]
    state[FITS + lane] = 1.0


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
    a, x, b = abscissas_about(is_turn, count, table, rule, j)
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
    state[FITS + lane] = 0.0
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
def _take_samples(first, second, third, fourth, sign, values, least):
    """Fill the values of a signal at four nodes, and lower the least ones to them."""
    # LLVM would unroll a loop of constant length instead of vectorising it.
    for lane in range(len(least)):
        a, b, c, d = sign * first[lane], sign * second[lane], sign * third[lane], sign * fourth[lane]
        values[lane], values[LANES + lane], values[2 * LANES + lane], values[3 * LANES + lane] = a, b, c, d
        lowest = least[lane]
        lowest = a if a < lowest else lowest
        lowest = b if b < lowest else lowest
        lowest = c if c < lowest else lowest
        least[lane] = d if d < lowest else lowest


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
    for j in range(0, count + 2, 4):
        first, second, third, fourth = four_nodes(samples, rows, row, j, count + 1)
        _take_samples(first, second, third, fourth, sign, values[j * LANES :], least)
    is_turn = shape[TILE_SCALE] == 0.0
    mark_candidates(is_turn, values, least, count, table, rule, marks)
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
        fit_minimum(
            fill, tile.constants, shape, anchor, law, variant, needs, row, sign, state, tile.node, tile.node_signals
        )  # fmt: skip
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
