"""Arguments of the compiled loop: what each request takes from the signals of its mechanism, as tables."""

from dataclasses import dataclass

import numpy as np

from explore.evaluation.quadrature.bounds import (
    FLAG_CV,
    FLAG_EXTREMES,
    FLAG_MOMENTS,
    FLAG_RESIDUAL,
    FLAG_SQUARES,
    FLAG_STD,
    FLAG_TERMS,
)
from explore.evaluation.quadrature.pieces import piece_factors
from explore.evaluation.quadrature.resolving import turn_factors
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.quadrature.slots import BOUND, MEAN, N_STATISTICS, VARIANCE
from explore.evaluation.quadrature.work_space import Sizes, Tables
from explore.evaluation.remembering import remembered
from explore.evaluation.statistics import Indices, statistics_beside_moments
from explore.evaluation.windows import interval_place, specify_window
from explore.model.quadrature import MOST_SINGULARITIES, Adaptive, Anchored, Located, Quadrature, Resolved
from explore.model.quantities import SampledMetric
from explore.model.request import Request
from explore.model.window import Window

_FLAGS = {
    "cv": FLAG_CV,
    "std": FLAG_STD,
    "min": FLAG_EXTREMES,
    "max": FLAG_EXTREMES,
    "peak": FLAG_EXTREMES,
    "peak_to_peak": FLAG_EXTREMES,
}
#: Factor on the tolerance of the inputs of derived metrics: formulas multiply errors, a bearing life by 10/3.
_INPUT_TOLERANCE_FACTOR = 0.02
#: Tolerance of the inputs of derived metrics that are to be as exact as they can be: a few times their rounding.
_FINEST_TOLERANCE = 1e-14


@dataclass(frozen=True)
class LoopTables:
    """Arrays that request statistics per window and row; `explore.evaluation.quadrature.loop.sample` describes them."""

    windows: tuple[Window, ...]
    needs: Indices
    flags: Indices
    orders: Indices
    term_rows: Indices
    references: Indices
    slots: Indices

    def slots_of(self, metric: SampledMetric) -> Indices:
        """Rows of the statistics array of a metric's signal and window, shape (N_STATISTICS,)."""
        row: Indices = self.slots[self.windows.index(metric.window), metric.signal.row]
        return row


def statistics_tolerance(request: Request) -> float:
    """The tolerance of statistics, which is smaller where derived metrics depend on them."""
    if not any(m.sampled for m in request.derived):
        return request.tolerance
    return _FINEST_TOLERANCE if request.is_finest else _INPUT_TOLERANCE_FACTOR * request.tolerance


