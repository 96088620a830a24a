"""Evaluate designs, doing only the work that the request needs.

1. Closed form of the whole block; 2. screening by constraints on closed-form metrics, then on statistics and formulas
that are known without samples; 3. sampling of the signals that the request uses, with the nodes that each design's
geometry needs; 4. exact scaling with the speed: designs that differ only in speed share one kinematic evaluation,
because velocities are proportional to the speed and accelerations to its square; 5. derived metrics; 6. all of this
once more with more digits, for designs that miss the tolerance, where the mechanism can.

The bound `error` of a row is over all statistics requested of it: |error of mean|/rms, |error of variance|/rms^2, of
std and rms over rms, of extremes over the largest |signal|, of cv and derived metrics relative; of a formula of the
user's own over the size that it has if no terms cancel.

Signals under load are not proportional to a power of the speed. Where a request uses them, designs share an evaluation
only if their loads and, for dynamic loads, their speeds are equal.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from explore.evaluation import constraints
from explore.evaluation.derived import derive, has_any_of, required_parameters
from explore.evaluation.kinematics import evaluate_kinematics
from explore.evaluation.loop_tables import statistics_tolerance
from explore.model.columns import Arrays, Column, join_columns
from explore.model.mechanism import Mechanism
from explore.model.quantities import AnyMetric, FloatArray, GivenMetric, Metric
from explore.model.request import Request
from explore.model.status import Status

# Products of four parameters of other magnitudes would leave the range of doubles.
#: Smallest magnitude of a usable parameter that is not 0.
SMALLEST_PARAMETER = 1e-30
#: Largest magnitude of a usable parameter.
LARGEST_PARAMETER = 1e30
#: Largest number of constants of designs that are kept at once, in 128 MB.
_MOST_CONSTANTS = 2**24
#: Size of the largest block that changes glibc's limits, with its header, bytes.
_LARGEST_KEPT = 2**25 - 2**16


@dataclass(frozen=True)
class Evaluation:
    """Arrays of a block by name, each of shape (n,), and the number of geometries that were sampled for them."""

    columns: Arrays
    kinematic_evaluations: int

    def replace(self, rows: npt.NDArray[np.intp], others: Evaluation) -> Evaluation:
        """The same with these rows from another evaluation."""
        columns = dict(self.columns)
        for name, column in others.columns.items():
            columns[name] = columns[name].copy()
            columns[name][rows] = column
        return Evaluation(columns, self.kinematic_evaluations + others.kinematic_evaluations)


def output_columns(request: Request, parameters: Sequence[str]) -> tuple[Column, ...]:
    """The columns of results, in order, of a request over designs that give these parameters."""
    mechanism = request.mechanism
    declared = [p for p in mechanism.parameters if p.name in parameters]
    columns = [Column("design", "", "design number", "index", "<i8")]
    columns += [Column(p.name, p.unit, p.long_name, "parameter") for p in declared]
    columns += [_metric_column(metric) for metric in request.metrics]
    for constraint in request.constraints:
        name, unit = constraint.metric.name, constraint.metric.unit
        meaning = f"signed distance of {name} to its nearer bound, >= 0 when satisfied"
        columns.append(Column(f"{name}_margin", unit, meaning, "margin"))
    return (
        *columns,
        Column("nodes", "1", "signal evaluations", "bookkeeping", "<i4"),
        Column("error", "1", "bound on the relative error of the worst statistic", "bookkeeping"),
        Column("feasible", "", "computed and every constraint satisfied", "bookkeeping", "|i1", {0: "no", 1: "yes"}),
        Column("status", "", "what became of the design", "bookkeeping", "|i1", request.mechanism.status_labels),
    )


def _metric_column(metric: AnyMetric) -> Column:
    if isinstance(metric, GivenMetric):
        return metric.column
    labels = dict(enumerate(metric.labels)) if isinstance(metric, Metric) else {}
    if labels:
        labels[-1] = "undefined"
    return Column(metric.name, metric.unit, metric.long_name, "metric", "|i1" if labels else "<f8", labels)


def evaluate_columns(request: Request, parameters: Arrays) -> Evaluation:
    """Evaluate designs: parameters by name, each of shape (n,), in declared units; those with a default may be missing.

    `parameters` has the metrics that are given with the designs, too. The columns are those of `output_columns`,
    without "design". Designs that miss the tolerance are evaluated once more by the precise functions of the mechanism,
    if it has these, for marks that windows end at too. Not where laws change at marks, nor with signals that have
    corners or singularities of their own: a curvature where a point rests misses it with any digits.
    """
    _keep_freed_memory()
    count = len(next(iter(parameters.values())))
    most = _MOST_CONSTANTS // max(request.kernel.n_constants, 1)
    evaluation = (
        _evaluate_in_digits(request, parameters) if count <= most else _evaluate_parts(request, parameters, most)
    )
    # A row without its numbers has no bound either: 0 would read as exact.
    evaluation.columns["error"][evaluation.columns["status"] == Status.NOT_FINITE] = np.nan
    return evaluation


def _evaluate_parts(request: Request, parameters: Arrays, most: int) -> Evaluation:
    """Evaluate so many designs at a time."""
    count = len(next(iter(parameters.values())))
    parts = [
        _evaluate_in_digits(request, {name: column[first : first + most] for name, column in parameters.items()})
        for first in range(0, count, most)
    ]
    return join_evaluations(parts)


def join_evaluations(parts: Sequence[Evaluation]) -> Evaluation:
    """The evaluation of all designs of parts, one after the other."""
    columns = join_columns([part.columns for part in parts])
    return Evaluation(columns, sum(part.kinematic_evaluations for part in parts))


def _evaluate_in_digits(request: Request, parameters: Arrays) -> Evaluation:
    """Evaluate designs, and those that miss the tolerance once more with more digits; see `evaluate_columns`."""
    evaluation = _evaluate(request, parameters)
    missed = np.flatnonzero(~(evaluation.columns["error"] <= request.tolerance))
    has_marks = any(metric.window.needs_stroke for metric in request.sampled)
    is_rough = bool(request.breaks) or (has_marks and request.kernel.precise_close is None)
    signals = [metric.signal for metric in request.sampled]
    is_rough |= any(signal.has_corners or signal.has_own_singularities for signal in signals)
    mechanism = None if is_rough or not len(missed) else request.kernel.precise
    if mechanism is None:
        return evaluation
    precise = replace(request, mechanism=mechanism, is_finest=True)
    return evaluation.replace(missed, _evaluate(precise, {name: column[missed] for name, column in parameters.items()}))


def _evaluate(request: Request, parameters: Arrays) -> Evaluation:
    """Evaluate designs once; see `evaluate_columns`."""
    mechanism = request.mechanism
    inputs = _complete(mechanism, parameters)
    given = {metric.name: parameters[metric.name].astype(np.float64) for metric in mechanism.given}
    usable = _is_usable(mechanism, inputs, parameters.keys() - given.keys())
    geometry = _kernel_inputs(request, inputs, usable)
    speed = inputs[mechanism.speed.name] if mechanism.speed else np.ones(len(usable))
    first_rows, inverse = _find_distinct(geometry)
    distinct = geometry if first_rows is None else np.ascontiguousarray(geometry[:, first_rows])
    usable_inputs = inputs
    if request.derived and not usable.all():
        usable_inputs = {name: np.where(usable, column, np.nan) for name, column in inputs.items()}
    kinematics = evaluate_kinematics(request, distinct, inverse, np.where(usable, speed, np.nan), usable_inputs)
    values, errors, error, status = kinematics.values, kinematics.errors, kinematics.error, kinematics.status
    values |= given
    for metric in request.sampled:
        if loads := metric.signal.required_loads:  # a force of 0 without any load would rank first
            values[metric.name] = np.where(has_any_of(loads, inputs), values[metric.name], np.nan)
    if request.derived:
        reached = np.maximum(error, statistics_tolerance(request))
        derived, bound = derive(request, usable_inputs, values, errors, reached)
        values |= derived
        error = np.maximum(error, bound)
        status[(status == Status.OK) & (error > request.tolerance)] = Status.TOLERANCE_NOT_MET
    if request.derived or _depends_on_load(request):
        lacks = ~np.all([has_any_of(names, inputs) for names in required_parameters(request)], axis=0)
        status[lacks & np.isin(status, (Status.OK, Status.TOLERANCE_NOT_MET))] = Status.NOT_GIVEN
    status[~usable] = Status.NOT_FINITE
    nodes = np.where(usable, kinematics.nodes, 0).astype(np.int32)
    bookkeeping: Arrays = {"nodes": nodes, "error": error}
    return Evaluation(_assemble(request, parameters, values, bookkeeping, status, usable), kinematics.evaluations)


def compile_kernels(request: Request) -> None:
    """Compile what the request needs, or load it from Numba's cache, so that workers need not do it at once."""
    evaluate_columns(request, {p.name: np.array([np.nan]) for p in request.mechanism.parameters})


