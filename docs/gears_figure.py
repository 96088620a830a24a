"""Make the picture of the page on gears: ``python docs/gears_figure.py``."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import explore
from explore.figures.charts.style import BLUE, INK, ORANGE, new_figure, save_figure

HERE = Path(__file__).parent
PAIR = {"growth": 1.5, "sector": 4.2, "centre_distance": 150}
SECTOR_DEGREES = np.rad2deg(4.2)
#: Angles of gear 1, deg, whose neighbours lie on both sides of the joint at the end of the sector.
ANGLES = np.sort(np.append(np.linspace(0.0, 360.0, 1441)[:-1], SECTOR_DEGREES + np.array([-1e-9, 1e-9])))


def draw_ratio(axes: plt.Axes, motion: pd.DataFrame) -> None:
    """The ratio over two turns."""
    for turn in (0.0, 360.0):
        axes.plot(motion.index + turn, motion["ratio"], color=BLUE)
        axes.axvspan(turn, turn + SECTOR_DEGREES, color=BLUE, alpha=0.08, lw=0)
    axes.set(xlabel="angle of gear 1 [deg]", ylabel="ratio", title="working sectors shaded", xticks=range(0, 721, 120))


def draw_mesh(axes: plt.Axes, motion: pd.DataFrame) -> None:
    """Both pitch curves, with the joint at angle 0 on the line of the axes."""
    driver, driven = np.deg2rad(motion.index), np.deg2rad(motion["driven_angle"])
    # the gears turn against each other, so that their curves are seen in the same sense from either axis
    for radius, angle, centre, color, name in (
        (motion["driver_radius"], -driver, 0.0, ORANGE, "gear 1"),
        (motion["driven_radius"], np.pi + driven, 150.0, BLUE, "gear 2"),
    ):
        x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
        axes.fill(x, y, facecolor=color, alpha=0.15, edgecolor="none")
        axes.plot(np.append(x, x.iloc[0]), np.append(y, y.iloc[0]), color=color, label=name)
        axes.plot(centre, 0.0, "+", color=INK)
    axes.set_aspect("equal")
    axes.set(xlabel="mm", ylabel="mm", title="pitch curves in mesh")
    axes.legend(frameon=False, loc="upper right", fontsize=9)


def draw_curvature(axes: plt.Axes, motion: pd.DataFrame) -> None:
    """Curvatures, with their jumps at the joints."""
    for name, color in (("driver", ORANGE), ("driven", BLUE)):
        axes.plot(motion.index, motion[f"{name}_curvature"], color=color)
    for joint in (0.0, SECTOR_DEGREES, 360.0):
        axes.axvline(joint, color=INK, lw=0.8, ls=":")
    axes.axhline(0.0, color=INK, lw=0.8)
    axes.set(xlabel="angle of gear 1 [deg]", ylabel="curvature [1/mm]", title="joints dotted", xticks=range(0, 361, 60))


def draw_drive(axes: plt.Axes) -> None:
    """The ratio of three trains over the input angle, at the largest shift without ripple and beyond."""
    largest = explore.evaluate("gears", PAIR, metrics=["phase_shift_max"])["phase_shift_max"][0]
    for factor, color in ((1.0, BLUE), (1.1, ORANGE)):
        motion = explore.simulate("gears", {**PAIR, "phase_shift": factor * largest}, angles=ANGLES)
        axes.plot(
            motion["driven_angle"], motion["overall_ratio"], color=color, label=f"{factor:g} of the largest shift"
        )
        axes.plot(motion["driven_angle"], motion["train_ratio"], color=color, lw=0.9, ls="--")
    axes.set(xlabel="input angle [deg]", ylabel="ratio", title="drive of three trains; one of them dashed")
    axes.set(xticks=range(0, 361, 60))
    axes.legend(frameon=False, loc="lower left", fontsize=9)


def draw_gears() -> None:
    """Draw all four panels."""
    motion = explore.simulate("gears", PAIR, angles=ANGLES)
    figure = new_figure(11.0, 8.2)
    (ratio, mesh), (curvature, drive) = figure.subplots(2, 2)
    draw_ratio(ratio, motion)
    draw_mesh(mesh, motion)
    draw_curvature(curvature, motion)
    draw_drive(drive)
    save_figure(figure, HERE / "gears.png")


if __name__ == "__main__":
    from figures import compress

    draw_gears()
    compress(HERE / "gears.png")
