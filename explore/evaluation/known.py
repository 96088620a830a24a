"""Statistics that are known without samples: moments in closed form, means of rates, extremes at declared angles.

Mean and variance of some signals are integrals that a mechanism declares. The mean of a rate over a window is the
change of the signal that it is the rate of, over the length of the window. A signal with declared `extremes_at` is
monotonic between them, so that its extremes are among these angles and the ends of the window.
"""

from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from explore.base.compiling import CLOSE_SIGNATURE, INTEGRALS, INTEGRALS_SIGNATURE, as_argument
from explore.evaluation.loop_tables import statistics_tolerance
from explore.evaluation.positions import Position, WindowPositions
from explore.evaluation.quadrature.bounds import ROUNDING
from explore.evaluation.quadrature.integrals import integrate, leave_open
from explore.evaluation.remembering import remembered
from explore.evaluation.statistics import moment_statistic, unit_factor
from explore.evaluation.windows import interval_half_tangents, specify_window
from explore.model.mechanism import Mechanism
from explore.model.quantities import EXTREME_STATISTICS, MOMENT_STATISTICS, FloatArray, SampledMetric, Signal
from explore.model.request import Request
from explore.model.window import Window


@dataclass
class KnownStatistics:
    """Statistics of u distinct geometries for unit speed, each of shape (u,), NaN where not computed.

    `values` are metrics by name in their signals' units, NaN where their bound misses the tolerance, and `errors`
    bounds of their absolute errors; `error` is the bound of the worst relative error of those that meet the tolerance,
    and `is_known` says whether all of them are computed and meet it.
    """

    values: dict[str, FloatArray]
    errors: dict[str, FloatArray]
    error: FloatArray
    is_known: npt.NDArray[np.bool_]


@remembered
def known_metrics(request: Request) -> tuple[SampledMetric, ...]:
    """The metrics of a request that are computed without samples where their bound meets the tolerance.

    They are the metrics with a constraint, because they screen, means that are 0, because samples have their rounding,
    and those of windows that nothing else must sample.
    """
    known = {metric for metric in request.sampled if _is_known(request, metric)}
    sampled_windows = {metric.window for metric in request.sampled if metric not in known}
    always = {constraint.metric for constraint in request.constraints} | {
        metric for metric in known if _is_zero(request.kernel, metric)
    }
    return tuple(m for m in request.sampled if m in known and (m.window not in sampled_windows or m in always))


def _is_known(request: Request, metric: SampledMetric) -> bool:
    """Whether a statistic follows from the declaration or from the signals at single angles."""
    mechanism, signal = request.kernel, metric.signal
    if metric.window.kind == "clutch" or signal.depends_on_load or signal.is_magnitude:
        return False
    if _is_zero(mechanism, metric) or _is_integrated(mechanism, metric):
        return True
    # Where laws or variants differ, the law at an end depends on the design.
    if request.breaks or mechanism.variant_row >= 0:
        return False
    if metric.statistic == "mean":
        antiderivative = mechanism.signal(signal.derivative_of) if signal.derivative_of else None
        # `_KnownSources._at` computes neither terms that bound the rounding of a signal nor disturbed samples.
        if antiderivative is None or antiderivative.terms_row >= 0 or mechanism.knows_rounding:
            return False
        return not antiderivative.depends_on_load
    return metric.statistic in EXTREME_STATISTICS and bool(signal.extremes_at)


def _is_zero(mechanism: Mechanism, metric: SampledMetric) -> bool:
    """Whether a statistic is a mean that is declared to be 0, or that of a rate over a full turn."""
    if metric.statistic != "mean":
        return False
    is_rate_over_a_turn = metric.window.kind == "turn" and bool(metric.signal.derivative_of)
    return is_rate_over_a_turn or (metric.signal.name, metric.window.name) in mechanism.zero_mean


def _is_integrated(mechanism: Mechanism, metric: SampledMetric) -> bool:
    """Whether a statistic follows from integrals in closed form."""
    knows_window = metric.window.kind == "turn" or not mechanism.integrates_turns_alone
    return knows_window and metric.statistic in MOMENT_STATISTICS and metric.signal.row in mechanism.integrated_rows


