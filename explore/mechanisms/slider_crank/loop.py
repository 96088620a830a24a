"""The loop of the slider-crank: crank + rod = position of the slider + offset."""

from explore.mechanisms.loops import LoopDeclaration
from explore.mechanisms.slider_crank.table import TABLE

LOOP = LoopDeclaration(
    table=TABLE,
    signals=(
        "rod_angle",
        "slider_position",
        "rod_velocity",
        "slider_velocity",
        "rod_acceleration",
        "slider_acceleration",
    ),
    # the lengths add up exactly at the limit, a rod of 200 mm
    design={"crank": 150.0, "rod": 264.0, "offset": 50.0},
    limited="rod",
)
