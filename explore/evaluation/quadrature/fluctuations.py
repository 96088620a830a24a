"""Fluctuations: ranges over a turn of the integral of a signal less its mean.

That of a torque is the energy that a flywheel stores and gives back in a turn. The integral has its extremes where the
signal is at its mean. So the panels are taken in the order of their angles and cut at these places, which
`quadrature.zeros` finds; what a place is off by tells in the integral by its square. Between two cuts Gauss-Legendre
rules of 20, 40, ... 320 nodes are compared as in `quadrature.magnitudes`. The bound includes what the integral is at
the end of the turn, where it should be 0.

Here the lanes of a tile are nodes of one design.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.chunks import gather_design
from explore.evaluation.quadrature.magnitudes import FEWEST_NODES, ROUNDS, place_between
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, SCALE, VARIANT
from explore.evaluation.quadrature.slots import FLUCTUATION, MEAN, VARIANCE
from explore.evaluation.quadrature.storing import add_bound
from explore.evaluation.quadrature.zeros import MOST_ZEROS, collect_zeros, half_angle, sample_row


@subroutine()
def fill_fluctuations(fill, sizes, tables, w, i, design, stride, statistics, nodes, error, work, tile):
    """Fill the fluctuations of the signals of one design, number i of the chunk and `design` of the block."""
    gather_design(sizes, i, work, tile)
    for s in range(sizes.rows):
        slots = tables.slots[w, s]
        if slots[FLUCTUATION] < 0:
            continue
        mean, variance = statistics[slots[MEAN], design], statistics[slots[VARIANCE], design]
        scale = math.sqrt(mean * mean + variance) * work.averaging[i]
        if not scale < math.inf:
            continue
        fluctuation, difference, count = _measure(fill, sizes, tables, s, i, stride, mean, scale, work, tile)
        bound = difference / scale if scale > 0.0 else 0.0
        statistics[slots[FLUCTUATION], design] = fluctuation
        add_bound(s, i, design, slots, bound, statistics, error, work)
        nodes[design] += count


@subroutine()
def _measure(fill, sizes, tables, s, i, stride, mean, scale, work, tile):
    """The fluctuation of a row of one design, the bound of its error by the quadrature, and the number of nodes.

    `scale` is what the tolerance is relative to.
    """
    panels, last, nodes = work.panels, -1.0, 0
    total = low = high = error = 0.0
    for _ in range(work.panel_count[i]):
        k, last = next_panel(panels, work.first_panel[i], work.panel_count[i], stride, last)
        samples = sample_row(
            fill, tables.row_needs[s], sizes.rows, s, tables.term_rows[s], work.noise[i], panels, k, tile
        )  # fmt: skip
        cuts = collect_zeros(fill, tables.row_needs[s], s, mean, panels, k, samples, 0, MOST_ZEROS, tile)
        error, cuts = (math.inf, MOST_ZEROS) if cuts > MOST_ZEROS else (error, cuts)
        for cut in range(cuts + 1):
            begin, end = tile.state[cut - 1] if cut > 0 else -1.0, tile.state[cut] if cut < cuts else 1.0
            integral, difference, count = _integrate(
                fill, sizes.rows, tables, s, k, begin, end, mean, 0.1 * tables.tolerance * scale, work, tile
            )  # fmt: skip
            total, error, nodes = total + integral, error + difference, nodes + count
            low, high = min(low, total), max(high, total)
    return high - low, error + abs(total), nodes


@subroutine()
def next_panel(panels, first, count, stride, last):
    """The panel of a design whose middle follows an angle, and the angle of its middle, rad, 0 to a turn."""
    panel, least = first, math.inf
    for p in range(first, first + count * stride, stride):
        angle = (panels[ANCHOR + p] * math.pi + 2.0 * half_angle(panels, p, 0.0)) % (2.0 * math.pi)
        if last < angle < least:
            panel, least = p, angle
    return panel, least


@subroutine()
def _integrate(fill, rows, tables, s, k, begin, end, mean, allowed, work, tile):
    """The integral of a row less its mean between two positions of panel k, its error, and the number of nodes."""
    panels, half = work.panels, work.panels[HALF + k]
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    integral, difference, error, wanted, nodes = 0.0, math.inf, math.inf, FEWEST_NODES, 0
    for number in range(ROUNDS):
        count = tables.size_of[wanted]
        place_between(
            panels[CENTRE + k], half * begin, half * end, panels[SCALE + k], count, tables.row_of, tables.rules,
            False, tile.roots, tile.tangents, tile.weights,
        )  # fmt: skip
        fill(
            tile.constants, tile.tangents, anchor, law, variant, (count + LANES - 1) // LANES, tables.row_needs[s],
            tile.signals,
        )  # fmt: skip
        previous, integral = integral, 0.0
        for j in range(count):
            integral += tile.weights[j] * (tile.signals[(j // LANES * rows + s) * LANES + j % LANES] - mean)
        nodes += count
        if number > 0:
            error = max(abs(integral - previous), 0.01 * difference if number > 1 else 0.0)
            difference = abs(integral - previous)
        if error <= allowed:
            break
        wanted = 2 * wanted
    return integral, error, nodes
