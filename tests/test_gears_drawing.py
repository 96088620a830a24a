"""The pitch curves of the gears in mesh: they touch at the pitch point and nowhere overlap beside it."""

import numpy as np
import pytest

import explore
from explore.figures.charts.mechanism import profile_curve
from explore.figures.simulation import SimulatedDesign
from explore.mechanisms.registry import MECHANISMS

GEARS = MECHANISMS["gears"]


@pytest.mark.parametrize("angle", [0.0, 77.0, 240.64, 300.0])
def test_pitch_curves_touch_on_the_line_of_centres(angle):
    design = {"growth": 1.44, "sector": 4.2, "centre_distance": 150.0}
    turn = np.append(np.linspace(0.0, 359.0, 360), angle)
    simulated = SimulatedDesign(GEARS, design, explore.simulate("gears", design, angles=turn))
    driver, driven = GEARS.drawing.profiles
    now = simulated.pose([angle])
    curves = [profile_curve(simulated.pose(), now, profile, GEARS.drawing) for profile in (driver, driven)]
    radius = now.lengths["driver_radius"][0]
    for curve in curves:
        assert curve[-1] == pytest.approx([radius, 0.0], abs=1e-10)  # rounding of angles in degrees
    # The curves roll: pieces of equal length have passed, so their tangents at the pitch point are one line.
    step = 1e-4
    moved = simulated.pose([angle - step, angle + step])
    chords = [profile_curve(moved, now, profile, GEARS.drawing) for profile in (driver, driven)]
    first, second = (np.diff(chord, axis=0)[0] for chord in chords)
    assert first == pytest.approx(second, abs=1e-7 * np.hypot(*first) + step**2)
