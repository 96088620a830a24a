"""Mechanisms with points keep every promise: statistics within their bounds, units, blocks, drawings, all commands."""

import pytest

from explore.mechanisms.registry import MECHANISMS
from explore.testing import check_mechanism

LINKS = {
    "crank-rocker": "coupler = 300\nrocker = [240, 280]\nground = 260\nbranch = [1, -1]\ninertia = 2",
    "test-rig": "coupler = 300\nrocker = [240, 280]\nground = 260\ninertia = 2\nconstant_torque = 50",
    "slider-crank": "rod = [200, 300]\noffset = [-20, 30]\nmass = 2",
}


@pytest.mark.parametrize("name", LINKS)
def test_points_keep_the_contract(name):
    study = f"""mechanism = "{name}"
[parameters]
crank = [60, 90]
speed = 3
{LINKS[name]}
[points]
knife = {{ along = [100, 420], across = {{ start = -60, stop = 60, num = 2 }} }}
[evaluate]
metrics = ["knife_x_max", "knife_curvature_mean"]
[constraints]
knife_y_peak_to_peak = {{ max = 2000 }}
[metrics]
span = {{ formula = "knife_x_peak_to_peak / knife_along", unit = "1" }}
[rank]
metrics = ["knife_curvature_mean:min", "span:max"]
"""
    check_mechanism(MECHANISMS[name], study=study, designs=3)