@remembered
def loop_arguments(
    request: Request, metrics: tuple[SampledMetric, ...], quadrature: Quadrature, corners: frozenset[str]
) -> tuple[Sizes, Tables]:
    """Arguments of the compiled loop; `explore.evaluation.quadrature.work_space` describes them.

    `corners` are the names of signals at whose levels others have corners.
    """
    mechanism, tables = request.kernel, make_tables(request, metrics)
    singularities = quadrature.singularities
    singular = [*singularities, *[(-1, -1)] * (MOST_SINGULARITIES - len(singularities))]
    singular_rows, singular_anchors = np.array(singular, dtype=np.int64).T.copy()
    cornering = [signal for signal in mechanism.signals if signal.name in corners]
    # Senses first, and then in the order of their bits: other signals may depend on them.
    cornering.sort(key=lambda signal: (*mechanism.senses, signal.name).index(signal.name))
    levels = [(signal.row, signal.terms_row, level) for signal in cornering for level in signal.corner_levels]
    corner_rows = np.array([each[:2] for each in levels], dtype=np.int64).reshape(-1, 2)
    needs, row_needs = tables.needs.copy(), np.zeros(mechanism.signal_rows, dtype=np.int64)
    for signal in cornering:
        needs |= signal.needs
    for signal in mechanism.signals:
        if mechanism.fills(signal):
            row_needs[signal.row] |= signal.needs
    sizes = Sizes(
        mechanism.record_rows, mechanism.first_parameter, int(mechanism.n_constants),
        int(mechanism.n_fill_constants or mechanism.n_constants), mechanism.signal_rows, int(mechanism.noise_row),
        int(mechanism.variant_row), int(mechanism.disturbed_fill is not None),
    )  # fmt: skip
    size_of, row_of, rules = gauss_legendre_rules()
    return sizes, Tables(
        np.array([specify_window(mechanism, window, request.drive) for window in tables.windows], dtype=np.int64),
        np.array([interval_place(mechanism, window) for window in tables.windows]),
        np.array([mechanism.marks[name] for name in request.breaks], dtype=np.int64),
        singular_rows, singular_anchors, needs, row_needs, tables.flags, tables.orders, tables.term_rows,
        _lag_rows(request), tables.references, corner_rows, np.array([level for *_, level in levels]), tables.slots,
        len(mechanism.senses) if {*mechanism.senses} <= corners else 0, float(statistics_tolerance(request)),
        isinstance(quadrature, Adaptive), isinstance(quadrature, Located), isinstance(quadrature, Anchored),
        isinstance(quadrature, Resolved), size_of, row_of, rules, turn_factors(), piece_factors(),
    )  # fmt: skip


def _lag_rows(request: Request) -> Indices:
    """For each row of the signals that of the rate of their lag, shape (s,); -1 for none."""
    rows = np.full(request.kernel.signal_rows, -1, dtype=np.int64)
    for signal in request.kernel.signals:
        if signal.lag_row >= 0 and request.kernel.fills(signal):
            rows[signal.row] = signal.lag_row
    return rows


@remembered
def make_tables(request: Request, metrics: tuple[SampledMetric, ...]) -> LoopTables:
    """The tables of sampled metrics; those that derived metrics depend on have a bound of their own error."""
    mechanism, bounded = request.kernel, {metric for derived in request.derived for metric in derived.sampled}
    windows = tuple(dict.fromkeys(metric.window for metric in metrics))
    shape = (len(windows), mechanism.signal_rows)
    needs, flags = np.zeros(len(windows), dtype=np.int64), np.zeros(shape, dtype=np.int64)
    orders, term_rows = np.full(shape, 2, dtype=np.int64), np.full(shape[1], -1, dtype=np.int64)
    references, kernel_parameters = np.full(shape[1], -1, dtype=np.int64), mechanism.kernel_parameters
    slots = np.full((*shape, N_STATISTICS), -1, dtype=np.int64)
    slot_count = 0
    for metric in metrics:
        w, signal = windows.index(metric.window), metric.signal
        needs[w] |= signal.needs
        flags[w, signal.row] |= FLAG_MOMENTS | _flags_of(metric)
        orders[w, signal.row] = signal.pole_order
        term_rows[signal.row] = signal.terms_row
        reference = mechanism.reference(signal)
        references[signal.row] = kernel_parameters.index(reference) if reference else -1
        if signal.terms_row >= 0:
            flags[w, signal.terms_row] |= FLAG_TERMS
        own_bound = (BOUND,) if metric in bounded else ()
        for k in (MEAN, VARIANCE, *statistics_beside_moments(metric), *own_bound):
            if slots[w, signal.row, k] < 0:
                slots[w, signal.row, k], slot_count = slot_count, slot_count + 1
    return LoopTables(windows, needs, flags, orders, term_rows, references, slots)


def _flags_of(metric: SampledMetric) -> int:
    """Flags of the row of a metric's signal, without `FLAG_MOMENTS`."""
    if not metric.signal.is_magnitude:
        return _FLAGS.get(metric.statistic, 0) | (FLAG_RESIDUAL if metric.signal.is_residual else 0)
    return FLAG_SQUARES | (FLAG_EXTREMES if metric.statistic == "max" else 0)
