"""Full turns with equispaced nodes, for designs that need fewer of these than of graded ones.

All nodes of a turn are one panel, whose variable is t = (theta - anchor)/2 and whose T is 0. Where the nearest
singularity stands at the distance delta from the real axis, the Fourier coefficients of a signal fall like
exp(-k delta), and the mean of N samples errs by those of the orders N, 2N, ... (Trefethen & Weideman, The exponentially
convergent trapezoidal rule, SIAM Review 56, 2014, theorem 3.2). The error model is

    C (1 + N delta)^(order - 1) exp(-(N - 2) delta),

because the squares of first harmonics are second harmonics, which the signals have however far singularities are.
"""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential, logarithm, tangent
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.panels import (
    CENTRE,
    COUNT,
    DECAY,
    FOURTH,
    HALF,
    PANEL_CAPACITY,
    RATE,
    SCALE,
    SECOND,
    SINGULAR,
    SIXTH,
    TARGET,
)
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT

#: Natural logarithm of C for pole order 2, from benchmarks/calibrate_error.py.
LOG_CONSTANT_2 = 0.3
#: Natural logarithm of C for higher pole orders, from benchmarks/calibrate_error.py.
LOG_CONSTANT_4 = -1.2
#: Smallest number of nodes, between which extremes are looked for.
FEWEST_NODES = 8
#: Largest number of nodes that is chosen, so that later rounds still find more.
MOST_NODES = 160
#: Largest number of nodes that is chosen where designs with more are left to another rule.
MOST_LOCATED_NODES = 256
#: Number of equispaced nodes that take as long as a graded one: they need no exponentials, and one panel, not two.
WORTH = 1.1
#: Largest half-tangent of a singularity's distance that counts: beyond it fewer than FEWEST_NODES would do.
_FARTHEST = 0.99
#: Mark of a panel that is left to another rule, in place of its singularity.
_LEFT = -1.0
#: Rate of decay of a panel with that mark, with which its few nodes seem enough.
_RATE_OF_LEFT = 50.0

_FACTOR_4 = math.exp(LOG_CONSTANT_4 - LOG_CONSTANT_2)


@subroutine(contract=True, inlined=True)
def _nodes(rate, target, order):
    """The number of nodes whose modelled error is below a target (a logarithm): even, a multiple of 4 beyond 32.

    Designs with the same number share tiles, of which one of each number is not full.
    """
    constant, power = LOG_CONSTANT_2 if order == 2 else LOG_CONSTANT_4, order - 1.0
    one_over_rate = 1.0 / rate
    least = 2.0 + (constant - target) * one_over_rate
    nodes = least
    for _ in range(3):
        nodes = least + power * one_over_rate * logarithm(1.0 + nodes * rate)
    nodes = nodes if nodes > FEWEST_NODES else 1.0 * FEWEST_NODES
    return 2.0 * np.ceil(0.5 * nodes) if nodes <= 32.0 else 4.0 * np.ceil(0.25 * nodes)


@subroutine(contract=True)
def choose_equispaced(panels, n, order, target, is_located):
    """Turn the first of the two graded panels of n designs into one of equispaced nodes, where that takes less time.

    Panel p of design i has the number ``p * n + i``, and COUNT is filled. Where singularities may stand above any
    angle, no design keeps graded panels: one that needs too many nodes has the fewest instead, marked as left.
    """
    most = MOST_LOCATED_NODES if is_located else MOST_NODES
    for k in range(n):
        panels[SECOND + k] = panels[COUNT + k] + panels[COUNT + n + k]
    # Constant offsets only: see `explore.evaluation.quadrature.panels`. All is read before anything is chosen: loops in
    # which a choice decides what is read do not vectorise in their callers.
    for k in range(n):
        s1, s2 = panels[SINGULAR + k], panels[SINGULAR + PANEL_CAPACITY + k]
        s3, both, count = panels[SINGULAR + 2 * PANEL_CAPACITY + k], panels[SECOND + k], panels[COUNT + k]
        target_of_panel, centre, half = panels[TARGET + k], panels[CENTRE + k], panels[HALF + k]
        scale, rate_of_panel, decay = panels[SCALE + k], panels[RATE + k], panels[DECAY + k]
        nearest = s1 if s1 < _FARTHEST else _FARTHEST
        nearest = s2 if s2 < nearest else nearest
        nearest = s3 if s3 < nearest else nearest
        rate = logarithm((1.0 + nearest) / (1.0 - nearest))
        nodes = _nodes(rate, target, order)
        fits = (rate > 0.0) & (nodes <= most)
        chosen = is_located | ((nodes <= WORTH * both) & fits)
        left = is_located & (not fits)
        nodes, rate = 1.0 * FEWEST_NODES if left else nodes, _RATE_OF_LEFT if left else rate
        decay_of_turn = exponential(-2.0 * rate)
        panels[SINGULAR + k] = _LEFT if left else s1
        panels[COUNT + k] = nodes if chosen else count
        panels[TARGET + k] = target if chosen else target_of_panel
        panels[CENTRE + k] = 0.0 if chosen else centre
        panels[HALF + k] = 0.5 * math.pi if chosen else half
        panels[SCALE + k] = 0.0 if chosen else scale
        panels[RATE + k] = rate if chosen else rate_of_panel
        panels[DECAY + k] = decay_of_turn if chosen else decay


