"""A metric over one parameter: the runs of values at which it exists, their ends to the last bit, and its extremes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.request import Request
from explore.model.status import Status

#: Number of points of a scan: over the range evenly, over positive ranges also in equal ratios, then over each run.
_N_SCAN = 257
#: Number of points inside an interval in each step to the end of a run or to an extreme.
_N_STEP = 64
#: Difference of neighbours, relative to them and to the median, up to which it may be rounding and makes no extreme.
_NOISE = 1e-12
#: Largest number of extremes that are searched; a run with more is noise, of values that miss their tolerance.
_MOST_EXTREMES = 64
#: Statuses of designs with values.
_WITH_VALUES = (int(Status.OK), int(Status.TOLERANCE_NOT_MET))
#: Cause of the end of a run at the end of the range that was searched.
END_OF_RANGE = "end of the range"
#: Cause of the end of a run where the design is computed but the metric is not defined.
UNDEFINED = "undefined"


@dataclass(frozen=True)
class MetricOfParameter:
    """A metric of one design as a function of one of its parameters.

    The request has no constraints, which would leave designs out.
    """

    request: Request
    design: Mapping[str, float]
    parameter: str
    metric: str

    def columns(self, parameters: FloatArray) -> Arrays:
        """All columns of the designs with these values of the parameter, each (n,)."""
        inputs: Arrays = {name: np.full(len(parameters), value) for name, value in self.design.items()}
        return evaluate_columns(
            self.request, inputs | {self.parameter: np.asarray(parameters, dtype=np.float64)}
        ).columns

    def values(self, parameters: FloatArray) -> tuple[FloatArray, npt.NDArray[np.int8]]:
        """The metric, NaN where it does not exist, and the status, each (n,)."""
        columns = self.columns(parameters)
        status = columns["status"]
        values = np.asarray(columns[self.metric], dtype=np.float64)
        return np.where(np.isin(status, _WITH_VALUES) & np.isfinite(values), values, np.nan), status

    def at(self, parameter: float) -> float:
        """The metric at one value of the parameter; NaN where it does not exist."""
        return float(self.values(np.array([parameter]))[0][0])

    def cause(self, status: int) -> str:
        """Why there is no metric at a point with a status, as a label."""
        return UNDEFINED if status in _WITH_VALUES else self.request.mechanism.status_labels[status]


@dataclass(frozen=True)
class Run:
    """Neighbouring values of a parameter at all of which a metric exists, as far as a scan shows.

    The causes say why it ends at its first and at its last point: the label of a status, or `END_OF_RANGE`.
    """

    parameters: FloatArray
    values: FloatArray
    causes: tuple[str, str] = field(default=(END_OF_RANGE, END_OF_RANGE))


def find_runs(function: MetricOfParameter, start: float, stop: float, known: Sequence[float] = ()) -> list[Run]:
    """Find the runs within a range, looking also at known values of the parameter.

    Two scans find runs and extremes that are wider than a 256th of the range, of the run, or in equal ratios of a
    positive range; narrower ones may be missed.
    """
    points = [np.linspace(start, stop, _N_SCAN), np.array([value for value in known if start <= value <= stop])]
    if start > 0.0:
        points.append(np.clip(np.geomspace(start, stop, _N_SCAN), start, stop))
    scan = np.unique(np.concatenate(points))
    fine = [np.linspace(run.parameters[0], run.parameters[-1], _N_SCAN) for run in _split(function, scan)]
    runs = _split(function, np.unique(np.concatenate([scan, *fine])))
    return [_with_extremes(function, run) for run in runs]


def split_run(function: MetricOfParameter, run: Run, hole: float) -> list[Run]:
    """The parts of a run on both sides of a value of the parameter at which the metric does not exist."""
    first, *inner, last = _split(function, np.sort(np.append(run.parameters, hole)))
    return [
        replace(first, causes=(run.causes[0], first.causes[1])),
        *inner,
        replace(last, causes=(last.causes[0], run.causes[1])),
    ]


def _split(function: MetricOfParameter, parameters: FloatArray) -> list[Run]:
    """The runs among ascending points, each up to its last value with the metric."""
    values, status = function.values(parameters)
    exists = np.concatenate([[False], ~np.isnan(values), [False]])
    firsts, stops = np.flatnonzero(exists[1:] & ~exists[:-1]), np.flatnonzero(exists[:-1] & ~exists[1:])
    runs = []
    for first, stop in zip(firsts.tolist(), stops.tolist(), strict=True):
        own, found = parameters[first:stop], values[first:stop]
        causes = [END_OF_RANGE, END_OF_RANGE]
        for side, (inside, outside) in enumerate(((first, first - 1), (stop - 1, stop))):
            if 0 <= outside < len(parameters):
                end, value, code = _approach_end(
                    function, parameters[inside], parameters[outside], int(status[outside])
                )
                causes[side] = function.cause(code)
                if end != parameters[inside]:
                    place = len(own) if side else 0
                    own, found = np.insert(own, place, end), np.insert(found, place, value)
        runs.append(Run(own, found, (causes[0], causes[1])))
    return runs


def _approach_end(function: MetricOfParameter, inside: float, outside: float, status: int) -> tuple[float, float, int]:
    """The last value of the parameter with the metric, the metric there, and the status of the next number."""
    value = function.at(inside)
    while np.nextafter(inside, outside) != outside:
        steps = np.linspace(inside, outside, _N_STEP + 2)[1:-1]
        steps = steps[(steps != inside) & (steps != outside)]
        if len(steps) == 0:  # two numbers apart
            steps = np.array([np.nextafter(inside, outside)])
        values, statuses = function.values(steps)
        missing = np.flatnonzero(np.isnan(values))
        first = int(missing[0]) if len(missing) else len(steps)
        if first > 0:
            inside, value = float(steps[first - 1]), float(values[first - 1])
        if first < len(steps):
            outside, status = float(steps[first]), int(statuses[first])
    return inside, value, status


def _with_extremes(function: MetricOfParameter, run: Run) -> Run:
    """The run with a point at each of its local extremes, so that no value between two points is beyond both."""
    steps, sizes = np.diff(run.values), np.abs(run.values)
    # The median, because a metric that is 0 has rounding errors of its terms, and one with a pole has no usual size.
    noise = _NOISE * np.maximum(np.maximum(sizes[1:], sizes[:-1]), np.median(sizes))
    moves = np.flatnonzero(np.abs(steps) > noise)
    rises = (steps[moves] > 0.0).tolist()
    brackets = [*zip(moves[:-1].tolist(), (moves[1:] + 1).tolist(), rises[:-1], rises[1:], strict=True)]
    if rises and run.causes[0] == END_OF_RANGE:
        brackets.append((0, int(moves[0]) + 1, not rises[0], rises[0]))
    if rises and run.causes[1] == END_OF_RANGE:
        brackets.append((int(moves[-1]), len(steps), rises[-1], not rises[-1]))
    points = []
    turns = [bracket for bracket in brackets if bracket[2] != bracket[3]]
    if len(turns) > _MOST_EXTREMES:
        return run
    for first, last, is_before, _ in turns:
        sign = -1.0 if is_before else 1.0
        place, value = _least(function, run.parameters[first], run.parameters[last], sign)
        if (sign * (run.values[[first, last]] - value) > noise[first]).all():
            points.append((place, value))
    if not points:
        return run
    parameters = np.concatenate([run.parameters, [x for x, _ in points]])
    order = np.argsort(parameters, kind="stable")
    return Run(parameters[order], np.concatenate([run.values, [value for _, value in points]])[order], run.causes)


def _least(function: MetricOfParameter, low: float, high: float, sign: float) -> tuple[float, float]:
    """The place between two others where a metric times a sign is least, and the metric there.

    Ends are drawn in until no number is left beside the least, so that a fold is met exactly; a smooth extreme is
    flat, so that its place is only known to the root of the rounding.
    """
    while True:
        points = np.unique(np.linspace(low, high, _N_STEP + 2))
        values = function.values(points)[0]
        best = int(np.nanargmin(sign * values))
        ends = float(points[max(best - 1, 0)]), float(points[min(best + 1, len(points) - 1)])
        if ends == (low, high):
            return float(points[best]), float(values[best])
        low, high = ends
