"""Derived metrics: pure functions of other metrics and parameters, with bounds of their errors.

The error bound is the largest change of the value when one input moves up or down by its own bound, summed over the
inputs, plus the rounding of the function. For smooth functions it is a bound to first order. For a formula that selects
one of its inputs it is the largest change, not the sum. That of a formula that a user writes is propagated through its
operations (`explore.evaluation.propagation`). Parameters and closed-form metrics count as exact. A parameter that a
design does not give is NaN.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from explore.evaluation.propagation import Bounded, propagate
from explore.model.columns import Arrays
from explore.model.expressions import Expression
from explore.model.quantities import OMITTED, AnyMetric, DerivedMetric, FloatArray, Formula, Parameter, SampledMetric
from explore.model.request import Request

#: Rounding of a formula of a few operations, relative.
_ROUNDING = 1e-15


def derive(
    request: Request,
    inputs: Arrays,
    values: Mapping[str, FloatArray],
    errors: Mapping[str, FloatArray],
    tolerance: FloatArray | float,
) -> tuple[dict[str, FloatArray], FloatArray]:
    """The derived metrics of n designs by name, and the largest of their relative error bounds, each of shape (n,).

    `inputs` are all parameters, `values` the closed-form and sampled metrics, `errors` bounds of the absolute errors of
    the sampled ones, `tolerance` what no relative bound of a design exceeds.
    """
    derivation = Derivation(inputs, values, errors, tolerance)
    metrics: dict[str, FloatArray] = {}
    largest = np.zeros(len(next(iter(inputs.values()))))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for metric in request.derived:
            value, error, scale = derivation.evaluate(metric)
            metrics[metric.name] = value
            relative = np.where(error == 0.0, 0.0, error / scale)
            np.maximum(largest, np.where(np.isfinite(value), relative, 0.0), out=largest)
    return metrics, largest


@dataclass
class Derivation:
    """Derived metrics of n designs, each evaluated once, from what `derive` takes."""

    inputs: Arrays
    values: Mapping[str, FloatArray]
    errors: Mapping[str, FloatArray]
    tolerance: FloatArray | float
    _evaluated: dict[str, Bounded] = field(default_factory=dict)

    def evaluate(self, metric: DerivedMetric) -> Bounded:
        """Value, bound of the absolute error and scale; where a change is undefined the bound is infinite."""
        if metric.name not in self._evaluated:
            sources = [self._input(source) for source in metric.inputs]
            function = metric.formula.function
            if isinstance(function, Expression):
                value, bound, scale = propagate(function, sources)
            else:
                value, bound = _bound_by_changes(metric.formula, function, sources)
                scale = np.abs(value)
                if metric.formula.scale:
                    scale = metric.formula.scale(*(source.value for source in sources))
                elif metric.formula.is_proportional:
                    others = (source.value for source in sources[1:])
                    scale = np.asarray(function(sources[0].scale, *others), dtype=np.float64)
            bound = np.where(np.isfinite(value), bound, 0.0)
            self._evaluated[metric.name] = Bounded(value, bound, scale)
        return self._evaluated[metric.name]

    def _input(self, source: AnyMetric | Parameter) -> Bounded:
        if isinstance(source, DerivedMetric):
            return self.evaluate(source)
        if isinstance(source, Parameter):
            column = self.inputs[source.name]
            return Bounded.exact(np.where(column == 0.0, np.nan, column) if source.zero_meaning == OMITTED else column)
        value, bound = self.values[source.name], self.errors.get(source.name)
        if bound is None:
            return Bounded.exact(value)
        # The bound is relative to a scale, such as the rms for a mean, that is at least this.
        return Bounded(value, bound, np.maximum(np.abs(value), bound / self.tolerance))


def _bound_by_changes(
    formula: Formula, function: Callable[..., npt.ArrayLike], inputs: Sequence[Bounded]
) -> tuple[FloatArray, FloatArray]:
    """Value of a function and bound of its absolute error, from the changes by inputs that move."""
    arguments = [source.value for source in inputs]

    def evaluate(*arguments: FloatArray) -> FloatArray:
        return np.asarray(function(*arguments), dtype=np.float64)

    value = evaluate(*arguments)
    total = np.zeros(value.shape)
    for k, source in enumerate(inputs):
        if not source.bound.any():
            continue
        change = np.zeros(value.shape)
        # Many inputs are magnitudes: the lower end of one that is not negative is at least 0.
        lower = arguments[k] - source.bound
        lower = np.where(arguments[k] >= 0.0, np.maximum(lower, 0.0), lower)
        for moved in (lower, arguments[k] + source.bound):
            np.maximum(change, np.abs(evaluate(*arguments[:k], moved, *arguments[k + 1 :]) - value), out=change)
        total = np.maximum(total, change) if formula.selects_one else total + change
    rounding = formula.rounding(*arguments) if formula.rounding else _ROUNDING * np.abs(value)
    return value, np.nan_to_num(total + rounding, nan=np.inf)


def has_any_of(parameters: tuple[str, ...], inputs: Arrays) -> npt.NDArray[np.bool_]:
    """Whether at least one of these parameters of each design is not 0, shape (n,)."""
    result: npt.NDArray[np.bool_] = np.any([inputs[name] != 0.0 for name in parameters], axis=0)
    return result


def required_parameters(request: Request) -> dict[tuple[str, ...], str]:
    """Groups of parameters of which each design must have one that is not 0, and the first metric that needs it."""
    groups: dict[tuple[str, ...], str] = {}
    for metric in request.all_metrics:
        for source in metric.sampled if isinstance(metric, DerivedMetric) else (metric,):
            if isinstance(source, SampledMetric) and source.signal.required_loads:
                groups.setdefault(source.signal.required_loads, metric.name)
        if isinstance(metric, DerivedMetric):
            for names in _needs(metric):
                groups.setdefault(names, metric.name)
    return groups


def _needs(metric: DerivedMetric) -> Iterator[tuple[str, ...]]:
    """Groups of parameters of which each design must have one for a derived metric and those that it names."""
    alternatives, optional = metric.formula.alternatives, metric.formula.optional
    for source in metric.inputs:
        groups: Iterable[tuple[str, ...]] = ()
        if isinstance(source, DerivedMetric):
            groups = _needs(source)
        elif isinstance(source, Parameter) and source.zero_meaning == OMITTED:
            groups = [(source.name,)]
        for names in groups:
            if not set(names) <= set(optional):
                yield names if set(names).isdisjoint(alternatives) else alternatives


def unavailable_metrics(request: Request, is_given: Callable[[str], bool]) -> list[tuple[str, str]]:
    """Metrics of the request that are undefined for all designs, each with the reason in a sentence."""
    return [
        (metric, f"{metric} needs {_join(names)}; give {'one' if len(names) > 1 else 'it'} a value that is not 0")
        for names, metric in required_parameters(request).items()
        if not any(is_given(name) for name in names)
    ]


def _join(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
