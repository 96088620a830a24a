"""The motion of one design under load over the crank angle: rocker, pin forces, drive torque and power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.bounds import SignalBound, draw_bounds
from explore.charts.simulation import SimulatedDesign
from explore.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RED, SKY, new_figure, write_heading
from explore.charts.turn import label_limits, set_turn_axis
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: A mean below this share of the largest value is the error of the sum over crank angles, and is written as 0.
_ROUNDING = 1e-6
_LABELS = {
    "rocker_angle": ("rocker angle [deg]", BLUE),
    "rocker_velocity": ("rocker velocity [rad/s]", BLUE),
    "rocker_acceleration": ("rocker acceleration [rad/s²]", BLUE),
    "drive_torque": ("drive torque [N m]", PURPLE),
    "power": ("power [kW]", RED),
}
_PINS = {
    "pin_force_a": ("pin a", ORANGE, "-", 3.6),
    "pin_force_b": ("pin b", SKY, "-", 2.6),
    "pin_force_c": ("pin c", GREEN, "--", 2.0),
    "pin_force_d": ("pin d", INK, ":", 2.0),
}


def forces_figure(simulated: SimulatedDesign) -> Figure:
    """Draw the rocker, the pin forces, the drive torque and the power over the crank angle."""
    figure = new_figure(11.0, 9.2)
    panels = figure.subplots(3, 2, sharex=True)
    (angle, pins), (velocity, torque), (acceleration, power) = panels
    for panel, name in zip((angle, velocity, acceleration, torque, power), _LABELS, strict=True):
        _draw_signal(panel, simulated.motion, name, simulated.bounds)
    _draw_pin_forces(pins, simulated.motion, simulated.bounds)
    for panel in panels.ravel():
        set_turn_axis(panel, None, simulated.limits)
    label_limits(panels[0], simulated.limits)
    for panel in panels[-1]:
        panel.set_xlabel("crank angle [deg]")
    write_heading(figure, simulated.title, 100)
    return figure


def _draw_signal(panel: Axes, motion: pd.DataFrame, name: str, bounds: Sequence[SignalBound]) -> None:
    """Draw a signal with its bounds; torque and power with their mean."""
    label, colour = _LABELS[name]
    scale = 1e-3 if name == "power" else 1.0
    angle, values = motion.index.to_numpy(), motion[name].to_numpy() * scale
    panel.plot(angle, values, color=colour, lw=1.8)
    panel.set_ylabel(label)
    if name != "rocker_angle":
        panel.axhline(0.0, color=INK, lw=0.6)
    if name in ("drive_torque", "power"):
        _draw_mean(panel, angle, values)
    draw_bounds(panel, angle, {name: values}, bounds, scale)


def _draw_mean(panel: Axes, angle: FloatArray, values: FloatArray) -> None:
    mean = float(np.trapezoid(values, angle) / (angle[-1] - angle[0]))
    if abs(mean) < _ROUNDING * np.abs(values).max():
        mean = 0.0
    panel.axhline(mean, color=MUTED, lw=1.2, ls="--", label=f"mean {mean:.4g}")
    panel.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def _draw_pin_forces(panel: Axes, motion: pd.DataFrame, bounds: Sequence[SignalBound]) -> None:
    curves = {name: motion[name].to_numpy() * 1e-3 for name in _PINS}
    for name, (label, colour, style, width) in _PINS.items():
        panel.plot(motion.index, curves[name], style, color=colour, lw=width, label=label)
    panel.set_ylabel("pin forces [kN]")
    # Forces that hardly vary lie below the top of the axis, and the legend above them.
    panel.set_ylim(0.0, 1.25e-3 * motion[list(_PINS)].to_numpy().max() or 1.0)
    draw_bounds(panel, motion.index.to_numpy(), curves, bounds, 1e-3)
    panel.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", ncols=2)
