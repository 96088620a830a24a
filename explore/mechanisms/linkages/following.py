"""A group of links as rows of constants: knots of its path, from which `follow` gives places near the true ones.

Knots are by p = 2 n + tan(phi/2), with phi the rest of the crank angle after n half turns. Between two knots the
directions of both links are cubics by p, beside a fold by the root of its distance. Knots are so many
that what cubics miss is a small share of the square in which an assembly is known to be the only one, see
`group_paths`: from there Newton's method finds it.
"""

import math

import numpy as np
from numba import types

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.group_assemblies import find_assembly
from explore.mechanisms.linkages.group_folds import distance_from_folds
from explore.mechanisms.linkages.group_paths import FOLDED, LOST, MOST_STATES, REACHED, follow_path
from explore.mechanisms.linkages.group_ties import STATE_SIZE, TIE_SIZE
from explore.mechanisms.linkages.turning import ROUNDING

#: Verdict on a group that is back in its assembly after a turn.
TURNS = 1.0
#: Verdict on one that two folds, or no assembly at the sketched crank angle, block.
BLOCKED = -1.0
#: Verdict on one that is in another assembly after a turn.
RETURNS_NOT = 2.0
#: Verdict on one that is lost.
UNDECIDED = 0.0
#: Number of constants before the knots: verdict, least and greatest p, number of knots, folds, error of these as a p.
_HEAD = 6
#: Numbers of a knot: p, cosine and sine of both links, and their derivatives by p.
_KNOT_SIZE = 9
#: Largest number of knots.
_MOST_KNOTS = 96
#: Number of constants of a group.
GROUP_ROWS = _HEAD + _KNOT_SIZE * _MOST_KNOTS
#: Number of numbers of the ties of a group.
TIES_SIZE = 2 * TIE_SIZE
#: Number of numbers that tell where a group is sketched.
START_SIZE = 4
#: Share of the width of a square that cubics may miss.
_MISSED = 0.02
#: A turn, in p.
_TURN = 4.0
#: Largest difference of two equal angles, rad.
_SAME = 1e-7

_ROW = types.CPointer(types.float64)
#: Signature of `follow`.
FOLLOW_SIGNATURE = types.void(_ROW, types.int64, types.int64, _ROW, _ROW, _ROW)


@compiled(FOLLOW_SIGNATURE)
def follow(constants, first, lanes, cosines, sines, out):
    """See `follow_group`."""
    follow_group(constants, first, lanes, cosines, sines, out)


@subroutine()
def follow_group(constants, first, lanes, cosines, sines, out):
    """Fill seven rows at crank angles: how far a group assembles, the directions of both links, slope and size.

    How far is as `distance_from_folds` says, 1 for a turn, -1 for no assembly, and 0 where that is not decided; its
    slope is by the crank angle, and its rounding errors are `turning.ROUNDING` times the size. `first` is the first row
    of the group.
    """
    for lane in range(lanes):
        base = first * lanes + lane
        cosine, sine = cosines[lane], sines[lane]
        tangent = sine / (1.0 + abs(cosine))
        verdict, low, high = constants[base], constants[base + lanes], constants[base + 2 * lanes]
        place = tangent if cosine >= 0.0 else 2.0 - tangent
        out[lane] = -1.0 if verdict == BLOCKED else 0.0 if verdict == UNDECIDED else 1.0
        out[5 * lanes + lane], out[6 * lanes + lane] = 0.0, 1.0
        if verdict == BLOCKED and high >= low:
            out[lane], out[5 * lanes + lane] = distance_from_folds(place, low, high)
            out[6 * lanes + lane] = constants[base + 5 * lanes] / ROUNDING
        place -= _TURN * math.floor((place - low) / _TURN)
        place = min(place, high)
        start, end = 0, int(constants[base + 3 * lanes]) - 1
        while end - start > 1:
            middle = (start + end) // 2
            if constants[base + (_HEAD + _KNOT_SIZE * middle) * lanes] <= place:
                start = middle
            else:
                end = middle
        is_last = end + 1 == int(constants[base + 3 * lanes])
        fold = _fold_of(int(constants[base + 4 * lanes]), start == 0, is_last)
        knot = base + (_HEAD + _KNOT_SIZE * start) * lanes
        _interpolate(constants, knot, lanes, place, fold, out, lane)


@subroutine(inlined=True)
def _fold_of(folds, is_first, is_last):
    """Which of the two knots of the first or the last cell is a fold: 1 or 2, or 0 for none."""
    return 1 if is_first and folds % 2 == 1 else 2 if is_last and folds >= 2 else 0


