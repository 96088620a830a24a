"""Every statistic of every signal over every window, also in closed form, against dense sampling within its bound."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from explore.model.columns import Arrays
from explore.model.quantities import FloatArray, SampledMetric
from explore.testing import dense_statistics
from explore.testing.dense_statistics import Statistics
from explore.testing.subject import COMPUTED, Subject, WindowArgument, name_of

#: Tolerances of statistics, in turn; of closed forms the first.
_TOLERANCES = (1e-9, 1e-12, 1e-6)
#: Largest relative error of dense sampling that tells anything.
_DECISIVE = 1e-9
#: Least share of the statistics that dense sampling must tell.
_DECISIVE_SHARE = 0.8
#: Bound of a metric in closed form, relative: rounding, which a nearly flat linkage amplifies.
_CLOSED_FORM = 1e-10
#: Full turn, rad, that a fluctuation is an integral over.
_TURN = 2.0 * np.pi
#: Mean, over the tolerance times the rms, below which a cv is undefined.
_CV_LIMIT = 1e3


@dataclass(frozen=True)
class _Deviation:
    """A statistic beside that of dense sampling.

    The error is their difference, infinite where the value is undefined without reason; the scale is what the bound is
    relative to, in the norms of `explore.evaluation.evaluate`; the uncertainty is the bound of the error of dense
    sampling.
    """

    metric: str
    design: int
    value: float
    dense: float
    error: float
    scale: float
    bound: float
    uncertainty: float

    @property
    def excess(self) -> float:
        """The error over what is allowed."""
        allowed = self.bound * self.scale + self.uncertainty
        return 0.0 if self.error == 0.0 else self.error / allowed if allowed > 0.0 else np.inf


@dataclass(frozen=True)
class _Dense:
    """Statistics of one signal by dense sampling, and bounds of their errors."""

    values: Statistics
    errors: Statistics

    def statistic(self, name: str) -> tuple[float, float, float]:
        """A statistic, the bound of its error, and the scale that errors of it are relative to."""
        values, errors = self.values, self.errors
        rms, std = float(values.rms), float(np.sqrt(values.variance))
        # the variance below its error may be 0 or as large as both
        variance, error = float(values.variance), float(errors.variance)
        std_error = float(max(std - np.sqrt(max(variance - error, 0.0)), np.sqrt(variance + error) - std))
        match name:
            case "std":
                return std, std_error, rms
            case "rms":
                of_rms = float(abs(values.mean) * errors.mean + 0.5 * errors.variance)
                return rms, of_rms / rms if rms > 0.0 else 0.0, rms
            case "cv":
                mean = float(abs(values.mean)) or np.nan
                return std / mean, (std_error + std / mean * float(errors.mean)) / mean, std / mean
            case "peak":
                return float(values.magnitude), float(max(errors.min, errors.max)), float(values.magnitude)
            case "worst":  # of an angle and of 180 deg less it
                worst = min(values.min, 180.0 - values.max)
                return float(worst), float(max(errors.min, errors.max)), float(values.magnitude)
            case "peak_to_peak":
                return float(values.max - values.min), float(errors.max + errors.min), float(values.magnitude)
        scale = {"mean": rms, "variance": rms**2, "power_mean": float(values.power_mean)}.get(name)
        scale = _TURN * rms if name == "fluctuation" else scale
        peak = float(values.magnitude)
        return float(getattr(values, name)), float(getattr(errors, name)), peak if scale is None else scale


def wrong_statistics(subject: Subject) -> Iterator[str]:
    """A sentence for each signal and window with a statistic that is off by more than its bound."""
    compared = decisive = 0
    for window, drive in subject.windows():
        deviations = list(_deviations(subject, window, drive))
        compared += len(deviations)
        # dense sampling is accurate enough to tell a wrong value
        decisive += sum(each.uncertainty <= max(each.bound, _DECISIVE) * each.scale for _, each in deviations)
        worst: dict[str, _Deviation] = {}
        for signal, deviation in deviations:
            if signal not in worst or deviation.excess > worst[signal].excess:
                worst[signal] = deviation
        yield from (_sentence(subject, each, window, drive) for each in worst.values() if each.excess > 1.0)
    if not compared or decisive < _DECISIVE_SHARE * compared:
        yield f"dense sampling tells {decisive} of {compared} statistics; give other designs"


def _deviations(subject: Subject, window: WindowArgument, drive: str) -> Iterator[tuple[str, _Deviation]]:
    """Each computed statistic of a window beside that of dense sampling, with the name of its signal or closed form."""
    results = [
        (metric.signal.name, metric.name, metric, tolerance, subject.evaluate([metric.name], window, drive, tolerance))
        for metric in subject.sampled_metrics(window)
        for tolerance in [_tolerance_of(subject, metric)]
    ]
    for name, metric in subject.closed_forms(window):
        # with the statistic, which is not computed where the signal does not exist
        columns = subject.evaluate([name, metric.name], window, drive, _TOLERANCES[0])
        columns["error"] = np.full(len(subject), _CLOSED_FORM)
        results.append((name, name, metric, _TOLERANCES[0], columns))
    for design in range(len(subject)):
        computed = [each for each in results if each[-1]["status"][design] in COMPUTED]
        limits = subject.limits(design, window, drive) if computed else None
        if limits is None:
            continue
        values, errors = _measure(subject, design, limits)
        for key, name, metric, tolerance, result in computed:
            row = subject.signals.index(metric.signal)
            dense = _Dense(values.of(row), errors.of(row))
            yield key, _compare(name, metric.statistic, result, design, tolerance, dense)


def _tolerance_of(subject: Subject, metric: SampledMetric) -> float:
    """One of the tolerances: each signal begins with another one."""
    number = subject.signals.index(metric.signal) + metric.signal.statistics.index(metric.statistic)
    return _TOLERANCES[number % len(_TOLERANCES)]


def _measure(subject: Subject, design: int, limits: tuple[float, float]) -> tuple[Statistics, Statistics]:
    def motion(input_angle: FloatArray) -> FloatArray:
        return subject.motion(design, input_angle)

    return dense_statistics.measure(motion, dense_statistics.sample(motion, *limits))


def _compare(name: str, statistic: str, result: Arrays, design: int, tolerance: float, dense: _Dense) -> _Deviation:
    expected, uncertainty, scale = dense.statistic(statistic)
    value, bound = float(result[name][design]), float(result["error"][design])
    least = 2.0 * _CV_LIMIT * tolerance * dense.values.rms  # of means that are far enough from 0 for a cv
    if statistic == "cv" and np.isnan(value) and not abs(dense.values.mean) > least:
        expected, error, uncertainty = value, 0.0, 0.0
    else:
        error = abs(value - expected) if np.isfinite(value) else np.inf
    return _Deviation(name, design, value, expected, error, scale, bound, uncertainty)


def _sentence(subject: Subject, deviation: _Deviation, window: WindowArgument, drive: str) -> str:
    over = name_of(window) + (f" (drive {drive})" if len(subject.mechanism.drives) > 1 else "")
    relative = deviation.error / deviation.scale if deviation.scale > 0.0 else np.inf
    return (
        f"{deviation.metric} over {over} is {deviation.value!r}, by dense sampling {deviation.dense!r}: "
        f"relative error {relative:.1e}, stated bound {deviation.bound:.1e}, "
        f"for {subject.describe(deviation.design)}"
    )
