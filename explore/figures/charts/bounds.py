"""Bounds of a study on signals, and the drive stroke that it uses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, cast

from explore.base.errors import RequestError, ResultsError
from explore.base.suggest import format_value
from explore.figures.charts.style import RED
from explore.figures.charts.turn import TURN, Span
from explore.model.mechanism import Mechanism
from explore.model.quantities import AnyMetric, DerivedMetric, FloatArray, Metric, SampledMetric
from explore.model.window import Window
from explore.results.store.results import Results
from explore.studies.request.names import find_metric, make_window

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Side = Literal["min", "max"]
#: Kinds of windows that depend on the drive stroke.
_DRIVE_KINDS = ("drive", "return", "clutch")
#: Kinds of windows whose input angles differ from design to design.
_STROKE_KINDS = ("drive", "return", "arc")


@dataclass(frozen=True)
class SignalBound:
    """A bound on a signal, in its unit, over the input angles of `span`, deg.

    `stroke` names the stroke where it holds, empty if it holds over the same input angles in all designs; the span is
    the whole turn until those of a design are known.
    """

    signal: str
    side: Side
    value: float
    span: tuple[float, float] = TURN.ends
    stroke: str = ""


def drive_of(results: Results, mechanism: Mechanism) -> str:
    """Name of the drive of a study; empty where its mechanism has none.

    Raises `ResultsError` if the mechanism has no drive of the name in the file.
    """
    if mechanism.drives and results.drive not in mechanism.drives:
        name = format_value(results.drive)
        raise ResultsError(f"{results.path} is damaged: a {mechanism.name} has no drive stroke {name}")
    return results.drive if mechanism.drives else ""


def interval_of(results: Results, mechanism: Mechanism) -> Window | None:
    """The interval that is the window of a study; None where it has another."""
    if not isinstance(results.window, Mapping):
        return None
    window = make_window(mechanism, results.window)
    return None if window.is_whole else window


def uses_drive_stroke(results: Results, mechanism: Mechanism) -> bool:
    """Whether a statistic of the study, a metric or a constraint, is over a window that depends on the drive stroke."""
    windows = [window.name for window in mechanism.windows if window.kind in _DRIVE_KINDS]
    names = [*(column.name for column in results.columns if column.role == "metric"), *results.constraints]
    if any(name.endswith(tuple(f"_{window}" for window in windows)) for name in names):
        return True
    return results.window in windows and any(_is_over(mechanism, name, str(results.window)) for name in names)


def _is_over(mechanism: Mechanism, name: str, window: str) -> bool:
    """Whether a metric depends on a statistic over a window; a formula of the study counts as one that does not."""
    try:
        metric = find_metric(mechanism, name, make_window(mechanism, window))
    except RequestError:
        return False
    parts = metric.sampled if isinstance(metric, DerivedMetric) else (metric,)
    return any(isinstance(part, SampledMetric) and part.window.name == window for part in parts)


def signal_bounds(results: Results, mechanism: Mechanism) -> list[SignalBound]:
    """The constraints that can be drawn on a curve: those on a signal's extremes."""
    bounds: list[SignalBound] = []
    try:
        window = make_window(mechanism, results.window)
    except RequestError:  # the file is of another version, with names that this one does not have
        return bounds
    for name, sides in results.constraints.items():
        try:
            metric = find_metric(mechanism, name, window)
        except RequestError:  # as above, or a formula of the study
            continue
        bounds += _bounds_of_metric(mechanism, metric, cast(dict[Side, float | None], sides))
    return [bound for bound in bounds if math.isfinite(bound.value)]


