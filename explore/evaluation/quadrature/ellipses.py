"""Rates of panels of designs that are moved over an interval, from an ellipse about it without singularities.

The ellipse has the ends of the interval as foci, in the plane of the angle theta. A panel is in t, with

    tan((theta - anchor)/2) = T sinh(t),

and its rule converges like rho^(-2N), rho of the largest ellipse in t, with the ends of the panel as foci, whose image
is inside. That reaches the boundary at the point whose distances from the two ends in t have the least sum, and it is
below the line Im t = pi/2, where the map ceases to be one-to-one.
"""

import math

from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import exponential, inverse_cosh, tangent
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    CENTRE,
    DECAY,
    FIRST,
    FOURTH,
    HALF,
    LAST,
    PANEL_CAPACITY,
    RATE,
    SCALE,
    SECOND,
    SINGULAR,
    SIXTH,
)

#: Places of the points of the boundary that are looked at, between the ends of the panel; both tips are two more.
_PLACES = (0.0, 0.05, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0)
#: Share of the rate that is relied on, as other points may be a few percent nearer.
_RELIED = 0.97
#: Largest angle from the anchor: points beyond the opposite of the anchor are no images of points below the line.
_LARGEST_ANGLE = 0.999999 * math.pi
# Rows of the singularities: middle and half length of the interval, rad.
_CENTRE, _REACH = SINGULAR + PANEL_CAPACITY, SINGULAR + 2 * PANEL_CAPACITY
# Rows of work: middle of the interval from the anchor of the panel, and the ends of the panel in half lengths from it.
_MIDDLE, _BEGIN, _END = SECOND, FOURTH, SIXTH


@subroutine(contract=True)
def bound_rates_by_ellipse(panels, count):
    """Fill rate and rho^-2 of panels whose first singularity is negative; see `explore.model.quadrature.Located`."""
    for k in range(count):
        half = panels[_REACH + k]
        begin, end = 2.0 * arctangent(panels[FIRST + k], 1.0), 2.0 * arctangent(panels[LAST + k], 1.0)
        middle = panels[_CENTRE + k] - math.pi * panels[ANCHOR + k]
        middle -= 2.0 * math.pi * math.floor((middle - 0.5 * (begin + end)) / (2.0 * math.pi) + 0.5)
        panels[_MIDDLE + k] = middle
        panels[_BEGIN + k], panels[_END + k] = (begin - middle) / half, (end - middle) / half
        line = 0.5 * math.pi / panels[HALF + k]
        panels[RATE + k] = panels[RATE + k] if panels[SINGULAR + k] >= 0.0 else math.sqrt(1.0 + line * line)
    for place in _PLACES:
        for k in range(count):
            _take_point(panels, k, panels[_BEGIN + k] + place * (panels[_END + k] - panels[_BEGIN + k]))
    for k in range(count):
        _take_point(panels, k, -1.0)
        _take_point(panels, k, 1.0)
    for k in range(count):
        rate = _RELIED * inverse_cosh(panels[RATE + k])
        panels[RATE + k] = panels[RATE + k] if panels[SINGULAR + k] >= 0.0 else rate
        panels[DECAY + k] = panels[DECAY + k] if panels[SINGULAR + k] >= 0.0 else exponential(-2.0 * rate)


@subroutine(contract=True, inlined=True)
def _take_point(panels, k, place):
    """Lower the semi-major axis of a panel to that of the ellipse through one point of the boundary."""
    e, half = -panels[SINGULAR + k], panels[_REACH + k]
    inner = 1.0 - place * place
    x = panels[_MIDDLE + k] + half * place * (1.0 + e * e) / (1.0 - e * e)
    y = half * math.sqrt(inner if inner > 0.0 else 0.0) * 2.0 * e / (1.0 - e * e)
    x = x if x < _LARGEST_ANGLE else _LARGEST_ANGLE
    x = x if x > -_LARGEST_ANGLE else -_LARGEST_ANGLE
    decay = exponential(-y)
    axis = axis_through(panels, k, tangent(0.5 * x), (1.0 - decay) / (1.0 + decay))
    is_nearer = (panels[SINGULAR + k] < 0.0) & (axis < panels[RATE + k])
    panels[RATE + k] = axis if is_nearer else panels[RATE + k]


@subroutine(contract=True, inlined=True)
def axis_through(panels, k, u, v):
    """Semi-major axis of the ellipse through the image of an angle x + iy, from tan(x/2) and tanh(y/2)."""
    scale = 1.0 / (panels[SCALE + k] * (1.0 + u * u * v * v))
    re, im = scale * u * (1.0 - v * v), scale * v * (1.0 + u * u)
    # |z + i| and |z - i| of z = sinh t are cosh(Re t) + sin(Im t) and cosh(Re t) - sin(Im t)
    above, below = math.sqrt(re * re + (im + 1.0) * (im + 1.0)), math.sqrt(re * re + (im - 1.0) * (im - 1.0))
    sine = 2.0 * im / (above + below)
    sine = sine if sine < 1.0 else 1.0
    real, imaginary = inverse_cosh(0.5 * (above + below)), arctangent(sine, math.sqrt(1.0 - sine * sine))
    one_over = 1.0 / panels[HALF + k]
    a, b = ((real if re >= 0.0 else -real) - panels[CENTRE + k]) * one_over, imaginary * one_over
    return 0.5 * (math.sqrt((a - 1.0) * (a - 1.0) + b * b) + math.sqrt((a + 1.0) * (a + 1.0) + b * b))
