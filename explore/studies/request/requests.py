"""Resolve the names of a request and of objectives, and check their numbers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from explore.base.entries import read_number
from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.identity import Identity
from explore.base.suggest import closest_name, format_value, suggestion
from explore.model.mechanism import Mechanism
from explore.model.quantities import AnyMetric, DerivedMetric, GivenMetric, Metric, SampledMetric, Sense
from explore.model.request import Constraint, Objective, Request
from explore.model.window import Window
from explore.results.ranking.objectives import read_objective
from explore.studies.request.formulas import resolve_formulas
from explore.studies.request.names import find_metric, make_window

#: Smallest and largest tolerance.
TOLERANCES = (1e-13, 1e-4)
#: Number of requests that are remembered.
_MOST_REMEMBERED = 256


def make_objective(source: Request | tuple[Mechanism, Window], text: str) -> Objective:
    """Make an objective from a text such as "cv" or "swing_angle:max".

    The name is that of a metric of the request, or of the mechanism over the window, or of a parameter, which has no
    sense; ``:min`` or ``:max`` overrides the sense of the metric. Labels are no objectives.
    """
    mechanism, window = (source.mechanism, source.window) if isinstance(source, Request) else source
    formulas = {formula.name: formula for formula in source.formulas} if isinstance(source, Request) else {}

    def default_sense(name: str) -> Sense | None:
        if name in {parameter.name for parameter in mechanism.parameters}:
            return None
        metric = find_metric(mechanism, name, window, formulas)
        refuse_label(metric, "ranked")
        if isinstance(metric, GivenMetric) and metric.column.role != "metric":
            raise RequestError(f"{name} can be bounded, but not ranked")
        return metric.sense

    return read_objective(text, default_sense)


def refuse_label(metric: AnyMetric, use: str) -> None:
    """Raise for a label, which is no quantity."""
    if isinstance(metric, Metric) and metric.labels:
        raise RequestError(f"{metric.name} is a label, not a quantity, so it cannot be {use}")


@dataclass(frozen=True)
class RequestArguments:
    """The arguments of `make_request`, not yet checked."""

    metrics: object = None
    window: str | Mapping[str, object] | None = None
    drive: str | None = None
    constraints: object = None
    tolerance: object = 1e-9
    formulas: object = None


def make_request(
    mechanism: Mechanism,
    *,
    metrics: Sequence[str] | None = None,
    window: str | Mapping[str, object] | None = None,
    drive: str | None = None,
    constraints: Mapping[str, Mapping[str, object]] | None = None,
    tolerance: float = 1e-9,
    formulas: Mapping[str, Mapping[str, str]] | None = None,
) -> Request:
    """Resolve the names of a request; the arguments are those of `explore.evaluate`.

    A `RequestError` has one line ``argument: reason; suggestion`` for each problem.
    """
    names = tuple(metrics) if isinstance(metrics, list) else metrics
    texts = (*(names if isinstance(names, tuple) else ()), window or "", drive or "")
    is_plain = constraints is None and formulas is None and type(tolerance) is float
    if is_plain and isinstance(names, tuple | None) and all(type(text) is str for text in texts):
        return _plain_request(Identity(mechanism), names, window, drive, tolerance)
    return _make_request(mechanism, RequestArguments(metrics, window, drive, constraints, tolerance, formulas))


@lru_cache(_MOST_REMEMBERED)
def _plain_request(
    mechanism: Identity[Mechanism],
    metrics: tuple[str, ...] | None,
    window: str | None,
    drive: str | None,
    tolerance: float,
) -> Request:
    """A request of names and a tolerance, which is remembered."""
    arguments = RequestArguments(metrics=metrics, window=window, drive=drive, tolerance=tolerance)
    return _make_request(mechanism.of, arguments)


def _make_request(mechanism: Mechanism, arguments: RequestArguments) -> Request:
    request, problems = resolve_request(mechanism, arguments)
    if problems:
        raise RequestError(
            "\n".join(f"{'.'.join(k for k in key if isinstance(k, str))}: {text}" for key, text in problems)
        )
    return request


def resolve_request(mechanism: Mechanism, arguments: RequestArguments) -> tuple[Request, Problems]:
    """The request, and each problem with its key; the request is valid only without problems."""
    request, problems = _resolve(mechanism, arguments)
    names = [part.signal.name if isinstance(part, SampledMetric) else part.name for part in request.parts]
    specialised = mechanism.for_signals(names, needs_stroke=request.needs_stroke)
    return (request, problems) if problems or specialised is mechanism else _resolve(specialised, arguments)


def _resolve(mechanism: Mechanism, arguments: RequestArguments) -> tuple[Request, Problems]:
    problems: Problems = []
    is_interval = isinstance(arguments.window, Mapping)
    try:
        window = make_window(mechanism, arguments.window)
    except RequestError as error:
        problems.append((("window",), str(error)))
        named = [window.name for window in (mechanism.windows if is_interval else mechanism.named_windows)]
        closest = closest_name("interval" if is_interval else str(arguments.window), named)
        window = mechanism.window(closest or mechanism.default_window)  # so that the metrics can still be checked
    drives, drive = mechanism.drives, mechanism.default_drive if arguments.drive is None else arguments.drive
    if drive not in (drives or ("",)):
        hint = suggestion(str(drive), drives) if drives else f"no window of {mechanism.in_words} depends on one"
        problems.append((("drive",), f"unknown drive {format_value(drive)}; {hint}"))
    entries = _table("formulas", arguments.formulas, problems)
    names = _Names(mechanism, window, resolve_formulas(mechanism, entries, window, problems))
    metrics = _metrics(names, arguments.metrics, problems)
    constraints = _constraints(names, _table("constraints", arguments.constraints, problems), problems)
    tolerance = _tolerance(arguments.tolerance, problems)
    return Request(mechanism, metrics, constraints, window, drive, tolerance), problems


def _table(name: str, value: object, problems: Problems) -> Mapping[str, Any]:
    """A mapping from names; an empty one for None, and after noting that it is something else."""
    if isinstance(value, Mapping):
        return value
    if value is not None:
        problems.append(((name,), f"must be a dict with a name for each of them, got {format_value(value)}"))
    return {}


@dataclass(frozen=True)
class _Names:
    """What the names of a request mean."""

    mechanism: Mechanism
    window: Window
    formulas: Mapping[str, DerivedMetric]

    def find(self, name: str) -> AnyMetric:
        return find_metric(self.mechanism, name, self.window, self.formulas)


def _metrics(known: _Names, names: object, problems: Problems) -> tuple[AnyMetric, ...]:
    """The metrics by name, in the order of the names; then the formulas that are not among them."""
    if names is None:
        defaults = known.mechanism.default_metrics
        names = defaults.get(known.window.name, defaults[""])
    if not isinstance(names, Iterable):
        problems.append((("metrics",), f"must be a list of names, got {format_value(names)}"))
        return ()
    names = [names] if isinstance(names, str) else list(names)
    if not names:
        problems.append((("metrics",), "the list is empty; leave it out to compute the default metrics"))
    metrics: list[AnyMetric] = []
    for position, name in enumerate(names):
        key: KeyPath = ("metrics", position)
        if not isinstance(name, str):
            problems.append((key, f"must be a string in quotes, got {format_value(name)}"))
            continue
        try:
            metric = known.find(name)
        except RequestError as error:
            problems.append((key, str(error)))
            continue
        if name in names[:position]:
            problems.append((key, f"{name} is listed twice; remove one"))
        metrics.append(metric)
    return tuple(dict.fromkeys((*metrics, *known.formulas.values())))


def _constraints(
    known: _Names, bounds: Mapping[str, Mapping[str, object]], problems: Problems
) -> tuple[Constraint, ...]:
    """The constraints, sorted by name so that their order in the study does not change its hash."""
    constraints = []
    for name in sorted(bounds):
        if name in known.formulas and not known.formulas[name].inputs:
            continue  # a formula with a mistake of its own
        try:
            metric = known.find(name)
            refuse_label(metric, "constrained")
        except RequestError as error:
            problems.append((("constraints", name), str(error)))
            continue
        constraint = _bounds(metric, bounds[name], problems)
        if constraint is not None:
            constraints.append(constraint)
    return tuple(constraints)


def _bounds(metric: AnyMetric, bounds: object, problems: Problems) -> Constraint | None:
    """The constraint of one metric; None if its bounds are invalid."""
    key: KeyPath = ("constraints", metric.name)
    if not isinstance(bounds, Mapping) or not bounds:
        reason = f"at least one bound is needed, such as {{ max = 0.5 }}, got {format_value(bounds)}"
        problems.append((key, reason))
        return None
    limits: dict[str, float] = {}
    for side, value in bounds.items():
        if side not in ("min", "max"):
            problems.append(((*key, str(side)), f"unknown key; {suggestion(str(side), ['min', 'max'])}"))
            continue
        if (limit := read_number(value, metric.unit, (*key, side), problems)) is not None:
            limits[side] = limit
    if len(limits) < len(bounds):
        return None
    minimum, maximum = limits.get("min"), limits.get("max")
    if minimum is not None and maximum is not None and minimum > maximum:
        problems.append((key, f"min = {minimum:g} is above max = {maximum:g}, so no design can satisfy it"))
        return None
    return Constraint(metric, minimum, maximum)


def _tolerance(value: object, problems: Problems) -> float:
    low, high = TOLERANCES
    tolerance = read_number(value, "1", ("tolerance",), problems)
    if tolerance is None:
        return 1e-9
    if not low <= tolerance <= high:
        reason = (
            "rounding errors of doubles are larger"
            if tolerance < low
            else "coefficients of variation would be undefined"
        )
        problems.append((("tolerance",), f"{tolerance:g} is outside {low:g} to {high:g}: {reason}"))
    return tolerance