@subroutine()
def _interpolate(knots, one, step, place, fold, out, lane):
    """Fill the directions between two knots; `fold` is 1 or 2 where the first or the second one is a fold, else 0."""
    other = one + _KNOT_SIZE * step
    width = knots[other] - knots[one]
    t = min(max((place - knots[one]) / width, 0.0), 1.0)
    t = math.sqrt(t) if fold == 1 else 1.0 - math.sqrt(1.0 - t) if fold == 2 else t
    # the rate of p by t at a knot, or at a fold that of the root of its distance
    before = width if fold == 0 else math.sqrt(width) if fold == 1 else 2.0 * width
    after = width if fold == 0 else 2.0 * width if fold == 1 else -math.sqrt(width)
    for k in range(1, 5):
        f0, f1 = knots[one + k * step], knots[other + k * step]
        d0, d1 = before * knots[one + (k + 4) * step], after * knots[other + (k + 4) * step]
        bend = (1.0 - t) * (d0 - (f1 - f0)) - t * (d1 - (f1 - f0))
        out[k * step + lane] = f0 + t * (f1 - f0) + t * (1.0 - t) * bend


@compiled(allocates=True)
def track_groups(ties, starts, groups, first, constants):
    """Fill the constants of groups from row `first` on; see `group_equations.rows_of` for the rows of ties.

    Of each group `starts` has the crank angle, rad, of its sketch, the directions of both links there, and the status
    of designs whose crank it blocks.
    """
    own, knots = np.empty(TIES_SIZE), np.empty(GROUP_ROWS)
    forward, backward = np.empty(MOST_STATES * STATE_SIZE), np.empty(MOST_STATES * STATE_SIZE)
    path = np.empty(2 * MOST_STATES * STATE_SIZE)
    for group in range(groups):
        for lane in range(LANES):
            for k in range(TIES_SIZE):
                own[k] = ties[(TIES_SIZE * group + k) * LANES + lane]
            _track(own, starts[START_SIZE * group :], forward, backward, path, knots)
            for k in range(GROUP_ROWS):
                constants[(first + GROUP_ROWS * group + k) * LANES + lane] = knots[k]


@subroutine(inlined=True)
def is_nowhere(constants, at):
    """Whether a group, with the first of its constants, has no assembly at the sketched crank angle."""
    return constants[at] == BLOCKED and constants[at + 2 * LANES] < constants[at + LANES]


@subroutine(inlined=True)
def has_fold(constants, at):
    """Whether the path of a group has an end in a fold."""
    return constants[at + 4 * LANES] > 0.0


@subroutine()
def passes_seam(constants, at, start, length):
    """Whether a group is in another assembly after a turn, and crank angles, rad, pass where the turn ends."""
    place = constants[at + LANES]
    half_turns = math.floor(0.5 * (place + 1.0))
    turns = (half_turns * math.pi + 2.0 * math.atan(place - 2.0 * half_turns) - start) / (2.0 * math.pi)
    return constants[at] == RETURNS_NOT and turns - math.floor(turns) < length / (2.0 * math.pi)


@subroutine(allocates=True)
def _track(ties, start, forward, backward, path, knots):
    """Fill the constants of a group."""
    for k in range(GROUP_ROWS):
        knots[k] = 0.0
    found = find_assembly(ties, start[0], start[1], start[2], forward)
    # a group without an assembly has an interval that no angle is in, and knots that are numbers
    knots[0], knots[1], knots[2], knots[3] = (BLOCKED if found < 0 else UNDECIDED), 0.0, -1.0, 2.0
    knots[_HEAD + _KNOT_SIZE] = 1.0
    for k in range(1, 5):
        knots[_HEAD + k] = knots[_HEAD + _KNOT_SIZE + k] = 1.0
    if found != 1:
        return
    for k in range(STATE_SIZE):
        backward[k] = forward[k]
    begin, turn = start[0], 2.0 * math.pi
    ahead, end = follow_path(ties, forward, 1, 1.0, begin + math.pi)
    last = forward[(ahead - 1) * STATE_SIZE] - turn if end == FOLDED else begin - math.pi
    behind, other = (1, LOST) if end == LOST else follow_path(ties, backward, 1, -1.0, last)
    if end == REACHED and other == FOLDED:
        ahead, end = follow_path(ties, forward, ahead, 1.0, backward[(behind - 1) * STATE_SIZE] + turn)
    if end == LOST or other == LOST:
        return
    count = ahead + behind - 1
    for n in range(count):
        source = backward[(behind - 1 - n) * STATE_SIZE :] if n < behind else forward[(n - behind + 1) * STATE_SIZE :]
        for k in range(STATE_SIZE):
            path[n * STATE_SIZE + k] = source[k]
    knots[4] = (1.0 if other == FOLDED else 0.0) + (2.0 if end == FOLDED else 0.0)
    knots[5] = max(path[STATE_SIZE - 1], path[count * STATE_SIZE - 1]) if knots[4] == 3.0 else 0.0
    verdict = TURNS if _is_back(path, path[(count - 1) * STATE_SIZE :]) else RETURNS_NOT
    verdict = BLOCKED if knots[4] == 3.0 else verdict
    knots[0] = verdict if _choose_knots(path, count, knots) else UNDECIDED


