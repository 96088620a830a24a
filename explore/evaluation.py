"""THE function: designs in, columns out, each design climbing only as far as the request and its own fate demand.

1. closed form over the whole block; 2. screening by constraints known from it; 3. sampling with the nodes that the
design's own geometry needs, at the lowest level that the request uses; 4. exact scaling over the speed: designs that
differ only in speed share one kinematic evaluation, w ~ W and a ~ W^2.

The bound `error` of a row is over all statistics requested of it: |error of mean|/rms, |error of variance|/rms^2, of
std and rms over rms, of extremes over the largest |signal|, of cv relative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore import constraints, quadrature, sampling
from explore import statistics as ask
from explore.vocabulary import Column, Columns, FloatArray, Mechanism, Metric, Request, SampledMetric, Signal, Status

_ASKED = {"cv": ask.CV, "std": ask.STD, "min": ask.EXTREMES, "max": ask.EXTREMES, "peak_to_peak": ask.EXTREMES}
_INPUTS = {"min": (2,), "max": (3,), "peak_to_peak": (2, 3)}
#: Parameters outside are no usable numbers: squares and products of four would leave the range of doubles.
SMALLEST, LARGEST = 1e-30, 1e30
_DEGREES = 180.0 / np.pi


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
    geometry = np.column_stack([np.where(usable, inputs[p.name], 0.0) for p in mechanism.geometry])
    windows = {metric.window.name for metric in request.sampled}
    for k, p in enumerate(mechanism.geometry):
        if p.only_in and not windows.intersection(p.only_in):
            geometry[:, k] = p.default  # it changes nothing here, so it must not ask for evaluations of its own
    speed = inputs[mechanism.speed.name]
    chosen, inverse = _distinct(geometry, speed)
    geometry_level = _evaluate_geometry(request, geometry if chosen is None else geometry[chosen])
    values = geometry_level.scaled(request, inverse, np.where(usable, speed, np.nan))
    return Evaluation(
        _assemble(request, parameters, geometry_level, values, inverse, usable), geometry_level.evaluations
    )


def _usable(mechanism: Mechanism, inputs: Columns) -> npt.NDArray[np.bool_]:
    """Which designs have parameters that are finite numbers within their declared ranges, shape (n,)."""
    usable = np.ones(len(inputs[mechanism.parameters[0].name]), dtype=np.bool_)
    for p in mechanism.parameters:
        column = inputs[p.name]
        if p.choices:
            usable &= np.isin(column, p.choices)
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
    sampled: dict[str, FloatArray]
    status: npt.NDArray[np.int8]
    nodes: npt.NDArray[np.int64]
    error: FloatArray
    evaluations: int

    def scaled(
        self, request: Request, inverse: npt.NDArray[np.intp] | None, speed: FloatArray
    ) -> dict[str, FloatArray]:
        """All metrics at the designs' own speeds, each of shape (n,)."""
        values = {}
        powers = {0: None, 1: speed}
        for metric in request.all_metrics:
            known = self.sampled if isinstance(metric, SampledMetric) else self.closed
            column = known[metric.name] if inverse is None else known[metric.name][inverse]
            power = speed_power(metric)
            if power not in powers:
                powers[power] = speed**power
            factor = powers[power]
            values[metric.name] = column if factor is None else column * factor
        return values


def speed_power(metric: Metric | SampledMetric) -> int:
    """The power of the speed to which a metric is proportional."""
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
    known = _Geometry(closed, {}, status, np.zeros(u, dtype=np.int64), np.zeros(u), 0)
    if request.sampled:
        _sample(request, kernel, singular, noise, known)
    return known


def _screen(request: Request, closed: dict[str, FloatArray], status: npt.NDArray[np.int8]) -> None:
    """Mark the designs that fail a constraint known from the closed form."""
    for constraint in request.constraints:
        if isinstance(constraint.metric, Metric):
            holds = constraints.satisfied(constraints.margin(constraint, closed[constraint.metric.name]))
            status[(status == Status.OK) & ~holds] = Status.SCREENED


