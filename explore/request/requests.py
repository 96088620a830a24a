"""The request and the objectives of a study: names become objects here and in `names`, nowhere below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from explore.errors import RequestError
from explore.request.names import find_mechanism, find_metric, likely_window, make_window
from explore.request.units import quantity
from explore.suggest import shown, suggestion
from explore.vocabulary import AnyMetric, Constraint, Mechanism, Metric, Objective, Request, Sense, Window

__all__ = ["Wanted", "find_mechanism", "find_metric", "make_objective", "make_request", "resolve"]

#: Tolerances that can be asked for.
TOLERANCES = (1e-13, 1e-4)

Key = tuple[str | int, ...]
Problems = list[tuple[Key, str]]


def make_objective(source: Request | tuple[Mechanism, Window], text: str) -> Objective:
    """An aim of a ranking, as in "cv" or "swing_angle:max".

    Parameters
    ----------
    source
        The request of the study, or its mechanism and window.
    text
        A metric; ``:min`` or ``:max`` overrides its own sense.

    Raises
    ------
    RequestError
        When the metric does not exist, is a label or has no sense of its own and none is given.
    """
    mechanism, window = (source.mechanism, source.window) if isinstance(source, Request) else source
    name, colon, written = text.partition(":")
    name, written = name.strip(), written.strip()
    if name in {parameter.name for parameter in mechanism.parameters}:
        raise RequestError(f"{name} is a parameter, and only metrics can be ranked")
    metric = find_metric(mechanism, name, window)
    _refuse_label(metric, "ranked")
    if colon and written not in ("min", "max"):
        raise RequestError(f"unknown sense {shown(written)} of {name}; write {name}:min or {name}:max")
    sense: Sense | None = ("max" if written == "max" else "min") if colon else metric.sense
    if sense is None:
        raise RequestError(f"neither small nor large {name} is better as such; write {name}:min or {name}:max")
    return Objective(name, sense)


def _refuse_label(metric: AnyMetric, done: str) -> None:
    if isinstance(metric, Metric) and metric.labels:
        raise RequestError(f"{metric.name} is a label, not a quantity, so it cannot be {done}")


@dataclass(frozen=True)
class Wanted:
    """What is asked for, in words: the arguments of `make_request`."""

    metrics: Sequence[object] | None = None
    window: str | Mapping[str, object] | None = None
    drive: str | None = None
    constraints: Mapping[str, Mapping[str, object]] | None = None
    tolerance: object = 1e-9


def make_request(
    mechanism: Mechanism,
    metrics: Sequence[str] | None = None,
    window: str | Mapping[str, object] | None = None,
    drive: str | None = None,
    constraints: Mapping[str, Mapping[str, object]] | None = None,
    tolerance: float = 1e-9,
) -> Request:
    """The request of these names.

    Parameters
    ----------
    mechanism
        Whose designs.
    metrics
        Names of the columns; None for the mechanism's own list.
    window
        Part of the turn that statistics run over, or ``{"from": 0, "to": 90}`` (deg).
    drive
        Which stroke the window "drive" is.
    constraints
        ``{"min": …, "max": …}`` by metric, in its unit or as a text with a unit.
    tolerance
        Wanted error of the sampled metrics, relative as `explore.evaluate` states.

    Raises
    ------
    RequestError
        One line for each problem found.
    """
    request, problems = resolve(mechanism, Wanted(metrics, window, drive, constraints, tolerance))
    if problems:
        raise RequestError(
            "\n".join(f"{'.'.join(k for k in key if isinstance(k, str))}: {text}" for key, text in problems)
        )
    return request


def resolve(mechanism: Mechanism, wanted: Wanted) -> tuple[Request, Problems]:
    """The request, and every problem met with the key it belongs to; use the request only when there are none."""
    problems: Problems = []
    try:
        window = make_window(mechanism, wanted.window)
    except RequestError as error:
        problems.append((("window",), str(error)))
        window = likely_window(mechanism, wanted.window)
    drive = mechanism.default_drive if wanted.drive is None else wanted.drive
    if drive not in mechanism.drives:
        problems.append((("drive",), f"unknown drive {shown(drive)}; {suggestion(str(drive), mechanism.drives)}"))
    metrics = _metrics(mechanism, wanted.metrics, window, problems)
    constraints = _constraints(mechanism, wanted.constraints or {}, window, problems)
    tolerance = _tolerance(wanted.tolerance, problems)
    return Request(mechanism, metrics, constraints, window, drive, tolerance), problems


def _metrics(
    mechanism: Mechanism, names: Sequence[object] | None, window: Window, problems: Problems
) -> tuple[AnyMetric, ...]:
    """The metrics of the columns, each once."""
    if names is None:
        names = mechanism.default_metrics.get(window.name, mechanism.default_metrics[""])
    names = [names] if isinstance(names, str) else list(names)
    if not names:
        problems.append(
            (("metrics",), "an empty list leaves nothing to compute; leave the key out for the usual metrics")
        )
    found: list[AnyMetric] = []
    for position, name in enumerate(names):
        key: Key = ("metrics", position)
        if not isinstance(name, str):
            problems.append((key, f"must be a text in quotes, got {shown(name)}"))
            continue
        try:
            metric = find_metric(mechanism, name, window)
        except RequestError as error:
            problems.append((key, str(error)))
            continue
        if metric in found:
            problems.append((key, f"{name} is listed twice; remove one"))
        found.append(metric)
    return tuple(found)


def _constraints(
    mechanism: Mechanism, bounds: Mapping[str, Mapping[str, object]], window: Window, problems: Problems
) -> tuple[Constraint, ...]:
    """The constraints by name, so that the order in which they are written changes nothing."""
    found = []
    for name in sorted(bounds):
        try:
            metric = find_metric(mechanism, name, window)
            _refuse_label(metric, "constrained")
        except RequestError as error:
            problems.append((("constraints", name), str(error)))
            continue
        constraint = _bounds(metric, bounds[name], problems)
        if constraint is not None:
            found.append(constraint)
    return tuple(found)


def _bounds(metric: AnyMetric, bounds: object, problems: Problems) -> Constraint | None:
    """The constraint of one metric; None when its bounds are wrong."""
    key: Key = ("constraints", metric.name)
    if not isinstance(bounds, Mapping) or not bounds:
        problems.append((key, "at least one bound is needed; write { min = … }, { max = … } or both"))
        return None
    sides: dict[str, float] = {}
    for side, value in bounds.items():
        if side not in ("min", "max"):
            problems.append(((*key, str(side)), f"unknown key; {suggestion(str(side), ['min', 'max'])}"))
            continue
        try:
            sides[side] = quantity(value, metric.unit)
        except RequestError as error:
            problems.append(((*key, str(side)), str(error)))
    if len(sides) < len(bounds):
        return None
    minimum, maximum = sides.get("min"), sides.get("max")
    if minimum is not None and maximum is not None and minimum > maximum:
        problems.append((key, f"min = {minimum:g} is above max = {maximum:g}, so no design can satisfy it"))
        return None
    return Constraint(metric, minimum, maximum)


def _tolerance(value: object, problems: Problems) -> float:
    low, high = TOLERANCES
    try:
        tolerance = quantity(value, "1")
    except RequestError as error:
        problems.append((("tolerance",), str(error)))
        return 1e-9
    if not low <= tolerance <= high:
        reason = (
            "rounding errors of doubles are larger"
            if tolerance < low
            else "coefficients of variation would be undefined"
        )
        problems.append((("tolerance",), f"{tolerance:g} is outside {low:g} to {high:g}: {reason}"))
    return tolerance
