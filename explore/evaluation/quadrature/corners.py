"""Places where signals reach levels, at which others have corners, of many designs at once: panels are cut there.

Changes of sign between samples less the level are brackets of zeros, which Chandrupatla's method narrows in all lanes
(T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm, Advances in Engineering Software 28, 1997). A dip may
hide a pair of zeros between two samples: where a parabola does not clear 0 by a margin, the design is left to the
adaptive rule, whose search `explore.evaluation.quadrature.zeros` is denser.
"""

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.bounds import ROUNDING
from explore.evaluation.quadrature.brent import TRIAL, fill_trial_tangents
from explore.evaluation.quadrature.panels import ANCHOR, COUNT, LAW, VARIANT
from explore.evaluation.quadrature.tiles import TILE_CENTRE, TILE_HALF, place_nodes, take_panels
from explore.evaluation.quadrature.zeros import MOST_ZEROS, insert

#: Factor on the depth of a dip below its samples, as a parabola tells, which 0 has to be clear of.
_MARGIN = 8.0
#: Slope at an end that is a zero, over curvature times distance to the next sample, that tells it is the only one.
_CLEAR = 0.2
#: Distances of looks from an end, over the distance to the node next to it.
_LOOKS = tuple(8.0**-k for k in range(1, 7))
# What is doubtful of a row on a panel: an end, the other end, both, or a dip between its nodes.
_FIRST_END, _LAST_END, _DIP = 1.0, 2.0, 4.0
#: Number of steps that narrow a bracket to rounding, at most.
_MOST_STEPS = 80
#: Largest width of a bracket that is a zero, half lengths of the panel.
_WIDTH = 4e-16

# Rows of the state of the search, after those of `brent.fill_trial_tangents`: both ends of the bracket and the point
# before, their values, the step as a share of the bracket, whether the lane is at work, the next sample to look at,
# what is doubtful, the largest sample.
_X1, _X2, _X3, _F1, _F2, _F3, _SHARE, _ACTIVE, _NEXT, _DOUBT, _LARGEST = (
    (TRIAL // LANES + 1 + row) * LANES for row in range(11)
)
#: Size of the state.
SEARCH_SIZE = _LARGEST + LANES


@subroutine()
def search_tile(fill, sizes, tables, w, first, last, chosen, work, tile):
    """Find where rows are at levels on the chosen panels: number in `codes`, -1 for doubtful, and positions."""
    panels, needs = work.panels, tables.needs[w]
    take_panels(sizes, chosen, True, work, tile)
    k = chosen[0]
    anchor, law, variant, count = (
        int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k]), int(panels[COUNT + k])
    )  # fmt: skip
    place_nodes(tile.shape, count, True, tables.row_of, tables.rules, tile.tangents, tile.weights)
    fill(tile.constants, tile.tangents, anchor, law, variant, count + 2, needs, tile.signals)
    state = tile.search
    for c in range(first, last):
        row, terms_row, level = tables.corner_rows[c, 0], tables.corner_rows[c, 1], tables.corner_levels[c]
        doubtful_ends = False
        _take_row(sizes.rows, row, terms_row, level, count + 2, work, tile)
        for lane in range(LANES):
            state[_DOUBT + lane] = _doubt(tile, tables.row_of[count], tables.rules, count, lane)
            doubtful_ends = doubtful_ends or 0.0 < state[_DOUBT + lane] < _DIP
        if doubtful_ends:
            gap = 1.0 - tables.rules[tables.row_of[count], 0]
            _look_beside_ends(fill, anchor, law, variant, needs, row, level, gap, count, tile)
        for lane in range(len(chosen)):
            if state[_DOUBT + lane] > 0.0:
                work.codes[chosen[lane]] = -1
        while _next_brackets(tile, tables.row_of[count], tables.rules, count, len(chosen)):
            _narrow(fill, anchor, law, variant, needs, row, level, tile)
            for lane in range(len(chosen)):
                k = chosen[lane]
                if state[_X1 + lane] > -1.0 and work.codes[k] >= 0:
                    zeros = work.corners[k * MOST_ZEROS : (k + 1) * MOST_ZEROS]
                    found = insert(panels, k, state[_X1 + lane], zeros, work.codes[k], MOST_ZEROS)
                    work.codes[k] = found if found <= MOST_ZEROS else -1


