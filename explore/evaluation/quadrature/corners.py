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
from explore.evaluation.quadrature.tiles import TILE_CENTRE, TILE_HALF, place_nodes, sample_abscissa, take_panels
from explore.evaluation.quadrature.zeros import MOST_ZEROS, insert

#: Factor on the largest depth of a parabola below its samples, which 0 has to be clear of.
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

# Rows of the state of the search, after those of `brent.fill_trial_tangents`: both ends of the bracket, their values,
# the step as a share of the bracket, whether the lane is at work, the next sample to look at, what is doubtful, the
# largest sample.
_X1, _X2, _F1, _F2, _SHARE, _ACTIVE, _NEXT, _DOUBT, _LARGEST = ((TRIAL // LANES + 1 + row) * LANES for row in range(9))
#: Size of the state.
SEARCH_SIZE = _LARGEST + LANES


@subroutine()
def search_tile(fill, sizes, tables, first, last, chosen, work, tile):
    """Find where rows are at levels on the chosen panels: number in `codes`, -1 for doubtful, and positions."""
    panels, needs = work.panels, 0
    for c in range(first, last):
        needs |= tables.row_needs[tables.corner_rows[c, 0]]
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
        _take_row(sizes.rows, row, terms_row, level, count + 2, work, tile)
        _doubt(tile, tables.row_of[count], tables.rules, count)
        doubtful_ends = False
        for lane in range(LANES):
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
    """Fill the samples of a row less the level, bounds of their rounding errors, and where the next sign begins.

    Where the size of its terms is not known, a row is rounded like its largest sample.
    """
    state = tile.search
    for lane in range(LANES):
        state[_NEXT + lane], state[_LARGEST + lane], noise = 1.0, 0.0, work.noise[tile.lane_designs[lane]]
        tile.node[lane] = ROUNDING * (1.0 + noise * (1.0 + noise))
        tile.marks[samples * LANES + lane] = 1.0 * samples
    largest = state[_LARGEST : _LARGEST + LANES]
    for j in range(samples):
        _take_sample(tile.signals[(j * rows + row) * LANES :], level, tile.roots[j * LANES :], largest)
    for j in range(samples):
        terms = tile.signals[(j * rows + terms_row) * LANES :] if terms_row >= 0 else largest
        _round_sample(terms, tile.node, tile.weights[j * LANES :])
    for j in range(samples - 1, 0, -1):
        _mark_change(tile.roots[(j - 1) * LANES :], j, tile.marks[j * LANES :], len(largest))


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
def _mark_change(values, j, marks, width):
    """Fill the number of the next sample from j on whose sign is not that of the one before."""
    for lane in range(width):
        changes = (values[lane] > 0.0) != (values[LANES + lane] > 0.0)
        following = marks[LANES + lane]
        marks[lane] = 1.0 * j if changes else following


@subroutine()
def _doubt(tile, rule, table, count):
    """Fill where zeros may be that samples of a row less its level do not show: in a dip, beside an end that is 0."""
    doubts = tile.search[_DOUBT : _DOUBT + LANES]
    doubts[:] = 0.0
    first, second = 1.0 + sample_abscissa(table, rule, count, 1), 1.0 + sample_abscissa(table, rule, count, 2)
    for side, end, step in ((_FIRST_END, 0, LANES), (_LAST_END, (count + 1) * LANES, -LANES)):
        _doubt_end(
            tile.roots[end:], tile.roots[end + step :], tile.roots[end + 2 * step :], tile.weights[end:],
            tile.weights[end + step :], first, second - first, side, doubts,
        )  # fmt: skip
    for j in range(1, count + 1):
        place = sample_abscissa(table, rule, count, j)
        to_left = place - sample_abscissa(table, rule, count, j - 1)
        to_right = sample_abscissa(table, rule, count, j + 1) - place
        _doubt_sample(tile.roots[(j - 1) * LANES :], tile.weights[j * LANES :], to_left, to_right, doubts)


@subroutine(no_alias=True)
def _doubt_sample(values, roundings, to_left, to_right, doubts):
    """Fill `_DIP` where zeros may be near the second of three samples: see `extremes._mark_inside`."""
    one_over_left, one_over_right, one_over_both = 1.0 / to_left, 1.0 / to_right, 1.0 / (to_left + to_right)
    share = 0.25 * _MARGIN * max(to_left, to_right) ** 2
    for lane in range(len(doubts)):
        left, value, right = values[lane], values[LANES + lane], values[2 * LANES + lane]
        sign = 1.0 if value > 0.0 else -1.0
        left, value, right = sign * left, sign * value, sign * right
        before, after = (value - left) * one_over_left, (right - value) * one_over_right
        curvature = (after - before) * one_over_both
        is_dip = (left > 0.0) & (right > 0.0) & (value <= left) & (value <= right)
        is_rounding = (left if left > right else right) <= roundings[lane]
        is_deep = value <= share * curvature
        doubts[lane] = _DIP if is_dip & is_deep & (not is_rounding) else doubts[lane]


@subroutine(no_alias=True)
def _doubt_end(at_end, at_next, at_second, rounding_at_end, rounding_at_next, first, second, side, doubts):
    """Add a side where zeros may be beside it, by a parabola through the samples at the end and next to it.

    `first` and `second` are the distances from the end to the next sample, and from that to the second one.
    """
    for lane in range(len(doubts)):
        sign = 1.0 if at_next[lane] > 0.0 else -1.0
        end, here, inner = sign * at_end[lane], sign * at_next[lane], sign * at_second[lane]
        outwards, inwards = (here - end) / first, (inner - here) / second
        curvature = (inwards - outwards) / (first + second)
        slope = outwards - curvature * first
        least = end + (slope if slope < 0.0 else 0.0) * first
        largest = abs(end) if abs(end) > abs(inner) else abs(inner)
        is_rounding = (here <= rounding_at_next[lane]) & (largest <= rounding_at_next[lane])
        is_near = (abs(end) <= rounding_at_end[lane] + here) & (inner > 0.0) & (least <= rounding_at_end[lane])
        is_doubtful = is_near & (curvature > 0.0) & (slope < _CLEAR * curvature * first) & (not is_rounding)
        doubts[lane] += side if is_doubtful else 0.0


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
                state[_X1 + lane] = sample_abscissa(table, rule, count, j - 2)
                state[_X2 + lane] = sample_abscissa(table, rule, count, j - 1)
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
        _update(state, tile.node_signals[row * LANES :], level, len(tile.node))


@subroutine(no_alias=True)
def _update(state, values, level, width):
    """Take the values at the trial points into the brackets, and choose the next step of each lane.

    Without branches, so that the loop over lanes vectorises.
    """
    for lane in range(width):
        is_active, share = state[_ACTIVE + lane], state[_SHARE + lane]
        x1, f1, old_x2, old_f2 = state[_X1 + lane], state[_F1 + lane], state[_X2 + lane], state[_F2 + lane]
        x, f = x1 + share * (old_x2 - x1), values[lane] - level
        passes = (f > 0.0) != (f1 > 0.0)
        x3, f3 = (old_x2, old_f2) if passes else (x1, f1)
        x2, f2 = (x1, f1) if passes else (old_x2, old_f2)
        width_of_bracket = abs(x2 - x)
        least = 0.5 * _WIDTH / width_of_bracket if width_of_bracket > 0.0 else 1.0
        is_found = (f == 0.0) | (least > 0.25)
        place, slope = (x - x2) / (x3 - x2), (f - f2) / (f3 - f2)
        is_inside = (slope * slope < place) & ((1.0 - slope) * (1.0 - slope) < 1.0 - place)
        quadratic = f / (f2 - f) * f3 / (f2 - f3) + (x3 - x) / (x2 - x) * f / (f3 - f) * f2 / (f3 - f2)
        next_share = quadratic if is_inside else 0.5
        next_share = least if least > next_share else next_share
        next_share = 1.0 - least if next_share > 1.0 - least else next_share
        rests = is_active == 0.0
        state[_X1 + lane], state[_F1 + lane] = (x1, f1) if rests else (x, f)
        state[_X2 + lane], state[_F2 + lane] = (old_x2, old_f2) if rests else (x2, f2)
        state[_SHARE + lane] = share if rests else next_share
        state[_ACTIVE + lane] = 0.0 if is_found else is_active
