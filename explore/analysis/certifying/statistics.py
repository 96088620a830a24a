"""Statistics of signals in ball arithmetic from their moments and extremes, and which stroke drives."""

from flint import arb

from explore.analysis.certifying.balls import Enclosure, UndecidedError, UnprovedError
from explore.evaluation.quadrature.windows import TIE
from explore.model.quantities import SampledMetric
from explore.model.request import Request

#: Relative rounding of the product of half-tangents by which the program tells the slow stroke.
_ROUNDING = 4e-15


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


def stroke_of(request: Request, window: str, product: arb) -> str:
    """Name of the stroke that a window is: a stroke, "drive", "return" or "clutch".

    The product is above 1 where the first stroke is the longer one, as in `quadrature.windows.orient`.
    """
    first, second = request.mechanism.strokes
    if window in (first, second):
        return window
    drive = request.drive
    if drive in ("slow", "fast"):
        excess = product - 1 - arb(TIE)
        if not abs(excess) > _ROUNDING:
            raise UnprovedError("both strokes take the same time but for rounding, so which of them is slow")
        drive = first if (excess > 0) == (drive == "slow") else second
    is_return = window == "return"
    return drive if not is_return else second if drive == first else first
