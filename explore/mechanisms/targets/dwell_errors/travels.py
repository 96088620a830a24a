"""How far an output moves while the input turns by an angle: the least over a turn, and the longest rest."""

import math

from explore.base.subroutines import subroutine
from explore.mechanisms.golden import narrowed, sections
from explore.mechanisms.targets.dwell_errors.pieces import LENGTH, POWER, START, polynomial, value_at
from explore.mechanisms.targets.path_errors.curve import TURN

#: Largest number of places where the output turns back.
MOST_REVERSALS = 256
#: Number of starts that are compared.
N_STARTS = 256
#: Number of intervals of them that are left out as a whole.
N_INTERVALS = 32
#: Steps of a golden section, from two of the starts that are compared to 4e-14 rad.
_SECTIONS = 58
#: Largest number of angles that the search of the longest rest compares.
_MOST_ANGLES = 60
#: Largest number of steps to a place between two others.
_MOST_STEPS = 80
#: Number of bisections after a secant that does not halve an interval, as where a value bends.
_BISECTIONS = 3
#: Length of an interval that secants leave, rad or parts of a piece.
_EXACT = 1e-14
#: Distance of the first start beside one that is tried, rad.
_NEAR = 1e-6
#: Largest step to the next one, rad: longer ones pass over starts that do not serve.
_FAR = TURN / N_STARTS
#: Length of an angle of rest that is known well enough, rad.
_SHORT = 1e-11


@subroutine()
def _derivative(piece, order, u):
    """First or second derivative of the output by the part of a piece that is passed."""
    value = 0.0
    for power in range(5, order - 1, -1):
        value = value * u + piece[POWER + power] * (power if order == 1 else power * (power - 1))
    return value


@subroutine(inlined=True)
def _between(low, high, at_low, at_high, bisections):
    """A place between two with values of two signs: the middle while bisections are due, else that of the secant.

    The value at an end that stays is halved by the caller, so that this end moves, too.
    """
    change = at_low - at_high
    return low + (high - low) * (0.5 if bisections > 0 or change == 0.0 else at_low / change)


@subroutine(inlined=True)
def _due(bisections, length, rest):
    """How many bisections are due after a step that left a rest of a length: some where a secant did not halve it."""
    return bisections - 1 if bisections > 0 else 0 if abs(rest) <= 0.5 * abs(length) else _BISECTIONS


@subroutine()
def _change_of_sign(piece, order, low, high):
    """Where a derivative changes its sign between two places where it has two."""
    at_low, at_high = _derivative(piece, order, low), _derivative(piece, order, high)
    rises, bisections = at_low >= 0.0, 0
    for _ in range(_MOST_STEPS):
        length = high - low
        if length <= _EXACT:
            break
        place = _between(low, high, at_low, at_high, bisections)
        value = _derivative(piece, order, place)
        if (value >= 0.0) == rises:
            low, at_low, at_high = place, value, 0.5 * at_high
        else:
            high, at_high, at_low = place, value, 0.5 * at_low
        bisections = _due(bisections, length, high - low)
    return 0.5 * (low + high)


@subroutine()
def _add_reversal(piece, low, high, reversals, found):
    u = _change_of_sign(piece, 1, low, high)
    if found < MOST_REVERSALS:
        reversals[found, 0] = piece[START] + u * piece[LENGTH]
        reversals[found, 1] = polynomial(piece, u)
    return found + 1


@subroutine()
def _find_in_half(piece, low, rises, rises_last, reversals, found):
    high = low + 0.5
    if rises != rises_last:
        return _add_reversal(piece, low, high, reversals, found)
    if (_derivative(piece, 2, low) >= 0.0) != (_derivative(piece, 2, high) >= 0.0):
        middle = _change_of_sign(piece, 2, low, high)
        if (_derivative(piece, 1, middle) >= 0.0) != rises:
            found = _add_reversal(piece, low, middle, reversals, found)
            found = _add_reversal(piece, middle, high, reversals, found)
    return found