@subroutine()
def _take_row(rows, row, terms_row, level, samples, work, tile):
    """Fill and mark the samples of a row less the level, and bounds of their rounding errors.

    Where the size of its terms is not known, a row is rounded like its largest sample.
    """
    state = tile.search
    for lane in range(LANES):
        state[_NEXT + lane], state[_LARGEST + lane], noise = 1.0, 0.0, work.noise[tile.lane_designs[lane]]
        tile.node[lane] = ROUNDING * (1.0 + noise * (1.0 + noise))
        tile.values[samples * LANES + lane] = tile.marks[samples * LANES + lane] = 1.0 * samples
    largest = state[_LARGEST : _LARGEST + LANES]
    for j in range(samples):
        _take_sample(tile.signals[(j * rows + row) * LANES :], level, tile.roots[j * LANES :], largest)
    for j in range(samples):
        terms = tile.signals[(j * rows + terms_row) * LANES :] if terms_row >= 0 else largest
        _round_sample(terms, tile.node, tile.weights[j * LANES :])
    for j in range(samples - 1, 0, -1):
        is_end = j == 1 or j >= samples - 2
        _mark_sample(
            tile.roots[(j - 1) * LANES :], j, is_end, tile.values[j * LANES :], tile.marks[j * LANES :], len(largest)
        )  # fmt: skip


@subroutine(no_alias=True)
def _take_sample(sample, level, values, largest):
    # LLVM would unroll loops of constant length instead of vectorising them.
    for lane in range(len(largest)):
        value, magnitude = sample[lane], abs(sample[lane])
        values[lane], largest[lane] = value - level, magnitude if magnitude > largest[lane] else largest[lane]


@subroutine(no_alias=True)
def _round_sample(terms, rounding, roundings):
    for lane in range(len(rounding)):
        roundings[lane] = rounding[lane] * terms[lane]


@subroutine(no_alias=True)
def _mark_sample(values, j, is_end, dips, changes, width):
    """Fill the numbers of the next sample from j on in a dip, or next to an end, and of the next change of sign.

    The values are those before, at and behind sample j; what is behind the last sample counts for nothing.
    """
    for lane in range(width):
        before, here, after = values[lane], values[LANES + lane], values[2 * LANES + lane]
        changes_sign, sign = (before > 0.0) != (here > 0.0), 1.0 if here > 0.0 else -1.0
        before, here, after = sign * before, sign * here, sign * after
        is_dip = (before > 0.0) & (after > 0.0) & (here <= before) & (here <= after)
        next_dip, next_change = dips[LANES + lane], changes[LANES + lane]
        dips[lane] = 1.0 * j if is_dip | is_end else next_dip
        changes[lane] = 1.0 * j if changes_sign else next_change


@subroutine(inlined=True)
def _place(table, rule, count, j):
    """Position of a sample of a rule with the two ends, between -1 and 1."""
    if j == 0 or j == count + 1:
        return -1.0 if j == 0 else 1.0
    return -table[rule + j - 1, 0] if 2 * (j - 1) < count else table[rule + count - j, 0]


@subroutine()
def _doubt(tile, rule, table, count, lane):
    """Where zeros may be that samples of a row less its level do not show: in a dip, beside an end that is zero."""
    doubt, following = 0.0, 1
    while True:
        j = int(tile.values[following * LANES + lane])
        if j > count:
            return doubt
        following = j + 1
        before, here = tile.roots[(j - 1) * LANES + lane], tile.roots[j * LANES + lane]
        after = tile.roots[(j + 1) * LANES + lane]
        sign = 1.0 if here > 0.0 else -1.0
        before, here, after = sign * before, sign * here, sign * after
        is_dip = before > 0.0 and after > 0.0 and here <= min(before, after)
        if here <= tile.weights[j * LANES + lane] and max(abs(before), abs(after)) <= tile.weights[j * LANES + lane]:
            continue
        x0, x1 = _place(table, rule, count, j - 1), _place(table, rule, count, j)
        x2 = _place(table, rule, count, j + 1)
        to_left, to_right = (here - before) / (x1 - x0), (after - here) / (x2 - x1)
        curvature = (to_right - to_left) / (x2 - x0)
        if curvature <= 0.0:
            continue
        if is_dip:
            slope = (to_left * (x2 - x1) + to_right * (x1 - x0)) / (x2 - x0)
            if here <= _MARGIN * 0.25 * slope * slope / curvature:
                return _DIP
        if j == 1 and abs(before) <= tile.weights[lane] + here and after > 0.0:
            slope = to_left - curvature * (x1 - x0)
            if before + min(0.0, slope) * (x1 - x0) <= tile.weights[lane] and slope < _CLEAR * curvature * (x1 - x0):
                doubt += _FIRST_END
        if j == count and abs(after) <= tile.weights[(count + 1) * LANES + lane] + here and before > 0.0:
            slope = -to_right - curvature * (x2 - x1)
            least = after + min(0.0, slope) * (x2 - x1)
            if least <= tile.weights[(count + 1) * LANES + lane] and slope < _CLEAR * curvature * (x2 - x1):
                doubt += _LAST_END


