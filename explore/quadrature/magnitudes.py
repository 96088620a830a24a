"""Means of powers of a magnitude, of which the samples are squares.

Where a magnitude touches 0, or nearly does, its odd powers have a corner, or nearly have one, that no rule over a whole
panel resolves. So each panel is cut at its local minima. The corners are then at the ends of the pieces, at worst as
algebraic singularities. A substitution by a polynomial whose first two derivatives are 0 at the ends clusters the nodes
there: a power p of the distance becomes one of 3 p, for which Gauss-Legendre rules converge like N^-(6 p + 2), at worst
N^-8.

The rules of 20, 40, ... 320 nodes are compared until two agree. The bound is the difference of the last two, which
estimates the error of the last but one, and at least a hundredth of the difference before, because two rules may agree
by accident.
"""

import math

import numpy as np

from explore.compiling import compiled
from explore.quadrature.moments import refined_minimum
from explore.quadrature.node_placement import place_nodes
from explore.quadrature.rules import LARGEST_NODE_COUNT

#: Number of powers: power 0 has the exponent 1, power 1 the exponent 10/3.
POWERS = 2
_FEWEST_NODES, _ROUNDS = 20, 5
#: Samples of a panel from which its local minima are refined.
_SEARCH_NODES = 96
#: Most pieces of a panel. A magnitude has few minima; the error bound includes further ones, which are not cut at.
_MOST_CUTS = 16


@compiled(allocates=True)
def power_means(
    fill, kernel, needs, row, power, panels, parts, shapes, tolerance, size_of, row_of, table, node, node_signals
):  # fmt: skip
    """Integral of a power of a magnitude, its relative error bound, and the number of nodes used.

    `row` holds its squares and `power` is the number of the power; the other arguments are those of
    `explore.quadrature.loop`.
    """
    cuts = np.empty(_MOST_CUTS + 1)
    t, weight = np.empty(LARGEST_NODE_COUNT), np.empty(LARGEST_NODE_COUNT)
    sine, cosine = np.empty(LARGEST_NODE_COUNT), np.empty(LARGEST_NODE_COUNT)
    signals = np.empty((node_signals.shape[0], LARGEST_NODE_COUNT))
    total, error, nodes = 0.0, 0.0, 0
    for p in range(panels):
        anchor = int(parts[p, 0])
        place_nodes(shapes, p, anchor, _SEARCH_NODES, 0, row_of, table, False, t, sine, cosine, weight)
        fill(kernel, sine, cosine, _SEARCH_NODES, needs, signals)
        nodes += _SEARCH_NODES
        pieces = _cut_at_minima(fill, kernel, needs, row, p, anchor, shapes, t, signals[row], node, node_signals, cuts)
        for k in range(pieces):
            integral, difference, bound, requested_count = 0.0, np.inf, np.inf, _FEWEST_NODES
            for _ in range(_ROUNDS):
                count = size_of[requested_count]
                _place_clustered_nodes(
                    cuts[k], cuts[k + 1], shapes[p, 2], anchor, count, row_of, table, sine, cosine, weight
                )
                fill(kernel, sine, cosine, count, needs, signals)
                previous, integral = integral, 0.0
                for j in range(count):
                    value = max(signals[row, j], 0.0)
                    root = math.sqrt(value) if power == 0 else np.cbrt(value)
                    integral += weight[j] * (root if power == 0 else value * root * root)
                nodes += count
                if count > _FEWEST_NODES:
                    bound = max(abs(integral - previous), 0.01 * difference if count > 2 * _FEWEST_NODES else 0.0)
                    difference = abs(integral - previous)
                if bound <= 0.2 * tolerance * integral:
                    break
                requested_count = 2 * requested_count
            total += integral
            error += bound
    return total, error / total if total > 0.0 else 0.0, nodes


@compiled(fast=True)
def _place_clustered_nodes(first, last, scale, anchor, count, row_of, table, sin_half, cos_half, weight):
    """Fill nodes between two t of a panel, clustered at both ends: half-angle sines and cosines, weights (rad)."""
    row = row_of[count]
    centre, half = 0.5 * (first + last), 0.5 * (last - first)
    for j in range(count):
        pair = min(j, count - 1 - j)
        s = -table[row + pair, 0] if j == pair else table[row + pair, 0]
        square = s * s
        step = half * s * (1.875 + square * (-1.25 + 0.375 * square))
        rate = half * 1.875 * (1.0 - square) * (1.0 - square)
        growth = math.exp(centre + step)
        tangent, slope = 0.5 * scale * (growth - 1.0 / growth), 0.5 * scale * (growth + 1.0 / growth)
        cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
        sin_half[j], cos_half[j] = (tangent * cosine, cosine) if anchor == 0 else (cosine, -tangent * cosine)
        weight[j] = 2.0 * table[row + pair, 1] * rate * slope * cosine * cosine


@compiled()
def _cut_at_minima(fill, kernel, needs, row, p, anchor, shapes, t, values, node, node_signals, cuts):
    """Fill the ends of the pieces between the local minima of a panel, in t; return the number of pieces."""
    first, last = shapes[p, 0] - shapes[p, 1], shapes[p, 0] + shapes[p, 1]
    cuts[0], pieces = first, 1
    for j in range(_SEARCH_NODES):
        # The ends of the panel are not sampled: a minimum may lie between the last sample and the end.
        left, right = values[j - 1] if j > 0 else np.inf, values[j + 1] if j < _SEARCH_NODES - 1 else np.inf
        if values[j] <= left and values[j] < right and pieces < _MOST_CUTS:
            low, high = t[j - 1] if j > 0 else first, t[j + 1] if j < _SEARCH_NODES - 1 else last
            _, position = refined_minimum(
                fill, kernel, shapes[p], anchor, row, needs, 1.0, low, t[j], high, values[j], node, node_signals
            )
            if first < position < last:
                cuts[pieces] = position
                pieces += 1
    cuts[pieces] = last
    return pieces
