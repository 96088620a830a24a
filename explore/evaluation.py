"""THE function: designs in, columns out, each design climbing only as far as the request and its own fate demand.

1. closed form over the whole block; 2. screening by constraints known from it; 3. sampling with the nodes that the
design's own geometry needs, at the lowest level that the request uses; 4. exact scaling over the speed: designs that
differ only in speed share one kinematic evaluation, w ~ W and a ~ W^2.

The bound `error` of a row is over all statistics requested of it: |error of mean|/rms, |error of variance|/rms^2, of
std and rms over rms, of extremes over the largest |signal|, of cv and derived metrics relative.

Signals under load are no power of the speed: where a request uses them, the load and, if it is dynamic, the speed are
part of what designs must share to share one evaluation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore import constraints
from explore.derived_metrics import any_given, derive, given
from explore.sampled_metrics import Sampled, sample_metrics
from explore.vocabulary import (
    AnyMetric,
    Column,
    Columns,
    DerivedMetric,
    FloatArray,
    Mechanism,
    Metric,
    Parameter,
    Request,
    SampledMetric,
    Status,
)  # fmt: skip

#: Parameters outside are no usable numbers: squares and products of four would leave the range of doubles.
SMALLEST, LARGEST = 1e-30, 1e30


@dataclass(frozen=True)
class Evaluation:
    """Columns of a block by name, each of shape (n,), and how many geometries were sampled for them."""

    columns: Columns
    kinematic_evaluations: int


def output_columns(request: Request, parameters: Sequence[str]) -> tuple[Column, ...]:
    """The columns of results of a request over designs that name these parameters, in order."""
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
        Column("status", "", "what became of the design", "bookkeeping", "|i1", {s.value: s.label for s in Status}),
    )


def evaluate_columns(request: Request, parameters: Columns) -> Evaluation:
    """Evaluate designs.

    Parameters
    ----------
    request
        What is to be known.
    parameters
        Parameters by name, each of shape (n,), in declared units; those with a default may be missing.

    Returns
    -------
    Evaluation
        Its columns are those of `output_columns`, without "design".
    """
    mechanism = request.mechanism
    n = len(next(iter(parameters.values())))
    inputs = {
        p.name: np.ascontiguousarray(parameters[p.name], dtype=np.float64)
        if p.name in parameters
        else np.full(n, p.default, dtype=np.float64)
        for p in mechanism.parameters
    }
    usable = _usable(mechanism, inputs)
    known_enough = given(request, inputs) if request.derived or _loaded(request) else None
    geometry = _kernel_inputs(request, inputs, usable)
    speed = inputs[mechanism.speed.name]
    chosen, inverse = _distinct(geometry, speed)
    level = _evaluate_geometry(request, geometry if chosen is None else geometry[chosen])
    values, errors = level.scaled(request, inverse, np.where(usable, speed, np.nan))
    for metric in request.sampled:
        if metric.signal.requires:  # no load is no load of 0, which would be the best of all
            values[metric.name] = np.where(any_given(metric.signal.requires, inputs), values[metric.name], np.nan)
    error = level.sampled.error if inverse is None else level.sampled.error[inverse]
    status = level.status.copy() if inverse is None else level.status[inverse]
    nodes = level.sampled.nodes if inverse is None else level.sampled.nodes[inverse]
    if request.derived:
        good = {name: np.where(usable, column, np.nan) for name, column in inputs.items()}
        derived, bound = derive(request, good, values, errors)
        values |= derived
        error = np.maximum(error, bound)
        status[(status == Status.OK) & (error > request.tolerance)] = Status.TOLERANCE_NOT_MET
    if known_enough is not None:
        status[~known_enough & np.isin(status, (Status.OK, Status.TOLERANCE_NOT_MET))] = Status.NOT_GIVEN
    status[~usable] = Status.NOT_FINITE
    work: Columns = {"nodes": nodes.astype(np.int32), "error": error}
    return Evaluation(_assemble(request, parameters, values, work, status, usable), level.sampled.evaluations)


def _kernel_inputs(request: Request, inputs: Columns, usable: npt.NDArray[np.bool_]) -> FloatArray:
    """What the closed form is given, shape (n, p): parameters that change nothing here are at their default.

    So they do not ask for evaluations of their own.
    """
    mechanism, windows, loaded = request.mechanism, {m.window.name for m in request.sampled}, _loaded(request)
    columns = []
    for p in mechanism.kernel_parameters:
        column = np.where(usable, inputs[p.name], 0.0)
        if (p.only_in and not windows.intersection(p.only_in)) or (p.enters == "load" and not loaded):
            column = np.full(len(usable), p.default)
        elif p.scales_speed:
            dynamic = [inputs[other.name] != 0.0 for other in mechanism.parameters if other.dynamic]
            column = np.where(usable & loaded & np.any(dynamic, axis=0), column, 1.0)
        columns.append(column)
    return np.column_stack(columns)


def _loaded(request: Request) -> bool:
    """Whether a signal under load is asked for."""
    return any(metric.signal.loaded for metric in request.sampled)


def _usable(mechanism: Mechanism, inputs: Columns) -> npt.NDArray[np.bool_]:
    """Which designs have parameters that are finite numbers within their declared ranges, shape (n,)."""
    usable = np.ones(len(inputs[mechanism.parameters[0].name]), dtype=np.bool_)
    for p in mechanism.parameters:
        column = inputs[p.name]
        if p.choices:
            usable &= np.isin(column, p.choices)
        elif p.zero or p.lower < 0.0:
            usable &= p.allows(column) & ((column == 0.0) | (np.abs(column) > SMALLEST)) & (np.abs(column) <= LARGEST)
        else:
            usable &= (column > max(p.lower, SMALLEST)) & (column <= min(p.upper, LARGEST))
    return usable


def _distinct(
    geometry: FloatArray, speed: FloatArray
) -> tuple[npt.NDArray[np.intp] | None, npt.NDArray[np.intp] | None]:
    """Rows of distinct geometry and where each design finds its own; None, None when nothing is shared."""
    n = len(speed)
    if n < 2:
        return None, None
    new = np.ones(n, dtype=np.bool_)
    new[1:] = np.any(geometry[1:] != geometry[:-1], axis=1)
    if not new.all():
        return np.flatnonzero(new), np.cumsum(new) - 1
    # No neighbours are equal: look further only if the speed repeats, as in a grid whose speed varies slowest.
    if not 1 < len(np.unique(speed)) <= n // 2:
        return None, None
    _, chosen, inverse = np.unique(geometry, axis=0, return_index=True, return_inverse=True)
    return (None, None) if len(chosen) == n else (chosen, inverse.reshape(n))


@dataclass
class _Geometry:
    """What is known of each distinct geometry, each of shape (u,)."""

    closed: dict[str, FloatArray]
    sampled: Sampled
    status: npt.NDArray[np.int8]

    def scaled(
        self, request: Request, inverse: npt.NDArray[np.intp] | None, speed: FloatArray
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        """All metrics but derived ones at the designs' own speeds, and bounds of their errors, each of shape (n,)."""
        values: dict[str, FloatArray] = {}
        errors: dict[str, FloatArray] = {}
        powers: dict[int, FloatArray | None] = {0: None, 1: speed}
        for metric in request.parts:
            if isinstance(metric, Parameter):
                continue
            known = self.sampled.values if isinstance(metric, SampledMetric) else self.closed
            column = known[metric.name] if inverse is None else known[metric.name][inverse]
            power = _scaling(metric)
            if power not in powers:
                powers[power] = speed**power
            factor = powers[power]
            values[metric.name] = column if factor is None else column * factor
            if metric.name in self.sampled.errors:
                bound = self.sampled.errors[metric.name]
                bound = bound if inverse is None else bound[inverse]
                errors[metric.name] = bound if factor is None else bound * factor
        return values, errors


