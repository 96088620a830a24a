"""What rounding of the ends of strokes changes statistics by, where signals are large or steep there.

Ends are zeros of the output's rate, each off by what rounding moves it by. Beside a limit they are beside a
singularity, where rates and accelerations are many times their means.
"""

import math
from collections.abc import Sequence

import numpy as np

from explore.evaluation.positions import WindowPositions, sample_signals
from explore.evaluation.quadrature.slots import MAXIMUM, MEAN, MINIMUM, VARIANCE
from explore.evaluation.statistics import Indices, moment_statistic
from explore.model.quantities import FloatArray, SampledMetric, Signal
from explore.model.request import Request

#: Angle over which the slope of a signal is taken, rad.
_STEP = 1e-8
#: Largest error of an end, rad, over that of the lengths of both strokes, relative: that of equal strokes.
_ANGLE = 0.5 * math.pi


def bound_ends(
    request: Request,
    metrics: Sequence[SampledMetric],
    slots: Sequence[Indices],
    statistics: FloatArray,
    constants: FloatArray,
) -> FloatArray:
    """Bounds of the errors of statistics over a stroke by the errors of its ends, relative, shape (m, u).

    The metrics have one window; `slots` are the rows of each in `statistics`. What follows from the lengths of strokes
    alone is not counted.
    """
    mechanism = request.kernel
    window = WindowPositions(mechanism, constants, metrics[0].window, request.drive)
    step = math.tan(0.5 * _STEP)
    ends = np.array([window.start.tangents, window.stop.tangents])
    places = np.concatenate([ends, (ends + step) / (1.0 - ends * step)])
    samples = sample_signals(mechanism, constants, [metric.signal for metric in metrics], places, 0)
    slopes = np.abs(samples[2:] - samples[:2]).max(axis=0) / _STEP
    result = np.empty(slopes.shape)
    for k, (metric, own) in enumerate(zip(metrics, slots, strict=True)):
        with np.errstate(divide="ignore", invalid="ignore"):  # of signals that are 0
            excess = _excess(metric.signal, own, statistics, np.abs(samples[:2, k]).max(axis=0), slopes[k])
            if not metric.signal.is_magnitude:
                excess = np.fmax(excess, _excess_of_spread(request, metric, own, statistics, samples[:2, k]))
        result[k] = np.where(np.isfinite(excess), constants[mechanism.closed_error_row] * excess, 0.0)
    return result


def _excess(signal: Signal, slots: Indices, statistics: FloatArray, value: FloatArray, slope: FloatArray) -> FloatArray:
    """What an error of the ends is multiplied by, from the largest value and slope there."""
    mean, variance = statistics[slots[MEAN]], statistics[slots[VARIANCE]]
    square = np.abs(mean) if signal.is_magnitude else mean**2 + variance
    largest = value if signal.is_magnitude else value**2
    excess = np.where(largest > square, largest / square, 0.0)
    extremes = [np.abs(statistics[slots[k]]) for k in (MINIMUM, MAXIMUM) if slots[k] >= 0]
    if extremes:
        excess = np.fmax(excess, _ANGLE * slope / np.fmax.reduce([*extremes, np.sqrt(square)]))
    return excess


def _excess_of_spread(
    request: Request, metric: SampledMetric, slots: Indices, statistics: FloatArray, values: FloatArray
) -> FloatArray:
    """The same of a std over the rms, and of a cv that is defined, if they are requested; `values` are of both ends.

    A std changes by half of what its variance does over it. A cv changes like its std and its mean, which may be small.
    """
    mean, variance = statistics[slots[MEAN]], statistics[slots[VARIANCE]]
    deviation = np.abs(values - mean).max(axis=0)
    of_std = 0.5 * np.fmax(deviation**2 / variance, 1.0)
    asked = {each.statistic for each in request.sampled if (each.signal, each.window) == (metric.signal, metric.window)}
    excess = np.where("std" in asked, of_std * np.sqrt(variance / (mean**2 + variance)), 0.0)
    if "cv" in asked:
        is_defined = np.isfinite(moment_statistic("cv", mean, variance, request.tolerance)) & (variance > 0.0)
        excess = np.fmax(excess, np.where(is_defined, of_std + deviation / np.abs(mean), 0.0))
    return np.where(excess > 1.0, excess, 0.0)