def _sample(request: Request, kernel: FloatArray, singular: FloatArray, noise: FloatArray, known: _Geometry) -> None:
    """Fill the sampled metrics of the designs that got so far; update status, nodes and error."""
    mechanism = request.mechanism
    windows = tuple(dict.fromkeys(metric.window for metric in request.sampled))
    shape = (len(windows), mechanism.signal_rows)
    needs = np.zeros(len(windows), dtype=np.int64)
    asked, orders = np.zeros(shape, dtype=np.int64), np.full(shape, 2, dtype=np.int64)
    slots = np.full((*shape, 4), -1, dtype=np.int64)
    used = 0
    for metric in request.sampled:
        w, row = windows.index(metric.window), metric.signal.row
        needs[w] |= metric.signal.needs
        asked[w, row] |= ask.MOMENTS | _ASKED.get(metric.statistic, 0)
        orders[w, row] = metric.signal.pole_order
        for k in (0, 1, *_extremes(metric)):
            if slots[w, row, k] < 0:
                slots[w, row, k], used = used, used + 1
    found = np.full((used, len(kernel)), np.nan)
    active = known.status == Status.OK
    sampling.sample(
        mechanism.fill, mechanism.pieces, kernel, singular, noise, active,
        np.array([window.code for window in windows]), np.array([(window.start, window.stop) for window in windows]),
        mechanism.drives[request.drive], needs, asked, orders, request.tolerance,
        *quadrature.rules(), slots, found, known.nodes, known.error,
    )  # fmt: skip
    known.evaluations = int(np.count_nonzero(active))
    known.status[active & ~(known.error <= request.tolerance)] = Status.TOLERANCE_NOT_MET
    known.status[active & ~np.isfinite(found).all(axis=0)] = Status.NOT_FINITE
    for metric in request.sampled:
        at = slots[windows.index(metric.window), metric.signal.row]
        known.sampled[metric.name] = _statistic(metric, found, at, request.tolerance)


def _extremes(metric: SampledMetric) -> tuple[int, ...]:
    """Which extremes a metric is made of: 2 the smallest, 3 the largest. The sign of a rectified signal swaps them."""
    return (2, 3) if metric.signal.rectified and metric.statistic in _INPUTS else _INPUTS.get(metric.statistic, ())


def _statistic(metric: SampledMetric, found: FloatArray, at: npt.NDArray[np.int64], tolerance: float) -> FloatArray:
    """A statistic for unit speed in the signal's unit, shape (u,); ``found[at]`` are mean, variance, min, max."""
    mean, variance, factor = found[at[0]], found[at[1]], _unit_factor(metric.signal)
    value: FloatArray
    match metric.statistic:
        case "mean":
            value = np.abs(mean) if metric.signal.rectified else mean
        case "variance":
            value, factor = variance, factor**2
        case "std":
            value = np.sqrt(variance)
        case "rms":
            value = np.sqrt(mean * mean + variance)
        case "cv":
            # Where the mean only happens to be tiny the quotient would be noise.
            square = mean * mean
            defined = (square > 0.0) & (square >= (1e3 * tolerance) ** 2 * (square + variance))
            value, factor = np.sqrt(variance / np.where(defined, square, np.nan)), 1.0
        case "min" | "max" if not metric.signal.rectified:
            value = found[at[_INPUTS[metric.statistic][0]]]
        case _:
            low, high = found[at[2]], found[at[3]]
            if metric.signal.rectified:
                low, high = np.where(mean < 0.0, -high, low), np.where(mean < 0.0, -low, high)
                low = np.maximum(low, 0.0)
            value = {"min": low, "max": high, "peak_to_peak": high - low}[metric.statistic]
    return value if factor == 1.0 else value * factor


def _unit_factor(signal: Signal) -> float:
    """What turns the kernel's radians into the signal's unit."""
    return float(_DEGREES) if signal.unit == "deg" else 1.0


def _assemble(
    request: Request,
    parameters: Columns,
    known: _Geometry,
    values: dict[str, FloatArray],
    inverse: npt.NDArray[np.intp] | None,
    usable: npt.NDArray[np.bool_],
) -> Columns:
    """Put the columns together in the order and with the types of `output_columns`."""

    def spread(column: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        return column if inverse is None else column[inverse]

    status = spread(known.status).astype(np.int8)
    status[~usable] = Status.NOT_FINITE
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
    columns["nodes"] = spread(known.nodes).astype(np.int32)
    columns["error"] = np.asarray(spread(known.error))
    columns["feasible"] = feasible.astype(np.int8)
    columns["status"] = status
    return columns
