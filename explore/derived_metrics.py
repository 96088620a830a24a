"""Derived metrics: pure functions of other metrics and parameters, and what the errors of these make of them.

The bound of a derived metric's error is what its value changes by when one input moves by its own bound, up or down,
added up over the inputs, and the rounding of the function itself: to first order in the bounds, for functions that are
smooth. A formula that selects one of its inputs has the largest change, not the sum. What a formula is told of a
parameter that is not given is NaN.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from explore.vocabulary import OMITTED, Columns, DerivedMetric, FloatArray, Parameter, Request, SampledMetric

#: Rounding of a formula of a few operations, relative.
_ROUNDING = 1e-15


def derive(
    request: Request, inputs: Columns, values: dict[str, FloatArray], errors: dict[str, FloatArray]
) -> tuple[dict[str, FloatArray], FloatArray]:
    """The derived metrics of designs.

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
    found: dict[str, FloatArray] = {}
    worst = np.zeros(len(next(iter(inputs.values()))))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for metric in request.derived:
            value, error = _derived(metric, inputs, values, errors)
            found[metric.name] = value
            relative = np.where(error == 0.0, 0.0, error / np.abs(value))
            np.maximum(worst, np.where(np.isfinite(value), relative, 0.0), out=worst)
    return found, worst


def _derived(
    metric: DerivedMetric, inputs: Columns, values: dict[str, FloatArray], errors: dict[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Value and bound of the absolute error of a derived metric; the bound is infinite where it is not known."""
    arguments: list[FloatArray] = []
    bounds: list[FloatArray | None] = []
    for each in metric.inputs:
        bound: FloatArray | None = None
        if isinstance(each, DerivedMetric):
            argument, bound = _derived(each, inputs, values, errors)
        elif isinstance(each, Parameter):
            column = inputs[each.name]
            argument = np.where((column == 0.0) & (each.zero == OMITTED), np.nan, column)
        else:
            argument, bound = values[each.name], errors.get(each.name)
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
        # what is a magnitude must not be moved below 0
        lower = np.where(arguments[k] >= 0.0, np.maximum(arguments[k] - bound, 0.0), arguments[k] - bound)
        for moved in (lower, arguments[k] + bound):
            np.maximum(change, np.abs(function(*arguments[:k], moved, *arguments[k + 1 :]) - value), out=change)
        total = np.maximum(total, change) if metric.formula.selects else total + change
    rounding = _ROUNDING * np.abs(value)
    return value, np.where(np.isfinite(value), np.nan_to_num(total + rounding, nan=np.inf), 0.0)


def given(request: Request, inputs: Columns) -> npt.NDArray[np.bool_]:
    """Which designs give the load and the sizing parameters that the request needs, shape (n,)."""
    enough = np.ones(len(next(iter(inputs.values()))), dtype=np.bool_)
    for parameters in requirements(request):
        enough &= any_given(parameters, inputs)
    return enough


def any_given(parameters: tuple[str, ...], inputs: Columns) -> npt.NDArray[np.bool_]:
    """Which designs give at least one of these parameters, shape (n,)."""
    enough: npt.NDArray[np.bool_] = np.any([inputs[name] != 0.0 for name in parameters], axis=0)
    return enough


def requirements(request: Request) -> dict[tuple[str, ...], str]:
    """Groups of parameters of which each design must give one, and the first metric that needs the group."""
    groups: dict[tuple[str, ...], str] = {}
    for metric in request.all_metrics:
        sampled = metric.sampled if isinstance(metric, DerivedMetric) else (metric,)
        for each in sampled:
            if isinstance(each, SampledMetric) and each.signal.requires:
                groups.setdefault(each.signal.requires, metric.name)
        if isinstance(metric, DerivedMetric):
            for parameter in metric.parts:
                either, optional = metric.formula.either, metric.formula.optional
                if isinstance(parameter, Parameter) and parameter.zero == OMITTED and parameter.name not in optional:
                    groups.setdefault(either if parameter.name in either else (parameter.name,), metric.name)
    return groups


def missing(request: Request, is_given: Callable[[str], bool]) -> list[tuple[str, str]]:
    """Metrics of the request that no design can have, and why, in a sentence."""
    return [
        (metric, f"{metric} needs {_words(names)}; give {'one' if len(names) > 1 else 'it'} a value that is not 0")
        for names, metric in requirements(request).items()
        if not any(is_given(name) for name in names)
    ]


def _words(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
