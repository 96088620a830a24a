"""What becomes of parts that are made from a design with tolerances."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from explore.evaluation.constraints import margin
from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays, join_columns
from explore.model.quantities import FloatArray, Metric, Sense
from explore.model.request import Constraint, Objective, Request
from explore.model.status import Status
from explore.studies.request.requests import TOLERANCES
from explore.studies.request.tolerances import Tolerance

BoolArray = npt.NDArray[np.bool_]
#: Number of parts that are evaluated at once, at first and at least, where somebody watches.
_LEAST_SLICE = 16
#: Time that the parts evaluated at once are to take where somebody watches, s.
_SLICE_SECONDS = 0.25
#: Function that is told how many parts are evaluated.
_WATCH: ContextVar[Callable[[int], None] | None] = ContextVar("watch", default=None)


@contextmanager
def watching(watch: Callable[[int], None]) -> Iterator[None]:
    """Call `watch` with the number of parts after each slice of parts; what it raises ends the evaluation."""
    token = _WATCH.set(watch)
    try:
        yield
    finally:
        _WATCH.reset(token)


def _evaluate(request: Request, columns: Arrays, count: int) -> Arrays:
    """The columns of parts; no bit depends on the slices that are evaluated while somebody watches."""
    watch, start, size, slices = _WATCH.get(), 0, _LEAST_SLICE, list[Arrays]()
    if watch is None:
        return evaluate_columns(request, columns).columns
    while start < count:
        began = time.monotonic()
        part = slice(start, start + size)
        slices.append(evaluate_columns(request, {name: column[part] for name, column in columns.items()}).columns)
        watch(min(size, count - start))
        start += size
        fitting = size * _SLICE_SECONDS / max(time.monotonic() - began, 1e-9)
        size = int(min(max(fitting, _LEAST_SLICE), 4 * size))
    return join_columns(slices)


@dataclass(frozen=True)
class Outcomes:
    """Metrics of n parts, NaN where a part has no motion or the metric is undefined.

    The status of each; which parts move, so that metrics are computed; which of them meet the error bound and all
    constraints too; and which of them miss each constraint, by its metric.
    """

    metrics: Arrays
    is_assembled: BoolArray
    is_feasible: BoolArray
    status: npt.NDArray[np.int8]
    is_missed: Mapping[str, BoolArray]


@dataclass(frozen=True)
class TolerancedRequest:
    """What to compute of parts, and how their parameters deviate.

    The request is without constraints: a design that breaks one would not be sampled.
    """

    request: Request
    constraints: tuple[Constraint, ...]
    tolerances: tuple[Tolerance, ...]
    senses: Mapping[str, Sense]

    @classmethod
    def of(cls, request: Request, objectives: Sequence[Objective], tolerances: tuple[Tolerance, ...]) -> Self:
        """The request of a study whose objectives say which side of their metrics is better."""
        free = replace(request, metrics=request.all_metrics, constraints=())
        senses = {metric.name: metric.sense for metric in free.metrics if metric.sense is not None}
        names = {metric.name for metric in free.metrics}
        senses |= {objective.metric: objective.sense for objective in objectives if objective.metric in names}
        return cls(free, request.constraints, tolerances, senses)

    @property
    def exact(self) -> Self:
        """The same with metrics as exact as can be: where a closed form loses digits, it is sampled instead."""
        return replace(self, request=replace(self.request, tolerance=TOLERANCES[0]))

    @property
    def metrics(self) -> tuple[str, ...]:
        """Names of the metrics that are numbers."""
        return tuple(m.name for m in self.request.metrics if not (isinstance(m, Metric) and m.labels))

    @property
    def widths(self) -> FloatArray:
        """The tolerances' `plus_minus`, (d,)."""
        return np.array([tolerance.plus_minus for tolerance in self.tolerances])

    def draw(self, random: np.random.Generator, count: int) -> FloatArray:
        """Deviations of parts that are drawn at random, (d, count)."""
        deviations = np.empty((len(self.tolerances), count))
        for row, tolerance in zip(deviations, self.tolerances, strict=True):
            if tolerance.distribution == "uniform":
                random.random(out=row)
                np.multiply(row, 2.0 * tolerance.plus_minus, out=row)
                row -= tolerance.plus_minus
            else:
                random.standard_normal(out=row)
                row *= tolerance.std
        return deviations

    def deviations(self, normals: FloatArray) -> FloatArray:
        """Deviations whose standard normal scores are given, both (d, n)."""
        scaled = np.array([tolerance.std for tolerance in self.tolerances])[:, None] * normals
        uniform = np.array([tolerance.distribution == "uniform" for tolerance in self.tolerances])
        scaled[uniform] = self.widths[uniform, None] * (2.0 * ndtr(normals[uniform]) - 1.0)
        return scaled

    def outcomes(self, nominal: Mapping[str, float], deviations: FloatArray) -> Outcomes:
        """The metrics of parts with these deviations, (d, n), from the parameters of a design."""
        count = deviations.shape[1]
        columns: Arrays = {name: np.full(count, value) for name, value in nominal.items()}
        for tolerance, row in zip(self.tolerances, deviations, strict=True):
            columns[tolerance.parameter] = nominal[tolerance.parameter] + row
        found = _evaluate(self.request, columns, count)
        status = found["status"]
        is_ok = status == Status.OK
        is_assembled = is_ok | (status == Status.TOLERANCE_NOT_MET)
        values = {name: found[name] for name in self.metrics}
        if not is_assembled.all():
            values = {name: np.where(is_assembled, column, np.nan) for name, column in values.items()}
        is_met = {c.metric.name: margin(c, values[c.metric.name]) >= 0.0 for c in self.constraints}
        is_feasible = np.logical_and.reduce([is_ok, *is_met.values()])
        is_missed = {name: is_assembled & ~met for name, met in is_met.items()}
        return Outcomes(values, is_assembled, is_feasible, status, is_missed)
