"""What a name stands for: mechanisms, windows and metrics as a user writes them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from explore.errors import RequestError
from explore.mechanisms.registry import MECHANISMS
from explore.request.units import quantity
from explore.suggest import closest, shown, suggestion
from explore.vocabulary import (
    STATISTICS,
    AnyMetric,
    DerivedMetric,
    Formula,
    Mechanism,
    Parameter,
    SampledMetric,
    Signal,
    Window,
)  # fmt: skip

#: Statistics that may stand alone, for the output of the mechanism.
OUTPUT_STATISTICS = ("mean", "variance", "cv")
_LOW_IS_GOOD = {"variance", "std", "cv", "max", "rms", "peak_to_peak", "power_mean"}
_WORDS = {
    "std": "standard deviation",
    "cv": "coefficient of variation",
    "min": "minimum",
    "max": "maximum",
    "rms": "root mean square",
    "peak_to_peak": "peak-to-peak value",
    "power_mean": "mean of power 10/3",
}


def find_mechanism(name: str) -> Mechanism:
    """The mechanism of that name.

    Raises
    ------
    RequestError
        With the closest name, when there is none of that name.
    """
    if name not in MECHANISMS:
        raise RequestError(f"unknown mechanism {shown(name)}; {suggestion(name, MECHANISMS)}")
    return MECHANISMS[name]


def make_window(mechanism: Mechanism, window: str | Mapping[str, object] | None) -> Window:
    """The window of a name, or of an interval ``{"from": 0, "to": 90}`` of crank angles (deg); None for the usual one.

    Raises
    ------
    RequestError
        When it does not exist or makes no sense.
    """
    if window is None:
        window = mechanism.default_window
    if isinstance(window, Mapping):
        interval = _interval(mechanism, window)
        # An interval of a full turn is the cycle: the same averages vanish, and a turning output has it too.
        full = math.isclose(interval.stop - interval.start, 2.0 * math.pi, rel_tol=1e-12)
        return _named_windows(mechanism).get("cycle", interval) if full else interval
    named = _named_windows(mechanism)
    if not isinstance(window, str) or window not in named:
        if window == "interval":
            raise RequestError("an interval is given by its crank angles; write { from = 0, to = 90 }")
        hint = suggestion(str(window), [*named, "{ from = 0, to = 90 }"])
        raise RequestError(f"unknown window {shown(window)}; {hint}")
    return named[window]


def _named_windows(mechanism: Mechanism) -> dict[str, Window]:
    return {window.name: window for window in mechanism.windows if window.name != "interval"}


def _interval(mechanism: Mechanism, bounds: Mapping[str, object]) -> Window:
    """The window between two crank angles, given in deg."""
    interval = next((window for window in mechanism.windows if window.name == "interval"), None)
    if interval is None:
        raise RequestError(f"{mechanism.name} has no interval windows; there is {', '.join(_named_windows(mechanism))}")
    for name in bounds:
        if name not in ("from", "to"):
            raise RequestError(f"unknown key {shown(name)} of an interval; write {{ from = 0, to = 90 }}")
    if len(bounds) < 2:
        raise RequestError("an interval needs both ends; write { from = 0, to = 90 }")
    start, stop = quantity(bounds["from"], "deg"), quantity(bounds["to"], "deg")
    if not start < stop:
        raise RequestError(f"from = {start:g} must be below to = {stop:g}; an interval may run past 360")
    if stop - start > 360.0 * (1.0 + 1e-12):
        raise RequestError(f"the interval of {stop - start:g} deg is longer than a turn; at most 360 deg")
    return replace(interval, start=math.radians(start), stop=math.radians(stop))


def likely_window(mechanism: Mechanism, written: object) -> Window:
    """The window probably meant, so that the metrics can be looked at although the window is wrong."""
    named = _named_windows(mechanism)
    return named[closest(str(written), named) or mechanism.default_window]


def find_metric(mechanism: Mechanism, name: str, window: Window) -> AnyMetric:
    """The metric of a name.

    Parameters
    ----------
    mechanism
        Whose metric.
    name
        A closed-form or derived metric, ``<signal>_<statistic>``, ``<signal>_<statistic>_<window>``, or "mean",
        "variance", "cv" alone for the output.
    window
        The study's window.

    Raises
    ------
    RequestError
        When it does not exist, or is undefined for every design.
    """
    for closed in mechanism.metrics:
        if closed.name == name:
            return closed
    formula = next((formula for formula in mechanism.formulas if formula.name == name), None)
    if formula is not None:
        return _derived(mechanism, formula, window)
    parsed = _parse(mechanism, name, window)
    if parsed is None:
        match = closest(name, all_metric_names(mechanism))
        hint = f"did you mean '{match}'?" if match else f"`explore mechanisms {mechanism.name}` lists them"
        raise RequestError(f"unknown metric {shown(name)}; {hint}")
    signal, statistic, over = parsed
    if statistic not in signal.statistics:
        raise RequestError(
            f"{signal.name} is a magnitude, which has no {statistic}; "
            f"ask for {', '.join(f'{signal.name}_{other}' for other in signal.statistics)}"
        )
    _check_window(mechanism, signal, statistic, over)
    _refuse_undefined(mechanism, signal, statistic, over)
    return SampledMetric(
        name,
        _unit(signal.unit, statistic),
        f"{_WORDS.get(statistic, statistic)} of {signal.long_name}, window {_window_words(over)}",
        "min" if statistic in _LOW_IS_GOOD else None,
        signal,
        statistic,
        over,
    )


def _derived(mechanism: Mechanism, formula: Formula, window: Window) -> DerivedMetric:
    """The metric of a formula, its inputs resolved."""
    parameters = {parameter.name: parameter for parameter in mechanism.parameters}

    def find(name: str) -> AnyMetric | Parameter:
        return parameters[name] if name in parameters else find_metric(mechanism, name, window)

    inputs = tuple(find(name) for name in formula.inputs)
    return DerivedMetric(formula.name, formula.unit, formula.long_name, formula.sense, formula, inputs)


def _window_words(window: Window) -> str:
    if window.name != "interval":
        return window.name
    return f"{math.degrees(window.start):g} to {math.degrees(window.stop):g} deg"


def all_metric_names(mechanism: Mechanism) -> Iterator[str]:
    """Every name that a metric can have, whatever the window of the study."""
    yield from (metric.name for metric in mechanism.metrics)
    yield from (formula.name for formula in mechanism.formulas)
    yield from OUTPUT_STATISTICS
    for signal in mechanism.signals:
        for statistic in signal.statistics:
            yield f"{signal.name}_{statistic}"
            yield from (f"{signal.name}_{statistic}_{window}" for window in _named_windows(mechanism))


def _parse(mechanism: Mechanism, name: str, window: Window) -> tuple[Signal, str, Window] | None:
    """Signal, statistic and window of a sampled metric's name; None when it is no such name."""
    if name in OUTPUT_STATISTICS:
        output = mechanism.output.get(window.name, mechanism.output[""])
        return next(signal for signal in mechanism.signals if signal.name == output), name, window
    named = _named_windows(mechanism)
    for signal in mechanism.signals:
        for statistic in dict.fromkeys((*signal.statistics, *STATISTICS)):
            stem = f"{signal.name}_{statistic}"
            if name == stem:
                return signal, statistic, window
            if not name.startswith(stem + "_"):
                continue
            suffix = name.removeprefix(stem + "_")
            if suffix in named:
                return signal, statistic, named[suffix]
            if suffix == "interval":
                raise RequestError(f"{shown(name)}: an interval has no name; set window = {{ from = 0, to = 90 }}")
    return None


def _check_window(mechanism: Mechanism, signal: Signal, statistic: str, window: Window) -> None:
    """Refuse a signal in a window where it does not exist."""
    inside = [other.name for other in mechanism.signals if window.name in other.only_in]
    if signal.only_in and window.name not in signal.only_in:
        only = signal.only_in[0]
        raise RequestError(
            f"{signal.name} exists only in the window '{only}'; "
            f'ask for {signal.name}_{statistic}_{only} or set window = "{only}"'
        )
    if inside and signal.name not in inside:
        raise RequestError(
            f"in the window '{window.name}' only {', '.join(inside)} exists, not {signal.name}; "
            f"name another window, such as {signal.name}_{statistic}_{mechanism.default_window}"
        )


def _refuse_undefined(mechanism: Mechanism, signal: Signal, statistic: str, over: Window) -> None:
    """Refuse a coefficient of variation about a mean that is exactly 0."""
    if statistic == "cv" and (signal.name, over.name) in mechanism.zero_mean:
        length = "a stroke" if over.needs_stroke and over.name != "cycle" else "a full turn"
        raise RequestError(
            f"the mean of {signal.name} over {length} is exactly 0, so its cv is undefined for every design; "
            f"use {signal.name}_std"
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
