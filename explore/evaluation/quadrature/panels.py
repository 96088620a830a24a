"""Windows to panels, and how many nodes a panel needs: graded Gauss-Legendre quadrature over the input angle.

A mechanism declares an anchor angle, above and below which, and above and below whose opposite, all complex
singularities of its signals stand. About an anchor the substitution

    tan((theta - anchor)/2) = T sinh(t),    T = min(tanh(distance of the nearest singularity / 2), 0.9)

puts every one of them on the lines Im t = +-pi/2: one of the same anchor at Re t = +-acosh(T_s/T), T_s its own tanh,
one of the opposite anchor at Re t = +-acosh(1/(T T_s)), and theta = +-i infinity at
+-acosh(1/T). A Gauss-Legendre rule of N nodes on a panel in t then converges like rho^(-2N), rho the sum of semi-axes
of the largest Bernstein ellipse that stays between them (Trefethen, Approximation Theory and Approximation Practice,
theorem 19.3). The panel's length grows only like the logarithm of 1/T, and with it the number of nodes, also near a
change point.

Panels are rows of one buffer with constant offsets: the compiler can then tell that the rows do not overlap, and
vectorises loops over panels.
"""

import math

from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import exponential, inverse_cosh, inverse_sinh, logarithm
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT
from explore.model.quadrature import MOST_SINGULARITIES

# The error model is C ((2N + 1)/h)^order rho^(-2N), h half the panel's length in t; order is the pole order of the
# signal: 2 (angles, velocities), 4 (accelerations) or 6 (inertia forces).
#: Natural logarithm of C for pole order 2, from benchmarks/calibrate_error.py.
LOG_CONSTANT_2 = 3.5
#: Natural logarithm of C for higher pole orders, from benchmarks/calibrate_error.py.
LOG_CONSTANT_4 = 5.3
#: Largest T: at 1 all singularities that are far away fall together with theta = +-i infinity.
LARGEST_SCALE = 0.9
#: Share of the least height of a line at three angles that lies below it at all angles.
_BELOW = 0.97
#: Largest number of panels at once.
PANEL_CAPACITY = 4096

_FACTOR_4 = math.exp(LOG_CONSTANT_4 - LOG_CONSTANT_2)

# Rows of the panels' buffer: anchor (0, or 1 for its opposite), half-tangents of the ends from the anchor, number of
# the law that holds between two breaks, variant of the design; centre and half length in t, T (0: equispaced nodes),
# logarithm of rho (of equispaced nodes delta), length in rad, node count; the model's errors for pole orders 2, 4, 6;
# rho^-2; difference of the half-tangents of the ends, which a short panel has with more digits than its ends; the
# half-tangent that nodes are turned by; the singularities of the design, or what `quadrature.anchored` and
# `quadrature.ellipses` have in their place.
ANCHOR, FIRST, LAST, LAW, VARIANT, CENTRE, HALF, SCALE, RATE, LENGTH, COUNT, TARGET = (
    row * PANEL_CAPACITY for row in range(12)
)
SECOND, FOURTH, SIXTH, DECAY, SPREAD, TURNED = (row * PANEL_CAPACITY for row in range(12, 18))
SINGULAR = 18 * PANEL_CAPACITY
PANELS_SIZE = SINGULAR + MOST_SINGULARITIES * PANEL_CAPACITY


@subroutine(contract=True)
def map_panels(panels, count, anchors):
    """Fill centre, half length, T, rate, rho^-2 and length of panels.

    `anchors` (MOST_SINGULARITIES,) has the anchor of each singularity, 0 or 1; -1 for a row that is not used, which
    holds 1.
    """
    first_anchor, second_anchor, third_anchor = float(anchors[0]), float(anchors[1]), float(anchors[2])
    for k in range(count):
        anchor = panels[ANCHOR + k]
        s1 = panels[SINGULAR + k]
        s2 = panels[SINGULAR + PANEL_CAPACITY + k]
        s3 = panels[SINGULAR + 2 * PANEL_CAPACITY + k]
        first, last, spread = panels[FIRST + k], panels[LAST + k], panels[SPREAD + k]
        # A T beyond the reach of a short panel would round its nodes more than the panel is long.
        reach = abs(first) if abs(first) > abs(last) else abs(last)
        here = reach if reach < LARGEST_SCALE else LARGEST_SCALE
        here = s1 if (first_anchor == anchor) & (s1 < here) else here
        here = s2 if (second_anchor == anchor) & (s2 < here) else here
        here = s3 if (third_anchor == anchor) & (s3 < here) else here
        one_over = 1.0 / here
        a, b = first * one_over, last * one_over
        start, stop = inverse_sinh(a), inverse_sinh(b)
        # The difference of two asinh of the same sign, without cancellation in short panels.
        mixed = b * math.sqrt(1.0 + a * a) + a * math.sqrt(1.0 + b * b)
        together = 0.5 * inverse_sinh(spread * one_over * (b + a) / mixed)
        centre, half = 0.5 * (start + stop), together if a * b > 0.0 else 0.5 * (stop - start)
        # The singularity on the line Im t = pi/2 that is nearest to the centre limits the convergence.
        distance = abs(centre)
        nearest = abs(distance - inverse_cosh(one_over))
        position = abs(distance - inverse_cosh(s1 * one_over if first_anchor == anchor else one_over / s1))
        nearest = position if position < nearest else nearest
        position = abs(distance - inverse_cosh(s2 * one_over if second_anchor == anchor else one_over / s2))
        nearest = position if position < nearest else nearest
        position = abs(distance - inverse_cosh(s3 * one_over if third_anchor == anchor else one_over / s3))
        nearest = position if position < nearest else nearest
        x, y = nearest / half, 0.5 * math.pi / half
        axis = 0.5 * (math.sqrt((x - 1.0) * (x - 1.0) + y * y) + math.sqrt((x + 1.0) * (x + 1.0) + y * y))
        panels[CENTRE + k], panels[HALF + k], panels[SCALE + k] = centre, half, here
        panels[RATE + k] = inverse_cosh(axis)
        growth = axis + math.sqrt(axis * axis - 1.0)
        panels[DECAY + k] = 1.0 / (growth * growth)
        panels[LENGTH + k] = 2.0 * arctangent(spread, 1.0 + first * last)


