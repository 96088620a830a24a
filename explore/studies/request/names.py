"""Find mechanisms, windows and metrics by name."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from types import MappingProxyType
from typing import Protocol

from explore.base.errors import RequestError
from explore.base.suggest import closest_name, format_value, suggestion
from explore.base.units.quantities import exact_angle, without_turns
from explore.mechanisms.linkages.table import PREFIX
from explore.mechanisms.registry import MECHANISMS
from explore.model.expressions import FUNCTIONS
from explore.model.mechanism import Mechanism
from explore.model.quantities import (
    EXTREME_STATISTICS,
    FLUCTUATION,
    OUTPUT_STATISTICS,
    STATISTICS,
    TURN_STATISTICS,
    AnyMetric,
    ComputedMetric,
    DerivedMetric,
    Formula,
    Parameter,
    SampledMetric,
    Signal,
)
from explore.model.window import Window
from explore.studies.request.points import add_points
from explore.studies.request.targets import TargetOrSection, add_target

_NO_FORMULAS: Mapping[str, DerivedMetric] = MappingProxyType({})
#: Full turn, deg.
_TURN = 360
#: Relative error of the length of a full turn whose ends were rounded.
_LENGTH_ROUNDING = Fraction(1, 10**12)
#: Ending of the names of metrics over the interval of a study.
_OVER_INTERVAL = "_interval"
#: Statistics of which smaller values are better.
_MINIMISED = {"variance", "std", "cv", "max", "peak", "rms", "peak_to_peak", "power_mean", *TURN_STATISTICS}

_LONG_NAMES = {
    "std": "standard deviation",
    "cv": "coefficient of variation",
    "min": "minimum",
    "max": "maximum",
    "peak": "largest magnitude",
    "rms": "root mean square",
    "peak_to_peak": "peak-to-peak value",
    "power_mean": "mean of power 10/3",
    FLUCTUATION: "range of the integral from the mean",
    "lagged_fluctuation": "range of the integral from what the motor gives",
    "lagged_max": "maximum of what the motor gives",
}


class DescribedLinkage(Protocol):
    """A linkage that a table describes, `explore.Linkage`."""

    @property
    def mechanism(self) -> Mechanism:
        """Its mechanism."""


#: The name of a mechanism, or a linkage.
NameOrLinkage = str | DescribedLinkage


def find_mechanism(name: NameOrLinkage, points: Sequence[str] = (), target: TargetOrSection | None = None) -> Mechanism:
    """Find a mechanism by name, or that of a linkage, with points of its floating link and a target.

    A `RequestError` suggests the closest name, or says that the mechanism cannot have these points or this target.
    """
    if hasattr(name, "mechanism"):
        return add_target(add_points(name.mechanism, points), target)
    if name not in MECHANISMS:
        raise RequestError(f"unknown mechanism {format_value(name)}; {suggestion(str(name), MECHANISMS)}")
    return add_target(add_points(MECHANISMS[name], points), target)


def make_window(mechanism: Mechanism, window: str | Mapping[str, object] | None) -> Window:
    """Find a window by name, or make that of an interval of crank angles, ``{"from": 0, "to": 90}`` in degrees."""
    if window is None:
        window = mechanism.default_window
    if isinstance(window, Mapping):
        interval = _interval(mechanism, window)
        if mechanism.limits:
            return _within(mechanism.limits, interval)
        # An interval of a full turn is that window: the same means are 0, and a rotating output has it too.
        return mechanism.whole_motion if interval.length >= _TURN * (1 - _LENGTH_ROUNDING) else interval
    windows = _named_windows(mechanism)
    if not isinstance(window, str) or window not in windows:
        if window == "interval":
            raise RequestError(f"an interval needs {mechanism.input_angle}s; give {{ from, to }} in degrees")
        hint = suggestion(str(window), [*windows, "{ from, to }"])
        raise RequestError(f"unknown window {format_value(window)}; {hint}")
    return windows[window]


def _named_windows(mechanism: Mechanism) -> dict[str, Window]:
    return {window.name: window for window in mechanism.named_windows}


def _interval(mechanism: Mechanism, bounds: Mapping[str, object]) -> Window:
    """The window between two crank angles in degrees."""
    interval = next((window for window in mechanism.windows if window.name == "interval"), None)
    if interval is None:
        named = ", ".join(_named_windows(mechanism))
        raise RequestError(f"{mechanism.in_words} has no interval windows; available: {named}")
    for name in bounds:
        if name not in ("from", "to"):
            raise RequestError(f"unknown key {format_value(name)} of an interval; give {{ from, to }}")
    if len(bounds) < 2:
        raise RequestError("an interval needs both ends; give { from, to } in degrees")
    start, stop = exact_angle(bounds["from"]), exact_angle(bounds["to"])
    if not start < stop:
        raise RequestError(f"from = {float(start):.17g} must be below to = {float(stop):.17g}; to may exceed 360")
    if stop - start > _TURN * (1 + _LENGTH_ROUNDING):
        raise RequestError(f"the interval of {float(stop - start):g} deg is longer than a turn; at most 360 deg")
    start, stop = without_turns((start, stop))
    return replace(interval, start=start, stop=stop)


def _within(limits: Window, interval: Window) -> Window:
    """An interval less the whole turns by which it lies beside a range of input angles, in which it must lie."""
    turn = limits.turns_into(interval.start, interval.stop)
    if turn is not None:
        moved = replace(interval, start=interval.start + turn, stop=interval.stop + turn)
        return limits if moved.length == limits.length else moved
    ends = [f"{float(end):.17g}" for end in (interval.start, interval.stop, limits.start, limits.stop)]
    raise RequestError("the interval from {} to {} deg leaves the range of the linkage, {} to {} deg".format(*ends))


def find_metric(
    mechanism: Mechanism, name: str, window: Window, formulas: Mapping[str, DerivedMetric] = _NO_FORMULAS
) -> AnyMetric:
    """Find a metric of a mechanism or of a study's formulas by name.

    The name is that of a closed-form, derived or given metric, ``<signal>_<statistic>`` over the study's window,
    ``<signal>_<statistic>_<window>`` over that one, or "mean", "variance" or "cv" of the output. A closed-form metric
    is of the design, in any window; where a statistic over a window would have the same name, it is the one with the
    window in its name. A `RequestError` says that it does not exist or is undefined for every design.
    """
    given = {metric.name: metric for metric in mechanism.given}
    metric = given.get(name) or formulas.get(name) or _declared_metric(mechanism, name, window)
    if metric is None:
        raise _unknown(mechanism, "metric", name, [*formulas, *mechanism.metric_names()])
    return metric


def find_input(
    mechanism: Mechanism, name: str, window: Window, formulas: Mapping[str, DerivedMetric]
) -> ComputedMetric | Parameter:
    """Find what a name in a formula means: a parameter, a formula, or a computed metric, as for `find_metric`."""
    if name in {metric.name for metric in mechanism.given}:
        raise RequestError(f"{name} comes with the designs, so a formula cannot use it")
    parameters = {parameter.name: parameter for parameter in mechanism.parameters}
    source = parameters.get(name) or formulas.get(name) or _declared_metric(mechanism, name, window)
    if source is None:
        raise _unknown(mechanism, "name", name, [*parameters, *formulas, *FUNCTIONS, "pi", *mechanism.metric_names()])
    return source


def _unknown(mechanism: Mechanism, kind: str, name: str, names: Iterable[str]) -> RequestError:
    match = closest_name(name, names)
    listed = "STUDY.toml" if mechanism.name.startswith(PREFIX) else mechanism.name
    hint = f"did you mean '{match}'?" if match else f"`explore mechanisms {listed}` lists them"
    return RequestError(f"unknown {kind} {format_value(name)}; {hint}")


def _declared_metric(mechanism: Mechanism, name: str, window: Window) -> ComputedMetric | None:
    """A computed metric that the mechanism declares, or None; see `find_metric`."""
    for closed_form in mechanism.metrics:
        if closed_form.name == name:
            return closed_form
    formula = next((formula for formula in mechanism.formulas if formula.name == name), None)
    if formula is None and window.name == "interval":
        formula = _over_interval(mechanism, name, window) if name.endswith(_OVER_INTERVAL) else None
    if formula is not None:
        return _derived(mechanism, formula, window)
    parsed = _parse(mechanism, name, window)
    if parsed is None:
        return None
    signal, statistic, metric_window = parsed
    if statistic not in signal.statistics:
        raise RequestError(
            f"{signal.name} is a magnitude, which has no {statistic}; "
            f"use {', '.join(f'{signal.name}_{other}' for other in signal.statistics)}"
        )
    _check_window(mechanism, signal, statistic, metric_window)
    if statistic == "cv" and (signal.name, metric_window.name) in mechanism.zero_mean:
        extent = "a stroke" if metric_window.needs_stroke and metric_window.kind != "turn" else "a full turn"
        raise RequestError(
            f"the mean of {signal.name} over {extent} is exactly 0, so its cv is undefined for every design; "
            f"use {signal.name}_std"
        )
    return SampledMetric(
        name,
        _unit(signal.unit, statistic),
        f"{_LONG_NAMES.get(statistic, statistic)} of {signal.long_name}, window {_describe_window(metric_window)}",
        "min" if statistic in _MINIMISED else None,
        signal,
        statistic,
        metric_window,
    )


def _over_interval(mechanism: Mechanism, name: str, window: Window) -> Formula | None:
    """The formula of a name that ends with "_interval": of extremes over the interval in place of the whole motion."""
    of_all, formulas = f"_{mechanism.whole_motion.name}", {formula.name: formula for formula in mechanism.formulas}
    formula = formulas.get(name.removesuffix(_OVER_INTERVAL))
    if formula is None:
        return None
    inputs, ends = [], tuple(f"_{statistic}{of_all}" for statistic in EXTREME_STATISTICS)
    for each in formula.inputs:
        if each.endswith(ends) or _over_interval(mechanism, f"{each}{_OVER_INTERVAL}", window):
            each = each.removesuffix(of_all) + _OVER_INTERVAL
        elif each not in {parameter.name for parameter in mechanism.parameters}:
            return None
        inputs.append(each)
    whole = " over the turn" if mechanism.whole_motion.kind == "turn" else " over the range"
    words = f"{formula.long_name.replace(whole, '')}, window {_describe_window(window)}"
    return replace(formula, name=name, long_name=words, inputs=tuple(inputs))


def _derived(mechanism: Mechanism, formula: Formula, window: Window) -> DerivedMetric:
    """The metric of a formula, its inputs resolved."""
    inputs = tuple(find_input(mechanism, name, window, _NO_FORMULAS) for name in formula.inputs)
    return DerivedMetric(formula.name, formula.unit, formula.long_name, formula.sense, formula, inputs)


def _describe_window(window: Window) -> str:
    if window.name != "interval":
        return window.name
    return f"{float(window.start):g} to {float(window.stop):g} deg"


def _parse(mechanism: Mechanism, name: str, window: Window) -> tuple[Signal, str, Window] | None:
    """Signal, statistic and window of the name of a sampled metric; None if the name is not of that form."""
    if name in OUTPUT_STATISTICS:
        output = mechanism.output_signals.get(window.name, mechanism.output_signals[""])
        return next(signal for signal in mechanism.signals if signal.name == output), name, window
    windows = _named_windows(mechanism)
    for signal in mechanism.signals:
        if not name.startswith(signal.name):
            continue
        for statistic in dict.fromkeys((*signal.statistics, *STATISTICS)):
            stem = f"{signal.name}_{statistic}"
            if name == stem:
                return signal, statistic, window
            if not name.startswith(stem + "_"):
                continue
            suffix = name.removeprefix(stem + "_")
            if suffix in windows:
                return signal, statistic, windows[suffix]
            if suffix == "interval" and window.name == "interval":
                return signal, statistic, window
            if suffix == "interval":
                raise RequestError(
                    f"{format_value(name)}: the window is no interval but {window.name!r}; write {stem}, or a window "
                    "{ from, to } of less than a turn"
                )
    return None


def _check_window(mechanism: Mechanism, signal: Signal, statistic: str, window: Window) -> None:
    """Raise for a signal in a window where it does not exist or jumps, and for a statistic of more than the window."""
    if statistic in TURN_STATISTICS and window.kind != "turn":
        raise RequestError(f"a {statistic} is that of a full turn; use {signal.name}_{statistic}_cycle")
    if signal.starts_anew and window.is_across_turns:
        whole = f"whole turns of the {mechanism.input_angle}"
        raise RequestError(
            f"{signal.name} begins again at {whole}, one of which is within the interval; divide it there"
        )
    signals_in_window = [other.name for other in mechanism.signals if window.name in other.only_in]
    if signal.only_in and window.name not in signal.only_in:
        only = signal.only_in[0]
        raise RequestError(
            f"{signal.name} exists only in the window '{only}'; "
            f'use {signal.name}_{statistic}_{only} or set window = "{only}"'
        )
    if signals_in_window and signal.name not in signals_in_window:
        raise RequestError(
            f"the window '{window.name}' has only {', '.join(signals_in_window)}, not {signal.name}; "
            f"name another window, such as {signal.name}_{statistic}_{mechanism.default_window}"
        )


def _unit(unit: str, statistic: str) -> str:
    """Unit of a statistic of a signal."""
    if statistic == "cv":
        return "1"
    return _squared(unit) if statistic == "variance" else unit


def _squared(unit: str) -> str:
    """The unit squared: "rad/s^2" gives "rad^2/s^4"."""
    if unit in ("", "1"):
        return unit

    def square(factor: str) -> str:
        name, _, power = factor.partition("^")
        return f"{name}^{2 * int(power or 1)}"

    return "/".join(" ".join(square(factor) for factor in part.split(" ")) for part in unit.split("/"))
