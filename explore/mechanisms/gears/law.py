"""The ratio and the driven angle of a gear pair at any angle of gear 1, whatever the law of the return sector."""

import math

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential, exponential_less_one
from explore.base.subroutines import subroutine
from explore.mechanisms.gears.columns import CONSTANT, DRIVEN_SECTOR, LOG_GROWTH, ORDER, SECTOR_ANGLE, START
from explore.mechanisms.gears.sine_law import sine_driven_angle, sine_driver_angle, sine_ratio
from explore.mechanisms.gears.smoothstep_law import (
    smoothstep_driven_angle,
    smoothstep_driver_angle,
    smoothstep_ratio,
)


@subroutine(inlined=True)
def working_ratio(constants, lane, angle):
    """The ratio at an angle in the working sector, and its first and second derivatives by the angle."""
    log_growth = constants[LOG_GROWTH * LANES + lane]
    ratio = constants[START * LANES + lane] * exponential(-log_growth * angle)
    return ratio, -log_growth * ratio, log_growth * log_growth * ratio


@subroutine(inlined=True)
def working_driven_angle(constants, lane, angle):
    """The driven angle at an angle in the working sector, rad."""
    return constants[CONSTANT * LANES + lane] * exponential_less_one(constants[LOG_GROWTH * LANES + lane] * angle)


@subroutine()
def ratio_at(constants, lane, angle, is_return):
    """The ratio at an angle in a sector, and its first and second derivatives by the angle."""
    if not is_return:
        return working_ratio(constants, lane, angle)
    beyond = angle - constants[SECTOR_ANGLE * LANES + lane]
    if constants[ORDER * LANES + lane] == 0.0:
        return sine_ratio(constants, lane, beyond)
    return smoothstep_ratio(constants, lane, beyond)


@subroutine()
def driven_angle_at(constants, lane, angle, is_return):
    """The driven angle at an angle in a sector, rad."""
    if not is_return:
        return working_driven_angle(constants, lane, angle)
    beyond = angle - constants[SECTOR_ANGLE * LANES + lane]
    if constants[ORDER * LANES + lane] == 0.0:
        return sine_driven_angle(constants, lane, beyond)
    return smoothstep_driven_angle(constants, lane, beyond)


@subroutine()
def driver_angle_at(constants, lane, driven_angle):
    """The angle of gear 1 at a driven angle between 0 and a full turn, rad."""
    if driven_angle <= constants[DRIVEN_SECTOR * LANES + lane]:
        return math.log1p(driven_angle / constants[CONSTANT * LANES + lane]) / constants[LOG_GROWTH * LANES + lane]
    if constants[ORDER * LANES + lane] == 0.0:
        return sine_driver_angle(constants, lane, driven_angle)
    return smoothstep_driver_angle(constants, lane, driven_angle)


@subroutine()
def ratio_in_turn(constants, lane, angle):
    """The ratio at an angle between 0 and two turns."""
    within = angle - 2.0 * math.pi if angle >= 2.0 * math.pi else angle
    ratio, _, _ = ratio_at(constants, lane, within, within > constants[SECTOR_ANGLE * LANES + lane])
    return ratio