def evaluate_known(
    request: Request, parameters: FloatArray, active: npt.NDArray[np.bool_], has_stroke: npt.NDArray[np.bool_]
) -> KnownStatistics:
    """Evaluate the `known_metrics` of the active ones of u distinct geometries, with closed-form parameters (p, u).

    `has_stroke` (u,) says for which of them the output rocks.
    """
    metrics, count = known_metrics(request), len(active)
    result = KnownStatistics({}, {}, np.zeros(count), np.zeros(count, dtype=np.bool_))
    if not metrics:
        return result
    designs = slice(None) if active.all() else np.flatnonzero(active)
    sources = _KnownSources(request, metrics, np.ascontiguousarray(parameters[:, designs]), has_stroke[designs])
    tolerance = statistics_tolerance(request)
    worst, is_known = np.zeros(sources.count), np.ones(sources.count, dtype=np.bool_)
    for metric in metrics:
        value, bound, scale = sources.statistic(metric)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            error = np.where(bound == 0.0, 0.0, bound / np.abs(scale))
        is_met = error <= tolerance  # not where a bound is NaN
        if not is_met.all():
            value, error, is_known = np.where(is_met, value, np.nan), np.where(is_met, error, 0.0), is_known & is_met
        worst = np.maximum(worst, error)
        factor = unit_factor(metric.signal)
        result.values[metric.name] = _spread(value if factor == 1.0 else value * factor, designs, count)
        if request.derived:
            result.errors[metric.name] = _spread(bound * factor, designs, count)
    result.error[designs], result.is_known[designs] = worst, is_known
    return result


def _spread(column: FloatArray, designs: slice | npt.NDArray[np.intp], count: int) -> FloatArray:
    """A column of some designs as one of all, NaN elsewhere."""
    if isinstance(designs, slice):
        return column
    result = np.full(count, np.nan)
    result[designs] = column
    return result


