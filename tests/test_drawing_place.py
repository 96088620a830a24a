"""A drawing at a place in the plane: all of it is shifted and turned as one body."""

import numpy as np
import pytest

from explore.model.drawing import Pose
from explore.running.public import simulate
from explore.studies.request.names import find_mechanism

DESIGNS = {
    "crank-rocker": {"crank": 100, "coupler": 300, "rocker": 250, "ground": 350, "M_along": 120, "M_across": 40},
    "slider-crank": {"crank": 50, "rod": 200, "offset": 20, "M_along": 120, "M_across": 40},
}


@pytest.mark.parametrize("name", DESIGNS)
def test_a_placed_drawing_is_turned_and_shifted(name):
    mechanism, parameters = find_mechanism(name, ("M",)), DESIGNS[name]
    motion = simulate(name, parameters, points={"M": (120, 40)}, angles=np.linspace(0.0, 350.0, 36))
    signals = {str(column): motion[column].to_numpy() for column in motion}
    pose = Pose.of(mechanism.signals, parameters, signals, motion.index.to_numpy())
    plain, placed = mechanism.drawing, mechanism.drawing.placed(70.0, -30.0, 25.0)
    turn = np.exp(1j * np.radians(25.0))
    for point, places in pose.points(plain).items():
        expected = 70.0 - 30.0j + turn * (places @ [1.0, 1.0j])
        # a few roundings of angles of 500 deg
        assert np.abs(pose.points(placed)[point] @ [1.0, 1.0j] - expected).max() < 1e-11
    assert [guide.angle for guide in placed.guides] == [guide.angle + 25.0 for guide in plain.guides]
