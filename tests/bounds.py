"""True errors beside their bounds, over the families of reference/families.npz and every window.

Each statistic is requested alone, so that its bound cannot hide behind a looser one.
"""

from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import norms
import numpy as np

import explore

SIGNALS = (
    "coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration",
    "coupler_angle", "rocker_angle", "transmission_angle",
)  # fmt: skip
STATISTICS = ("mean", "variance", "std", "cv", "min", "max", "peak", "peak_to_peak")
STROKES = ("overlapped_to_extended", "extended_to_overlapped")
#: Statistics that do not exist: the cv of a mean of 0.
ABSENT = {("cycle", signal, "cv") for signal in SIGNALS[:4]}
ABSENT |= {(stroke, "rocker_acceleration", "cv") for stroke in STROKES}
#: Requests over explicit intervals, and over the mechanism's own windows.
PARTS = ("moments", "extremes", "interval")
OK, TOLERANCE_NOT_MET = 1, 7
DEGREES = 180.0 / np.pi
#: Largest error of the references, where links are 1e7 times as long as others: a smaller difference counts as none,
#: also beside a bound of 0.
REFERENCE_ERROR = 4e-17


class References:
    """The stored arrays; the first axis is over the designs of all families."""

    def __init__(self):
        with np.load(Path(__file__).parent / "reference" / "families.npz") as stored:
            arrays = dict(stored)
        self.families = tuple(map(str, arrays.pop("families")))
        self.family = np.repeat(np.arange(len(self.families)), arrays["branch"].shape[1])
        for name, array in arrays.items():
            setattr(self, name, array.reshape(len(self.family), *array.shape[2:]))

    def evaluate(self, metric, tolerance, rows=slice(None), **options):
        """Values (angles in rad), bounds and statuses of one metric, shape (3, n)."""
        lengths = {name: self.lengths[rows, k] for k, name in enumerate(("crank", "coupler", "rocker", "ground"))}
        others = {name: getattr(self, name)[rows].astype(float) for name in ("branch", "phases")}
        table = explore.evaluate("crank-rocker", lengths | others, metrics=[metric], tolerance=tolerance, **options)
        values, bounds, statuses = (table[name].to_numpy(float) for name in (metric, "error", "status"))
        if "_angle_" in metric and "_cv" not in metric:
            values = values / (DEGREES**2 if "_variance" in metric else DEGREES)
        return np.array((values, bounds, statuses))


@dataclass(frozen=True)
class Bounds:
    """True errors and bounds, each of shape (requests, designs); an error is NaN where the statistic is undefined.

    `requests` names window, signal and statistic of each row; `family` is the index of the family of each design.
    """

    requests: list[tuple[str, str, str]] = field(repr=False)
    family: np.ndarray = field(repr=False)
    tolerance: float
    error: np.ndarray = field(repr=False)
    bound: np.ndarray = field(repr=False)

    def figures(self, family=None, part=None):
        """Figures of one family and one of PARTS, by default of all."""
        chosen = self._chosen(family, part)
        error, bound = self.error[chosen], self.bound[chosen]
        is_defined = ~np.isnan(error)
        error, bound = error[is_defined], bound[is_defined]
        is_missed = bound > self.tolerance
        return {
            "rows": error.size,
            "above": np.count_nonzero(error > bound),
            "worst": np.max(_ratio(error, bound)),
            "missed": np.mean(is_missed),
            "needless": np.mean(is_missed & (error <= self.tolerance)),
            # a value that is right to the last bit counts as one that errs by a tenth of it
            "median": np.median(bound / np.fmax(error, 1e-17)),
        }

    def worst(self, family=None, part=None):
        """Where the ratio of error to bound is largest: window, signal, statistic and design, counted in its family."""
        chosen = self._chosen(family, part)
        ratio = np.nan_to_num(_ratio(self.error[chosen], self.bound[chosen]), nan=-1.0, posinf=np.inf)
        request, design = np.unravel_index(np.argmax(ratio), ratio.shape)
        number = chosen[1][0, design]
        first = np.argmax(self.family == self.family[number])
        return f"{', '.join(self.requests[chosen[0][request, 0]])}, design {number - first}"

    def _chosen(self, family, part):
        """Indices of the rows and columns of a family and a part."""
        requests = [part in (None, part_of(*request)) for request in self.requests]
        designs = np.full(len(self.family), True) if family is None else self.family == family
        return np.ix_(np.flatnonzero(requests), np.flatnonzero(designs))


