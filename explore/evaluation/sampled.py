"""Sampled metrics: the designs that each quadrature samples, and their statistics."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.evaluation.loop_tables import LoopTables, loop_arguments, make_tables
from explore.evaluation.quadrature.loop import sample
from explore.evaluation.quadrature.slots import BOUND
from explore.evaluation.quadrature.tails import LARGEST_ANCHORED_EXCESS, LARGEST_EXCESS
from explore.evaluation.quadrature.work_space import leave_work_space, take_work_space
from explore.evaluation.remembering import remembered
from explore.evaluation.statistics import Indices, error_of, has_own_places, statistic_of
from explore.evaluation.stroke_ends import bound_ends
from explore.model.mechanism import ClosedFormResult, Mechanism
from explore.model.quadrature import Adaptive, Anchored, Graded, Located, Quadrature, Resolved
from explore.model.quantities import FloatArray, SampledMetric
from explore.model.request import Request
from explore.model.status import Status


@dataclass
class SampledStatistics:
    """Statistics of distinct geometries for unit speed, each of shape (u,).

    `values` are metrics by name, in their signals' units, and `errors` bounds of the absolute errors of those that
    derived metrics need; `nodes` are signal evaluations, `error` the bound of the worst relative error, and
    `evaluations` the number of geometries that were sampled.
    """

    values: dict[str, FloatArray]
    errors: dict[str, FloatArray]
    nodes: npt.NDArray[np.int64]
    error: FloatArray
    evaluations: int = 0

    @classmethod
    def empty(cls, count: int) -> SampledStatistics:
        """No metrics of `count` geometries, with 0 nodes and an error of 0."""
        return cls({}, {}, np.zeros(count, dtype=np.int64), np.zeros(count))

    def replace(self, designs: npt.NDArray[np.bool_], others: SampledStatistics) -> None:
        """Take these designs, shape (u,), from other statistics of the same metrics."""
        for own, other in ((self.values, others.values), (self.errors, others.errors)):
            for name, column in other.items():
                own[name] = np.where(designs, column, own[name])
        self.nodes = np.where(designs, others.nodes, self.nodes)
        self.error = np.where(designs, others.error, self.error)
        self.evaluations += others.evaluations

    def add(self, others: SampledStatistics) -> None:
        """Take other metrics of the same designs."""
        self.values |= others.values
        self.errors |= others.errors
        self.nodes = self.nodes + others.nodes
        self.error = np.maximum(self.error, others.error)
        self.evaluations = max(self.evaluations, others.evaluations)


def sample_metrics(
    request: Request,
    metrics: tuple[SampledMetric, ...],
    parameters: FloatArray,
    active: npt.NDArray[np.bool_],
    closed: ClosedFormResult,
) -> SampledStatistics:
    """Sample the metrics of the active ones of u distinct geometries, and update their status.

    `parameters` (p, u) are those of the closed form, whose result is `closed`.
    """

    def sample_all(kind: Request, designs: npt.NDArray[np.bool_]) -> SampledStatistics:
        result = SampledStatistics.empty(len(designs))
        for quadrature, group in _groups(kind, metrics):
            result.add(_sample(kind, group, quadrature, parameters, designs, closed))
        return result

    jumping = active & _has_jumps(request, parameters)
    smooth = active & ~jumping
    if not jumping.any():
        return sample_all(request.without_jumps, smooth)
    result = sample_all(request, jumping)
    if smooth.any():
        result.replace(smooth, sample_all(request.without_jumps, smooth))
    return result


def _has_jumps(request: Request, parameters: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether a parameter of each design makes signals jump at the breaks, shape (u,)."""
    result = np.zeros(parameters.shape[1], dtype=np.bool_)
    if request.breaks:
        for parameter, values in zip(request.kernel.kernel_parameters, parameters, strict=True):
            if parameter.adds_jumps:
                result |= values != 0.0
    return result


@remembered
def _groups(
    request: Request, metrics: tuple[SampledMetric, ...]
) -> tuple[tuple[Quadrature, tuple[SampledMetric, ...]], ...]:
    """The metrics that each quadrature samples together."""
    groups: dict[tuple[Quadrature, bool], list[SampledMetric]] = {}
    for metric in metrics:
        # without corners a turn that no break cuts has equal steps
        has_own_cuts = metric.signal.has_corners and not request.breaks
        groups.setdefault((_quadrature_of(request, metric), has_own_cuts), []).append(metric)
    return tuple((quadrature, tuple(group)) for (quadrature, _), group in groups.items())


def _quadrature_of(request: Request, metric: SampledMetric) -> Quadrature:
    """The quadrature that samples a metric first."""
    declared, signal = request.kernel.quadrature, metric.signal
    if signal.has_corners:
        # A corner between the nodes of a rule may hide from its check.
        return _resolved(declared) if signal.corners_at else _adaptive(declared)
    if signal.has_own_singularities:
        return _resolved(declared)
    if isinstance(declared, Located) and (request.breaks or metric.window.kind == "clutch" or has_own_places(metric)):
        # A distance is one of all laws together, and the phases of clutches are not known before sampling.
        return _resolved(declared)
    if isinstance(declared, Located) and declared.knows_places and metric.window.needs_stroke:
        return declared.anchored
    return _resolved(declared) if isinstance(declared, Adaptive) else declared


def _resolved(declared: Quadrature) -> Resolved:
    """The resolved quadrature, with panels graded towards the singularities of a graded one."""
    return Resolved(_adaptive(declared).singularities)


