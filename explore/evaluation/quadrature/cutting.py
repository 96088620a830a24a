"""Cuts of panels into pieces, many designs at once: first at zeros of senses, then where other rows are at levels."""

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.adaptive import place_part
from explore.evaluation.quadrature.chunks import sort_by_rule
from explore.evaluation.quadrature.corners import search_tile
from explore.evaluation.quadrature.equispaced import has_left_panel, leave_panel
from explore.evaluation.quadrature.panels import CENTRE, COUNT, HALF, LENGTH, SINGULAR
from explore.evaluation.quadrature.pieces import fewest_nodes
from explore.evaluation.quadrature.senses import tell_senses
from explore.evaluation.quadrature.zeros import MOST_ZEROS, half_angle

#: Largest number of parts of a design's panels, over the number of panels; at senses, the number of these more.
MOST_PARTS = 4
#: Smallest number of nodes of a panel that is searched for zeros.
_FEWEST_NODES = 24


@subroutine()
def cut_pieces(fill, disturbed_fill, sizes, tables, w, begin, until, count, work, tile):
    """Cut the panels of the designs from `begin` to `until` where rows are at levels; return the number of panels.

    They are cut first at senses, on which other rows depend. They are in the order of the designs. Designs that are
    left to the adaptive rule keep their panels.
    """
    senses, rows = tables.sense_count, len(tables.corner_rows)
    if senses > 0:
        most = MOST_PARTS + senses
        count = _cut_at(fill, sizes, tables, 0, senses, most, begin, until, count, work, tile)
        tell_senses(fill, disturbed_fill, sizes, tables, w, count, work, tile)
    if senses < rows:
        count = _cut_at(fill, sizes, tables, senses, rows, MOST_PARTS, begin, until, count, work, tile)
    return count


@subroutine()
def _cut_at(fill, sizes, tables, first, last, most, begin, until, count, work, tile):
    """Cut panels where the corner rows from `first` to before `last` are at their levels; return their number.

    Designs have at most `most` times as many panels as before, or are left to the adaptive rule.
    """
    panels, n_todo = work.panels, 0
    for k in range(count):
        panels[COUNT + k] = float(fewest_nodes(panels, k, _FEWEST_NODES))
        if not has_left_panel(panels, k, 1, 1):
            work.todo[n_todo] = k
            n_todo += 1
    n_bins = sort_by_rule(
        panels, work.todo, n_todo, tables.size_of, work.kinds, work.codes, work.histogram, work.order, work.starts
    )
    for k in range(count):
        work.codes[k] = -1 if has_left_panel(panels, k, 1, 1) else 0
    for b in range(n_bins):
        for start in range(work.starts[b], work.starts[b + 1], LANES):
            lanes = min(LANES, work.starts[b + 1] - start)
            search_tile(fill, sizes, tables, first, last, work.order[start : start + lanes], work, tile)
    return _rebuild(work, begin, until, most)


@subroutine()
def _parts(work, i, most):
    """Number of panels of a design after the cuts; 0 where it is left to the adaptive rule."""
    parts, first = work.panel_count[i], work.first_panel[i]
    for k in range(first, first + work.panel_count[i]):
        if work.codes[k] < 0:
            return 0
        parts += work.codes[k]
    return parts if parts <= most * work.panel_count[i] else 0


@subroutine()
def _rebuild(work, begin, until, most):
    """Replace the panels of all designs by their parts, from the last one on; return the number of panels."""
    total = 0
    for i in range(begin, until):
        parts = _parts(work, i, most)
        total += parts if parts > 0 else work.panel_count[i]
    to = total
    for i in range(until - 1, begin - 1, -1):
        first, parts = work.first_panel[i], _parts(work, i, most)
        for k in range(first + work.panel_count[i] - 1, first - 1, -1):
            cuts = work.codes[k] if parts > 0 else 0
            to -= cuts + 1
            _cut_panel(work, k, to, work.corners[k * MOST_ZEROS :], cuts)
        work.first_panel[i] = to
        if parts > 0:
            work.panel_count[i] = parts
        else:
            leave_panel(work.panels, to)
    return total


@subroutine()
def _cut_panel(work, k, to, zeros, cuts):
    """Place the parts of panel k from the number `to` on, which is not before k."""
    panels, centre, half, length = work.panels, work.panels[CENTRE + k], work.panels[HALF + k], work.panels[LENGTH + k]
    for part in range(cuts, -1, -1):
        begin, end = zeros[part - 1] if part > 0 else -1.0, zeros[part] if part < cuts else 1.0
        length = length if cuts == 0 else 2.0 * (half_angle(panels, k, end) - half_angle(panels, k, begin))
        place_part(
            panels, work.owner, k, to + part, centre + 0.5 * half * (begin + end), 0.5 * half * (end - begin)
        )  # fmt: skip
        panels[LENGTH + to + part], panels[SINGULAR + to + part] = length, 1.0
