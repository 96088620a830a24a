"""The loop of the four-bar linkage: crank + coupler = ground + rocker."""

from collections.abc import Mapping

import numpy as np

from explore.mechanisms.four_bar_table import four_bar_table
from explore.mechanisms.loops import Columns, LoopDeclaration
from explore.model.quantities import FloatArray


def _derived(_columns: Columns, values: FloatArray) -> Mapping[str, FloatArray]:
    difference = np.remainder(values[0] - values[1] + np.pi, 2.0 * np.pi) - np.pi
    return {"transmission_angle": np.abs(difference)}


LOOP = LoopDeclaration(
    table=four_bar_table(),
    signals=(
        "coupler_angle",
        "rocker_angle",
        "coupler_velocity",
        "rocker_velocity",
        "coupler_acceleration",
        "rocker_acceleration",
    ),
    # the lengths add up exactly at the limit, a ground of 691.75 mm
    design={"crank": 150.0, "coupler": 1083.5, "rocker": 541.75, "ground": 755.75},
    smooth={"crank": 20.0, "coupler": 50.0, "rocker": 45.0, "ground": 40.0},
    limited="ground",
    derived=_derived,
)
