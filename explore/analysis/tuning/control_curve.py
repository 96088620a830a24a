"""The control curve of a design: its metrics over one parameter, and where one of them is within a range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from explore.analysis.tuning.curves import MetricOfParameter, Run, find_runs
from explore.analysis.tuning.intervals import End, Interval, find_intervals, find_reach
from explore.base.errors import MotionError, RequestError
from explore.base.suggest import suggestion
from explore.base.units.quantities import quantity
from explore.base.units.shown import PLAIN, Scale, headings, in_units
from explore.model.mechanism import Mechanism
from explore.model.quantities import Metric, Parameter
from explore.model.request import Request
from explore.studies.request.names import find_mechanism
from explore.studies.request.parameters import parameter_columns
from explore.studies.request.requests import make_request
from explore.studies.request.targets import TargetOrSection

if TYPE_CHECKING:
    import pandas as pd

    from explore.studies.config.linkage import Linkage

#: Largest value that is searched, over the largest parameter of the design with the same unit.
_WIDEST = 10.0
#: Smallest positive value that is searched, over the largest.
_NARROWEST = 1e-6
#: Number of rows of the curve that are evenly spread over the intervals.
_N_EVEN = 101


@dataclass(frozen=True, repr=False)
class Tuning:
    """The control curve of a design.

    Attributes
    ----------
    curve
        The parameter, ascending, the metrics, ``error``, the bound on their relative errors, and ``piece``, the number
        of the run: between two runs the metric does not exist. ``curve.attrs["units"]`` has the units, and
        ``curve.attrs["tolerance"]`` what `error` is to keep.
    intervals
        Where the metric is within its bounds, ascending; empty where it never is.
    reach
        The smallest and the largest value of the metric on the curve, and where it has them.
    parameter, metric
        Names.
    bounds
        Bounds of the metric, in its unit; infinite for none.
    design
        The other parameters of the design.
    own
        The design's own value of the parameter; NaN where it gives none.
    """

    curve: pd.DataFrame
    intervals: tuple[Interval, ...]
    reach: tuple[End, End]
    parameter: str
    metric: str
    bounds: tuple[float, float]
    design: Mapping[str, float]
    own: float

    def __repr__(self) -> str:
        ranges = ", ".join(f"{i.start.parameter!r} to {i.stop.parameter!r}" for i in self.intervals) or "nowhere"
        low, high = self.bounds
        return f"<Tuning: {self.metric} from {low:g} to {high:g} with {self.parameter} {ranges}>"

    def in_units(self, scales: Mapping[str, Scale]) -> Tuning:
        """The same in shown units; names in `design` have their unit where it is not the declared one."""
        place, amount = scales.get(self.parameter, PLAIN), scales.get(self.metric, PLAIN)
        named = headings(scales, self.design)
        low, high = self.bounds

        def show_end(end: End) -> End:
            return replace(end, parameter=place.show(end.parameter), value=amount.show(end.value))

        return replace(
            self,
            curve=in_units(self.curve, scales),
            intervals=tuple(Interval(show_end(each.start), show_end(each.stop)) for each in self.intervals),
            reach=(show_end(self.reach[0]), show_end(self.reach[1])),
            bounds=(amount.show(low), amount.show(high)),
            design={named.get(name, name): scales.get(name, PLAIN).show(value) for name, value in self.design.items()},
            own=place.show(self.own),
        )


def tune(
    mechanism: str | Linkage,
    design: Mapping[str, float | str],
    *,
    parameter: str,
    metric: str,
    low: float | str | None = None,
    high: float | str | None = None,
    start: float | str | None = None,
    stop: float | str | None = None,
    also: Sequence[str] | str = (),
    window: str | Mapping[str, float | str] | None = None,
    drive: str | None = None,
    formulas: Mapping[str, Mapping[str, str]] | None = None,
    points: Sequence[str] | str = (),
    target: TargetOrSection | None = None,
    tolerance: float = 1e-12,
) -> Tuning:
    """Vary one parameter of a design, and find where a metric is within a range.

    The range is scanned at a few hundred values, and again where the mechanism moves; every change of sign between two
    of them is followed to the last digits by TOMS 748. So all intervals are found that are wider than a step of the
    scan, also of a metric that rises and falls.

    Parameters
    ----------
    mechanism
        Name, as listed by `list_mechanisms`, or a `Linkage`.
    design
        Parameters by name, in declared units or as strings with a unit; the varied one may be missing.
    parameter
        The parameter to vary.
    metric
        The metric whose value is wanted.
    low, high
        The smallest and the largest wanted value, in the unit of the metric or as strings with a unit; equal for one
        value, None for no bound.
    start, stop
        Ends of the range of the parameter to search; by default up to ten times the largest parameter of the design
        with the same unit.
    also
        More metrics of the curve.
    window, drive, formulas, points, target
        As of `evaluate`.
    tolerance
        Bound on the error of sampled metrics, as of `evaluate`; the ends of intervals are as exact as the metric.

    Returns
    -------
    Tuning

    Raises
    ------
    RequestError
        If a name, a bound or the range is invalid.
    MotionError
        If the metric exists nowhere in the range.
    """
    declared = find_mechanism(mechanism, [points] if isinstance(points, str) else points, target)
    varied = _find_parameter(declared, parameter)
    names = list(dict.fromkeys([metric, *([also] if isinstance(also, str) else also)]))
    request = make_request(declared, metrics=names, window=window, drive=drive, formulas=formulas, tolerance=tolerance)
    bounds = _read_bounds(request, metric, low, high)
    others, known = _read_design(declared, design, parameter)
    first, last = _read_range(varied, declared, {**others, **known}, start, stop)
    function = MetricOfParameter(request, others, parameter, metric)
    runs = find_runs(function, first, last, list(known.values()))
    if not runs:
        code = int(function.values(np.array([(first + last) / 2.0]))[1][0])
        raise MotionError(
            f"{metric} exists for no {parameter} from {first:g} to {last:g} {varied.unit}: "
            f"{declared.status_sentences[declared.status_labels[code]]}"
        )
    intervals, runs = find_intervals(function, runs, *bounds)
    curve = _make_curve(function, runs, intervals, names)
    units = {m.name: m.unit for m in request.all_metrics}
    curve.attrs["units"] = {parameter: varied.unit, **{name: units[name] for name in names}, "error": "1", "piece": "1"}
    curve.attrs["tolerance"] = tolerance
    return Tuning(
        curve, tuple(intervals), find_reach(runs), parameter, metric, bounds, others, known.get(parameter, math.nan)
    )


def _find_parameter(mechanism: Mechanism, name: str) -> Parameter:
    """The parameter of a name that can be varied continuously."""
    declared = {p.name: p for p in mechanism.parameters}
    if name not in declared:
        raise RequestError(f"{mechanism.in_words} has no parameter '{name}'; {suggestion(name, declared)}")
    if declared[name].choices:
        values = ", ".join(f"{value:g}" for value in declared[name].choices)
        raise RequestError(f"{name} has only the values {values}, so it cannot be varied continuously; sweep it")
    return declared[name]


def _read_bounds(request: Request, name: str, low: float | str | None, high: float | str | None) -> tuple[float, float]:
    metric = next(m for m in request.all_metrics if m.name == name)
    if isinstance(metric, Metric) and metric.labels:
        raise RequestError(f"{name} is a label, not a quantity, so it cannot be tuned")
    smallest = -math.inf if low is None else _quantity("low", low, metric.unit)
    largest = math.inf if high is None else _quantity("high", high, metric.unit)
    if smallest > largest:
        raise RequestError(f"`low` = {smallest:g} is above `high` = {largest:g}")
    return smallest, largest


def _quantity(name: str, value: float | str, unit: str) -> float:
    try:
        return quantity(value, unit)
    except RequestError as error:
        raise RequestError(f"`{name}`: {error}") from None


def _read_design(
    mechanism: Mechanism, design: Mapping[str, float | str], parameter: str
) -> tuple[dict[str, float], dict[str, float]]:
    """The other parameters, and the varied one where the design has it."""
    stand_in = {parameter: math.nan} if parameter not in design else {}
    columns = parameter_columns(mechanism, {**design, **stand_in})
    if any(len(column) != 1 for column in columns.values()):
        raise RequestError("tune takes one design")
    values = {name: float(column[0]) for name, column in columns.items()}
    own = values.pop(parameter)
    for name, value in values.items():
        if not mechanism.parameter(name).allows(value):
            raise RequestError(f"{name} = {value:g} is not an allowed value of {mechanism.in_words}")
    return values, {} if math.isnan(own) else {parameter: own}


def _read_range(
    parameter: Parameter,
    mechanism: Mechanism,
    design: Mapping[str, float],
    start: float | str | None,
    stop: float | str | None,
) -> tuple[float, float]:
    """The range of the parameter to search."""
    values = {p.name: p.default for p in mechanism.parameters if p.default is not None} | dict(design)
    like = [abs(value) for name, value in values.items() if mechanism.parameter(name).unit == parameter.unit]
    widest = _WIDEST * max(like, default=0.0)
    largest = min(parameter.upper, widest) if stop is None else _quantity("stop", stop, parameter.unit)
    smallest = max(parameter.lower, -widest)
    if parameter.lower >= 0.0:
        smallest = max(parameter.lower, _NARROWEST * largest)
    if start is not None:
        smallest = _quantity("start", start, parameter.unit)
    if widest == 0.0 and None in (start, stop):
        raise RequestError(f"{parameter.name} is 0 here, which says no range to look at; give `start` and `stop`")
    if not smallest < largest:
        raise RequestError(
            f"the range of {parameter.name} from {smallest:g} to {largest:g} is empty; give `start` and `stop`"
        )
    return smallest, largest


def _make_curve(
    function: MetricOfParameter, runs: Sequence[Run], intervals: Sequence[Interval], names: Sequence[str]
) -> pd.DataFrame:
    """A table of the runs, with rows at the ends of the intervals and evenly spread between the first and the last."""
    import pandas as pd

    ends = np.array([end.parameter for interval in intervals for end in (interval.start, interval.stop)])
    if len(ends):
        ends = np.concatenate([ends, np.linspace(ends[0], ends[-1], _N_EVEN)])
    pieces = []
    for number, run in enumerate(runs):
        within = ends[(ends >= run.parameters[0]) & (ends <= run.parameters[-1])]
        points = np.unique(np.concatenate([run.parameters, within]))
        columns = function.columns(points)
        shown = (function.parameter, *names, "error")
        pieces.append(pd.DataFrame({name: columns[name] for name in shown}).assign(piece=number))
    return pd.concat(pieces, ignore_index=True)
