"""The motion of one design over the input angle, in the panels that its mechanism declares."""

from __future__ import annotations

import math
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from explore.figures.charts.bounds import draw_bounds
from explore.figures.charts.style import (
    BLUE,
    BROWN,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    YELLOW,
    new_figure,
    write_heading,
)
from explore.figures.charts.turn import TURN, label_marks, set_turn_axis
from explore.figures.simulation import SimulatedDesign, simulate_design
from explore.model.drawing import Panel
from explore.model.output_slider import TRAVEL_PANEL
from explore.model.quantities import FloatArray, Signal
from explore.results.labels import unit_text
from explore.results.store.open_results import ResultsOrPath, results_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Error of the mean as a sum over input angles, at least, over the largest value.
_ROUNDING = 1e-6
#: Colours of panels with one curve, in turn.
_SINGLE = (GREEN, PURPLE, BLUE, ORANGE, INK)
#: Colour, line and width of two curves that share a panel. Bounds are red.
_PAIR = ((ORANGE, "--", 1.8), (BLUE, "-", 1.8))
#: Colour, line and width of more curves that share a panel, which may coincide.
_SEVERAL = (
    (ORANGE, "-", 3.6),
    (SKY, "-", 2.6),
    (GREEN, "--", 2.0),
    (INK, ":", 2.0),
    (PURPLE, "-.", 1.6),
    (BLUE, "-", 1.4),
    (BROWN, "--", 1.4),
    (YELLOW, "-.", 1.4),
    (MUTED, "-", 1.2),
)


def motion_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the motion of one design over the input angle.

    The panels are those that the mechanism declares, such as angles, velocities, forces and torques; where the study
    uses clutches also the output behind them. The study's bounds on signals are drawn as lines.

    Parameters
    ----------
    results
        The results of a sweep, finished or not, or the path of their file.
    design
        Number of the design; the best of the Pareto set unless given.

    Raises
    ------
    MotionError
        If the design has no motion over a full turn, the range of its crank, or the interval of the study.
    RequestError
        If no number is given and no design is feasible.
    ResultsError
        If the design is not in the file, or the window of the study cannot be read.
    """
    return motion_figure(simulate_design(results_of(results), design))


def motion_figure(simulated: SimulatedDesign) -> Figure:
    """Draw the panels in two columns with a heading."""
    panels = [panel for panel in simulated.panels if _applies(panel, simulated)]
    rows = -(-len(panels) // 2)
    figure = new_figure(11.0, 0.8 + 2.8 * rows)
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False)
    for chart, panel, colour in zip(axes.ravel(), panels, _SINGLE * len(panels), strict=False):
        draw_panel(chart, simulated, panel, colour)
        set_turn_axis(chart, simulated.drive, simulated.marks, simulated.span)
    label_marks(axes[0][: len(panels)], simulated.limits or simulated.marks, simulated.span)
    for chart in axes.ravel()[len(panels) :]:
        chart.remove()
    for chart in axes.ravel()[max(0, len(panels) - 2) : len(panels)]:
        chart.set_xlabel(f"{simulated.mechanism.input_angle} [deg]")
        chart.tick_params(labelbottom=True)
    write_heading(figure, simulated.title, 100)
    return figure


def _applies(panel: Panel, simulated: SimulatedDesign) -> bool:
    """Whether the study uses clutches, for a panel with them, and the design has a load and its forces, for those."""
    loads = {load for name in panel.signals for load in simulated.signal(name).required_loads}
    is_there = all(name in simulated.motion for name in panel.signals)
    loaded = not loads or (is_there and any(simulated.parameters.get(load, 0.0) for load in loads))
    return loaded and (simulated.phases is not None or not panel.with_clutch)


def clutch_output(simulated: SimulatedDesign, signal: Signal, drive: tuple[float, float], phases: int) -> FloatArray:
    """A rectified signal of equal mechanisms, evenly phased, behind one-way clutches.

    The clutches transmit between the input angles of the drive, deg. The values are at the input angles of the motion.
    """
    motion = simulated.motion
    angle, values = motion.index.to_numpy(), motion[signal.shares_row_with].to_numpy()
    sense = np.sign(np.interp(sum(drive) / 2.0, angle, values, period=360.0))
    shifts = 360.0 * np.arange(phases) / phases
    shifted = [sense * np.interp(angle + shift, angle, values, period=360.0) for shift in shifts]
    output: FloatArray = np.maximum(0.0, np.max(shifted, axis=0))
    return output


def draw_panel(chart: Axes, simulated: SimulatedDesign, panel: Panel, colour: str) -> None:
    """Draw the curves of a panel with the study's bounds on them."""
    signals = [simulated.signal(name) for name in panel.signals]
    scale = simulated.units.scale(panel.unit or signals[0].unit)
    unit, factor = scale.shown, panel.factor * float(scale.factor)
    chart.set_ylabel(f"{panel.label} [{unit_text(unit)}]")
    if any(signal.is_rectified for signal in signals):
        _draw_output(chart, simulated, signals[0], factor)
        return
    motion = simulated.motion
    curves = {signal.name: _values(simulated, signal) * factor for signal in signals}
    looks = ((colour, "-", 1.8),) if len(signals) == 1 else _PAIR if len(signals) == 2 else _SEVERAL
    for (name, values), (hue, style, width) in zip(curves.items(), cycle(looks), strict=False):
        chart.plot(motion.index, values, style, color=hue, lw=width, label=name.replace("_", " "))
    if not any(np.isfinite(values).any() for values in curves.values()):
        chart.text(0.5, 0.5, "no value at any input angle", ha="center", va="center", color=MUTED,
                   transform=chart.transAxes)  # fmt: skip
    if panel.shows_mean:
        _draw_mean(chart, motion.index.to_numpy(), *curves.values())
    limits = tuple(scale.show(limit) for limit in panel.limits)
    _set_value_axis(chart, limits, unit, any(signal.is_magnitude for signal in signals))
    draw_bounds(chart, motion.index.to_numpy(), curves, simulated.bounds, factor)
    shades_drive = simulated.drive is not None and panel == simulated.panels[0]
    if shades_drive:
        chart.fill_between([], [], color=MUTED, alpha=0.17, lw=0, label="drive stroke")
    dwell = simulated.slider.dwell if simulated.slider and panel == TRAVEL_PANEL else simulated.dwell
    names_dwell = dwell is not None and panel == simulated.panels[0]
    for number, (start, stop) in enumerate(TURN.parts(dwell) if dwell else ()):
        label = f"dwell, {dwell[1] - dwell[0]:.4g}°" if dwell and names_dwell and number == 0 else None
        chart.axvspan(start, stop, color=GREEN, alpha=0.2, lw=0, zorder=0, label=label)
    if len(signals) > 1 or shades_drive or names_dwell or panel.shows_mean:
        _add_legend(chart, "", 2 if len(signals) > 3 else 1)