def _ratio(error, bound):
    """Errors over their bounds; 0 where there is no error, also beside a bound of 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(error == 0.0, 0.0, error / bound)


def part_of(window, signal, statistic):
    """The one of PARTS that a request belongs to."""
    if window == "interval":
        return window
    return "extremes" if statistic in ("min", "max", "peak", "peak_to_peak") else "moments"


def measure(references, tolerance):
    """Bounds of every statistic over every window."""
    requests, errors, bounds = [], [], []
    for request, (value, bound, status), (mean, variance, low, high) in _evaluated(references, tolerance):
        statistic = request[2]
        error = norms.worst(statistic, value, mean, variance, (low, high))
        error[error <= REFERENCE_ERROR] = 0.0
        is_undefined = np.zeros(len(error), bool)
        if statistic == "cv":
            share = np.abs(mean) / np.sqrt(mean**2 + variance)
            is_undefined = np.isnan(value) & (share < 1.001 * (1e3 * tolerance))
        # no value is an infinite error, and so is a status that contradicts the bound
        error[np.isnan(error) | (status != np.where(bound <= tolerance, OK, TOLERANCE_NOT_MET))] = np.inf
        error[is_undefined | np.isnan(mean)] = np.nan
        requests.append(request)
        errors.append(error)
        bounds.append(bound)
    return Bounds(requests, references.family, tolerance, np.array(errors), np.array(bounds))


def _evaluated(references, tolerance):
    """Yield (window, signal, statistic), the result of `evaluate`, and true mean, variance, minimum and maximum."""
    for which, window in enumerate((*STROKES, "cycle", "interval")):
        for s, signal, statistic in _requested(window, STATISTICS):
            if window == "interval":
                result = _over_intervals(references, f"{signal}_{statistic}_interval", tolerance)
            else:
                result = references.evaluate(f"{signal}_{statistic}_{window}", tolerance, window=window)
            yield (window, signal, statistic), result, references.statistics[:, which, s].T
    for window, stroke in zip(("drive", "return"), _slow_and_fast(references.interval), strict=True):
        for s, signal, statistic in _requested(window, ("mean", "variance", "max")):
            result = references.evaluate(f"{signal}_{statistic}_{window}", tolerance, window=window)
            truth = references.statistics[np.arange(len(stroke)), stroke, s]
            yield (window, signal, statistic), result, np.where(stroke[:, None] < 2, truth, np.nan).T
    for (drive, stroke), statistic in product(enumerate(STROKES), STATISTICS):
        result = references.evaluate(f"output_velocity_{statistic}", tolerance, window="clutch", drive=stroke)
        yield (f"clutch, {stroke}", "output_velocity", statistic), result, references.clutch[:, drive].T


def _requested(window, statistics):
    """Yield number and name of each signal with the statistics that exist over a window."""
    for (s, signal), statistic in product(enumerate(SIGNALS), statistics):
        if (window, signal, statistic) not in ABSENT:
            yield s, signal, statistic


def _over_intervals(references, metric, tolerance):
    """Result of `evaluate` over each design's own interval."""
    intervals, which = np.unique(references.degrees, axis=0, return_inverse=True)
    result = np.empty((3, len(which)))
    for k, (start, stop) in enumerate(intervals):
        rows = which == k
        result[:, rows] = references.evaluate(metric, tolerance, rows, window={"from": start, "to": stop})
    return result


def _slow_and_fast(interval):
    """Index of the slow and of the fast stroke; 2, the cycle, where their intervals differ by less than 1e-9.

    There the last digits of the lengths decide.
    """
    is_clear = np.abs(interval[:, 0] - interval[:, 1]) > 1e-9
    slow = np.argmax(interval[:, :2], axis=1)
    return np.where(is_clear, slow, 2), np.where(is_clear, 1 - slow, 2)
