"""The compiled loop: designs to panels, panels to tiles of nodes, tiles to statistics and their error bound.

Designs are taken in chunks that fit into the cache. In each chunk the panels of one window are sorted by their rule; a
tile holds panels with the same rule, padded by repetition, so that no result depends on the neighbours of a design.
"""

import math

from numba import types

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, as_argument, compiled
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.adaptive import (
    ADAPTIVE_NODES,
    MOST_HALVINGS,
    estimate_errors,
    halve_panels,
)
from explore.evaluation.quadrature.bin_filling import fill_bin
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_EXTREMES
from explore.evaluation.quadrature.chunks import CLOSE_TYPE, close_chunk, sort_by_rule
from explore.evaluation.quadrature.equispaced import (
    count_equispaced,
    has_left_panel,
    leave_panel,
)
from explore.evaluation.quadrature.fluctuations import fill_fluctuations
from explore.evaluation.quadrature.lags import fill_lags
from explore.evaluation.quadrature.magnitudes import fill_powers
from explore.evaluation.quadrature.merging import bound_rows, choose_next, collect, merge, merge_regular
from explore.evaluation.quadrature.opening import demands_of, open_window
from explore.evaluation.quadrature.panels import (
    count_nodes,
)
from explore.evaluation.quadrature.pieces import choose_next_pieces, count_again
from explore.evaluation.quadrature.resolving import choose_next_counts, take_turns
from explore.evaluation.quadrature.slots import BOUND, CLUTCH, ROOT_MEAN
from explore.evaluation.quadrature.storing import store
from explore.evaluation.quadrature.tails import check_model
from explore.evaluation.quadrature.tiles import FILL_TYPE
from explore.evaluation.quadrature.work_space import (
    CHUNK_WORK_TYPE,
    PANEL_SUMS_TYPE,
    SIZES_TYPE,
    TABLES_TYPE,
    TILE_WORK_TYPE,
)

#: Largest number of node counts that are tried for one design and window.
MOST_ROUNDS = 4

_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


@subroutine()
def _merge_rows(n, regular, per_design, stride, flags, w, work, sums):
    """Fill means and variances of all flagged rows of the live designs."""
    for s in range(flags.shape[1]):
        if flags[w, s] and regular:
            merge_regular(
                work.bounds, n, per_design, s, sums.masses, sums.integrals, sums.deviations, work.means,
                work.variances,
            )  # fmt: skip
        elif flags[w, s]:
            merge(
                work.bounds, n, work.live, work.first_panel, work.panel_count, stride, s, sums.masses, sums.integrals,
                sums.deviations, work.means, work.variances,
            )  # fmt: skip


@subroutine()
def _sample_window(
    fill, disturbed_fill, sizes, tables, parameters, w, begin, here, statistics, nodes, error, excess, extremes, rare,
    work, tile, sums,
):  # fmt: skip
    """Statistics of a window of the designs of the chunk from `begin` on, as many as fit; return the first left."""
    demands = demands_of(tables, w)
    ends, integrals, pole_order, _, pieces = demands
    until, count, stride, n_todo, has_turns = open_window(
        fill, disturbed_fill, sizes, tables, w, begin, here, demands, error, rare, work, tile, sums
    )
    n = until - begin
    regular, per_design = begin == 0 and stride > 1 and until == len(here), count // n
    for number in range(MOST_HALVINGS if tables.is_adaptive or tables.is_resolved else MOST_ROUNDS):
        if n == 0:
            break
        if tables.is_adaptive:
            work.panel_count[begin] = count
        elif number > 0 and not tables.is_resolved:
            count_nodes(work.panels, count, pole_order)
            if has_turns:
                count_equispaced(work.panels, count, pole_order)
        n_bins = sort_by_rule(
            work.panels, work.todo, n_todo, tables.size_of, work.kinds, work.codes, work.histogram, work.order,
            work.starts,
        )  # fmt: skip
        for k in range(n_bins):
            fill_bin(
                fill, disturbed_fill, sizes, tables, w, work.starts[k], work.starts[k + 1], ends, pieces, extremes,
                rare, work, tile, sums,
            )  # fmt: skip
        modelled = 0 if tables.is_adaptive or pieces else count
        collect(work, modelled, has_turns, n, regular and number == 0, per_design, stride, 2.0 if ends else 0.0)
        _merge_rows(n, regular and number == 0, per_design, stride, tables.flags, w, work, sums)
        if tables.is_adaptive:
            if rare is not None:
                work.bounds[bounds.TOTAL] = n_todo * (ADAPTIVE_NODES + 2)
                estimate_errors(work, sums, w, tables.flags, 1, 1)
        elif pieces:
            if rare is not None:
                if number > 0:
                    count_again(work, n, n_todo)
                estimate_errors(work, sums, w, tables.flags, n, stride)
        elif tables.is_resolved:
            if rare is not None:
                take_turns(work, sums, n, sizes.rows)
        else:
            check_model(
                work.bounds, n, regular and number == 0, per_design, work.live, work.first_panel, work.panel_count,
                stride, w, tables, sums.tails, work.means, work.variances,
            )  # fmt: skip
        bound_rows(n, w, sizes, tables, parameters, here, regular and number == 0, per_design, stride, work, sums)
        store(n, number == 0, here, stride, w, tables.flags, tables.slots, statistics, nodes, work, sums)
        if pieces:
            if rare is not None:
                n, n_todo = choose_next_pieces(
                    work, sums, w, tables.flags, tables.tolerance, n, stride, sizes.is_disturbed != 0
                )  # fmt: skip
        elif tables.is_resolved:
            if rare is not None:
                n = choose_next_counts(work.bounds, work.panels, n, work.live, tables.tolerance, work.todo)
            n_todo = n
        elif not tables.is_adaptive:
            n, n_todo = choose_next(
                work.bounds, work.panels, n, work.live, work.first_panel, work.panel_count, stride, pole_order,
                tables.tolerance, work.todo,
            )  # fmt: skip
        elif work.bounds[bounds.IMPROVABLE] == 0.0:
            break
        else:
            if rare is not None:
                count, n_todo = halve_panels(
                    work, sums, w, tables.flags, tables.tolerance, count, sizes.is_disturbed != 0
                )  # fmt: skip
            n = min(n_todo, 1)
    for j in range(n if tables.is_resolved else 0):
        leave_panel(work.panels, work.first_panel[work.live[j]])
    for i in range(begin, until):
        error[here[i]] = max(error[here[i]], work.worst[i])
        may_be_left = tables.is_located or tables.is_anchored or tables.is_resolved
        is_left = may_be_left and has_left_panel(work.panels, work.first_panel[i], work.panel_count[i], stride)
        excess[here[i]] = max(excess[here[i]], math.inf if is_left else work.excess[i])
        if rare is not None:  # noqa: SIM102  (alone, so that Numba leaves out the block)
            if integrals:
                fill_powers(fill, sizes, tables, w, i, here[i], stride, statistics, nodes, error, work, tile)
                fill_fluctuations(fill, sizes, tables, w, i, here[i], stride, statistics, nodes, error, work, tile)
                fill_lags(fill, sizes, tables, w, i, here[i], stride, statistics, nodes, error, work, tile)
    return until


