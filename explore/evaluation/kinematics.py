"""Kinematics of designs: closed form, screening and sampling of distinct geometries, then scaling with the speed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from explore.evaluation import constraints
from explore.evaluation.derived import Derivation
from explore.evaluation.known import KnownStatistics, evaluate_known, known_metrics
from explore.evaluation.sampled import SampledStatistics, sample_metrics
from explore.model.columns import Arrays
from explore.model.mechanism import ClosedFormResult, Mechanism
from explore.model.quantities import (
    AnyMetric,
    DerivedMetric,
    FloatArray,
    GivenMetric,
    Metric,
    Parameter,
    SampledMetric,
)
from explore.model.request import Request
from explore.model.status import Status
from explore.model.window import Window

#: A radian, deg.
_RADIAN = 180.0 / np.pi

BoolArray = npt.NDArray[np.bool_]
_Indices = npt.NDArray[np.intp]
_Scalar = TypeVar("_Scalar", bound=np.generic)


@dataclass
class Kinematics:
    """Closed-form metrics and statistics of n designs at their speeds.

    `values` are all metrics but derived ones by name, `errors` bounds of the absolute errors of those that derived
    metrics need; nodes, error and status are the signal evaluations, the bound of the worst relative error, and the
    status of each design. `evaluations` is the number of geometries that were sampled.
    """

    values: dict[str, FloatArray]
    errors: dict[str, FloatArray]
    nodes: npt.NDArray[np.int64]
    error: FloatArray
    status: npt.NDArray[np.int8]
    evaluations: int


def evaluate_kinematics(
    request: Request, geometry: FloatArray, inverse: _Indices | None, speed: FloatArray, inputs: Arrays
) -> Kinematics:
    """Closed form, screening and sampling of distinct geometries, scaled with the speeds of the designs.

    `geometry` (p, u) has the parameters of the closed form, `inverse` (n,) the geometry of each design, None where each
    has its own; `speed` and each of the `inputs`, all parameters by name, are of shape (n,).
    """
    mechanism = request.kernel
    interval = request.interval if mechanism.takes_interval else None
    result = mechanism.evaluate_closed_form(geometry, keeps_constants=interval is not None)
    row = mechanism.closed_error_row
    closed_error = result.constants[row].copy() if row >= 0 else None
    if interval:
        _move_over_interval(mechanism, geometry, interval, result)
    closed = {metric.name: result.metrics[k] for k, metric in enumerate(mechanism.metrics)}
    has_stroke = np.ones(len(result.status), dtype=np.bool_)
    for code, own in mechanism.statuses.items():
        if own.lacks_strokes:
            has_stroke &= result.status != code
    if not request.needs_stroke:
        result.status[~has_stroke] = Status.OK
    _screen(request, closed, result.status)
    known = evaluate_known(request, geometry, result.status == Status.OK, has_stroke)
    is_screened = _violates_known(request, known, inverse, speed)
    is_screened |= _violates_formulas(request, closed, result.status, inverse, inputs)
    active = result.status == Status.OK
    if is_screened.any():
        active &= _has_any(~is_screened, inverse, len(active))
    sampled = _sample(request, known, geometry, active, result)
    if closed_error is not None:
        _bound_closed(request, closed, closed_error, sampled)
        result.status[(result.status == Status.OK) & ~(sampled.error <= request.tolerance)] = Status.TOLERANCE_NOT_MET
    values, errors = _scale(request, closed, sampled, inverse, speed)
    kinematics = Kinematics(
        values,
        errors,
        _per_design(sampled.nodes, inverse),
        _per_design(sampled.error, inverse),
        _per_design(result.status, inverse).copy(),
        sampled.evaluations,
    )
    if is_screened.any():
        _remove_samples(request, known, kinematics, is_screened, inverse, speed)
    return kinematics


def _move_over_interval(mechanism: Mechanism, geometry: FloatArray, interval: Window, closed: ClosedFormResult) -> None:
    """Take those geometries that lack a turn by their motion over an interval, if it has one."""
    codes = [code for code, own in mechanism.statuses.items() if own.lacks_turn]
    stuck = np.flatnonzero(np.isin(closed.status, codes))
    if len(stuck):
        part = mechanism.evaluate_closed_form(geometry[:, stuck], interval, keeps_constants=True)
        moves = part.status == Status.OK
        closed.status[stuck[moves]] = Status.OK
        closed.constants[:, stuck[moves]] = part.constants[:, moves]


def _screen(request: Request, closed: dict[str, FloatArray], status: npt.NDArray[np.int8]) -> None:
    """Mark the geometries that violate a constraint on a closed-form metric."""
    for constraint in request.constraints:
        if isinstance(constraint.metric, Metric):
            holds = constraints.margin(constraint, closed[constraint.metric.name]) >= 0.0
            status[(status == Status.OK) & ~holds] = Status.SCREENED


def may_screen(request: Request, metric: AnyMetric) -> bool:
    """Whether a constraint on a metric is known without samples, so that designs which violate it are not sampled."""
    if isinstance(metric, DerivedMetric):
        return metric in request.formulas and not metric.sampled
    return isinstance(metric, Metric) or metric in known_metrics(request)


def _violates_known(request: Request, known: KnownStatistics, inverse: _Indices | None, speed: FloatArray) -> BoolArray:
    """Whether each design violates a constraint on a statistic that is known without samples, shape (n,)."""
    violates = np.zeros(len(speed), dtype=np.bool_)
    for constraint in request.constraints:
        metric = constraint.metric
        if isinstance(metric, SampledMetric) and metric.name in known.values:
            values = _per_design(known.values[metric.name], inverse) * speed ** _scaling_power(metric)
            violates |= constraints.margin(constraint, values) < 0.0  # not where it is not known
    return violates


def _violates_formulas(
    request: Request,
    closed: Mapping[str, FloatArray],
    status: npt.NDArray[np.int8],
    inverse: _Indices | None,
    inputs: Arrays,
) -> BoolArray:
    """Whether each design violates a constraint on a formula of the user's that needs no samples, shape (n,).

    `status` is that of the distinct geometries.
    """
    is_ok: BoolArray = _per_design(status, inverse) == Status.OK
    violates = np.zeros(len(is_ok), dtype=np.bool_)
    for constraint in request.constraints:
        metric = constraint.metric
        if isinstance(metric, DerivedMetric) and may_screen(request, metric):
            parts = {part.name for part in metric.parts if isinstance(part, Metric)}
            values = {name: _per_design(closed[name], inverse) for name in parts}
            value = Derivation(inputs, values, {}, request.tolerance).evaluate(metric).value
            violates |= constraints.margin(constraint, value) < 0.0  # not where it is undefined
    return violates & is_ok


def _has_any(designs: BoolArray, inverse: _Indices | None, count: int) -> BoolArray:
    """Whether each of `count` geometries belongs to one of these designs, shape (u,)."""
    if inverse is None:
        return designs
    result = np.zeros(count, dtype=np.bool_)
    result[inverse[designs]] = True
    return result


def _sample(
    request: Request, known: KnownStatistics, geometry: FloatArray, active: BoolArray, closed: ClosedFormResult
) -> SampledStatistics:
    """Statistics of the active geometries: known where the bound allows, else sampled."""
    others = tuple(metric for metric in request.sampled if metric.name not in known.values)
    is_complete = known.is_known if known.values else np.ones(len(active), dtype=np.bool_)
    result = (
        sample_metrics(request, others, geometry, active & is_complete, closed)
        if others
        else SampledStatistics.empty(len(active))
    )
    if not known.values:
        return result
    result.values |= known.values
    result.errors |= known.errors
    result.error = np.maximum(result.error, known.error)  # those that are sampled below have one of their own
    incomplete = active & ~is_complete
    if incomplete.any():
        result.replace(incomplete, sample_metrics(request, request.sampled, geometry, incomplete, closed))
    return result


def _bound_closed(
    request: Request, closed: Mapping[str, FloatArray], error: FloatArray, sampled: SampledStatistics
) -> None:
    """Raise bounds by those of closed-form metrics, and those of what is taken over strokes by those of their lengths.

    The mean over a stroke changes by the share of the length times its difference from the signal at the end.
    """
    is_used = np.full(len(error), any(metric.window.needs_stroke for metric in request.sampled))
    for metric in request.parts:
        if isinstance(metric, Metric):
            value = closed[metric.name]
            size = np.maximum(np.abs(value), _RADIAN) if metric.unit == "deg" else np.abs(value)
            sampled.errors[metric.name] = error * size
            is_used |= np.isfinite(value)
    sampled.error = sampled.error + np.where(is_used, error, 0.0)


def _scale(
    request: Request,
    closed: dict[str, FloatArray],
    sampled: SampledStatistics,
    inverse: _Indices | None,
    speed: FloatArray,
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """All metrics but derived ones at the speeds of the designs, and bounds of their errors, each of shape (n,)."""
    values: dict[str, FloatArray] = {}
    errors: dict[str, FloatArray] = {}
    is_unit = bool((speed == 1.0).all())  # the statistics are for unit speed
    powers: dict[int, FloatArray | None] = {0: None, 1: None if is_unit else speed}
    for metric in request.parts:
        if isinstance(metric, Parameter):
            continue
        source = sampled.values if isinstance(metric, SampledMetric) else closed
        column = _per_design(source[metric.name], inverse)
        power = _scaling_power(metric)
        if power not in powers:
            powers[power] = None if is_unit else speed**power
        factor = powers[power]
        values[metric.name] = column if factor is None else column * factor
        if metric.name in sampled.errors:
            bound = _per_design(sampled.errors[metric.name], inverse)
            errors[metric.name] = bound if factor is None else bound * factor
    return values, errors


def _remove_samples(
    request: Request,
    known: KnownStatistics,
    kinematics: Kinematics,
    designs: BoolArray,
    inverse: _Indices | None,
    speed: FloatArray,
) -> None:
    """Keep of these designs only what is known without samples: another speed may have needed those of the geometry."""
    kinematics.status[designs] = Status.SCREENED
    kinematics.nodes = np.where(designs, 0, kinematics.nodes)
    kinematics.error = np.where(designs, _per_design(known.error, inverse), kinematics.error)
    for metric in request.sampled:
        factor = speed ** _scaling_power(metric)
        for own, of_known in ((kinematics.values, known.values), (kinematics.errors, known.errors)):
            if metric.name in own:
                column = of_known.get(metric.name)
                kept = np.nan if column is None else _per_design(column, inverse) * factor
                own[metric.name] = np.where(designs, kept, own[metric.name])


def _per_design(values: npt.NDArray[_Scalar], inverse: _Indices | None) -> npt.NDArray[_Scalar]:
    """Values of distinct geometries, shape (u,), for each design, shape (n,)."""
    return values if inverse is None else values[inverse]


def speed_power(metric: AnyMetric) -> int | None:
    """The power of the speed that a metric is proportional to; None where it need not be proportional to any."""
    is_loaded = isinstance(metric, SampledMetric) and metric.signal.depends_on_load
    return None if is_loaded or isinstance(metric, DerivedMetric | GivenMetric) else _scaling_power(metric)


def _scaling_power(metric: Metric | SampledMetric) -> int:
    """The power of the speed by which a metric for unit speed is multiplied."""
    if not isinstance(metric, SampledMetric) or metric.statistic == "cv":
        return 0
    return metric.signal.speed_power * (2 if metric.statistic == "variance" else 1)