def _bounds_of_metric(
    mechanism: Mechanism, metric: AnyMetric, sides: Mapping[Side, float | None]
) -> Iterator[SignalBound]:
    low, high = sides["min"], sides["max"]
    if isinstance(metric, Metric) and metric.worst_of:
        if low is not None:
            yield SignalBound(metric.worst_of, "min", low)
            yield SignalBound(metric.worst_of, "max", 180.0 - low)
    elif isinstance(metric, DerivedMetric) and metric.formula.is_folded and low is not None:
        for part in metric.sampled:
            yield from _bounds_of_extreme(part, {"min": low, "max": 180.0 - low})
    elif isinstance(metric, DerivedMetric) and "_peak" in metric.name and high is not None:
        for part in metric.sampled:
            yield from _bounds_of_extreme(part, {"min": -high, "max": high})
    elif isinstance(metric, SampledMetric):
        yield from _bounds_of_extreme(metric, sides)
    elif isinstance(metric, Metric):  # in closed form, over the whole turn
        for side, value in sides.items():
            signal = metric.name.removesuffix(f"_{side}")
            if value is not None and signal in {other.name for other in mechanism.signals}:
                yield SignalBound(signal, side, value)


def _bounds_of_extreme(metric: SampledMetric, sides: Mapping[Side, float | None]) -> Iterator[SignalBound]:
    """The bounds that hold for a whole curve: a lower one on its minimum, an upper one on its maximum."""
    window, span = metric.window, TURN.ends
    if window.name == "interval":  # may begin at any input angle, but is drawn in the turn that begins at 0
        start = float(window.start % 360)
        span = (start, start + float(window.length))
    if metric.statistic == "peak":  # the largest magnitude
        high = sides["max"]
        sides = {} if high is None else {"min": -high, "max": high}
    for side, value in sides.items():
        if metric.statistic in (side, "peak") and value is not None:
            stroke = window.name if window.kind in _STROKE_KINDS else ""
            yield SignalBound(metric.signal.name, side, value, span, stroke)


def draw_bounds(
    panel: Axes, angle: FloatArray, curves: Mapping[str, FloatArray], bounds: Iterable[SignalBound], scale: float = 1.0
) -> None:
    """Draw the bounds on the signals of a panel as lines where they hold, and hatch where a curve violates one.

    The curves are at input angles in deg; bounds on other signals are not drawn. `scale` is the factor from the unit of
    the signals to that of the axis.
    """
    panel.set_ylim(panel.get_ylim())  # a bound beyond the axis does not move it
    for bound in bounds:
        if bound.signal in curves:
            _draw_bound(panel, angle, curves[bound.signal], bound, scale)


def _draw_bound(panel: Axes, angle: FloatArray, values: FloatArray, bound: SignalBound, scale: float) -> None:
    parts = Span(float(angle[0]), float(angle[-1])).parts(bound.span)
    if not parts:
        return
    limit = bound.value * scale
    violated = values < limit if bound.side == "min" else values > limit
    bottom, top = panel.get_ylim()
    for start, stop in parts:
        panel.plot([start, stop], [limit, limit], color=RED, lw=1.2, ls="-.")
        here = violated & (angle >= start) & (angle <= stop)
        panel.fill_between(angle, values, limit, where=here, color=RED, alpha=0.25, hatch="//", lw=0)
    height = (limit - bottom) / (top - bottom)
    below = height > 0.92 or (bound.side == "min" and height > 0.08)
    panel.annotate(f"{'≥' if bound.side == 'min' else '≤'} {limit:g}", (parts[-1][1] - 3.0, limit),
                   (0, -2 if below else 2), color=RED, textcoords="offset points", ha="right",
                   va="top" if below else "bottom", annotation_clip=True)  # fmt: skip


def draw_metric_bounds(panel: Axes, results: Results, **names: str) -> None:
    """Draw the study's bounds on the columns of the axes, `x` and `y`, as lines; they do not extend the axes."""
    limits = {"x": panel.get_xlim(), "y": panel.get_ylim()}
    lines = {"x": panel.axvline, "y": panel.axhline}
    label = "bound of the study"
    for side, name in names.items():
        low, high = sorted(limits[side])
        for bound in results.constraints.get(name, {}).values():
            if bound is not None and low <= bound <= high:
                lines[side](bound, color=RED, lw=1.1, ls="-.", zorder=1, label=label)
                label = "_further bound"  # not in the legend
    panel.set_xlim(limits["x"])
    panel.set_ylim(limits["y"])
