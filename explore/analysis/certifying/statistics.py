"""Statistics of signals in ball arithmetic from their moments and extremes."""

from flint import arb

from explore.analysis.certifying.balls import Enclosure, UndecidedError
from explore.model.quantities import SampledMetric


def from_moments(statistic: str, mean: arb, square: arb, tolerance: float) -> Enclosure | None:
    """A statistic from the mean of a signal and of its square; None for a cv that the tolerance leaves undefined."""
    variance = square - mean * mean
    if variance < 0:
        raise UndecidedError
    rms = square.sqrt()
    match statistic:
        case "mean":
            return Enclosure(mean, rms)
        case "variance":
            return Enclosure(variance, square)
        case "std":
            return Enclosure(variance.sqrt(), rms)
        case "rms":
            return Enclosure(rms, rms)
    return _cv(mean, variance, 1 / (1000 * arb(tolerance)) ** 2 - 1)


def _cv(mean: arb, variance: arb, limit: arb) -> Enclosure | None:
    """The coefficient of variation; None where its square is above a limit."""
    if mean.contains(0):
        if variance > limit * mean * mean:
            return None
        raise UndecidedError
    ratio = variance / (mean * mean)
    if ratio > limit:
        return None
    if not ratio < limit:
        raise UndecidedError
    return Enclosure.of(ratio.sqrt())


def from_extremes(statistic: str, low: arb, high: arb) -> Enclosure:
    """A statistic from the smallest and the largest value."""
    largest = abs(low).max(abs(high))
    value = {"min": low, "max": high, "peak": largest, "peak_to_peak": high - low}[statistic]
    return Enclosure(value, largest)


def in_its_unit(enclosure: Enclosure | None, metric: SampledMetric, speed: arb) -> Enclosure | None:
    """A statistic for unit speed in rad at another speed in the unit of its metric."""
    if enclosure is None or metric.statistic == "cv":
        return enclosure
    unit = 180 / arb.pi() if metric.signal.unit == "deg" else arb(1)
    return enclosure.times((unit * speed**metric.signal.speed_power) ** (2 if metric.statistic == "variance" else 1))


def time_ratio(stroke: arb) -> Enclosure:
    """The longer over the shorter of the intervals of a stroke and of the rest of the turn."""
    other = 2 * arb.pi() - stroke
    ratio = stroke.max(other) / stroke.min(other)
    return Enclosure(ratio, ratio * (1 + ratio) / 2)  # the intervals are as exact as a turn
