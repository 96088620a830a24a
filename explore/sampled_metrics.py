"""Sampled metrics: what a request asks of the compiled loop, and its statistics in the units of the signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore import quadrature, sampling
from explore import statistics as ask
from explore.vocabulary import FloatArray, Request, SampledMetric, Signal, Status

_ASKED = {"cv": ask.CV, "std": ask.STD, "min": ask.EXTREMES, "max": ask.EXTREMES, "peak_to_peak": ask.EXTREMES}
_BOTH = (sampling.MINIMUM, sampling.MAXIMUM)
_EXTREMES = {"min": _BOTH[:1], "max": _BOTH[1:], "peak_to_peak": _BOTH}
_POWERS = {"mean": sampling.ROOT_MEAN, "power_mean": sampling.ROOT_POWER_MEAN}
_DEGREES = 180.0 / np.pi
#: How much sharper the inputs of derived metrics are sampled, because formulas multiply errors: a life by 10/3.
_SHARPER = 0.02


@dataclass
class Sampled:
    """Statistics of distinct geometries for unit speed, each of shape (u,).

    `values` are the metrics in their signals' units, `errors` the bounds of their absolute errors; `nodes` counts
    signal evaluations, `error` bounds the worst relative error, and `evaluations` counts the geometries sampled.
    """

    values: dict[str, FloatArray]
    errors: dict[str, FloatArray]
    nodes: npt.NDArray[np.int64]
    error: FloatArray
    evaluations: int = 0

    @classmethod
    def nothing(cls, count: int) -> Sampled:
        """What is known of so many geometries when nothing is sampled."""
        return cls({}, {}, np.zeros(count, dtype=np.int64), np.zeros(count))


def sample_metrics(
    request: Request, kernel: FloatArray, singular: FloatArray, noise: FloatArray, status: npt.NDArray[np.int8]
) -> Sampled:
    """The sampled metrics of the designs whose status is OK; updates the status.

    The arguments are those of `explore.vocabulary.Mechanism.closed_form`.
    """
    mechanism, metrics = request.mechanism, request.sampled
    windows = tuple(dict.fromkeys(metric.window for metric in metrics))
    shape = (len(windows), mechanism.signal_rows)
    needs = np.zeros(len(windows), dtype=np.int64)
    asked, orders = np.zeros(shape, dtype=np.int64), np.full(shape, 2, dtype=np.int64)
    slots, terms = np.full((*shape, sampling.STATISTICS), -1, dtype=np.int64), np.full(shape[1], -1, dtype=np.int64)
    bounded = {s for derived in request.derived for s in derived.sampled}
    used = 0
    for metric in metrics:
        w, signal = windows.index(metric.window), metric.signal
        needs[w] |= signal.needs
        asked[w, signal.row] |= ask.MOMENTS | _asked(metric)
        orders[w, signal.row] = signal.pole_order
        terms[signal.row] = signal.terms
        if signal.terms >= 0:
            asked[w, signal.terms] |= ask.TERMS
        own_bound = (sampling.BOUND,) if metric in bounded else ()
        for k in (sampling.MEAN, sampling.VARIANCE, *_statistics(metric), *own_bound):
            if slots[w, signal.row, k] < 0:
                slots[w, signal.row, k], used = used, used + 1
    tolerance = request.tolerance * (_SHARPER if request.derived else 1.0)
    found = np.full((used, len(kernel)), np.nan)
    known, active = Sampled.nothing(len(kernel)), status == Status.OK
    sampling.sample(
        mechanism.fill, mechanism.pieces, kernel, singular, noise, active,
        np.array([window.code for window in windows]), np.array([(window.start, window.stop) for window in windows]),
        mechanism.drives[request.drive], needs, asked, orders, terms, tolerance,
        *quadrature.rules(), slots, found, known.nodes, known.error,
    )  # fmt: skip
    known.evaluations = int(np.count_nonzero(active))
    status[active & ~(known.error <= request.tolerance)] = Status.TOLERANCE_NOT_MET
    status[active & ~np.isfinite(found).all(axis=0)] = Status.NOT_FINITE
    for metric in metrics:
        at = slots[windows.index(metric.window), metric.signal.row]
        known.values[metric.name] = _statistic(metric, found, at, request.tolerance)
        if metric in bounded:
            known.errors[metric.name] = _error(metric, found, at, known.values[metric.name])
    return known


def _asked(metric: SampledMetric) -> int:
    """What is asked of the row of a metric's signal beside its moments."""
    if not metric.signal.magnitude:
        return _ASKED.get(metric.statistic, 0) | (ask.REST if metric.signal.rest else 0)
    return ask.SQUARES | (ask.EXTREMES if metric.statistic == "max" else 0)


def _statistics(metric: SampledMetric) -> tuple[int, ...]:
    """Which statistics beside the moments a metric is made of. The sign of a rectified signal swaps its extremes."""
    if metric.signal.magnitude and metric.statistic in _POWERS:
        return (_POWERS[metric.statistic],)
    return _BOTH if metric.signal.rectified and metric.statistic in _EXTREMES else _EXTREMES.get(metric.statistic, ())


def _statistic(metric: SampledMetric, found: FloatArray, at: npt.NDArray[np.int64], tolerance: float) -> FloatArray:
    """A statistic for unit speed in the signal's unit, shape (u,); ``found[at]`` are those of `explore.sampling`."""
    mean, variance, factor = found[at[sampling.MEAN]], found[at[sampling.VARIANCE]], unit_factor(metric.signal)
    value: FloatArray
    if metric.signal.magnitude:
        return _of_magnitude(metric.statistic, found, at)
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
            value = found[at[_EXTREMES[metric.statistic][0]]]
        case _:
            low, high = found[at[sampling.MINIMUM]], found[at[sampling.MAXIMUM]]
            if metric.signal.rectified:
                low, high = np.where(mean < 0.0, -high, low), np.where(mean < 0.0, -low, high)
                low = np.maximum(low, 0.0)
            value = {"min": low, "max": high, "peak_to_peak": high - low}[metric.statistic]
    return value if factor == 1.0 else value * factor


def _of_magnitude(statistic: str, found: FloatArray, at: npt.NDArray[np.int64]) -> FloatArray:
    """A statistic of a magnitude, of whose row the moments and the maximum are those of its square."""
    match statistic:
        case "mean":
            value = found[at[sampling.ROOT_MEAN]]
        case "power_mean":
            value = found[at[sampling.ROOT_POWER_MEAN]] ** 0.3
        case "max":
            value = np.sqrt(found[at[sampling.MAXIMUM]])
        case _:
            value = np.sqrt(found[at[sampling.MEAN]])
    return np.asarray(value)


def _error(metric: SampledMetric, found: FloatArray, at: npt.NDArray[np.int64], value: FloatArray) -> FloatArray:
    """Bound of the absolute error of a metric for unit speed: its relative bound times what that is relative to."""
    bound, mean, variance = (found[at[k]] for k in (sampling.BOUND, sampling.MEAN, sampling.VARIANCE))
    factor = unit_factor(metric.signal)
    if metric.signal.magnitude or metric.statistic == "cv":
        return np.asarray(bound * np.abs(value))
    rms = np.sqrt(mean * mean + variance)
    if metric.statistic == "variance":
        return np.asarray(bound * (rms * factor) ** 2)
    # Neither extreme is known to be the largest; where none is larger than the rms, the rms is nearly the largest.
    return np.asarray(bound * np.maximum(rms * factor, np.abs(value)))


def unit_factor(signal: Signal) -> float:
    """What turns the kernel's radians into the signal's unit."""
    return float(_DEGREES) if signal.unit == "deg" else 1.0
