"""Windows to panels: any part of the turn, cut where a law changes and between anchors.

Positions in the turn are half-tangents from the anchor, between -infinity and infinity; from the opposite of the anchor
the half-tangent of the same position is -1 over it.
"""

import math

from explore.compiling import compiled
from explore.quadrature.panels import ANCHOR, FIRST, LAST, LAW
from explore.subroutines import subroutine

#: Kinds of windows: the full turn; from one mark to another; the longer or shorter of that and its complement; a fixed
#: interval of angles.
TURN, ARC, LONGER, SHORTER, INTERVAL = range(5)
#: A stroke is the longer one if it exceeds half a turn by more than the rounding of its ends.
TIE = 1e-14
#: Angles (rad) that differ by less are equal.
_SAME = 1e-12
#: Half-tangents beyond which a panel would reach the opposite of its anchor: from infinity, a node has no offset.
LARGEST_TANGENT = 1e15


@subroutine()
def _add(panels, k, anchor, first, last, law):
    """Append one panel; return the next number."""
    panels[ANCHOR + k], panels[FIRST + k], panels[LAST + k], panels[LAW + k] = anchor, first, last, float(law)
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
def _add_cut_arc(panels, k, start, stop, length, breaks, count):
    """Append the panels of an arc of a known length, cut at the breaks; return the next number.

    The law of a panel is the number of the break before it.
    """
    law, latest = 0, -1.0
    for i in range(count):
        offset = _offset(start, breaks[i])
        if offset == 0.0:
            law, latest = i, 7.0
        elif offset > latest:
            law, latest = i, offset
    done = 0.0
    while True:
        following, at = -1, length - _SAME
        for i in range(count):
            offset = _offset(start, breaks[i])
            if done + _SAME < offset < at:
                following, at = i, offset
        if following < 0:
            return add_arc(panels, k, start if done == 0.0 else breaks[law], stop, law)
        k = add_arc(panels, k, start if done == 0.0 else breaks[law], breaks[following], law)
        law, done = following, at


@subroutine()
def _add_interval(panels, k, start, stop, breaks, count):
    """Append the panels of an interval of angles from the anchor, rad, of at most a full turn.

    One panel where it keeps its distance from the opposite of an anchor and no law changes, else parts of at most half
    a turn.
    """
    anchor = math.floor(0.5 * (start + stop) / math.pi + 0.5)
    reach = 0.9 * math.pi
    if count == 0 and stop - anchor * math.pi < reach and start - anchor * math.pi > -reach:
        first, last = math.tan(0.5 * (start - anchor * math.pi)), math.tan(0.5 * (stop - anchor * math.pi))
        return _add(panels, k, anchor % 2.0, first, last, 0)
    anchor = math.floor(start / math.pi + 0.5)
    while True:
        end = min(stop, (anchor + 0.5) * math.pi)
        first, last = math.tan(0.5 * (start - anchor * math.pi)), math.tan(0.5 * (end - anchor * math.pi))
        if count == 0:
            k = _add(panels, k, anchor % 2.0, first, last, 0)
        elif end - start > _SAME:
            if anchor % 2.0 == 1.0:
                first, last = -1.0 / first if first != 0.0 else math.inf, -1.0 / last if last != 0.0 else -math.inf
            k = _add_cut_arc(panels, k, first, last, end - start, breaks, count)
        if end == stop:
            return k
        start, anchor = end, anchor + 1.0


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
    """Append the panels of a window of one design.

    Parameters
    ----------
    panels
        Buffer of `explore.quadrature.panels`.
    k
        Number of the first panel to fill.
    kind
        TURN, ARC, LONGER, SHORTER or INTERVAL.
    start, stop
        Half-tangents from the anchor; angles from the anchor (rad) for INTERVAL.
    breaks, count
        Half-tangents where the law of a signal changes, each forwards from the one before, and their number.

    Returns
    -------
    int
        Number of the panel after the last.
    """
    if kind == INTERVAL:
        return _add_interval(panels, k, start, stop, breaks, count)
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