def _values(simulated: SimulatedDesign, signal: Signal) -> FloatArray:
    """A signal over the turn; angles go on past 180 deg."""
    values = simulated.motion[signal.name].to_numpy()
    return np.unwrap(values, period=360.0) if signal.unit == "deg" else values


def _set_value_axis(chart: Axes, limits: tuple[float, ...], unit: str, is_magnitude: bool) -> None:
    """Ticks of angles at multiples of 30 deg, magnitudes from 0, a line at 0 where the sign changes."""
    from matplotlib.ticker import MaxNLocator

    if limits:
        chart.set_ylim(*limits)
    if unit == "deg":
        chart.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 1.5, 3, 6, 9, 10]))
    bottom, top = chart.get_ylim()
    if is_magnitude:
        # Forces that hardly vary lie below the top of the axis, and the legend above them.
        curves = [np.asarray(line.get_ydata(), float) for line in chart.get_lines()]
        largest = max((float(np.max(each, where=np.isfinite(each), initial=0.0)) for each in curves), default=0.0)
        chart.set_ylim(0.0, 1.25 * largest or 1.0)
    elif bottom < 0.0 < top and unit != "deg":
        chart.axhline(0.0, color=INK, lw=0.6)


def _draw_mean(chart: Axes, angle: FloatArray, *curves: FloatArray) -> None:
    """The mean of each curve, to as many digits as that of every fourth value agrees to; 0 where none does."""
    for values in curves:
        mean, coarser = (
            float(np.trapezoid(values[::step], angle[::step]) / (angle[::step][-1] - angle[0])) for step in (1, 4)
        )
        if math.isnan(mean):
            continue
        error = max(abs(mean - coarser), _ROUNDING * float(np.abs(values).max()), np.finfo(float).tiny)
        decimals = math.floor(-math.log10(2.0 * error))
        shown = round(mean, decimals) if abs(mean) > error else 0.0
        digits = decimals + 1 + math.floor(math.log10(abs(mean))) if shown else 0
        text = f"{mean:.{min(digits, 4)}g}" if digits > 0 else f"{shown:g}"  # rounded once
        chart.axhline(shown, color=MUTED, lw=1.2, ls="--", label=f"mean {text}")


def _draw_output(chart: Axes, simulated: SimulatedDesign, signal: Signal, factor: float) -> None:
    """Draw the output of all mechanisms in bold over that of one; `factor` is that to the unit of the axis."""
    if simulated.drive is None or simulated.phases is None:
        chart.text(0.5, 0.5, "the output turns fully:\nno stroke to drive a clutch", ha="center", va="center",
                   color=MUTED, transform=chart.transAxes)  # fmt: skip
        return
    angle, phases = simulated.motion.index.to_numpy(), simulated.phases
    if phases > 1:
        one = clutch_output(simulated, signal, simulated.drive, 1) * factor
        chart.plot(angle, one, "--", color=SKY, lw=1.4, label="1 mechanism")
    output = clutch_output(simulated, signal, simulated.drive, phases) * factor
    chart.plot(angle, output, color=INK, lw=2.0, label=f"{phases} mechanism{'s' * (phases > 1)}")
    chart.set_ylim(bottom=0.0)
    draw_bounds(chart, angle, {signal.name: output}, simulated.bounds, factor)
    _add_legend(chart, "through clutches")


def _add_legend(chart: Axes, title: str = "", columns: int = 1) -> None:
    chart.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", title=title or None, ncols=columns)
