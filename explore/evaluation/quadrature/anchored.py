"""Panels graded towards a singularity that stands above any angle, its place; all others are farther than a distance.

Half-tangents are from the place, and from its opposite, until panels are mapped to t. From then on they are those from
the anchor again, to which the nodes are turned back.
"""

import math

from explore.base.lanes.elementary import exponential, inverse_cosh
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.ellipses import axis_through
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    CENTRE,
    DECAY,
    FOURTH,
    HALF,
    PANEL_CAPACITY,
    RATE,
    SCALE,
    SECOND,
    SINGULAR,
    TURNED,
    map_panels,
)
from explore.evaluation.quadrature.windows import ARC, LONGER, SHORTER, orient

#: Row of the place, rad, where singularities are otherwise.
_PLACE = SINGULAR + PANEL_CAPACITY
#: Row of the half-tangent of the distance of all others.
_OTHERS = SINGULAR + 2 * PANEL_CAPACITY
#: Abscissas of a panel above which the line of all other singularities is looked at, dense near its ends.
_SHARES = tuple(math.cos(math.pi * k / 24.0) for k in range(25))
#: Share of the rate that is relied on: of 3,148 panels points between these made that of three smaller, by 5 %.
_RELIED = 0.93
#: Largest half-tangent of an angle, that of half a turn.
_LARGEST = 1e100


@subroutine(inlined=True)
def turn_by(tangent, other):
    """The half-tangent of the sum of two angles from their half-tangents."""
    above, below = tangent + other, 1.0 - tangent * other
    return above / below if abs(below) * _LARGEST > abs(above) else _LARGEST


@subroutine()
def turn_window(kind, start, stop, place):
    """Kind and ends of a window, half-tangents from the anchor, from a place of the turn, rad."""
    if kind == LONGER or kind == SHORTER:
        start, stop = orient(kind, start, stop)
        kind = ARC
    back = -math.tan(0.5 * place)
    return kind, turn_by(start, back), turn_by(stop, back)


@subroutine()
def turn_interval(anchor, start, place):
    """The anchor, 0 or 1, that is nearer to an angle from a place, and the angle from it; `start` is from `anchor`."""
    angle = start + math.pi * anchor - place
    half_turns = math.floor(angle / math.pi + 0.5)
    return half_turns % 2.0, angle - math.pi * half_turns


@subroutine()
def map_anchored(panels, count, anchors):
    """Map panels about their places, and fill the smaller of the rates of the place and of all other singularities.

    Panels whose place is not known have a rate of 0.
    """
    for k in range(count):
        is_known = panels[_PLACE + k] == panels[_PLACE + k]  # not NaN
        panels[TURNED + k] = panels[_PLACE + k] if is_known else 0.0
        panels[SECOND + k] = panels[_OTHERS + k] if is_known else 0.0
        panels[SINGULAR + k] = panels[SINGULAR + k] if is_known else 1.0
        panels[_PLACE + k] = panels[_OTHERS + k] = 1.0  # no singularities for `map_panels`
    map_panels(panels, count, anchors)
    for k in range(count):
        panels[FOURTH + k] = math.inf
    for share in _SHARES:
        for k in range(count):
            growth = exponential(panels[CENTRE + k] + share * panels[HALF + k])
            above = 0.5 * panels[SCALE + k] * (growth - 1.0 / growth)
            axis = axis_through(panels, k, above, panels[SECOND + k])
            panels[FOURTH + k] = axis if axis < panels[FOURTH + k] else panels[FOURTH + k]
    for k in range(count):
        rate = _RELIED * inverse_cosh(panels[FOURTH + k])
        nearer = rate < panels[RATE + k]
        panels[RATE + k] = rate if nearer else panels[RATE + k]
        panels[DECAY + k] = exponential(-2.0 * rate) if nearer else panels[DECAY + k]
        tangent = math.tan(0.5 * panels[TURNED + k])
        opposite = -1.0 / tangent if abs(tangent) * _LARGEST > 1.0 else _LARGEST
        panels[TURNED + k] = tangent if panels[ANCHOR + k] == 0.0 else opposite
        panels[ANCHOR + k] = 0.0
