"""Statistics of signals from the numbers of the compiled loop: their values and errors, in the units of the signals."""

import numpy as np
import numpy.typing as npt

from explore.evaluation.quadrature.slots import (
    BOUND,
    FLUCTUATION,
    LAGGED_FLUCTUATION,
    LAGGED_MAX,
    MAXIMUM,
    MEAN,
    MINIMUM,
    ROOT_MEAN,
    ROOT_POWER_MEAN,
    VARIANCE,
)
from explore.model.quantities import MOMENT_STATISTICS, TURN_STATISTICS, FloatArray, SampledMetric, Signal

Indices = npt.NDArray[np.int64]

_BOTH_EXTREMES = (MINIMUM, MAXIMUM)
_EXTREMES = {"min": (MINIMUM,), "max": (MAXIMUM,), "peak": _BOTH_EXTREMES, "peak_to_peak": _BOTH_EXTREMES}
_OF_TURNS = dict(zip(TURN_STATISTICS, (FLUCTUATION, LAGGED_FLUCTUATION, LAGGED_MAX), strict=True))
_POWERS = {"mean": ROOT_MEAN, "power_mean": ROOT_POWER_MEAN}
_DEGREES = 180.0 / np.pi
_TURN = 2.0 * np.pi


def has_own_places(metric: SampledMetric) -> bool:
    """Whether a metric is integrated between places of its own: a mean of a power that is no polynomial, for one."""
    return metric.statistic in _OF_TURNS or (metric.signal.is_magnitude and metric.statistic in _POWERS)


def statistics_beside_moments(metric: SampledMetric) -> tuple[int, ...]:
    """Statistics that a metric needs beside the moments; both extremes of a rectified signal, which may swap."""
    if has_own_places(metric):
        return ((_OF_TURNS | _POWERS)[metric.statistic],)
    extremes: tuple[int, ...] = _EXTREMES.get(metric.statistic, ())
    return _BOTH_EXTREMES if metric.signal.is_rectified and extremes else extremes


def statistic_of(metric: SampledMetric, statistics: FloatArray, slots: Indices, tolerance: float) -> FloatArray:
    """A statistic for unit speed in the signal's unit, shape (u,), from ``statistics[slots]``."""
    mean, variance, factor = statistics[slots[MEAN]], statistics[slots[VARIANCE]], unit_factor(metric.signal)
    value: FloatArray
    if metric.signal.is_magnitude:
        return _magnitude_statistic(metric.statistic, statistics, slots)
    match metric.statistic:
        case "mean" if metric.signal.is_rectified:
            value = np.abs(mean)
        case statistic if statistic in _OF_TURNS:
            value = statistics[slots[_OF_TURNS[statistic]]]
        case "variance":
            value, factor = variance, factor**2
        case "cv":
            value, factor = moment_statistic("cv", mean, variance, tolerance), 1.0
        case statistic if statistic in MOMENT_STATISTICS:
            value = moment_statistic(statistic, mean, variance, tolerance)
        case "min" | "max" if not metric.signal.is_rectified:
            value = statistics[slots[_EXTREMES[metric.statistic][0]]]
        case _:
            low, high = statistics[slots[MINIMUM]], statistics[slots[MAXIMUM]]
            if metric.signal.is_rectified:
                low, high = np.where(mean < 0.0, -high, low), np.where(mean < 0.0, -low, high)
                low = np.maximum(low, 0.0)
            largest = np.maximum(np.abs(low), np.abs(high))
            value = {"min": low, "max": high, "peak": largest, "peak_to_peak": high - low}[metric.statistic]
    return value if factor == 1.0 else value * factor


def moment_statistic(statistic: str, mean: FloatArray, variance: FloatArray, tolerance: float) -> FloatArray:
    """One of MOMENT_STATISTICS, shape (u,); a cv is NaN where the mean is too small for one."""
    match statistic:
        case "mean":
            return mean
        case "variance":
            return variance
        case "std":
            return np.asarray(np.sqrt(variance))
        case "rms":
            return _root_mean_square(mean, variance)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = mean * mean
        np.divide(variance, ratio, out=ratio)
        # A mean that its error bound cannot distinguish from 0 would give a meaningless quotient.
        is_defined = ratio <= (1e3 * tolerance) ** -2 - 1.0
        result = np.sqrt(ratio, out=ratio)
    return result if is_defined.all() else np.where(is_defined, result, np.nan)


def _root_mean_square(mean: FloatArray, variance: FloatArray) -> FloatArray:
    with np.errstate(over="ignore"):  # what is not finite has a status
        return np.asarray(np.sqrt(mean * mean + variance))


def _magnitude_statistic(statistic: str, statistics: FloatArray, slots: Indices) -> FloatArray:
    """A statistic of a magnitude, from the moments and the maximum of its square."""
    match statistic:
        case "mean":
            value = _where_square_has_mean(statistics[slots[ROOT_MEAN]], statistics, slots)
        case "power_mean":
            value = _where_square_has_mean(statistics[slots[ROOT_POWER_MEAN]] ** 0.3, statistics, slots)
        case "max":
            value = np.sqrt(statistics[slots[MAXIMUM]])
        case _:
            value = np.sqrt(statistics[slots[MEAN]])
    return np.asarray(value)


def _where_square_has_mean(value: FloatArray, statistics: FloatArray, slots: Indices) -> FloatArray:
    """The value, NaN where the square of the magnitude is NaN: roots of that count as 0."""
    return np.where(np.isnan(statistics[slots[MEAN]]), np.nan, value)


def error_of(metric: SampledMetric, statistics: FloatArray, slots: Indices, value: FloatArray) -> FloatArray:
    """Bound of the absolute error of a metric for unit speed: its relative bound times its scale."""
    bound, mean, variance = (statistics[slots[k]] for k in (BOUND, MEAN, VARIANCE))
    factor = unit_factor(metric.signal)
    if metric.signal.is_magnitude or metric.statistic == "cv":
        return np.asarray(bound * np.abs(value))
    rms = _root_mean_square(mean, variance)
    if metric.statistic == "variance":
        return np.asarray(bound * (rms * factor) ** 2)
    if metric.statistic in ("fluctuation", "lagged_fluctuation"):
        return np.asarray(bound * rms * factor * _TURN)
    # The scale is the largest magnitude of the signal, which is at least the rms and at least this value.
    return np.asarray(bound * np.maximum(rms * factor, np.abs(value)))


def unit_factor(signal: Signal) -> float:
    """Factor from the kernel's radians to the signal's unit."""
    return float(_DEGREES) if signal.unit == "deg" else 1.0