@subroutine()
def find_reversals(pieces, count, reversals):
    """Fill angles and places, (MOST_REVERSALS, 2), where the output turns back, and give their number, also if larger.

    Where the slope keeps its sign over half a piece and turns back in between, two reversals are inside.
    """
    found = 0
    for k in range(count):
        piece, following = pieces[k], pieces[(k + 1) % count]
        first, middle, last = piece[POWER + 1] >= 0.0, _derivative(piece, 1, 0.5) >= 0.0, following[POWER + 1] >= 0.0
        found = _find_in_half(piece, 0.0, first, middle, reversals, found)
        found = _find_in_half(piece, 0.5, middle, last, reversals, found)
    return found


@subroutine()
def travel(motion, start, angle):
    """Largest less least place of the output while the input turns by an angle, at most a turn, from a start."""
    pieces, cells, drift, reversals, found = motion
    first, last = value_at(pieces, cells, drift, start), value_at(pieces, cells, drift, start + angle)
    low, high = min(first, last), max(first, last)
    turn = math.floor(start / TURN)
    start -= TURN * turn
    for k in range(found):
        ahead = 0 if reversals[k, 0] > start else 1
        if reversals[k, 0] + TURN * ahead < start + angle:
            value = reversals[k, 1] + drift * (turn + ahead)
            low, high = min(low, value), max(high, value)
    return high - low


@subroutine()
def _least_between(motion, angle, low, high):
    """The start of the least travel between two starts, and that travel."""
    a, b = sections(low, high)
    at_a, at_b = travel(motion, a, angle), travel(motion, b, angle)
    for _ in range(_SECTIONS):
        is_left = at_a <= at_b
        low, high, a, b, at_a, at_b = narrowed(low, high, a, b, at_a, at_b)
        value = travel(motion, a if is_left else b, angle)
        at_a, at_b = value if is_left else at_a, at_b if is_left else value
    return (a, at_a) if at_a <= at_b else (b, at_b)


@subroutine()
def _least_bound(motion, angle, start, length):
    """No travel that starts within a length from a start is less: all of them pass this part."""
    return travel(motion, start + length, angle - length) if angle > length else 0.0


