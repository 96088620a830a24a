"""Windows to panels: any part of the turn, cut where a law changes and between anchors.

Positions in the turn are half-tangents from the anchor, between -infinity and infinity; from the opposite of the anchor
the half-tangent of the same position is -1 over it.
"""

import math

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.panels import ANCHOR, FIRST, LAST, LAW, SPREAD

# Kinds of windows: the full turn; from one mark to another; the longer or shorter of that and its complement; a fixed
# interval of angles.
TURN, ARC, LONGER, SHORTER, INTERVAL = range(5)

#: Excess over 1, by rounding, of the product of the half-tangents of the ends of half a turn.
TIE = 1e-14
#: Smallest difference of unequal angles, a few roundings of an angle of a turn, rad.
_SAME = 4e-15
#: Largest angle between an anchor and an end of a panel of an interval, rad.
_REACH = 0.9 * math.pi
#: Largest half-tangent near the anchor; an arc from there to beyond its inverse, near the opposite, is cut between.
_NEAR = 0.1
#: Largest half-tangent of an end of a panel: from infinity, at the opposite of its anchor, a node has no offset.
LARGEST_TANGENT = 1e15


@subroutine()
def _add(panels, k, anchor, first, last, law):
    """Append one panel; return the next number."""
    panels[ANCHOR + k], panels[FIRST + k], panels[LAST + k], panels[LAW + k] = anchor, first, last, float(law)
    panels[SPREAD + k] = last - first
    return k + 1


@subroutine()
def _split(panels, k, anchor, first, last, law):
    """Append a panel about an anchor, cut a quarter turn off the anchor at ends that reach the anchor's opposite."""
    if first < -LARGEST_TANGENT:
        k = _add(panels, k, 1.0 - anchor, -1.0 / first, 1.0, law)
        first = -1.0
    if last > LARGEST_TANGENT:
        k = _add(panels, k, anchor, first, 1.0, law)
        return _add(panels, k, 1.0 - anchor, -1.0, -1.0 / last, law)
    return _add(panels, k, anchor, first, last, law)


@subroutine()
def add_arc(panels, k, start, stop, law):
    """Append the panels from `start` forwards to `stop`, half-tangents from the anchor; return the next number."""
    if 0.0 <= start < _NEAR and stop > 1.0 / _NEAR:
        k = _add(panels, k, 0.0, start, 1.0, law)
        return _split(panels, k, 1.0, -1.0, -1.0 / stop, law)
    if start < -1.0 / _NEAR and -_NEAR < stop <= 0.0:
        k = _split(panels, k, 1.0, -1.0 / start, 1.0, law)
        return _add(panels, k, 0.0, -1.0, stop, law)
    if start < stop:  # not past the opposite of the anchor
        if (start < 0.0 < stop) or abs(math.atan(start) + math.atan(stop)) <= 0.5 * math.pi:
            return _split(panels, k, 0.0, start, stop, law)
        return _split(panels, k, 1.0, -1.0 / start, -1.0 / stop, law)
    if start >= 0.0 >= stop:  # not past the anchor
        return _split(panels, k, 1.0, -1.0 / start if start > 0.0 else -math.inf,
                      -1.0 / stop if stop < 0.0 else math.inf, law)  # fmt: skip
    if start < 0.0:  # past the anchor, then its opposite
        k = _split(panels, k, 0.0, start, 1.0, law)
        return _split(panels, k, 1.0, -1.0, -1.0 / stop, law)
    k = _split(panels, k, 1.0, -1.0 / start, 1.0, law)
    return _split(panels, k, 0.0, -1.0, stop, law)


@subroutine()
def _offset(start, position):
    """Angle from one half-tangent forwards to another, between 0 and a full turn, rad; rounding of 0 is 0."""
    angle = 2.0 * (math.atan(position) - math.atan(start))
    angle = angle + 2.0 * math.pi if angle < 0.0 else angle
    return 0.0 if angle < _SAME or angle > 2.0 * math.pi - _SAME else angle


@subroutine()
def _law_at(start, breaks, count):
    """The law that holds from a position on: the number of the break before it, 0 where there is none."""
    law, latest = 0, -1.0
    for i in range(count):
        offset = _offset(start, breaks[i])
        if offset == 0.0:
            law, latest = i, 7.0
        elif offset > latest:
            law, latest = i, offset
    return law


@subroutine()
def _next_break(start, done, length, breaks, count):
    """The first break beyond an angle from the start and before the end, and its angle; -1 and the end for none."""
    following, at = -1, length - _SAME
    for i in range(count):
        offset = _offset(start, breaks[i])
        if done + _SAME < offset < at:
            following, at = i, offset
    return following, at


