"""Evaluate designs, doing only the work that the request needs.

1. Closed form of the whole block; 2. screening by constraints on closed-form metrics; 3. sampling of the signals that
the request uses, with the nodes that each design's geometry needs; 4. exact scaling with the speed: designs that differ
only in speed share one kinematic evaluation, because velocities are proportional to the speed and accelerations to its
square; 5. derived metrics.

The bound `error` of a row is over all statistics requested of it: |error of mean|/rms, |error of variance|/rms^2, of
std and rms over rms, of extremes over the largest |signal|, of cv and derived metrics relative.

Signals under load are not proportional to a power of the speed. Where a request uses them, designs share an evaluation
only if their loads and, for dynamic loads, their speeds are equal.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from explore.evaluation import constraints
from explore.evaluation.derived import derive, has_any_of, has_required_parameters
from explore.evaluation.sampled import SampledStatistics, sample_metrics
from explore.model.columns import Arrays, Column
from explore.model.mechanism import Mechanism
from explore.model.quantities import AnyMetric, DerivedMetric, FloatArray, Metric, Parameter, SampledMetric
from explore.model.request import Request
from explore.model.status import Status

#: Parameters of other magnitudes are not usable, because products of four of them would leave the range of doubles.
SMALLEST_PARAMETER, LARGEST_PARAMETER = 1e-30, 1e30

_Scalar = TypeVar("_Scalar", bound=np.generic)


@dataclass(frozen=True)
class Evaluation:
    """Arrays of a block by name, each of shape (n,), and the number of geometries that were sampled for them."""

    columns: Arrays
    kinematic_evaluations: int


def output_columns(request: Request, parameters: Sequence[str]) -> tuple[Column, ...]:
    """The columns of results, in order, of a request over designs that give these parameters."""
    mechanism = request.mechanism
    declared = [p for p in mechanism.parameters if p.name in parameters]
    columns = [Column("design", "", "design number", "index", "<i8")]
    columns += [Column(p.name, p.unit, p.long_name, "parameter") for p in declared]
    for metric in request.metrics:
        labels = dict(enumerate(metric.labels)) if isinstance(metric, Metric) else {}
        if labels:
            labels[-1] = "undefined"
        columns.append(Column(metric.name, metric.unit, metric.long_name, "metric", "|i1" if labels else "<f8", labels))
    for constraint in request.constraints:
        metric = constraint.metric
        long_name = f"signed distance of {metric.name} to its nearer bound, >= 0 when satisfied"
        columns.append(Column(f"{metric.name}_margin", metric.unit, long_name, "margin"))
    return (
        *columns,
        Column("nodes", "1", "signal evaluations", "bookkeeping", "<i4"),
        Column("error", "1", "bound on the relative error of the worst statistic", "bookkeeping"),
        Column("feasible", "", "computed and every constraint satisfied", "bookkeeping", "|i1", {0: "no", 1: "yes"}),
        Column("status", "", "what became of the design", "bookkeeping", "|i1", request.mechanism.status_labels),
    )


def evaluate_columns(request: Request, parameters: Arrays) -> Evaluation:
    """Evaluate designs.

    Parameters
    ----------
    request
        Metrics and constraints to evaluate.
    parameters
        Parameters by name, each of shape (n,), in declared units; those with a default may be missing.

    Returns
    -------
    Evaluation
        Its columns are those of `output_columns`, without "design".
    """
    mechanism = request.mechanism
    inputs = _complete(mechanism, parameters)
    usable = _is_usable(mechanism, inputs, parameters)
    geometry = _kernel_inputs(request, inputs, usable)
    speed = inputs[mechanism.speed.name] if mechanism.speed else np.ones(len(usable))
    first_rows, inverse = _find_distinct(geometry, speed)
    distinct = geometry if first_rows is None else np.ascontiguousarray(geometry[:, first_rows])
    kinematics = _evaluate_geometry(request, distinct)
    values, errors = kinematics.scaled(request, inverse, np.where(usable, speed, np.nan))
    _remove_forces_without_load(request, inputs, values)
    error = _per_design(kinematics.sampled.error, inverse)
    status = _per_design(kinematics.status, inverse).copy()
    nodes = _per_design(kinematics.sampled.nodes, inverse)
    if request.derived:
        usable_inputs = {name: np.where(usable, column, np.nan) for name, column in inputs.items()}
        derived, bound = derive(request, usable_inputs, values, errors)
        values |= derived
        error = np.maximum(error, bound)
        status[(status == Status.OK) & (error > request.tolerance)] = Status.TOLERANCE_NOT_MET
    if request.derived or _depends_on_load(request):
        has_parameters = has_required_parameters(request, inputs)
        status[~has_parameters & np.isin(status, (Status.OK, Status.TOLERANCE_NOT_MET))] = Status.NOT_GIVEN
    status[~usable] = Status.NOT_FINITE
    work: Arrays = {"nodes": nodes.astype(np.int32), "error": error}
    return Evaluation(_assemble(request, parameters, values, work, status, usable), kinematics.sampled.evaluations)


def _complete(mechanism: Mechanism, parameters: Arrays) -> Arrays:
    """All parameters of the mechanism, those that are missing at their defaults."""
    n = len(next(iter(parameters.values())))
    return {
        p.name: np.ascontiguousarray(parameters[p.name], dtype=np.float64)
        if p.name in parameters
        else np.broadcast_to(np.float64(np.nan if p.default is None else p.default), n)
        for p in mechanism.parameters
    }


def _remove_forces_without_load(request: Request, inputs: Arrays, values: dict[str, FloatArray]) -> None:
    """Set metrics of forces to NaN where a design has no load: a force of 0 would rank first."""
    for metric in request.sampled:
        loads = metric.signal.required_loads
        if loads:
            values[metric.name] = np.where(has_any_of(loads, inputs), values[metric.name], np.nan)


def _kernel_inputs(request: Request, inputs: Arrays, usable: npt.NDArray[np.bool_]) -> FloatArray:
    """Parameters of the closed form, shape (p, n).

    Those that no requested metric depends on are at their default, so that designs that differ only in them share one
    evaluation.
    """
    mechanism, windows, loaded = request.mechanism, {m.window.name for m in request.sampled}, _depends_on_load(request)
    n, all_usable = len(usable), bool(usable.all())
    columns = np.empty((len(mechanism.kernel_parameters), n))
    for k, p in enumerate(mechanism.kernel_parameters):
        column: FloatArray | float = inputs[p.name] if all_usable else np.where(usable, inputs[p.name], 0.0)
        if (p.only_in and not windows.intersection(p.only_in)) or (p.affects == "load" and not loaded):
            column = float("nan") if p.default is None else p.default
        elif p.scales_speed:
            dynamic = [inputs[other.name] != 0.0 for other in mechanism.parameters if other.is_dynamic]
            column = np.where(usable & np.any(dynamic, axis=0), column, 1.0) if loaded else 1.0
        columns[k] = column
    return columns


def _depends_on_load(request: Request) -> bool:
    """Whether a requested metric depends on the load."""
    return any(metric.signal.depends_on_load for metric in request.sampled)


def _is_usable(mechanism: Mechanism, inputs: Arrays, names: Iterable[str]) -> npt.NDArray[np.bool_]:
    """Whether the parameters of these names are within their declared ranges, shape (n,); defaults are."""
    usable = np.ones(len(inputs[mechanism.parameters[0].name]), dtype=np.bool_)
    for p in (mechanism.parameter(name) for name in names):
        column = inputs[p.name]
        if p.choices:
            usable &= np.isin(column, p.choices)
        elif p.zero_meaning or p.lower < 0.0:
            usable &= (
                p.allows(column)
                & ((column == 0.0) | (np.abs(column) > SMALLEST_PARAMETER))
                & (np.abs(column) <= LARGEST_PARAMETER)
            )
        else:
            usable &= (column > max(p.lower, SMALLEST_PARAMETER)) & (column <= min(p.upper, LARGEST_PARAMETER))
    return usable


def _find_distinct(
    geometry: FloatArray, speed: FloatArray
) -> tuple[npt.NDArray[np.intp] | None, npt.NDArray[np.intp] | None]:
    """First row of each distinct geometry, and the geometry of each design; None, None when all are distinct."""
    n = len(speed)
    if n < 2:
        return None, None
    differs = np.ones(n, dtype=np.bool_)  # from the row before
    differs[1:] = False
    for column in geometry:
        np.logical_or(differs[1:], column[1:] != column[:-1], out=differs[1:])
        if differs.all():
            break
    if not differs.all():
        return np.flatnonzero(differs), np.cumsum(differs) - 1
    # No neighbours are equal. Compare all rows only if the speed repeats, as in a grid whose speed varies slowest.
    if not 1 < len(np.unique(speed)) <= n // 2:
        return None, None
    _, first_rows, inverse = np.unique(geometry, axis=1, return_index=True, return_inverse=True)
    return (None, None) if len(first_rows) == n else (first_rows, inverse.reshape(n))


def _per_design(values: npt.NDArray[_Scalar], inverse: npt.NDArray[np.intp] | None) -> npt.NDArray[_Scalar]:
    """Values of distinct geometries, shape (u,), for each design, shape (n,); see `_find_distinct`."""
    return values if inverse is None else values[inverse]


@dataclass
class _Kinematics:
    """Closed-form and sampled metrics of distinct geometries for unit speed, each of shape (u,)."""

    closed: dict[str, FloatArray]
    sampled: SampledStatistics
    status: npt.NDArray[np.int8]

    def scaled(
        self, request: Request, inverse: npt.NDArray[np.intp] | None, speed: FloatArray
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        """All metrics but derived ones at the speeds of the designs, and bounds of their errors, each of shape (n,)."""
        values: dict[str, FloatArray] = {}
        errors: dict[str, FloatArray] = {}
        powers: dict[int, FloatArray | None] = {0: None, 1: speed}
        for metric in request.parts:
            if isinstance(metric, Parameter):
                continue
            source = self.sampled.values if isinstance(metric, SampledMetric) else self.closed
            column = _per_design(source[metric.name], inverse)
            power = _scaling_power(metric)
            if power not in powers:
                powers[power] = speed**power
            factor = powers[power]
            values[metric.name] = column if factor is None else column * factor
            if metric.name in self.sampled.errors:
                bound = _per_design(self.sampled.errors[metric.name], inverse)
                errors[metric.name] = bound if factor is None else bound * factor
        return values, errors


def speed_power(metric: AnyMetric) -> int | None:
    """The power of the speed that a metric is proportional to; None where it need not be proportional to any."""
    if isinstance(metric, DerivedMetric) or (isinstance(metric, SampledMetric) and metric.signal.depends_on_load):
        return None
    return _scaling_power(metric)


def _scaling_power(metric: Metric | SampledMetric) -> int:
    """The power of the speed by which a metric for unit speed is multiplied."""
    if not isinstance(metric, SampledMetric) or metric.statistic == "cv":
        return 0
    return metric.signal.speed_power * (2 if metric.statistic == "variance" else 1)


def _evaluate_geometry(request: Request, geometry: FloatArray) -> _Kinematics:
    """Closed form, screening and sampling for unit speed."""
    mechanism = request.mechanism
    result = mechanism.evaluate_closed_form(geometry)
    closed = {metric.name: result.metrics[k] for k, metric in enumerate(mechanism.metrics)}
    windows = (request.window, *(metric.window for metric in request.sampled))
    needs_stroke = [window.needs_stroke for window in windows] + [
        metric.signal.needs_stroke for metric in request.sampled
    ]
    if not any(needs_stroke):
        for code, status in mechanism.statuses.items():
            if status.lacks_strokes:
                result.status[result.status == code] = Status.OK
    _screen(request, closed, result.status)
    if not request.sampled:
        return _Kinematics(closed, SampledStatistics.empty(geometry.shape[1]), result.status)
    return _Kinematics(closed, sample_metrics(request, geometry, result.status), result.status)


def _screen(request: Request, closed: dict[str, FloatArray], status: npt.NDArray[np.int8]) -> None:
    """Mark the designs that violate a constraint on a closed-form metric."""
    for constraint in request.constraints:
        if isinstance(constraint.metric, Metric):
            holds = constraints.is_satisfied(constraints.margin(constraint, closed[constraint.metric.name]))
            status[(status == Status.OK) & ~holds] = Status.SCREENED


def _assemble(
    request: Request,
    parameters: Arrays,
    values: dict[str, FloatArray],
    work: Arrays,
    status: npt.NDArray[np.int8],
    usable: npt.NDArray[np.bool_],
) -> Arrays:
    """Assemble the columns in the order and with the types of `output_columns`; `work` has nodes and error."""
    if not usable.all():
        values = {name: np.where(usable, column, np.nan) for name, column in values.items()}
    feasible = status == Status.OK
    columns: Arrays = {
        p.name: np.ascontiguousarray(parameters[p.name], dtype=np.float64)
        for p in request.mechanism.parameters
        if p.name in parameters
    }
    for metric in request.metrics:
        column = values[metric.name]
        if isinstance(metric, Metric) and metric.labels:
            column = np.where(usable, column, -1).astype(np.int8)
        columns[metric.name] = column
    for constraint in request.constraints:
        margins = constraints.margin(constraint, values[constraint.metric.name])
        feasible &= constraints.is_satisfied(margins)
        columns[f"{constraint.metric.name}_margin"] = margins
    return columns | work | {"feasible": feasible.astype(np.int8), "status": status}
