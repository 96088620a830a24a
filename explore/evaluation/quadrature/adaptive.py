"""Adaptive quadrature: panels of one design and window, halved until the tails of all signals are small enough.

Nothing needs to be known of the signals. `quadrature.tails` says what a tail is. A window is first cut into one
or two tiles of lanes, so that a feature is seen that is not much narrower than the distance of the nodes, about half a
degree over a turn.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_EXTREMES, FLAG_SQUARES, FLAG_TERMS
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    CENTRE,
    COUNT,
    HALF,
    LAW,
    LENGTH,
    PANEL_CAPACITY,
    SCALE,
    VARIANT,
)

#: Number of nodes of each panel beside its two ends.
ADAPTIVE_NODES = 16
#: Largest number of panels of one design and window.
MOST_PIECES = 2048
#: Largest number of rounds that halve panels.
MOST_HALVINGS = 48
#: Smallest half length of a panel in t, relative to 1 + |t|: below, rounding moves the nodes.
_SHORTEST = 1e-12
#: Largest tail that may be rounding, relative to the size of the signal on the panel.
_ROUNDING_TAIL = 1e-9
#: Largest tail that is rounding, over the amplification of rounding errors on the panel, where that is known.
_TAIL_OF_ROUNDING = 4e-15
#: Share of its earlier tail that a panel's tail exceeds where halving hardly lowers it, because it is rounding.
_HARDLY = 0.25
#: Share of the error budget left to accepted panels.
_SHARE = 0.5


@subroutine()
def place_part(panels, owner, source, to, centre, half):
    """Fill panel `to` as a part of the panel `source`."""
    panels[ANCHOR + to], panels[LAW + to], panels[VARIANT + to] = (
        panels[ANCHOR + source], panels[LAW + source], panels[VARIANT + source]
    )  # fmt: skip
    panels[SCALE + to], panels[COUNT + to] = panels[SCALE + source], float(ADAPTIVE_NODES)
    panels[CENTRE + to], panels[HALF + to] = centre, half
    owner[to] = owner[source]


@subroutine()
def cut_panels(work, sums, rows, count, uncut):
    """Cut the panels of a window into pieces of about the same angle, each of equal length in t; return their number.

    As many together as one or two panels, those of a window without breaks, have tiles of lanes, and at least one per
    unit of t, in which singularities may be graded. `uncut` is the number of panels before they were cut at zeros.
    """
    panels, total, wanted = work.panels, 0.0, LANES * min(uncut, 2)
    for k in range(count):
        total += panels[LENGTH + k]
    number = 0
    for k in range(count):
        work.codes[k] = math.ceil(max(wanted * panels[LENGTH + k] / total, 2.0 * panels[HALF + k]))
        number += work.codes[k]
    first = number
    for k in range(count - 1, -1, -1):  # the pieces of panel 0 replace it
        pieces = work.codes[k]
        first -= pieces
        centre, half = panels[CENTRE + k], panels[HALF + k] / pieces
        for piece in range(pieces - 1, -1, -1):
            to = first + piece
            place_part(panels, work.owner, k, to, centre + (2 * piece + 1 - pieces) * half, half)
            work.todo[to] = to
            for s in range(rows):
                sums.earlier_tails[s * PANEL_CAPACITY + to] = math.inf
    return number


@subroutine(no_alias=True)
def _fill_errors(masses, integrals, deviations, tails, count, stride, mean, length, scale, squares, errors, sizes):
    """Fill bounds of the errors of panels' shares in the statistics of a row, relative, and sizes of the row on them.

    The arrays begin with the first panel.
    """
    for p in range(count):
        k = p * stride
        mass = masses[k]
        here, spread = integrals[k] / mass, deviations[k] / mass
        ratio = 2.0 * math.sqrt(spread + (here - mean) * (here - mean)) / scale
        # Of the integral, or of that of the squared deviation from the mean.
        factor = ratio if (ratio > 1.0) & (not squares) else 1.0
        errors[k], sizes[k] = mass * tails[k] * factor / (length * scale), math.sqrt(spread + here * here)


@subroutine()
def _errors_of_row(work, sums, s, j, stride, flags):
    """Bound of the error of one row's moments, relative; largest size of the row on a panel; what errors are over.

    Errors and sizes of the panels are filled in `panel_errors` and `panel_sizes`.
    """
    mean, length, first = work.means[s * CHUNK + j], work.bounds[bounds.AVERAGING + j], work.first_panel[work.live[j]]
    squares, at = flags & FLAG_SQUARES != 0, s * PANEL_CAPACITY + first
    scale = abs(mean) if squares else math.sqrt(mean * mean + work.variances[s * CHUNK + j])
    count, total, largest = work.panel_count[work.live[j]] if scale > 0.0 else 0, 0.0, 0.0
    _fill_errors(
        sums.masses[first:], sums.integrals[at:], sums.deviations[at:], sums.tails[at:], count, stride, mean, length,
        scale, squares, sums.panel_errors[first:], sums.panel_sizes[first:],
    )  # fmt: skip
    for p in range(count):
        k = first + p * stride
        total, largest = total + sums.panel_errors[k], max(largest, sums.panel_sizes[k])
    return total, largest, scale


@subroutine()
def estimate_errors(work, sums, w, flags, n, stride):
    """Fill the bounds of the quadrature's errors of all rows of the live designs, relative.

    An extreme is refined on the signal itself. But the tails tell also how far off rounding may make it.
    """
    for s in range(flags.shape[1]):
        if not flags[w, s] or flags[w, s] == FLAG_TERMS:
            continue
        for j in range(n):
            error, largest, _ = _errors_of_row(work, sums, s, j, stride, flags[w, s])
            if flags[w, s] & FLAG_EXTREMES and largest > 0.0:
                first = s * PANEL_CAPACITY + work.first_panel[work.live[j]]
                for p in range(work.panel_count[work.live[j]]):
                    error = max(error, sums.tails[first + p * stride] / largest)
            work.estimates[s * CHUNK + j] = error


@subroutine()
def _mark_panels(work, sums, s, j, stride, flags, tolerance, is_disturbed):
    """Raise, in `codes`, the nodes that one row needs on the panels of a live design, if it needs more of them."""
    total, largest, scale = _errors_of_row(work, sums, s, j, stride, flags)
    first = work.first_panel[work.live[j]]
    excess, count = _SHARE * tolerance / work.row_bounds[s * CHUNK + j], work.panel_count[work.live[j]]
    allowed, allowed_tail = excess * total / count, excess * work.estimates[s * CHUNK + j] * largest
    for p in range(count if scale > 0.0 else 0):
        k = first + p * stride
        at, error, size = s * PANEL_CAPACITY + k, sums.panel_errors[k], sums.panel_sizes[k]
        tail, earlier = sums.tails[at], sums.earlier_tails[at]
        if is_disturbed and not tail > _TAIL_OF_ROUNDING * math.sqrt(sums.roundings[at]):
            continue
        ratio = error / allowed if error > allowed else 1.0
        if flags & FLAG_EXTREMES and tail > allowed_tail:
            ratio = max(ratio, tail / allowed_tail)
        if ratio > 1.0 and not (tail <= _ROUNDING_TAIL * size and tail > _HARDLY * earlier):
            # A tail falls like a power of the number of nodes.
            share = math.log(ratio) / math.log(size / tail) if tail < size else 1.0
            work.codes[k] = max(work.codes[k], math.ceil(work.panels[COUNT + k] * (1.0 + min(share, 1.0))))


@subroutine()
def mark_panels(work, sums, w, flags, tolerance, j, stride, is_disturbed):
    """Fill `codes` of the panels of a live design: the nodes that its rows above the tolerance need; 0 for enough."""
    for p in range(work.panel_count[work.live[j]]):
        work.codes[work.first_panel[work.live[j]] + p * stride] = 0
    for s in range(flags.shape[1]):
        if flags[w, s] and flags[w, s] != FLAG_TERMS and work.row_bounds[s * CHUNK + j] > tolerance:
            _mark_panels(work, sums, s, j, stride, flags[w, s], tolerance, is_disturbed)


@subroutine()
def keep_tails(sums, flags, k, to):
    """Keep the tails of the flagged rows on panel k as the earlier ones of panel `to`."""
    for s in range(len(flags)):
        if flags[s]:
            sums.earlier_tails[s * PANEL_CAPACITY + to] = sums.tails[s * PANEL_CAPACITY + k]


@subroutine()
def halve_panels(work, sums, w, flags, tolerance, count, is_disturbed):
    """Halve the panels that keep a bound of the first live design above the tolerance.

    Return the number of panels, and of those to sample: none where no panel can be halved, or there is no room.
    """
    panels = work.panels
    mark_panels(work, sums, w, flags, tolerance, 0, 1, is_disturbed)
    marked = 0
    for k in range(count):
        if panels[HALF + k] < _SHORTEST * (1.0 + abs(panels[CENTRE + k])):
            work.codes[k] = 0
        marked += 1 if work.codes[k] > 0 else 0
    if count + marked > MOST_PIECES:
        return count, 0
    to, position = count, 0
    for k in range(count):
        if work.codes[k] == 0:
            continue
        keep_tails(sums, flags[w], k, k)
        keep_tails(sums, flags[w], k, to)
        centre, half = panels[CENTRE + k], 0.5 * panels[HALF + k]
        place_part(panels, work.owner, k, to, centre + half, half)
        place_part(panels, work.owner, k, k, centre - half, half)
        work.todo[position], work.todo[position + 1] = to, k
        to, position = to + 1, position + 2
    return to, position
