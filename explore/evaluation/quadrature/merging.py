"""Panels to designs: merged moments, bounds of their errors, and which designs need more nodes."""

import math

from numba import types

from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.bounds import (
    CHUNK,
    FLAG_RESIDUAL,
    FLAG_TERMS,
    bound_row,
    bound_sum_of_terms,
    collect_rms,
)
from explore.evaluation.quadrature.equispaced import model_equispaced
from explore.evaluation.quadrature.panels import (
    COUNT,
    FOURTH,
    PANEL_CAPACITY,
    SCALE,
    SECOND,
    SIXTH,
    TARGET,
    model_errors,
)
from explore.evaluation.quadrature.rounding import merge_roundings
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT

_F1, _I1, _I2 = types.float64[::1], types.int64[::1], types.int64[:, ::1]


@subroutine(no_alias=True)
def copy_numbers(to, source, n):
    """Copy n numbers; assigning a slice would need Numba's runtime."""
    for j in range(n):
        to[j] = source[j]


@subroutine(no_alias=True)
def _collect_designs(b, n, live, averaging, rest, noise):
    """Fill lengths and noise of the live designs, and start the sums over their panels."""
    for j in range(n):
        i = live[j]
        length, noise_of_design = averaging[i] - rest[i], noise[i]
        # The terms of the velocities are a peak of this height and of a width of its inverse.
        width = math.pi / (2.0 * length * noise_of_design) if noise_of_design > 0.0 else 1.0
        b[bounds.AVERAGING + j], b[bounds.REST + j] = averaging[i], rest[i]
        b[bounds.NOISE + j] = noise_of_design * math.sqrt(width if width < 1.0 else 1.0)
        b[bounds.SECOND + j] = b[bounds.FOURTH + j] = b[bounds.SIXTH + j] = b[bounds.TOTAL + j] = 0.0
        b[bounds.IS_FINEST + j] = 1.0


@subroutine(inlined=True)
def _add_panel(b, panels, j, k, counts, ends):
    """Add node count and the model's errors of panel k to design j, if it counts."""
    second, fourth, sixth = panels[SECOND + k], panels[FOURTH + k], panels[SIXTH + k]
    nodes, scale, finest = panels[COUNT + k], panels[SCALE + k], b[bounds.IS_FINEST + j]
    b[bounds.SECOND + j] += second if counts else 0.0
    b[bounds.FOURTH + j] += fourth if counts else 0.0
    b[bounds.SIXTH + j] += sixth if counts else 0.0
    b[bounds.TOTAL + j] += nodes + (ends if scale > 0.0 else 0.0) if counts else 0.0
    b[bounds.IS_FINEST + j] = 0.0 if counts & (nodes != LARGEST_NODE_COUNT) else finest


@subroutine(no_alias=True)
def _add_regular(b, panels, n, part, panel_count, ends):
    """Add the panel of this number of each design that has as many."""
    for j in range(n):
        _add_panel(b, panels, j, part * n + j, part < panel_count[j], ends)