@subroutine()
def _is_back(one, other):
    """Whether two states are the same assembly."""
    away = 0.0
    for k in range(1, 3):
        turns = (other[k] - one[k]) / (2.0 * math.pi)
        away = max(away, abs(turns - math.floor(turns + 0.5)))
    return 2.0 * math.pi * away < _SAME


@subroutine(allocates=True)
def _choose_knots(path, count, knots):
    """Fill as few knots as suffice; return whether there is room for them."""
    samples, folds = np.empty(count * _KNOT_SIZE), int(knots[4])
    if count < 4:
        return False
    for n in range(count):
        _sample(path[n * STATE_SIZE :], samples[n * _KNOT_SIZE :])
    if folds % 2 == 1:
        _slope_by_root(samples, 0, 1)
    if folds >= 2:
        _slope_by_root(samples, count - 1, -1)
    number, at = 1, 0
    _put_knot(samples, 0, knots, 0)
    while at < count - 1:
        if number == _MOST_KNOTS:
            return False
        least, step = at + 1, 2
        if folds >= 2 and _suffices(path, samples, at, count - 1, count, folds):
            least, step = count - 1, count
        while at + step < count and _suffices(path, samples, at, at + step, count, folds):
            least, step = at + step, 2 * step
        most = min(at + step, count)
        while most - least > 1:
            middle = (least + most) // 2
            if _suffices(path, samples, at, middle, count, folds):
                least = middle
            else:
                most = middle
        _put_knot(samples, least, knots, number)
        at, number = least, number + 1
    knots[1], knots[2], knots[3] = samples[0], samples[(count - 1) * _KNOT_SIZE], number
    return True


@subroutine()
def _put_knot(samples, n, knots, number):
    for k in range(_KNOT_SIZE):
        knots[_HEAD + number * _KNOT_SIZE + k] = samples[n * _KNOT_SIZE + k]


@subroutine()
def _sample(state, knot):
    """Fill the numbers of a knot."""
    half_turns = math.floor(state[0] / math.pi + 0.5)
    tangent = math.tan(0.5 * (state[0] - half_turns * math.pi))
    knot[0] = 2.0 * half_turns + tangent
    for k in range(2):
        cosine, sine = math.cos(state[1 + k]), math.sin(state[1 + k])
        rate = 2.0 * state[3 + k] / (1.0 + tangent * tangent)
        knot[1 + 2 * k], knot[2 + 2 * k] = cosine, sine
        knot[5 + 2 * k], knot[6 + 2 * k] = -sine * rate, cosine * rate


@subroutine()
def _slope_by_root(samples, fold, sense):
    """Fill the derivatives at a fold by the root of the distance from it, from two states beside it: the line by it."""
    one, other = samples[(fold + sense) * _KNOT_SIZE :], samples[(fold + 2 * sense) * _KNOT_SIZE :]
    near, far = (
        math.sqrt(abs(one[0] - samples[fold * _KNOT_SIZE])),
        math.sqrt(abs(other[0] - samples[fold * _KNOT_SIZE])),
    )
    for k in range(5, _KNOT_SIZE):
        samples[fold * _KNOT_SIZE + k] = 2.0 * sense * near * far * (one[k] - other[k]) / (far - near)


@subroutine(allocates=True)
def _suffices(path, samples, first, last, count, folds):
    """Whether the knots of two states give all states between them nearly enough."""
    out, two = np.empty(5), np.empty(2 * _KNOT_SIZE)
    fold = _fold_of(folds, first == 0, last == count - 1)
    if folds == 3 and first == 0 and last == count - 1:
        return False
    for k in range(_KNOT_SIZE):
        two[k], two[_KNOT_SIZE + k] = samples[first * _KNOT_SIZE + k], samples[last * _KNOT_SIZE + k]
    for n in range(first + 1, last):
        sample = samples[n * _KNOT_SIZE :]
        # the second derivative by p jumps where the anchor changes
        if abs(sample[0] - 2.0 * math.floor(0.5 * sample[0]) - 1.0) < 1e-9:
            return False
        _interpolate(two, 0, 1, sample[0], fold, out, 0)
        for k in range(1, 5, 2):
            missed = math.hypot(out[k] - sample[k], out[k + 1] - sample[k + 1])
            if not missed <= _MISSED * path[n * STATE_SIZE + 5]:
                return False
    return True