@subroutine(contract=True)
def leave_panels(panels, count):
    """Leave panels that need too many nodes, although COUNT is filled, to another rule: they have the fewest."""
    for k in range(count):
        fits = (panels[RATE + k] > 0.0) & (panels[COUNT + k] <= MOST_NODES)
        panels[SINGULAR + k] = panels[SINGULAR + k] if fits else _LEFT
        panels[COUNT + k] = panels[COUNT + k] if fits else FEWEST_NODES
        panels[RATE + k] = panels[RATE + k] if fits else _RATE_OF_LEFT
        panels[DECAY + k] = panels[DECAY + k] if fits else 0.0


@subroutine()
def leave_panel(panels, k):
    """Leave one panel to another rule."""
    panels[SINGULAR + k] = _LEFT


@subroutine()
def has_left_panel(panels, first, count, stride):
    """Whether a panel of a design is left to another rule."""
    is_left = False
    for p in range(count):
        is_left |= panels[SINGULAR + first + p * stride] == _LEFT
    return is_left


@subroutine(contract=True)
def count_equispaced(panels, count, order):
    """Fill the number of nodes of the panels with equispaced ones; see `quadrature.panels.count_nodes`."""
    for k in range(count):
        nodes = _nodes(panels[RATE + k], panels[TARGET + k], order)
        nodes = nodes if nodes < LARGEST_NODE_COUNT else 1.0 * LARGEST_NODE_COUNT
        panels[COUNT + k] = nodes if panels[SCALE + k] == 0.0 else panels[COUNT + k]


@subroutine(contract=True)
def model_equispaced(panels, count):
    """Fill the error model of the panels with equispaced nodes; see `quadrature.panels.model_errors`."""
    for k in range(count):
        nodes, rate, chosen = panels[COUNT + k], panels[RATE + k], panels[SCALE + k] == 0.0
        density = 1.0 + nodes * rate
        exponent = LOG_CONSTANT_2 - (nodes - 2.0) * rate
        second = density * exponential(exponent if exponent > -700.0 else -700.0)
        fourth = second * density * density * _FACTOR_4
        panels[SECOND + k] = second if chosen else panels[SECOND + k]
        panels[FOURTH + k] = fourth if chosen else panels[FOURTH + k]
        panels[SIXTH + k] = fourth * density * density if chosen else panels[SIXTH + k]


@subroutine(inlined=True)
def abscissa(count, j):
    """Abscissa of node j of a turn, between -1 and 1; nodes before the first and after the last are of other turns."""
    return (2.0 * j + 1.0 - count) / count


@subroutine(fast=True)
def place_equispaced(count, tangents, weights):
    """Fill half-tangents and weights of the nodes of a turn, the same in all lanes."""
    for j in range(count):
        u = tangent(0.5 * math.pi * abscissa(count, j))
        for lane in range(LANES):
            tangents[j * LANES + lane], weights[j * LANES + lane] = u, 2.0 * math.pi / count


@subroutine()
def place_equispaced_factors(count, factors):
    """Fill the factors of each node of a turn in the two parts of tails, node after node.

    The parts are the components along cos(k theta) + sin(k theta), normalized, for the two largest k below N/2: a
    signal that is even, odd, or the same after half a turn does not lack both.
    """
    weight = math.sqrt(2.0 * math.pi) / count
    for part in range(2):
        order = (count - 1) // 2 - part
        start, step = order * math.pi * abscissa(count, 0), 2.0 * math.pi * order / count
        cosine, sine, cosine_of_step, sine_of_step = math.cos(start), math.sin(start), math.cos(step), math.sin(step)
        for j in range(count):
            factors[2 * j + part] = weight * (cosine + sine)
            cosine, sine = cosine * cosine_of_step - sine * sine_of_step, sine * cosine_of_step + cosine * sine_of_step


@subroutine()
def repeat_turn(signals, rows, count):
    """Copy the last and the first of the nodes 1 to `count` to before the first and after the last."""
    size = rows * LANES
    before, after = signals[count * size :], signals[(count + 1) * size :]
    for k in range(size):
        signals[k], after[k] = before[k], signals[size + k]
