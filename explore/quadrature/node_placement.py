"""Quadrature over the crank angle: graded Gauss-Legendre panels, their node counts and their error bounds.

The signals of a crank-driven linkage have all their complex singularities on two vertical lines, above and below an
anchor angle (0) and its opposite (pi). About an anchor the substitution

    tan((theta - anchor)/2) = T sinh(t),    T = tanh(distance of the nearest singularity / 2)

puts every one of them on the lines Im t = +-pi/2: the nearest at Re t = 0, those of the other anchor at
Re t = +-acosh(1/(T T_other)), and theta = +-i infinity at +-acosh(1/T). A Gauss-Legendre rule of N nodes on a panel
in t then converges like rho^(-2N), rho the sum of semi-axes of the largest Bernstein ellipse that stays between them
(Trefethen, Approximation Theory and Approximation Practice, theorem 19.3). The panel's length grows only like the
logarithm of 1/T, and with it the number of nodes, also near a change point.
"""

import math

from explore.compiling import compiled
from explore.quadrature.rules import LARGEST_NODE_COUNT

#: Natural logarithm of the factor C in the error model C ((2N + 1)/h)^order rho^(-2N), h half the panel's length in t;
#: by pole order: 2 (angles, velocities) and 4 (accelerations); 6 (inertia forces) takes the constant of 4. Calibrated
#: by benchmarks/calibrate_error.py.
LOG_CONSTANT_2 = 4.9
LOG_CONSTANT_4 = 4.9


@compiled("float64(float64)")
def _acosh(x):
    """Inverse hyperbolic cosine; an argument rounded to below 1 counts as 1."""
    return math.log(x + math.sqrt(max(x * x - 1.0, 0.0)))


@compiled("void(float64[:, ::1], int64, float64[:, ::1], int64, float64[:, ::1])")
def map_panel(parts, p, singular, i, shapes):
    """Fill centre, half length, scale and convergence rate of one piece of a window.

    Parameters
    ----------
    parts : (p, 3) array
        Row p: anchor (0 for the anchor angle, 1 for its opposite), half-tangents of the piece's ends, measured from it.
    singular : (n, 3) array
        Row i: half-tangents of the distances of the singularities: nearest at the anchor angle, nearest at its
        opposite, a second one at the anchor angle.
    shapes : (p, 4) array
        Row p is filled with centre and half length in t, T, and ln(rho).
    """
    # The arguments are whole arrays and row numbers, because a row as an array costs two atomic reference counts.
    at_zero, at_opposite, second_at_zero = singular[i, 0], singular[i, 1], singular[i, 2]
    anchor = parts[p, 0]
    here, there = (at_zero, at_opposite) if anchor == 0.0 else (at_opposite, at_zero)
    start, stop = math.asinh(parts[p, 1] / here), math.asinh(parts[p, 2] / here)
    centre, half = 0.5 * (start + stop), 0.5 * (stop - start)
    # The singularity on the line Im t = pi/2 that is nearest to the centre limits the convergence.
    distance = abs(centre)
    at_infinity = _acosh(1.0 / here)
    nearest = min(distance, abs(distance - at_infinity))
    second = _acosh(max(second_at_zero / here, 1.0)) if anchor == 0.0 else _acosh(1.0 / (here * second_at_zero))
    nearest = min(nearest, abs(distance - second), abs(distance - _acosh(1.0 / (here * there))))
    x, y = nearest / half, 0.5 * math.pi / half
    axis = 0.5 * (math.sqrt((x - 1.0) ** 2 + y * y) + math.sqrt((x + 1.0) ** 2 + y * y))
    shapes[p, 0], shapes[p, 1], shapes[p, 2], shapes[p, 3] = centre, half, here, _acosh(axis)


@compiled("UniTuple(float64, 3)(int64, float64, float64)")
def model_errors(count, half, rate):
    """Error model of a panel for pole orders 2, 4 and 6, relative to the rms (squared, for variances)."""
    density = (2.0 * count + 1.0) / half
    second = density * density * math.exp(LOG_CONSTANT_2 - 2.0 * count * rate)
    fourth = second * density * density * math.exp(LOG_CONSTANT_4 - LOG_CONSTANT_2)
    return second, fourth, fourth * density * density


@compiled("int64(float64, float64, float64, int64, int64[::1])")
def node_count(log_tolerance, half, rate, order, size_of):
    """Smallest number of nodes with a rule whose modelled error is below the tolerance, or at most 1.8 times that."""
    constant = LOG_CONSTANT_2 if order == 2 else LOG_CONSTANT_4
    # The model has its maximum where d/dN = 0 and decreases beyond.
    one_over_half, power = 1.0 / half, order / (2.0 * rate)
    lower, count = (constant - log_tolerance) / (2.0 * rate), max(4.0, power)
    for _ in range(3):
        count = max(count, lower + power * math.log((2.0 * count + 1.0) * one_over_half))
    return size_of[min(math.ceil(count), LARGEST_NODE_COUNT)]


@compiled(
    "void(float64[:, ::1], int64, int64, int64, int64, int64[::1], float64[:, ::1], boolean, "
    "float64[::1], float64[::1], float64[::1], float64[::1])",
    fast=True,
)
def place_nodes(shapes, p, anchor, count, offset, row_of, table, ends, t, sin_half, cos_half, weight):
    """Fill the nodes of a panel from `offset` on: t, half-angle sines and cosines, weights (rad).

    With `ends` the panel's two ends are added as first and last node, with weight 0.
    """
    # One function: its parts would exchange the constants of the panel and of its slices.
    centre, half, scale = shapes[p, 0], shapes[p, 1], shapes[p, 2]
    row = row_of[count]
    pairs = (count + 1) // 2
    begin = offset + 1 if ends else offset
    last = begin + count - 1
    up, down = 0.5 * scale * math.exp(centre), 0.5 * scale * math.exp(-centre)
    # scale*sinh(t) goes into sin_half and scale*cosh(t) into weight first; one exponential serves a symmetric pair.
    for j in range(pairs):
        step = half * table[row + j, 0]
        growth = math.exp(step)
        decay = 1.0 / growth
        rule_weight = 2.0 * half * table[row + j, 1]
        t[begin + j], t[last - j] = centre - step, centre + step
        sin_half[begin + j], sin_half[last - j] = up * decay - down * growth, up * growth - down * decay
        weight[begin + j], weight[last - j] = (
            rule_weight * (up * decay + down * growth),
            rule_weight * (up * growth + down * decay),
        )
    if ends:
        growth = math.exp(half)
        decay = 1.0 / growth
        t[offset], t[last + 1] = centre - half, centre + half
        sin_half[offset], sin_half[last + 1] = up * decay - down * growth, up * growth - down * decay
        weight[offset], weight[last + 1] = 0.0, 0.0
        begin -= 1
        last += 1
    # Slices start at 0, because LLVM does not vectorise a loop from `begin`, which it cannot prove non-negative.
    sines, cosines, weights = sin_half[begin : last + 1], cos_half[begin : last + 1], weight[begin : last + 1]
    if anchor == 0:
        for j in range(len(sines)):
            tangent = sines[j]
            cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
            sines[j], cosines[j] = tangent * cosine, cosine
            weights[j] *= cosine * cosine
    else:
        for j in range(len(sines)):
            tangent = sines[j]
            cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
            sines[j], cosines[j] = cosine, -tangent * cosine
            weights[j] *= cosine * cosine
