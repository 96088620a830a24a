"""Means of powers of a magnitude, of which the samples are squares.

Where a magnitude touches 0, or nearly does, its odd powers have a corner, or nearly have one, that no rule over a whole
panel resolves. So each panel is cut at the local minima. What is left is at the ends of the pieces, at worst an
algebraic singularity, and there the substitution of a polynomial that is flat of second order draws the nodes together:
a power p of the distance becomes one of 3 p, for which Gauss-Legendre rules converge like N^-(6 p + 2), at worst N^-8.

The rules of 20, 40, ... 320 nodes are compared until two agree. The bound is the difference of the last two, which is
an estimate of the error of the rule before the last, but no less than a hundredth of the difference before: two rules
may agree by accident.
"""

import math

import numpy as np

from explore.compiling import compiled
from explore.quadrature import LARGEST, place_nodes
from explore.statistics import refined_minimum

#: How many powers there are: number 0 is 1, number 1 is 10/3.
POWERS = 2
_FEWEST, _ROUNDS = 20, 5
#: Samples of a panel among which its minima are looked for.
_SEARCHED = 96
#: The most pieces of a panel. A magnitude has few minima; from there on they are left uncut, and the bound tells.
_MOST = 16


@compiled(allocates=True)
def power_means(
    fill, kernel, needs, row, power, panels, parts, shapes, tolerance, size_of, row_of, table, node, one
):  # fmt: skip
    """Integral of a power of a magnitude, its relative error bound, and the nodes taken.

    `row` holds its squares and `power` is the number of the power; the other arguments are those of `explore.sampling`.
    """
    cuts = np.empty(_MOST + 1)
    where, weight, sine, cosine = np.empty(LARGEST), np.empty(LARGEST), np.empty(LARGEST), np.empty(LARGEST)
    signals = np.empty((one.shape[0], LARGEST))
    total, error, nodes = 0.0, 0.0, 0
    for p in range(panels):
        anchor = int(parts[p, 0])
        place_nodes(shapes, p, anchor, _SEARCHED, 0, row_of, table, False, where, sine, cosine, weight)
        fill(kernel, sine, cosine, _SEARCHED, needs, signals)
        nodes += _SEARCHED
        pieces = _cuts(fill, kernel, needs, row, p, anchor, shapes, where, signals[row], node, one, cuts)
        for k in range(pieces):
            integral, difference, bound, asked = 0.0, np.inf, np.inf, _FEWEST
            for _ in range(_ROUNDS):
                count = size_of[asked]
                _place(cuts[k], cuts[k + 1], shapes[p, 2], anchor, count, row_of, table, sine, cosine, weight)
                fill(kernel, sine, cosine, count, needs, signals)
                before, integral = integral, 0.0
                for j in range(count):
                    value = max(signals[row, j], 0.0)
                    root = math.sqrt(value) if power == 0 else np.cbrt(value)
                    integral += weight[j] * (root if power == 0 else value * root * root)
                nodes += count
                if count > _FEWEST:
                    bound = max(abs(integral - before), 0.01 * difference if count > 2 * _FEWEST else 0.0)
                    difference = abs(integral - before)
                if bound <= 0.2 * tolerance * integral:
                    break
                asked = 2 * asked
            total += integral
            error += bound
    return total, error / total if total > 0.0 else 0.0, nodes


@compiled(fast=True)
def _place(first, last, scale, anchor, count, row_of, table, sin_half, cos_half, weight):
    """Nodes between two t of a panel, drawn together at both ends: half-angle sines and cosines, weights (rad)."""
    row = row_of[count]
    centre, half = 0.5 * (first + last), 0.5 * (last - first)
    for j in range(count):
        pair = min(j, count - 1 - j)
        s = -table[row + pair, 0] if j == pair else table[row + pair, 0]
        square = s * s
        step = half * s * (1.875 + square * (-1.25 + 0.375 * square))
        rate = half * 1.875 * (1.0 - square) * (1.0 - square)
        grow = math.exp(centre + step)
        tangent, slope = 0.5 * scale * (grow - 1.0 / grow), 0.5 * scale * (grow + 1.0 / grow)
        cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
        sin_half[j], cos_half[j] = (tangent * cosine, cosine) if anchor == 0 else (cosine, -tangent * cosine)
        weight[j] = 2.0 * table[row + pair, 1] * rate * slope * cosine * cosine


@compiled()
def _cuts(fill, kernel, needs, row, p, anchor, shapes, t, values, node, one, cuts):
    """Ends of the pieces between the local minima of a panel, in t, into `cuts`; how many pieces."""
    first, last = shapes[p, 0] - shapes[p, 1], shapes[p, 0] + shapes[p, 1]
    cuts[0], pieces = first, 1
    for j in range(_SEARCHED):
        # The ends of the panel are no samples: a minimum may lie between the last sample and the end.
        left, right = values[j - 1] if j > 0 else np.inf, values[j + 1] if j < _SEARCHED - 1 else np.inf
        if values[j] <= left and values[j] < right and pieces < _MOST:
            low, high = t[j - 1] if j > 0 else first, t[j + 1] if j < _SEARCHED - 1 else last
            _, at = refined_minimum(
                fill, kernel, shapes[p], anchor, row, needs, 1.0, low, t[j], high, values[j], node, one
            )
            if first < at < last:
                cuts[pieces] = at
                pieces += 1
    cuts[pieces] = last
    return pieces