def _adaptive(quadrature: Quadrature) -> Adaptive:
    """The adaptive quadrature, with panels graded towards the singularities of a graded one."""
    if isinstance(quadrature, Graded):
        return Adaptive(quadrature.singularities)
    return quadrature if isinstance(quadrature, Adaptive) else Adaptive()


def _sample(
    request: Request,
    metrics: tuple[SampledMetric, ...],
    quadrature: Quadrature,
    parameters: FloatArray,
    active: npt.NDArray[np.bool_],
    closed: ClosedFormResult,
) -> SampledStatistics:
    """Sample metrics by one quadrature; see `sample_metrics`."""
    mechanism, status = request.kernel, closed.status
    tables = make_tables(request, metrics)
    statistics = np.full((tables.slots.max() + 1, len(status)), np.nan)
    result, excess = SampledStatistics.empty(len(status)), np.zeros(len(status))

    def run(designs: Indices, quadrature: Quadrature, corners: Collection[str]) -> None:
        sizes, loop_tables = loop_arguments(request, metrics, quadrature, frozenset(corners))
        space = take_work_space(sizes, loop_tables, len(request.breaks))
        sample(
            mechanism.close, mechanism.fill, mechanism.disturbed_fill or mechanism.fill, sizes, loop_tables, parameters,
            closed.constants, designs, statistics, result.nodes, result.error, excess,
            *space,
        )  # fmt: skip
        leave_work_space(loop_tables, space)

    def run_all(designs: npt.NDArray[np.bool_], quadratures: tuple[Quadrature, ...], corners: set[str]) -> None:
        for number, each in enumerate(quadratures):
            if designs.any() or number == 0:  # without designs too, which compiles
                result.error[designs], excess[designs] = 0.0, 0.0
                run(np.flatnonzero(designs), each, corners)
                largest = LARGEST_ANCHORED_EXCESS if isinstance(each, Anchored) else LARGEST_EXCESS
                designs = designs & (excess > largest)

    own = {name for metric in metrics for name in metric.signal.corners_at}
    cornered, added = _added_corners(mechanism, metrics, parameters)
    run_all(active & ~cornered, _attempts(mechanism.quadrature, quadrature), own)
    if (active & cornered).any():
        adaptive = _adaptive(mechanism.quadrature)
        is_known = quadrature != adaptive and "" not in added
        attempts = (_resolved(mechanism.quadrature), adaptive) if is_known else (adaptive,)
        run_all(active & cornered, attempts, own | added)
    result.evaluations = int(np.count_nonzero(active))
    if mechanism.closed_error_row >= 0:
        _add_errors_of_ends(request, metrics, tables, statistics, parameters, closed, result)
    missed = active & ~(result.error <= request.tolerance)
    status[missed & (status != Status.NOT_FINITE)] = Status.TOLERANCE_NOT_MET  # not where another group lacks one
    not_finite = active & ~np.isfinite(statistics).all(axis=0)
    status[not_finite] = Status.NOT_FINITE
    if not_finite.any():  # extremes of a signal that is finite nowhere are infinite
        statistics[:, not_finite] = np.where(np.isinf(statistics[:, not_finite]), np.nan, statistics[:, not_finite])
    for metric in metrics:
        slots = tables.slots_of(metric)
        result.values[metric.name] = statistic_of(metric, statistics, slots, request.tolerance)
        if slots[BOUND] >= 0:
            result.errors[metric.name] = error_of(metric, statistics, slots, result.values[metric.name])
    return result


def _add_errors_of_ends(
    request: Request,
    metrics: tuple[SampledMetric, ...],
    tables: LoopTables,
    statistics: FloatArray,
    parameters: FloatArray,
    closed: ClosedFormResult,
    result: SampledStatistics,
) -> None:
    """Add what the errors of the ends of strokes change statistics by to their bounds, and the worst to all."""
    mechanism, constants, worst = request.kernel, closed.constants, np.zeros(len(closed.status))
    windows = {metric.window for metric in metrics if metric.window.needs_stroke}
    if windows and len(constants) < mechanism.n_constants:
        constants = mechanism.constants(parameters)
    for window in windows:
        own = list({metric.signal: metric for metric in metrics if metric.window == window}.values())
        slots = [tables.slots_of(metric) for metric in own]
        bounds = bound_ends(request, own, slots, statistics, constants)
        for each, bound in zip(slots, bounds, strict=True):
            if each[BOUND] >= 0:
                statistics[each[BOUND]] += bound + closed.constants[mechanism.closed_error_row]
        worst = np.fmax(worst, bounds.max(axis=0))
    result.error += worst


def _attempts(declared: Quadrature, first: Quadrature) -> tuple[Quadrature, ...]:
    """What samples designs in turn, from the first one on, until the samples do not contradict it."""
    if isinstance(declared, Located) and isinstance(first, Anchored | Located):
        return first, declared.anchored if first == declared else declared, _adaptive(declared)
    # a declaration that the samples contradict grades no panels
    return first, Adaptive() if isinstance(first, Graded) else _adaptive(declared)


def _added_corners(
    mechanism: Mechanism, metrics: tuple[SampledMetric, ...], parameters: FloatArray
) -> tuple[npt.NDArray[np.bool_], set[str]]:
    """Whether a parameter of each design gives these metrics corners, shape (u,), and signals that say where."""
    result, names = np.zeros(parameters.shape[1], dtype=np.bool_), set()
    if any(metric.signal.depends_on_load for metric in metrics):
        for parameter, values in zip(mechanism.kernel_parameters, parameters, strict=True):
            if parameter.adds_corners:
                result |= values != 0.0
                names |= {*parameter.corners_at} or {""}
    return result, names