@subroutine(contract=True)
def bound_rates(panels, count):
    """Fill rate and rho^-2 of panels for singularities above any angle, which T does not depend on.

    All stand above a line, at the distance of the first row from the real axis. Its image in t is nearest to the real
    axis at theta = 0 from the anchor or at an end of the panel, but for a few percent in short panels. An ellipse below
    that, with the ends of the panel as foci, has the semi-minor axis b and rho = b + sqrt(1 + b^2).
    """
    for k in range(count):
        s, one_over = panels[SINGULAR + k], 1.0 / panels[SCALE + k]
        height = _height(0.0, s, one_over)
        at_first, at_last = _height(panels[FIRST + k], s, one_over), _height(panels[LAST + k], s, one_over)
        height = at_first if at_first < height else height
        height = at_last if at_last < height else height
        minor = _BELOW * height / panels[HALF + k]
        growth = minor + math.sqrt(1.0 + minor * minor)
        panels[RATE + k], panels[DECAY + k] = inverse_sinh(minor), 1.0 / (growth * growth)


@subroutine(contract=True, inlined=True)
def _height(u, s, one_over):
    """Least imaginary part of t at the distance with the half-tangent s above an angle with the half-tangent u.

    That of asinh z is the arc sine of (|z + i| - |z - i|)/2, which is at least y + y^3/6 of this y.
    """
    scale = one_over / (1.0 + u * u * s * s)
    x, y = scale * u * (1.0 - s * s), scale * s * (1.0 + u * u)
    above, below = math.sqrt(x * x + (y + 1.0) * (y + 1.0)), math.sqrt(x * x + (y - 1.0) * (y - 1.0))
    sine = 2.0 * y / (above + below)
    return sine * (1.0 + sine * sine / 6.0)


@subroutine(contract=True)
def count_nodes(panels, count, order):
    """Fill the smallest number of nodes whose modelled error is below each panel's target (a logarithm)."""
    constant = LOG_CONSTANT_2 if order == 2 else LOG_CONSTANT_4
    for k in range(count):
        one_over_half, half_rate = 1.0 / panels[HALF + k], 0.5 / panels[RATE + k]
        # The model has its maximum where d/dN = 0 and decreases beyond.
        power, lower = order * half_rate, (constant - panels[TARGET + k]) * half_rate
        nodes = power if power > 4.0 else 4.0
        for _ in range(3):
            following = lower + power * logarithm((2.0 * nodes + 1.0) * one_over_half)
            nodes = following if following > nodes else nodes
        # before it is made whole: a number without end has none
        panels[COUNT + k] = math.ceil(nodes if nodes < LARGEST_NODE_COUNT else 1.0 * LARGEST_NODE_COUNT)


@subroutine(contract=True)
def model_errors(panels, count):
    """Fill the error model for pole orders 2, 4 and 6, relative to the rms (squared, for variances)."""
    for k in range(count):
        nodes = panels[COUNT + k]
        density = (2.0 * nodes + 1.0) / panels[HALF + k]
        exponent = LOG_CONSTANT_2 - 2.0 * nodes * panels[RATE + k]
        second = density * density * exponential(exponent if exponent > -700.0 else -700.0)
        fourth = second * density * density * _FACTOR_4
        panels[SECOND + k], panels[FOURTH + k], panels[SIXTH + k] = second, fourth, fourth * density * density