@cache
def _keep_freed_memory() -> None:
    """Let the C library keep up to 64 MB of freed memory: mapping arrays anew takes up to 100 ns a design.

    glibc raises its limits to the size of a mapped block that is freed, up to 32 MB, and to twice that.
    """
    np.empty(_LARGEST_KEPT, dtype=np.uint8)


def _complete(mechanism: Mechanism, parameters: Arrays) -> Arrays:
    """All parameters of the mechanism, those that are missing at their defaults."""
    n = len(next(iter(parameters.values())))
    # One array for all with the same default: a mechanism has a dozen loads, most of them 0.
    missing = {p.default for p in mechanism.parameters if p.name not in parameters}
    defaults = {value: np.broadcast_to(np.float64(np.nan if value is None else value), n) for value in missing}
    return {
        p.name: np.ascontiguousarray(parameters[p.name], dtype=np.float64)
        if p.name in parameters
        else defaults[p.default]
        for p in mechanism.parameters
    }


def _kernel_inputs(request: Request, inputs: Arrays, usable: npt.NDArray[np.bool_]) -> FloatArray:
    """Parameters of the closed form, shape (p, n).

    Those that no requested metric depends on are at their default, so that designs that differ only in them share one
    evaluation. Ones replace a design that is not usable: where all lengths are 0, it takes a table 0.1 s to see that it
    does not move.
    """
    mechanism, windows, loaded = request.kernel, {m.window.name for m in request.sampled}, _depends_on_load(request)
    has_points, n, all_usable = any(m.signal.point for m in request.sampled), len(usable), bool(usable.all())
    columns = np.empty((len(mechanism.kernel_parameters), n))
    for k, p in enumerate(mechanism.kernel_parameters):
        column: FloatArray | float = inputs[p.name] if all_usable else np.where(usable, inputs[p.name], 1.0)
        if (p.only_in and not windows.intersection(p.only_in)) or (p.affects == "load" and not loaded):
            column = float("nan") if p.default is None else p.default
        elif p.affects == "point" and not has_points:
            column = 0.0
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
            lower, upper = max(p.lower, SMALLEST_PARAMETER), min(p.upper, LARGEST_PARAMETER)
            if not (column.min(initial=np.inf) > lower and column.max(initial=-np.inf) <= upper):  # or one is NaN
                usable &= (column > lower) & (column <= upper)
    return usable


