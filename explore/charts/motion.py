"""The motion of one design over the crank angle, with its drive stroke and limit positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.bounds import SignalBound, draw_bounds
from explore.charts.forces import forces_figure
from explore.charts.simulation import SimulatedDesign, simulate_design
from explore.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, SKY, new_figure, write_heading
from explore.charts.turn import label_limits, set_turn_axis
from explore.model.quantities import FloatArray
from explore.store.open_results import ResultsOrPath, results_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LINKS = {"coupler": (ORANGE, "--"), "rocker": (BLUE, "-")}
_UNITS = {"angle": "deg", "velocity": "rad/s", "acceleration": "rad/s²"}


def motion_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the motion of one design over the crank angle.

    Angles, angular velocities and accelerations of coupler and rocker, and the transmission angle; where the study uses
    clutches also the velocity ratio and the output. Of a mechanism under load: rocker, pin forces, drive torque, power.
    The study's bounds on signals are drawn as lines.

    Parameters
    ----------
    results
        The results of a sweep, finished or not, or the path of their file.
    design
        Number of the design; the best of the Pareto set unless given.

    Raises
    ------
    MotionError
        If the crank of the design cannot make a full turn.
    RequestError
        If no number is given and no design is feasible.
    ResultsError
        If the design is not in the file, or the window of the study cannot be read.
    """
    simulated = simulate_design(results_of(results), design)
    return forces_figure(simulated) if "drive_torque" in simulated.motion else motion_figure(simulated)


def motion_figure(simulated: SimulatedDesign) -> Figure:
    """Draw the motion without forces."""
    phases, motion = simulated.phases, simulated.motion
    figure = new_figure(11.0, 9.2 if phases else 6.4)
    panels = figure.subplots(3 if phases else 2, 2, sharex=True)
    (angles, transmission), (velocities, accelerations) = panels[:2]
    for panel, quantity in ((angles, "angle"), (velocities, "velocity"), (accelerations, "acceleration")):
        _draw_links(panel, motion, quantity, simulated.bounds)
    if simulated.drive is not None:
        angles.fill_between([], [], color=MUTED, alpha=0.17, lw=0, label="drive stroke")
    angles.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")
    transmission.set_ylim(0, 180)
    transmission.set_yticks(range(0, 181, 30))
    _draw_signal(transmission, motion["transmission_angle"], "transmission angle [deg]", GREEN, simulated.bounds)
    if phases:
        ratio, output = panels[2]
        _draw_signal(ratio, motion["velocity_ratio"], "rocker over crank velocity [1]", PURPLE, simulated.bounds)
        _draw_output(output, motion, simulated.drive, phases, simulated.bounds)
    for panel in panels.ravel():
        set_turn_axis(panel, simulated.drive, simulated.limits)
    label_limits(panels[0], simulated.limits)
    for panel in panels[-1]:
        panel.set_xlabel("crank angle [deg]")
    write_heading(figure, simulated.title, 100)
    return figure


def clutch_output(motion: pd.DataFrame, drive: tuple[float, float], phases: int) -> FloatArray:
    """Output velocity of equal linkages, evenly phased, behind one-way clutches.

    Parameters
    ----------
    motion
        The motion of one turn, from `explore.simulate`.
    drive
        Crank angles between which the clutches transmit, deg.
    phases
        Number of linkages.

    Returns
    -------
    (t,) array
        rad/s, at the crank angles of the motion.
    """
    angle, velocity = motion.index.to_numpy(), motion["rocker_velocity"].to_numpy()
    sense = np.sign(np.interp(sum(drive) / 2.0, angle, velocity, period=360.0))
    shifts = 360.0 * np.arange(phases) / phases
    velocities = [sense * np.interp(angle + shift, angle, velocity, period=360.0) for shift in shifts]
    output: FloatArray = np.maximum(0.0, np.max(velocities, axis=0))
    return output


def _draw_links(panel: Axes, motion: pd.DataFrame, quantity: str, bounds: Sequence[SignalBound]) -> None:
    """Draw one quantity of coupler and rocker."""
    angle = motion.index.to_numpy()
    curves = {f"{link}_{quantity}": motion[f"{link}_{quantity}"].to_numpy() for link in _LINKS}
    if quantity == "angle":
        curves = {name: np.unwrap(values, period=360.0) for name, values in curves.items()}
    for values, (link, (colour, style)) in zip(curves.values(), _LINKS.items(), strict=True):
        panel.plot(angle, values, style, color=colour, lw=1.8, label=link)
    panel.set_ylabel(f"{'' if quantity == 'angle' else 'angular '}{quantity} [{_UNITS[quantity]}]")
    draw_bounds(panel, angle, curves, bounds)


def _draw_signal(panel: Axes, signal: pd.Series, label: str, colour: str, bounds: Sequence[SignalBound]) -> None:
    """Draw one signal with its bounds."""
    panel.plot(signal.index, signal, color=colour, lw=1.8)
    panel.set_ylabel(label)
    draw_bounds(panel, signal.index.to_numpy(), {str(signal.name): signal.to_numpy()}, bounds)


def _draw_output(
    panel: Axes, motion: pd.DataFrame, drive: tuple[float, float] | None, phases: int, bounds: Sequence[SignalBound]
) -> None:
    """Draw the output of all linkages in bold over that of one."""
    panel.set_ylabel("output velocity [rad/s]")
    if drive is None:
        panel.text(0.5, 0.5, "the output turns fully:\nno stroke to drive a clutch", ha="center", va="center",
                   color=MUTED, transform=panel.transAxes)  # fmt: skip
        return
    if phases > 1:
        panel.plot(motion.index, clutch_output(motion, drive, 1), "--", color=SKY, lw=1.4, label="1 linkage")
    output = clutch_output(motion, drive, phases)
    panel.plot(motion.index, output, color=INK, lw=2.0, label=f"{phases} linkage{'s' * (phases > 1)}")
    panel.set_ylim(bottom=0.0)
    draw_bounds(panel, motion.index.to_numpy(), {"output_velocity": output}, bounds)
    panel.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", title="through clutches")
