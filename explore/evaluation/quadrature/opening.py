"""Windows to panels before their first samples: how they are cut, and with how many nodes they begin."""

import math

from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.adaptive import cut_panels
from explore.evaluation.quadrature.anchored import map_anchored
from explore.evaluation.quadrature.bounds import FLAG_CV, FLAG_EXTREMES, FLAG_STD
from explore.evaluation.quadrature.chunks import add_panels, constant
from explore.evaluation.quadrature.clutches import shorten_to_clutches
from explore.evaluation.quadrature.cutting import MOST_PARTS, cut_pieces
from explore.evaluation.quadrature.ellipses import bound_rates_by_ellipse
from explore.evaluation.quadrature.equispaced import choose_equispaced, leave_panels
from explore.evaluation.quadrature.panels import (
    LENGTH,
    PANEL_CAPACITY,
    SCALE,
    TARGET,
    bound_rates,
    count_nodes,
    map_panels,
)
from explore.evaluation.quadrature.pieces import open_pieces
from explore.evaluation.quadrature.resolving import open_turns
from explore.evaluation.quadrature.single_cuts import cut_at_corners
from explore.evaluation.quadrature.slots import BOUND, CLUTCH, KIND, ROOT_MEAN
from explore.evaluation.quadrature.windows import INTERVAL, TURN

#: Natural logarithm of the tolerance over the modelled error at the first node count: room for rounding.
HEADROOM = 0.5
#: `HEADROOM` where a std or a cv is requested, which multiply the error by a few.
HEADROOM_OF_CV = 1.5


@subroutine()
def demands_of(tables, w):
    """What a window needs: ends of panels, integrals between own places, pole order, headroom; whether it is pieces.

    Pieces are all that has no equal steps where nothing is known of the signals.
    """
    ends, integrals, pole_order, headroom = tables.is_adaptive, False, 2, HEADROOM
    for s in range(tables.flags.shape[1]):
        if tables.flags[w, s]:
            ends = ends or (tables.flags[w, s] & FLAG_EXTREMES) != 0
            pole_order = max(pole_order, tables.orders[w, s])
            headroom = HEADROOM_OF_CV if tables.flags[w, s] & (FLAG_STD | FLAG_CV) else headroom
            for slot in range(ROOT_MEAN, BOUND):
                integrals = integrals or tables.slots[w, s, slot] >= 0
    is_cut = len(tables.breaks) > 0 or len(tables.corner_rows) > 0 or integrals
    pieces = tables.is_resolved and (is_cut or tables.windows[w, KIND] != TURN)
    return ends or pieces, integrals, pole_order, headroom, pieces


@subroutine()
def open_window(fill, disturbed_fill, sizes, tables, w, begin, here, demands, error, rare, work, tile, sums):
    """Fill the panels of a window of the designs of the chunk from `begin` on, as many as fit; one, if adaptive.

    Return the first design that is left, the numbers of panels, stride and panels to sample, and whether some are whole
    turns. The error of a design with more corners than its panels are cut at is infinite.
    """
    _, integrals, pole_order, headroom, pieces = demands
    is_cut, capacity = pieces and len(tables.corner_rows) > 0, PANEL_CAPACITY
    if is_cut:
        capacity //= MOST_PARTS * (MOST_PARTS + tables.sense_count if tables.sense_count > 0 else 1)
    until, count, stride = add_panels(
        work.constants, sizes.n_constants, begin, begin + 1 if tables.is_adaptive else len(here),
        capacity, tables.windows[w], tables.intervals[w], tables.breaks, tables.singular_rows, tables.is_anchored,
        sizes.variant_row, work.panels, work.first_panel, work.panel_count, work.owner, work.positions,
    )  # fmt: skip
    is_turn = tables.windows[w, KIND] == TURN and len(tables.breaks) == 0 and not integrals
    is_whole = is_turn and not pieces and (tables.is_located or tables.is_resolved)
    _map_window(tables, w, is_whole, count, work)
    _open_designs(sizes, begin, until, stride, work)
    if rare is not None:
        if tables.windows[w, CLUTCH]:
            shorten_to_clutches(fill, sizes, tables.windows[w], count, work, tile)
            map_panels(work.panels, count, tables.singular_anchors)
        if tables.is_adaptive:
            count, is_missed = _open_adaptive(fill, disturbed_fill, sizes, tables, w, count, work, tile, sums)
            error[here[begin]] = math.inf if is_missed else error[here[begin]]
            return until, count, stride, count, False
        if pieces:
            if is_cut:
                count = cut_pieces(fill, disturbed_fill, sizes, tables, w, begin, until, count, work, tile)
            open_pieces(work, sums, tables.flags[w], tables.tolerance, count)
            return until, count, stride, count, False
    target = math.log(tables.tolerance)
    _set_targets(work, count, target, headroom)
    if not is_whole:
        count_nodes(work.panels, count, pole_order)
    if not is_turn or tables.is_anchored:
        if tables.is_located or tables.is_anchored:
            leave_panels(work.panels, count)
        return until, count, stride, count, False
    if tables.is_resolved:
        open_turns(work.panels, until)
    else:
        choose_equispaced(work.panels, until, pole_order, target - headroom, tables.is_located)
    return until, count, stride, _drop_second_halves(until, sizes.rows, tables.flags[w], work, sums), True