@subroutine()
def _fill_events(motion, angle, events):
    """Fill the starts, in order, at which a dwell begins or ends where the output turns back; and the first once more.

    Between two of them no reversal enters the dwell or leaves it. Give their number, with the last.
    """
    _, _, _, reversals, found = motion
    for k in range(2 * found):
        at = reversals[k // 2, 0] - (angle if k % 2 else 0.0)
        at -= TURN * math.floor(at / TURN)
        j = k
        while j > 0 and events[j - 1] > at:
            events[j] = events[j - 1]
            j -= 1
        events[j] = at
    events[2 * found] = events[0] + TURN
    return 2 * found + 1 if found else 0


@subroutine()
def least_travel(motion, angle, start, travels, events):
    """The start of the least travel during an angle of the input, and that travel.

    `start` is one that may be near, NaN for none; `travels` has N_STARTS numbers, `events` 2 MOST_REVERSALS + 1.
    Intervals of starts are left out in which no travel is less. Those between two events that are nearer than starts
    are searched alone.
    """
    step, wide, share = TURN / N_STARTS, TURN / N_INTERVALS, N_STARTS // N_INTERVALS
    least = math.inf
    if start == start:
        start, least = _least_between(motion, angle, start - step, start + step)
    else:
        for k in range(N_INTERVALS):
            value = travel(motion, wide * k, angle)
            if value < least:
                start, least = wide * k, value
    for k in range(N_INTERVALS):
        leaves_out = _least_bound(motion, angle, wide * k, wide) >= least
        for j in range(k * share, (k + 1) * share):
            travels[j] = math.inf if leaves_out else travel(motion, step * j, angle)
            if travels[j] < least:
                start, least = step * j, travels[j]
    for k in range(N_STARTS):  # the first after the last: an index of -1
        if travels[k] < travels[k - 1] and travels[k] <= travels[(k + 1) % N_STARTS]:
            start, least = _less_between(motion, angle, step * (k - 1), step * (k + 1), start, least)
    for k in range(_fill_events(motion, angle, events) - 1):
        if events[k + 1] - events[k] < 2.0 * step:
            start, least = _less_between(motion, angle, events[k], events[k + 1], start, least)
    return start, least


@subroutine()
def _less_between(motion, angle, low, high, start, least):
    """The least travel, and its start, of one that is known and those between two starts."""
    if _least_bound(motion, angle, low, high - low) < least:
        found, value = _least_between(motion, angle, low, high)
        if value < least:
            return found, value
    return start, least


@subroutine()
def longest_rest(motion, most, error, travels, events):
    """The longest angle of the input during which the output moves by `most`, its start and the bound of its error.

    The least travel never falls as the angle grows, so that the angle is between two. It is found by Chandrupatla's
    method: inverse quadratic interpolation where that is safe, else a bisection. `error` bounds the error of a travel.
    """
    start, whole = 0.0, travel(motion, 0.0, TURN)
    if whole <= most:
        return TURN, start, 0.0 if whole + error <= most else TURN
    # the last angle, the one beyond the zero from it, and the one before, with what their travels are above `most`
    a, b, c = 0.0, TURN, TURN
    at_a, at_b, at_c = -most, whole - most, whole - most
    part, guess = 0.5, math.nan
    for _ in range(_MOST_ANGLES):
        angle = a + part * (b - a)
        guess, value = least_travel(motion, angle, guess, travels, events)
        value -= most
        if (value > 0.0) == (at_a > 0.0):
            c, at_c = a, at_a
        else:
            b, at_b, c, at_c = a, at_a, b, at_b
        a, at_a = angle, value
        start = guess if value <= 0.0 else start
        if abs(b - a) <= _SHORT or abs(at_b - at_a) <= error:
            break
        x, y = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
        part = 0.5
        if y * y < x and (1.0 - y) * (1.0 - y) < 1.0 - x:
            part = at_a / (at_b - at_a) * (at_c / (at_b - at_c))
            part += (c - a) / (b - a) * (at_a / (at_c - at_a)) * (at_b / (at_c - at_b))
        margin = 0.25 * _SHORT / abs(b - a)
        part = min(max(part, margin), 1.0 - margin)
    low, slope = min(a, b), (at_b - at_a) / (b - a)
    return low, start, abs(b - a) + (error / slope if slope > 0.0 else TURN)


@subroutine()
def middle_start(motion, angle, start, error):
    """The middle of the starts about one whose travels are as small, up to an error: those of ripples in a dwell.

    And the bound of its error: it moves with the square root of the error, or less, towards that without.
    """
    least = travel(motion, start, angle)
    middle = _middle(motion, angle, start, least + error)
    return middle, 3.0 * abs(_middle(motion, angle, start, least + 2.0 * error) - middle) + _SHORT


@subroutine()
def _middle(motion, angle, start, most):
    return start + 0.5 * (_reach(motion, angle, start, most, 1.0) + _reach(motion, angle, start, most, -1.0))


@subroutine()
def _reach(motion, angle, start, most, sense):
    """How far a start may move in a sense before its travel is above a limit, at most half a turn, signed."""
    inside, outside = 0.0, sense * _NEAR
    while travel(motion, start + outside, angle) <= most:
        if abs(outside) >= 0.5 * TURN:
            return sense * 0.5 * TURN
        inside, outside = outside, outside + sense * min(abs(outside), _FAR)
    below, above = travel(motion, start + inside, angle) - most, travel(motion, start + outside, angle) - most
    bisections = 0
    for _ in range(_MOST_STEPS):
        length = outside - inside
        if abs(length) <= _EXACT:
            break
        place = _between(inside, outside, below, above, bisections)
        value = travel(motion, start + place, angle) - most
        if value <= 0.0:
            inside, below, above = place, value, 0.5 * above
        else:
            outside, above, below = place, value, 0.5 * below
        bisections = _due(bisections, length, outside - inside)
    return inside