@dataclass
class _KnownSources:
    """Integrals, and signals at the ends of windows and at the angles of extremes, of d designs."""

    request: Request
    metrics: tuple[SampledMetric, ...]
    parameters: FloatArray
    has_stroke: npt.NDArray[np.bool_]
    windows: dict[str, WindowPositions] = field(default_factory=dict)
    moments: dict[str, dict[int, FloatArray]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of designs."""
        return len(self.has_stroke)

    @cached_property
    def constants(self) -> FloatArray:
        """Constants of the designs, shape (k, d)."""
        return self.request.kernel.constants(self.parameters)

    def statistic(self, metric: SampledMetric) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value, bound of its error, and the scale of that, in the kernel's units, each of shape (d,)."""
        mechanism = self.request.kernel
        if _is_integrated(mechanism, metric) and not _is_zero(mechanism, metric):
            return self._moment(metric)
        return self._mean(metric) if metric.statistic == "mean" else self._extreme(metric)

    def _moment(self, metric: SampledMetric) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Statistic from mean and variance in closed form."""
        window = metric.window.name
        if window not in self.moments:
            rows = {m.signal.row for m in self.metrics if m.window.name == window}
            self.moments[window] = integrate_window(
                self.request.kernel, self.parameters, metric.window, self.request.drive, rows
            )
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return from_moments(metric.statistic, self.moments[window][metric.signal.row], self.request.tolerance)

    def _mean(self, metric: SampledMetric) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mean of a signal that is a rate of change: from what it is the rate of, at the ends, or 0."""
        mechanism, signal = self.request.kernel, metric.signal
        antiderivative = mechanism.signal(signal.derivative_of) if signal.derivative_of else None
        if antiderivative is None or _is_zero(mechanism, metric):
            value, bound, scale = (np.full(self.count, number) for number in (0.0, 0.0, 1.0))
        else:
            window = self._window(metric)
            (first, error), (last, other_error) = (self._at(antiderivative, at) for at in (window.start, window.stop))
            value = (last - first) / window.length
            scale = np.abs(value)
            bound = (error + other_error) / window.length + ROUNDING * scale
        # An angle that grows from turn to turn is not the same after a turn.
        if antiderivative is not None and antiderivative.needs_stroke:
            bound = np.where(self.has_stroke, bound, np.nan)
        return value, bound, scale

    def _extreme(self, metric: SampledMetric) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Extreme of a signal, relative to its largest magnitude."""
        window = self._window(metric)
        low, high, bound = (np.full(self.count, number) for number in (np.inf, -np.inf, 0.0))
        for position, is_inside in window.candidates(metric.signal):
            value, error = self._at(metric.signal, position)
            low = np.where(is_inside, np.minimum(low, value), low)
            high = np.where(is_inside, np.maximum(high, value), high)
            bound = np.where(is_inside, np.maximum(bound, error), bound)
        largest = np.maximum(np.abs(low), np.abs(high))
        value = {"min": low, "max": high, "peak": largest, "peak_to_peak": high - low}[metric.statistic]
        return value, bound * (2.0 if metric.statistic == "peak_to_peak" else 1.0), largest

    def _window(self, metric: SampledMetric) -> WindowPositions:
        name = metric.window.name
        if name not in self.windows:
            self.windows[name] = WindowPositions(self.request.kernel, self.constants, metric.window, self.request.drive)
        return self.windows[name]

    def _at(self, signal: Signal, position: Position) -> tuple[FloatArray, FloatArray]:
        """A signal at one angle of each design, and the bound of its error: like that of one sample.

        An angle is as exact as a turn, a place as the length that it is relative to, a rate as its terms, which may
        cancel.
        """
        mechanism = self.request.kernel
        noise = self.constants[mechanism.noise_row] if mechanism.noise_row >= 0 else 0.0
        value = position.sample(mechanism, self.constants, signal)
        reference = mechanism.reference(signal)
        unit = np.abs(self.parameters[mechanism.kernel_parameters.index(reference)]) if reference else 1.0
        is_place = unit_factor(signal) != 1.0 or (reference is not None and not signal.derivative_of)
        size = np.maximum(np.abs(value), unit) if is_place else np.abs(value) + noise * unit
        return value, ROUNDING * size


def integrate_window(
    mechanism: Mechanism, parameters: FloatArray, window: Window, drive: str, rows: Collection[int]
) -> dict[int, FloatArray]:
    """Mean, variance and bounds of their errors of the signals in these rows, each of shape (4, n), by row.

    Rows without integrals are left out. `parameters` (p, n) are those of the closed form.
    """
    kind, start_row, stop_row, *_ = specify_window(mechanism, window, drive)
    start, stop = interval_half_tangents(mechanism, window)
    numbers = [number for number, row in enumerate(mechanism.integrated_rows) if row in rows]
    results = np.empty((len(numbers), INTEGRALS, parameters.shape[1]))
    close = leave_open if mechanism.integrates_turns_alone else mechanism.close
    integrate(
        as_argument(close, CLOSE_SIGNATURE), as_argument(mechanism.integrals, INTEGRALS_SIGNATURE),
        parameters, mechanism.record_rows, mechanism.first_parameter, kind, start_row, stop_row, start, stop,
        len(mechanism.integrated_rows), np.array(numbers, dtype=np.int64), results,
    )  # fmt: skip
    return {mechanism.integrated_rows[number]: result for number, result in zip(numbers, results, strict=True)}


def from_moments(statistic: str, moments: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value, bound of its error, and scale of that, of one of MOMENT_STATISTICS, each of shape (n,).

    `moments` (4, n) are mean, variance, and bounds of their errors.
    """
    mean, variance, of_mean, of_variance = moments
    value = moment_statistic(statistic, mean, variance, tolerance)
    if statistic == "cv":
        return _cv(value, mean, variance, of_mean, of_variance)
    square = mean * mean + variance
    # The variance may be all error, the mean be exact.
    rms = np.sqrt(np.maximum(mean * mean, square - of_variance))
    match statistic:
        case "mean":
            return value, of_mean, rms
        case "variance":
            return value, of_variance, square
        case "std":
            return value, 0.5 * of_variance / value, rms
    return value, (np.abs(mean) * of_mean + 0.5 * of_variance) / rms, rms


def _cv(
    value: FloatArray, mean: FloatArray, variance: FloatArray, of_mean: FloatArray, of_variance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value, bound and scale of a coefficient of variation."""
    bound = value * (0.5 * of_variance / variance + of_mean / np.abs(mean))
    is_defined = np.isfinite(value)
    if is_defined.all():
        return value, bound, value
    # Where there is none, mean and variance are as exact as they are.
    square = mean * mean + variance
    undefined = np.maximum(of_mean / np.sqrt(square), of_variance / square)
    return value, np.where(is_defined, bound, undefined), np.where(is_defined, value, 1.0)