@subroutine()
def _look_beside_ends(fill, anchor, law, variant, needs, row, level, gap, count, tile):
    """Clear doubtful ends of the lanes where the row has the sign of the node next to the end ever nearer to it."""
    state, shape = tile.search, tile.shape
    for side, end, near in ((_FIRST_END, 0, 1), (_LAST_END, count + 1, count)):
        for lane in range(LANES):
            is_doubtful = state[_DOUBT + lane] == side or state[_DOUBT + lane] == _FIRST_END + _LAST_END
            state[_ACTIVE + lane] = 1.0 if is_doubtful else 0.0
        for look in _LOOKS:
            place = (1.0 - look * gap) * (-1.0 if end == 0 else 1.0)
            for lane in range(LANES):
                state[TRIAL + lane] = shape[TILE_CENTRE + lane] + shape[TILE_HALF + lane] * place
            fill_trial_tangents(shape, state, tile.node)
            fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.node_signals)
            for lane in range(LANES):
                value = tile.node_signals[row * LANES + lane] - level
                if (value > 0.0) != (tile.roots[near * LANES + lane] > 0.0) and abs(value) > tile.weights[
                    end * LANES + lane
                ]:
                    state[_ACTIVE + lane] = 0.0
        for lane in range(LANES):
            state[_DOUBT + lane] -= side * state[_ACTIVE + lane]


@subroutine()
def _next_brackets(tile, rule, table, count, lanes):
    """Start each lane at its next change of sign between samples; return whether there is one. Others rest at -1."""
    state, any_left = tile.search, False
    for lane in range(LANES):
        state[_ACTIVE + lane], state[_X1 + lane] = 0.0, -1.0
        j = int(state[_NEXT + lane])
        while lane < lanes:
            j = int(tile.marks[j * LANES + lane]) + 1
            if j > count + 2:
                break
            before, here = tile.roots[(j - 2) * LANES + lane], tile.roots[(j - 1) * LANES + lane]
            at_before, at_here = tile.weights[(j - 2) * LANES + lane], tile.weights[(j - 1) * LANES + lane]
            # an end that is a zero has any sign
            is_end = (j == 2 and abs(before) <= at_before) or (j == count + 2 and abs(here) <= at_here)
            is_rounding = is_end or (abs(before) <= at_before and abs(here) <= at_here)
            if not is_rounding:
                state[_X1 + lane] = _place(table, rule, count, j - 2)
                state[_X2 + lane] = _place(table, rule, count, j - 1)
                state[_F1 + lane], state[_F2 + lane] = before, here
                state[_SHARE + lane], state[_ACTIVE + lane], any_left = before / (before - here), 1.0, True
                break
        state[_NEXT + lane] = 1.0 * min(j, count + 2)
    return any_left


@subroutine()
def _narrow(fill, anchor, law, variant, needs, row, level, tile):
    """Narrow the brackets of all lanes at work, until the first end of each is the zero."""
    state, shape = tile.search, tile.shape
    for _ in range(_MOST_STEPS):
        active = 0.0
        for lane in range(LANES):
            active += state[_ACTIVE + lane]
            place = state[_X1 + lane] + state[_SHARE + lane] * (state[_X2 + lane] - state[_X1 + lane])
            place = place if state[_ACTIVE + lane] > 0.0 else state[_X1 + lane]
            state[TRIAL + lane] = shape[TILE_CENTRE + lane] + shape[TILE_HALF + lane] * place
        if active == 0.0:
            return
        fill_trial_tangents(shape, state, tile.node)
        fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.node_signals)
        _update(state, tile.node_signals[row * LANES :], level)


@subroutine()
def _update(state, values, level):
    """Take the values at the trial points into the brackets, and choose the next step of each lane."""
    for lane in range(LANES):
        if state[_ACTIVE + lane] == 0.0:
            continue
        x1, x2, f1, f2 = state[_X1 + lane], state[_X2 + lane], state[_F1 + lane], state[_F2 + lane]
        x, f = x1 + state[_SHARE + lane] * (x2 - x1), values[lane] - level
        x3, f3 = x1, f1
        if (f > 0.0) != (f1 > 0.0):
            x3, f3, x2, f2 = x2, f2, x1, f1
        x1, f1 = x, f
        width = abs(x2 - x1)
        least = 0.5 * _WIDTH / width if width > 0.0 else 1.0
        if f == 0.0 or least > 0.25:
            state[_ACTIVE + lane] = 0.0
        place, slope = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
        share = 0.5
        if slope * slope < place and (1.0 - slope) * (1.0 - slope) < 1.0 - place:
            share = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        state[_X1 + lane], state[_X2 + lane], state[_X3 + lane] = x1, x2, x3
        state[_F1 + lane], state[_F2 + lane], state[_F3 + lane] = f1, f2, f3
        state[_SHARE + lane] = min(max(share, least), 1.0 - least)
