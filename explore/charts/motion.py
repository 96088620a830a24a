"""The motion of one design over the crank angle, with its drive stroke and limit positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RED, SKY, heading, new_figure
from explore.vocabulary import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Letters of one line of the title.
LETTERS = 100
#: Transmission angles outside are held to be bad, deg.
_GOOD = (30.0, 150.0)
_LINKS = {"coupler": (ORANGE, "--"), "rocker": (BLUE, "-")}


def crank_angles() -> FloatArray:
    """Crank angles of a turn in degrees, ascending, ever closer to 0 and 180, where a motion may be sharp."""
    offsets = 0.5 * 0.75 ** np.arange(100)
    near = [centre + sign * offsets for centre in (0.0, 180.0, 360.0) for sign in (-1.0, 1.0)]
    angles = np.unique(np.concatenate([np.arange(0.0, 360.5, 0.5), *near]))
    return angles[(angles >= 0.0) & (angles <= 360.0)]


def clutch_output(motion: pd.DataFrame, drive: tuple[float, float], phases: int) -> FloatArray:
    """Output velocity of equal linkages, evenly phased, behind one-way clutches, rad/s, at the motion's angles.

    Parameters
    ----------
    motion
        Of one turn, as `explore.simulate` gives it.
    drive
        Crank angles between which the clutches transmit, deg.
    phases
        Number of linkages.
    """
    angle, velocity = motion.index.to_numpy(), motion["rocker_velocity"].to_numpy()
    sense = np.sign(np.interp(sum(drive) / 2.0, angle, velocity, period=360.0))
    shifts = 360.0 * np.arange(phases) / phases
    each = [sense * np.interp(angle + shift, angle, velocity, period=360.0) for shift in shifts]
    output: FloatArray = np.maximum(0.0, np.max(each, axis=0))
    return output


def motion_chart(
    motion: pd.DataFrame,
    title: str,
    drive: tuple[float, float] | None = None,
    limits: Mapping[str, float] | None = None,
    phases: int = 1,
) -> Figure:
    """Angles, velocities, accelerations, ratio, transmission angle and output of one design over the crank angle.

    Parameters
    ----------
    motion
        Of one turn, as `explore.simulate` gives it at `crank_angles`.
    title
        Of the figure.
    drive
        Crank angles between which the clutches transmit, deg, the second larger; None where there are no strokes.
    limits
        Crank angles of the limit positions by name, deg.
    phases
        Number of linkages that share the output.
    """
    figure = new_figure(11.0, 9.2)
    charts = figure.subplots(3, 2, sharex=True)
    (angles, transmission), (velocities, ratio), (accelerations, output) = charts
    for chart, quantity, unit in (
        (angles, "angle", "deg"), (velocities, "velocity", "rad/s"), (accelerations, "acceleration", "rad/s²"),
    ):  # fmt: skip
        for link, (colour, style) in _LINKS.items():
            values = motion[f"{link}_{quantity}"].to_numpy()
            values = np.unwrap(values, period=360.0) if quantity == "angle" else values
            chart.plot(motion.index, values, style, color=colour, lw=1.8, label=link)
        chart.set_ylabel(f"{'' if quantity == 'angle' else 'angular '}{quantity} [{unit}]")
    if drive is not None:
        angles.fill_between([], [], color=MUTED, alpha=0.17, lw=0, label="drive stroke")
    angles.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")
    _transmission(transmission, motion)
    ratio.plot(motion.index, motion["velocity_ratio"], color=PURPLE, lw=1.8)
    ratio.set_ylabel("rocker over crank velocity [1]")
    _output(output, motion, drive, phases)
    for chart in charts.ravel():
        turn_axis(chart, drive, limits or {})
    name_limits(charts[0], limits or {})
    for chart in charts[-1]:
        chart.set_xlabel("crank angle [deg]")
    heading(figure, title, LETTERS)
    return figure


def _transmission(chart: Axes, motion: pd.DataFrame) -> None:
    values = motion["transmission_angle"]
    chart.plot(motion.index, values, color=GREEN, lw=1.8)
    for limit in _GOOD:
        chart.axhline(limit, color=RED, lw=1.2, ls="-.")
        chart.text(358, limit, f"{limit:.0f}°", color=RED, ha="right", va="top" if limit < 90 else "bottom")
    bad = (values < _GOOD[0]) | (values > _GOOD[1])
    chart.fill_between(
        motion.index, values, np.clip(values, *_GOOD), where=bad, color=RED, alpha=0.25, hatch="//", lw=0
    )
    chart.set_ylim(0, 180)
    chart.set_yticks(range(0, 181, 30))
    chart.set_ylabel("transmission angle [deg]")


def _output(chart: Axes, motion: pd.DataFrame, drive: tuple[float, float] | None, phases: int) -> None:
    """The output in bold over what one linkage alone would give."""
    chart.set_ylabel("output velocity [rad/s]")
    if drive is None:
        chart.text(0.5, 0.5, "the output turns fully:\nno stroke to drive a clutch", ha="center", va="center",
                   color=MUTED, transform=chart.transAxes)  # fmt: skip
        return
    if phases > 1:
        chart.plot(motion.index, clutch_output(motion, drive, 1), "--", color=SKY, lw=1.4, label="1 linkage")
    word = f"{phases} linkage{'s' * (phases > 1)}"
    chart.plot(motion.index, clutch_output(motion, drive, phases), color=INK, lw=2.0, label=word)
    chart.set_ylim(bottom=0.0)
    chart.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", title="through clutches")


def turn_axis(chart: Axes, drive: tuple[float, float] | None, limits: Mapping[str, float]) -> None:
    """The turn as the axis, the drive stroke shaded, also where it passes 360 degrees."""
    chart.set_xlim(0, 360)
    chart.set_xticks(range(0, 361, 60))
    chart.grid(color=MUTED, alpha=0.25, lw=0.5)
    for turn in (-360.0, 0.0, 360.0) if drive else ():
        start, stop = (np.clip(angle + turn, 0.0, 360.0) for angle in drive or ())
        if stop > start:
            chart.axvspan(start, stop, color=MUTED, alpha=0.17, lw=0, zorder=0)
    for angle in limits.values():
        chart.axvline(angle % 360.0, color=INK, lw=0.9, ls=":")


def name_limits(charts: Iterable[Axes], limits: Mapping[str, float]) -> None:
    """The names of the limit positions above the charts."""
    for chart in charts:
        for name, angle in limits.items():
            right = angle % 360.0 > 180.0
            chart.annotate(f"{name} {angle % 360.0:.1f}°", (angle % 360.0, 1.0), (0, 3), fontsize=9, color=INK,
                           xycoords=("data", "axes fraction"), textcoords="offset points",
                           ha="right" if right else "left")  # fmt: skip