def _find_distinct(geometry: FloatArray) -> tuple[npt.NDArray[np.intp] | None, npt.NDArray[np.intp] | None]:
    """First row of each distinct geometry, and the geometry of each design; None, None when all are distinct."""
    n = geometry.shape[1]
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
    # No neighbours are equal. Compare all only if the first comes again, as in a grid whose speed varies slowest.
    again = np.flatnonzero(geometry[0] == geometry[0, 0])[1:]
    again = again[(geometry[:, again] == geometry[:, :1]).all(axis=0)]
    if not len(again):
        return None, None
    period = int(again[0])
    if np.array_equal(geometry[:, period:], geometry[:, :-period]):
        return np.arange(period), np.arange(n) % period
    _, first_rows, inverse = np.unique(geometry, axis=1, return_index=True, return_inverse=True)
    return (None, None) if len(first_rows) == n else (first_rows, inverse.reshape(n))


def _assemble(
    request: Request,
    parameters: Arrays,
    values: dict[str, FloatArray],
    bookkeeping: Arrays,
    status: npt.NDArray[np.int8],
    usable: npt.NDArray[np.bool_],
) -> Arrays:
    """Assemble the columns in the order and with the types of `output_columns`; `bookkeeping` has nodes and error."""
    if not usable.all():
        values = {name: np.where(usable, column, np.nan) for name, column in values.items()}
    feasible = status == Status.OK
    columns: Arrays = {
        p.name: np.ascontiguousarray(parameters[p.name], dtype=np.float64)
        for p in request.mechanism.parameters
        if p.name in parameters
    }
    for metric in request.metrics:
        column = parameters[metric.name] if isinstance(metric, GivenMetric) else values[metric.name]
        if isinstance(metric, Metric) and metric.labels:
            column = np.where(usable, column, -1).astype(np.int8)
        columns[metric.name] = column
    for constraint in request.constraints:
        margins = constraints.margin(constraint, values[constraint.metric.name])
        feasible &= margins >= 0.0
        columns[f"{constraint.metric.name}_margin"] = margins
    return columns | bookkeeping | {"feasible": feasible.astype(np.int8), "status": status}
