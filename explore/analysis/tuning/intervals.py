"""Where a metric is within a range: the intervals of the parameter, their ends by bracketed root finding."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.analysis.tuning.curves import MetricOfParameter, Run, split_run
from explore.model.quantities import FloatArray

#: Distance from a bound at its crossing, over the change of the metric in the step of the scan, above which it jumps.
_JUMP = 1e-6
#: Distance from a bound at its crossing, relative to the metric, up to which it may be the metric's error.
_NOISE = 1e-9
#: Distance from a bound, relative to it, up to which the metric meets it: a few roundings.
_ROUNDING = 4.0 * np.finfo(float).eps
#: Cause of the end of an interval where the metric jumps across its bound.
JUMP = "jump"


@dataclass(frozen=True)
class End:
    """An end of an interval, or the place of a smallest or largest value: the parameter, and the metric there.

    The cause is empty where the metric meets its bound or has an extreme; else why the curve ends here: the label of a
    status, `END_OF_RANGE` or `JUMP`.
    """

    parameter: float
    value: float
    cause: str = ""


@dataclass(frozen=True)
class Interval:
    """Values of a parameter from `start` to `stop`, at all of which a metric is within its bounds."""

    start: End
    stop: End


class _HoleError(Exception):
    """A value of the parameter within a run at which the metric does not exist."""

    def __init__(self, parameter: float) -> None:
        super().__init__()
        self.parameter = parameter


def find_intervals(
    function: MetricOfParameter, runs: Sequence[Run], low: float, high: float
) -> tuple[list[Interval], list[Run]]:
    """The intervals in which the metric is from `low` to `high`, ascending, and the runs, split at holes they have."""
    intervals: list[Interval] = []
    whole: list[Run] = []
    todo = list(reversed(runs))
    while todo:
        run = todo.pop()
        try:
            intervals += _intervals_of(function, run, low, high)
            whole.append(run)
        except _HoleError as hole:
            todo += reversed(split_run(function, run, hole.parameter))
    return intervals, whole


def find_reach(runs: Sequence[Run]) -> tuple[End, End]:
    """The smallest and the largest value of the metric, with the places where it has them."""
    ends = [_end(run, int(k)) for run in runs for k in (run.values.argmin(), run.values.argmax())]
    return min(ends, key=lambda end: end.value), max(ends, key=lambda end: end.value)


def _end(run: Run, place: int) -> End:
    last = len(run.parameters) - 1
    cause = run.causes[0] if place == 0 else run.causes[1] if place == last else ""
    return End(float(run.parameters[place]), float(run.values[place]), cause)


def _intervals_of(function: MetricOfParameter, run: Run, low: float, high: float) -> list[Interval]:
    cuts = {run.parameters[0]: _end(run, 0), run.parameters[-1]: _end(run, len(run.parameters) - 1)}
    for level in dict.fromkeys((low, high)):
        if np.isfinite(level):
            for root in _find_roots(function, run, level):
                cuts[root.parameter] = root if root.parameter not in cuts or not root.cause else cuts[root.parameter]
    ends = [cuts[parameter] for parameter in sorted(cuts)]
    middles = np.array([(a.parameter + b.parameter) / 2.0 for a, b in itertools.pairwise(ends)])
    values = function.values(middles)[0] if len(middles) else middles
    if np.isnan(values).any():
        raise _HoleError(float(middles[np.isnan(values)][0]))
    is_met = ((low <= values) & (values <= high)) | _meets(values, low) | _meets(values, high)
    inside = [False, *is_met.tolist(), False]
    intervals: list[Interval] = []
    for end, before, after in zip(ends, inside[:-1], inside[1:], strict=True):
        if after and not before:
            intervals.append(Interval(end, end))  # its end follows
        elif before and not after:
            intervals[-1] = Interval(intervals[-1].start, end)
        elif not before and not after and (not end.cause or (end.cause != JUMP and low <= end.value <= high)):
            intervals.append(Interval(end, end))  # a single value, perhaps rounded to outside of its bounds
    return intervals


def _meets(values: FloatArray, level: float) -> npt.NDArray[np.bool_]:
    """Whether a metric has a value, to its rounding."""
    return np.abs(values - level) <= (_ROUNDING * abs(level) if np.isfinite(level) else 0.0)


def _find_roots(function: MetricOfParameter, run: Run, level: float) -> list[End]:
    """The places where the metric has a value, or jumps across it."""
    from scipy.optimize import toms748

    def value_at(parameter: float) -> float:
        value = function.at(parameter)
        if np.isnan(value):
            raise _HoleError(parameter)
        return value

    excess = np.where(_meets(run.values, level), 0.0, run.values - level)
    # the ends of the run are known, and why it ends there
    roots = [End(float(x), level) for x in run.parameters[1:-1][excess[1:-1] == 0.0]]
    roots += [_end_of_rest(value_at, run, place, step, level) for place, step in _rests(excess)]
    for k in np.flatnonzero(np.sign(excess[:-1]) * np.sign(excess[1:]) < 0.0).tolist():
        # The smallest tolerances that it takes: roots are the numbers next to a change of sign.
        root = toms748(
            lambda x: value_at(x) - level, run.parameters[k], run.parameters[k + 1],
            xtol=np.finfo(float).tiny, rtol=4.0 * np.finfo(float).eps, maxiter=200,
        )  # fmt: skip
        roots.append(_classify(float(root), value_at(root), level, run.values[k : k + 2]))
    return roots


def _rests(excess: FloatArray) -> Iterator[tuple[int, int]]:
    """Places of points from which a metric leaves its bound after two points at it, and the steps to where it does."""
    for step in (1, -1):
        along = excess[::step] == 0.0
        for k in np.flatnonzero(along[:-2] & along[1:-1] & ~along[2:]).tolist():
            yield (k + 1 if step > 0 else len(excess) - 2 - k), step


def _end_of_rest(value_at: Callable[[float], float], run: Run, place: int, step: int, level: float) -> End:
    """The last number with the value that a metric keeps up to a place, on the way to the next one."""
    inside, outside = run.parameters[[place, place + step]].tolist()
    while (middle := inside + 0.5 * (outside - inside)) not in (inside, outside):
        is_at_rest = bool(_meets(np.asarray(value_at(middle)), level))
        inside, outside = (middle, outside) if is_at_rest else (inside, middle)
    return _classify(inside, value_at(outside), level, run.values[[place, place + step]])


def _classify(parameter: float, value: float, level: float, around: FloatArray) -> End:
    """The end at a crossing, from the values at the points of the scan around it: a pole elsewhere tells nothing."""
    least = max(_JUMP * float(np.ptp(around)), _NOISE * float(np.abs(around).max()))
    return End(parameter, value, JUMP if abs(value - level) > least else "")