@subroutine()
def _map_window(tables, w, is_whole, count, work):
    """Map the panels of a window; `is_whole`: no design keeps the halves of its turn, only their lengths are used."""
    if is_whole:
        for k in range(count):
            work.panels[LENGTH + k] = math.pi
        return
    if tables.is_anchored:
        map_anchored(work.panels, count, tables.singular_anchors)
        return
    map_panels(work.panels, count, tables.singular_anchors)
    if tables.is_located:
        bound_rates(work.panels, count)
        if tables.windows[w, KIND] == INTERVAL:
            bound_rates_by_ellipse(work.panels, count)


@subroutine()
def _open_designs(sizes, begin, until, stride, work):
    """Fill what the window of each design is averaged over and its noise, and make the designs live."""
    for i in range(begin, until):
        total = 0.0
        for p in range(work.panel_count[i]):
            total += work.panels[LENGTH + work.first_panel[i] + p * stride]
        work.averaging[i], work.rest[i], work.live[i - begin] = total, 0.0, i
        noise = sizes.noise_row
        work.noise[i] = constant(work.constants, sizes.n_constants, noise, i) if noise >= 0 else 0.0


@subroutine()
def _open_adaptive(fill, disturbed_fill, sizes, tables, w, count, work, tile, sums):
    """Cut the panels of one design; return their number, and whether it has more corners than they are cut at."""
    uncut, is_missed = count, False
    if len(tables.corner_rows) > 0:
        count, is_missed = cut_at_corners(
            fill, disturbed_fill, sizes, tables.needs[w], tables.corner_rows, tables.corner_levels,
            tables.sense_count, work, tile, count,
        )  # fmt: skip
    return cut_panels(work, sums, sizes.rows, count, uncut), is_missed


@subroutine()
def _set_targets(work, count, target, headroom):
    """Fill the logarithms of the errors that panels may have: those of a design's panels add up."""
    per_design, share = 0, 0.0
    for k in range(count):
        if work.panel_count[work.owner[k]] != per_design:
            per_design = work.panel_count[work.owner[k]]
            share = max(headroom, HEADROOM + math.log(per_design))
        work.panels[TARGET + k], work.todo[k] = target - share, k


@subroutine()
def _drop_second_halves(n, rows, flags, work, sums):
    """Leave designs whose turn is one panel without their second one; return the number of panels to sample."""
    for i in range(n):
        if work.panels[SCALE + i] == 0.0:
            work.panel_count[i], sums.masses[n + i] = 1, 0.0
    for s in range(rows):
        if flags[s]:
            for i in range(n):
                if work.panels[SCALE + i] == 0.0:
                    at = s * PANEL_CAPACITY + n + i
                    sums.integrals[at] = sums.deviations[at] = sums.tails[at] = 0.0
    n_todo = n
    for k in range(n, 2 * n):
        if work.panel_count[k - n] == 2:
            work.todo[n_todo] = k
            n_todo += 1
    return n_todo