@subroutine()
def _add_cut_arc(panels, k, start, stop, length, breaks, count):
    """Append the panels of an arc of a known length, cut at the breaks; return the next number.

    The law of a panel is the number of the break before it.
    """
    law, done = _law_at(start, breaks, count), 0.0
    while True:
        following, at = _next_break(start, done, length, breaks, count)
        if following < 0:
            return add_arc(panels, k, start if done == 0.0 else breaks[law], stop, law)
        k = add_arc(panels, k, start if done == 0.0 else breaks[law], breaks[following], law)
        law, done = following, at


@subroutine()
def _add_part(panels, k, anchor, start, length, breaks, count):
    """Append a part of an interval that keeps its distance from the opposite of an anchor, cut at the breaks."""
    first, last = math.tan(0.5 * start), math.tan(0.5 * (start + length))
    law = 0
    if count > 0:
        begin, end = first, last
        if anchor == 1.0:
            begin, end = -1.0 / first if first != 0.0 else math.inf, -1.0 / last if last != 0.0 else -math.inf
        if _next_break(begin, 0.0, length, breaks, count)[0] >= 0:
            return _add_cut_arc(panels, k, begin, end, length, breaks, count)
        law = _law_at(begin, breaks, count)
    k = _add(panels, k, anchor, first, last, law)
    # The difference of two tangents from the angle between them, which has more digits where it is short.
    panels[SPREAD + k - 1] = math.sin(0.5 * length) * math.sqrt((1.0 + first * first) * (1.0 + last * last))
    return k


@subroutine()
def add_interval(panels, k, anchor, start, length, breaks, count):
    """Append the panels of an explicit interval of at most a full turn; return the number of the panel after the last.

    One panel where it keeps its distance from the opposite of an anchor, else parts of at most half a turn, cut where
    laws change. `anchor` is the anchor (0) or its opposite (1) that is nearer to the first angle, `start` that angle
    from there, and `length` the length of the interval to its last digit however short it is, both rad; the other
    arguments are those of `add_window`.
    """
    middle = math.floor((start + 0.5 * length) / math.pi + 0.5)
    from_middle = start - middle * math.pi
    if from_middle > -_REACH and from_middle + length < _REACH:
        return _add_part(panels, k, (anchor + middle) % 2.0, from_middle, length, breaks, count)
    while True:
        part = 0.5 * math.pi - start
        part = length if length - part < _SAME else part
        if part > _SAME:
            k = _add_part(panels, k, anchor, start, part, breaks, count)
        if part == length:
            return k
        anchor, start, length = 1.0 - anchor, -0.5 * math.pi, length - part


@subroutine(inlined=True)
def orient(kind, start, stop):
    """The ends of the longer or shorter of an arc and its complement; those of an ARC as they are."""
    # Without the rounding of angles: about the anchor inside the arc the product of the half-tangents of its ends is
    # below -1 where the arc exceeds half a turn. An arc between ends on the same side of the anchor goes past both
    # anchors or past neither.
    product = -start * stop if start < stop else -1.0 / (start * stop)
    same_side = start * stop >= 0.0
    first_is_longer = start > stop if same_side else product > 1.0 + TIE
    swap = (kind != ARC) & (first_is_longer != (kind == LONGER))
    return stop if swap else start, start if swap else stop


@compiled("void(int64, float64[::1], float64[::1], float64[::1])")
def orient_arcs(kind, starts, stops, lengths):
    """Orient many arcs in place, as `orient` does, and fill their lengths, rad."""
    for i in range(len(starts)):
        start, stop = orient(kind, starts[i], stops[i])
        half = math.atan2(stop - start, 1.0 + start * stop)
        starts[i], stops[i], lengths[i] = start, stop, 2.0 * (half if half > 0.0 else half + math.pi)


@subroutine()
def add_window(panels, k, kind, start, stop, breaks, count):
    """Append the panels of a window of one design from number k on; return the number of the panel after the last.

    `kind` is TURN, ARC, LONGER or SHORTER, from `start` to `stop`, half-tangents from the anchor. The first `count` of
    the `breaks` are half-tangents where the law of a signal changes, each forwards from the one before.
    """
    if kind == TURN:
        if count == 0:
            k = _add(panels, k, 0.0, -1.0, 1.0, 0)
            return _add(panels, k, 1.0, -1.0, 1.0, 0)
        for i in range(count):
            following = breaks[i + 1] if i + 1 < count else breaks[0]
            if count == 1:
                k = add_arc(panels, k, following, -1.0 / following, i)
                k = add_arc(panels, k, -1.0 / following, following, i)
            else:
                k = add_arc(panels, k, breaks[i], following, i)
        return k
    start, stop = orient(kind, start, stop)
    if count == 0:
        return add_arc(panels, k, start, stop, 0)
    return _add_cut_arc(panels, k, start, stop, _offset(start, stop), breaks, count)
