"""The motion of one design under load over the crank angle: rocker, pin forces, drive torque and power."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.motion import LETTERS, name_limits, turn_axis
from explore.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RED, SKY, heading, new_figure
from explore.vocabulary import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Share of the largest value below which a mean is nothing but the error of the sum over the crank angles.
_ROUNDING = 1e-6
_PINS = {
    "pin_force_a": ("pin a", ORANGE, "-", 3.6),
    "pin_force_b": ("pin b", SKY, "-", 2.6),
    "pin_force_c": ("pin c", GREEN, "--", 2.0),
    "pin_force_d": ("pin d", INK, ":", 2.0),
}


def load_chart(motion: pd.DataFrame, title: str, limits: Mapping[str, float] | None = None) -> Figure:
    """Angle, velocity and acceleration of the rocker, pin forces, drive torque and power over the crank angle.

    Parameters
    ----------
    motion
        Of one turn, as `explore.simulate` gives it at `explore.charts.motion.crank_angles`.
    title
        Of the figure.
    limits
        Crank angles of the limit positions by name, deg.
    """
    figure = new_figure(11.0, 9.2)
    charts = figure.subplots(3, 2, sharex=True)
    (angle, pins), (velocity, torque), (acceleration, power) = charts
    for chart, name, words, colour in (
        (angle, "rocker_angle", "rocker angle [deg]", BLUE),
        (velocity, "rocker_velocity", "rocker velocity [rad/s]", BLUE),
        (acceleration, "rocker_acceleration", "rocker acceleration [rad/s²]", BLUE),
        (torque, "drive_torque", "drive torque [N m]", PURPLE),
        (power, "power", "power [kW]", RED),
    ):
        values = motion[name].to_numpy() * (1e-3 if name == "power" else 1.0)
        chart.plot(motion.index, values, color=colour, lw=1.8)
        chart.set_ylabel(words)
        if name != "rocker_angle":
            chart.axhline(0.0, color=INK, lw=0.6)
        if name in ("drive_torque", "power"):
            _mean(chart, motion.index.to_numpy(), values)
    for name, (label, colour, style, width) in _PINS.items():
        pins.plot(motion.index, motion[name] * 1e-3, style, color=colour, lw=width, label=label)
    pins.set_ylabel("pin forces [kN]")
    # Forces that hardly vary lie below the top of the axis, and the legend above them.
    pins.set_ylim(0.0, 1.25e-3 * motion[list(_PINS)].to_numpy().max() or 1.0)
    pins.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", ncols=2)
    for chart in charts.ravel():
        turn_axis(chart, None, limits or {})
    name_limits(charts[0], limits or {})
    for chart in charts[-1]:
        chart.set_xlabel("crank angle [deg]")
    heading(figure, title, LETTERS)
    return figure


def _mean(chart: Axes, angle: FloatArray, values: FloatArray) -> None:
    mean = float(np.trapezoid(values, angle) / (angle[-1] - angle[0]))
    if abs(mean) < _ROUNDING * np.abs(values).max():
        mean = 0.0
    chart.axhline(mean, color=MUTED, lw=1.2, ls="--", label=f"mean {mean:.4g}")
    chart.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")