def _sample(
    close, fill, disturbed_fill, sizes, tables, parameters, kept, designs, statistics, nodes, error, excess, extremes,
    rare, work, tile, sums,
):  # fmt: skip
    """Like `sample`; None for `extremes` or `rare` leaves them out of the compiled code."""
    for start in range(0, len(designs), CHUNK):
        here = designs[start : start + CHUNK]
        close_chunk(
            close, parameters, kept, here, sizes.first_parameter, sizes.n_constants, work.record, work.constants
        )
        for w in range(tables.windows.shape[0]):
            begin = 0
            while begin < len(here):
                begin = _sample_window(
                    fill, disturbed_fill, sizes, tables, parameters, w, begin, here, statistics, nodes, error, excess,
                    extremes, rare, work, tile, sums,
                )  # fmt: skip


def _signature(extremes, rare):
    return types.void(
        CLOSE_TYPE, FILL_TYPE, FILL_TYPE, SIZES_TYPE, TABLES_TYPE, _F2, _F2, _I1, _F2, _I1, _F1, _F1, extremes, rare,
        CHUNK_WORK_TYPE, TILE_WORK_TYPE, PANEL_SUMS_TYPE,
    )  # fmt: skip


sample_moments = compiled(_signature(types.none, types.none))(_sample)
sample_extremes = compiled(_signature(types.int64, types.none))(_sample)
sample_all = compiled(_signature(types.int64, types.int64))(_sample)


def sample(
    close, fill, disturbed_fill, sizes, tables, parameters, kept, designs, statistics, nodes, error, excess, work, tile,
    sums,
) -> None:  # fmt: skip
    """Statistics of d `designs` of n over every window, by the compiled functions of a mechanism.

    Extremes, and clutches, means of powers, fluctuations and the adaptive rule are compiled when a request needs one of
    them: together they take two fifths of the time of a compilation.

    `sizes`, `tables` and the work space `work`, `tile` and `sums` are those of `quadrature.work_space`, `parameters`
    (p, n) of the closed form, `kept` (k, n) the constants; where rows are missing `close` fills them all. The
    entries of the sampled designs are filled in `statistics` (m, n), for unit speed and rad, `nodes` (n,), the signal
    evaluations, `error` (n,), the bound, and `excess` (n,), how many times the samples exceed the error model.
    """
    has_integrals = (tables.slots[:, :, ROOT_MEAN:BOUND] >= 0).any()
    if tables.is_adaptive or tables.is_resolved or has_integrals or tables.windows[:, CLUTCH].any():
        loop, extremes, rare = sample_all, 1, 1
    elif (tables.flags & FLAG_EXTREMES).any():
        loop, extremes, rare = sample_extremes, 1, None
    else:
        loop, extremes, rare = sample_moments, None, None
    loop(
        as_argument(close, CLOSE_SIGNATURE), as_argument(fill, FILL_SIGNATURE),
        as_argument(disturbed_fill, FILL_SIGNATURE), sizes, tables, parameters, kept, designs, statistics, nodes, error,
        excess, extremes, rare, work, tile, sums,
    )  # fmt: skip