@subroutine()
def collect(work, total, has_turns, n, regular, per_design, stride, ends):
    """Fill lengths, noise, node counts and errors of the model of the live designs.

    `total` panels have a model; `regular` tells that panel p of the live design j has the number ``p * n + j``; `ends`
    are the samples of a panel beside its nodes, which a turn has not.
    """
    b, panels, live, panel_count = work.bounds, work.panels, work.live, work.panel_count
    model_errors(panels, total)
    if has_turns:
        model_equispaced(panels, total // 2)
    _collect_designs(b, n, live, work.averaging, work.rest, work.noise)
    if regular:
        for part in range(per_design):
            _add_regular(b, panels, n, part, panel_count, ends)
        return
    for j in range(n):
        for part in range(panel_count[live[j]]):
            _add_panel(b, panels, j, work.first_panel[live[j]] + part * stride, True, ends)


@subroutine(no_alias=True)
def merge_regular(b, n, per_design, row, masses, integrals, deviations, means, variances):
    """Like `merge` where every design has `per_design` panels, all of them live; those of mass 0 count for nothing."""
    base, to = row * PANEL_CAPACITY, row * CHUNK
    mean, variance = means[to : to + n], variances[to : to + n]
    length, rest = b[bounds.AVERAGING : bounds.AVERAGING + n], b[bounds.REST : bounds.REST + n]
    mean[:] = 0.0
    for p in range(per_design):
        integral = integrals[base + p * n : base + p * n + n]
        for j in range(n):
            mean[j] += integral[j]
    for j in range(n):
        mean[j] /= length[j]
        variance[j] = rest[j] * mean[j] * mean[j]
    for p in range(per_design):
        integral, deviation = integrals[base + p * n : base + p * n + n], deviations[base + p * n : base + p * n + n]
        mass = masses[p * n : p * n + n]
        for j in range(n):
            difference = integral[j] / mass[j] - mean[j] if mass[j] > 0.0 else 0.0
            variance[j] += deviation[j] + mass[j] * difference * difference
    for j in range(n):
        variance[j] /= length[j]


@subroutine()
def merge(b, n, live, first_panel, panel_count, stride, row, masses, integrals, deviations, means, variances):
    """Fill mean and variance of one row over the windows of the live designs, from those of their panels.

    By the formula of Chan, Golub & LeVeque (1983) for the squared deviations of parts.
    """
    base, to = row * PANEL_CAPACITY, row * CHUNK
    for j in range(n):
        begin, count = first_panel[live[j]], panel_count[live[j]]
        length = b[bounds.AVERAGING + j]
        total = 0.0
        for p in range(count):
            total += integrals[base + begin + p * stride]
        mean = total / length
        squares = b[bounds.REST + j] * mean * mean
        for p in range(count):
            k = begin + p * stride
            difference = integrals[base + k] / masses[k] - mean
            squares += deviations[base + k] + masses[k] * difference * difference
        means[to + j], variances[to + j] = mean, squares / length


@subroutine()
def _is_bounded(flags, w, references, reference, s):
    """Whether a row has a bound of its own and is relative to this parameter."""
    return flags[w, s] != 0 and flags[w, s] != FLAG_TERMS and references[s] == reference


@subroutine()
def _collect_sizes(b, n, w, flags, orders, term_rows, references, reference, means, variances):
    """Fill the largest rms of the rows that are relative to a parameter: of the slow ones, and of all."""
    for row in (bounds.LARGEST_RMS, bounds.SLOW_RMS):
        b[row : row + n] = 0.0
    for slow in (True, False):
        for s in range(flags.shape[1]):
            if _is_bounded(flags, w, references, reference, s) and term_rows[s] < 0 and (orders[w, s] == 2) == slow:
                copy_numbers(b[bounds.MEAN :], means[s * CHUNK :], n)
                copy_numbers(b[bounds.VARIANCE :], variances[s * CHUNK :], n)
                collect_rms(b, n)
        if slow:
            copy_numbers(b[bounds.SLOW_RMS :], b[bounds.LARGEST_RMS :], n)


@subroutine()
def _bound_row(b, n, s, flags, order, has_terms, tolerance, means, variances, row_bounds, terms):
    """Fill the bounds of one row of the live designs, which may have terms."""
    copy_numbers(b[bounds.MEAN :], means[s * CHUNK :], n)
    copy_numbers(b[bounds.VARIANCE :], variances[s * CHUNK :], n)
    if has_terms:
        bound_sum_of_terms(b, n, flags, order, tolerance, terms)
    else:
        bound_row(b, n, flags, order, tolerance)
    copy_numbers(row_bounds[s * CHUNK :], b[bounds.BOUND :], n)


@subroutine()
def bound_rows(n, w, sizes, tables, parameters, here, regular, per_design, stride, work, sums):
    """Fill the bounds of all rows of the live designs, and their worst.

    The rounding of a row follows from disturbed samples, from its terms, or from rows that are relative to the same
    parameter: others have other units. The error of the quadrature is that of the model, or what samples tell.
    `regular` is that of `collect`.
    """
    b, means, variances, terms = work.bounds, work.means, work.variances, work.terms
    for row in (bounds.WORST, bounds.IMPROVABLE):
        b[row : row + n] = 0.0
    flags, references = tables.flags, tables.references
    for reference in range(-1, parameters.shape[0]):
        count = 0
        for s in range(flags.shape[1]):
            count += 1 if _is_bounded(flags, w, references, reference, s) else 0
        if count == 0:
            continue
        for j in range(n):
            b[bounds.REFERENCE + j] = abs(parameters[reference, here[work.live[j]]]) if reference >= 0 else 1.0
        _collect_sizes(b, n, w, flags, tables.orders, tables.term_rows, references, reference, means, variances)
        for s in range(flags.shape[1]):
            if _is_bounded(flags, w, references, reference, s):
                of_row = flags[w, s]
                if tables.is_resolved or tables.is_adaptive:
                    for j in range(n):
                        error = work.estimates[s * CHUNK + j]
                        b[bounds.SECOND + j] = b[bounds.FOURTH + j] = b[bounds.SIXTH + j] = error
                    of_row &= ~FLAG_RESIDUAL
                has_terms, at = sizes.is_disturbed != 0 or tables.term_rows[s] >= 0, tables.term_rows[s] * CHUNK
                if sizes.is_disturbed:
                    merge_roundings(n, s, of_row, regular, per_design, stride, work, sums)
                elif has_terms:
                    for j in range(n):
                        terms[j] = math.sqrt(means[at + j] * means[at + j] + variances[at + j])
                _bound_row(
                    b, n, s, of_row, tables.orders[w, s], has_terms, tables.tolerance, means, variances,
                    work.row_bounds, terms,
                )  # fmt: skip


@subroutine()
def choose_next(b, panels, n, live, first_panel, panel_count, stride, pole_order, tolerance, todo):
    """Keep the designs live whose bound more nodes can lower, and set the targets of their panels.

    Return the number of live designs and of their panels.
    """
    left, n_todo = 0, 0
    for j in range(n):
        if b[bounds.IMPROVABLE + j] == 0.0 or b[bounds.IS_FINEST + j] == 1.0:
            continue
        i = live[j]
        # Continue from the modelled error of this count, which may be far below the target.
        model = b[bounds.SECOND + j]
        model = b[bounds.FOURTH + j] if pole_order == 4 else b[bounds.SIXTH + j] if pole_order == 6 else model
        reached, excess = math.log(model), math.log(b[bounds.WORST + j] / tolerance) + 0.5
        for p in range(panel_count[i]):
            k = first_panel[i] + p * stride
            panels[TARGET + k] = min(panels[TARGET + k], reached) - excess
            todo[n_todo] = k
            n_todo += 1
        live[left] = i
        left += 1
    return left, n_todo