def speed_power(metric: AnyMetric) -> int | None:
    """The power of the speed to which a metric is proportional; None where it may be to none."""
    if isinstance(metric, DerivedMetric) or (isinstance(metric, SampledMetric) and metric.signal.loaded):
        return None
    return _scaling(metric)


def _scaling(metric: Metric | SampledMetric) -> int:
    """The power of the speed that turns what was sampled into the metric."""
    if not isinstance(metric, SampledMetric) or metric.statistic == "cv":
        return 0
    return metric.signal.speed_power * (2 if metric.statistic == "variance" else 1)


def _evaluate_geometry(request: Request, geometry: FloatArray) -> _Geometry:
    """Closed form, screening and sampling for unit speed."""
    mechanism, u = request.mechanism, len(geometry)
    metrics = np.empty((len(mechanism.metrics), u))
    status = np.zeros(u, dtype=np.int8)
    kernel, singular, noise = np.zeros((u, mechanism.kernel_size)), np.ones((u, 3)), np.ones(u)
    mechanism.closed_form(np.ascontiguousarray(geometry), metrics, status, kernel, singular, noise)
    closed = {metric.name: metrics[k] for k, metric in enumerate(mechanism.metrics)}
    windows = (request.window, *(metric.window for metric in request.sampled))
    rocking = [window.needs_stroke for window in windows] + [metric.signal.needs_stroke for metric in request.sampled]
    if not any(rocking):
        status[status == Status.NO_STROKE] = Status.OK
    _screen(request, closed, status)
    if not request.sampled:
        return _Geometry(closed, Sampled.nothing(u), status)
    return _Geometry(closed, sample_metrics(request, kernel, singular, noise, status), status)


def _screen(request: Request, closed: dict[str, FloatArray], status: npt.NDArray[np.int8]) -> None:
    """Mark the designs that fail a constraint known from the closed form."""
    for constraint in request.constraints:
        if isinstance(constraint.metric, Metric):
            holds = constraints.satisfied(constraints.margin(constraint, closed[constraint.metric.name]))
            status[(status == Status.OK) & ~holds] = Status.SCREENED


def _assemble(
    request: Request,
    parameters: Columns,
    values: dict[str, FloatArray],
    work: Columns,
    status: npt.NDArray[np.int8],
    usable: npt.NDArray[np.bool_],
) -> Columns:
    """Put the columns together in the order and with the types of `output_columns`; `work` are nodes and error."""
    if not usable.all():
        values = {name: np.where(usable, column, np.nan) for name, column in values.items()}
    feasible = status == Status.OK
    columns: Columns = {
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
        feasible &= constraints.satisfied(margins)
        columns[f"{constraint.metric.name}_margin"] = margins
    return columns | work | {"feasible": feasible.astype(np.int8), "status": status}
