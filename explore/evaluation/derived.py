"""Derived metrics: pure functions of other metrics and parameters, with bounds of their errors.

The error bound is the largest change of the value when one input moves up or down by its own bound, summed over the
inputs, plus the rounding of the function. For smooth functions it is a bound to first order. For a formula that selects
one of its inputs it is the largest change, not the sum. A parameter that a design does not give is NaN.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from explore.model.columns import Arrays
from explore.model.quantities import OMITTED, DerivedMetric, FloatArray, Parameter, SampledMetric
from explore.model.request import Request

#: Rounding of a formula of a few operations, relative.
_ROUNDING = 1e-15


def derive(
    request: Request, inputs: Arrays, values: dict[str, FloatArray], errors: dict[str, FloatArray]
) -> tuple[dict[str, FloatArray], FloatArray]:
    """Evaluate the derived metrics of designs.

    Parameters
    ----------
    inputs
        All parameters by name, each of shape (n,).
    values, errors
        Closed-form and sampled metrics, and bounds of the absolute errors of the sampled ones, each of shape (n,).

    Returns
    -------
    tuple
        The metrics by name, and the largest of their relative error bounds, each of shape (n,).
    """
    metrics: dict[str, FloatArray] = {}
    largest = np.zeros(len(next(iter(inputs.values()))))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for metric in request.derived:
            value, error = _evaluate(metric, inputs, values, errors)
            metrics[metric.name] = value
            relative = np.where(error == 0.0, 0.0, error / np.abs(value))
            np.maximum(largest, np.where(np.isfinite(value), relative, 0.0), out=largest)
    return metrics, largest


def _evaluate(
    metric: DerivedMetric, inputs: Arrays, values: dict[str, FloatArray], errors: dict[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Value and bound of the absolute error of a derived metric; where a change is undefined the bound is infinite."""
    arguments: list[FloatArray] = []
    bounds: list[FloatArray | None] = []
    for source in metric.inputs:
        bound: FloatArray | None = None
        if isinstance(source, DerivedMetric):
            argument, bound = _evaluate(source, inputs, values, errors)
        elif isinstance(source, Parameter):
            column = inputs[source.name]
            argument = np.where((column == 0.0) & (source.zero_meaning == OMITTED), np.nan, column)
        else:
            argument, bound = values[source.name], errors.get(source.name)
        arguments.append(argument)
        bounds.append(bound)

    def function(*arguments: FloatArray) -> FloatArray:
        return np.asarray(metric.formula.function(*arguments), dtype=np.float64)

    value = function(*arguments)
    total = np.zeros(value.shape)
    for k, bound in enumerate(bounds):
        if bound is None:
            continue
        change = np.zeros(value.shape)
        # Many inputs are magnitudes: the lower end of one that is not negative is at least 0.
        lower = np.where(arguments[k] >= 0.0, np.maximum(arguments[k] - bound, 0.0), arguments[k] - bound)
        for moved in (lower, arguments[k] + bound):
            np.maximum(change, np.abs(function(*arguments[:k], moved, *arguments[k + 1 :]) - value), out=change)
        total = np.maximum(total, change) if metric.formula.selects_one else total + change
    rounding = _ROUNDING * np.abs(value)
    return value, np.where(np.isfinite(value), np.nan_to_num(total + rounding, nan=np.inf), 0.0)


def has_required_parameters(request: Request, inputs: Arrays) -> npt.NDArray[np.bool_]:
    """Whether each design has the load and the sizing parameters that the request needs, shape (n,)."""
    has_all = np.ones(len(next(iter(inputs.values()))), dtype=np.bool_)
    for parameters in required_parameters(request):
        has_all &= has_any_of(parameters, inputs)
    return has_all


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
            for parameter in metric.parts:
                alternatives, optional = metric.formula.alternatives, metric.formula.optional
                if (
                    isinstance(parameter, Parameter)
                    and parameter.zero_meaning == OMITTED
                    and parameter.name not in optional
                ):
                    groups.setdefault(
                        alternatives if parameter.name in alternatives else (parameter.name,), metric.name
                    )
    return groups


def unavailable_metrics(request: Request, is_given: Callable[[str], bool]) -> list[tuple[str, str]]:
    """Metrics of the request that are undefined for all designs, each with the reason in a sentence."""
    return [
        (metric, f"{metric} needs {_join(names)}; give {'one' if len(names) > 1 else 'it'} a value that is not 0")
        for names, metric in required_parameters(request).items()
        if not any(is_given(name) for name in names)
    ]


def _join(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
