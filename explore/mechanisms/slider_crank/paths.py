"""The curve of a point of a slider-crank's rod, in its frame: the crank's pivot at 0, x along the slider's line.

With p the crank's pin, h = r sin(theta) - offset the height of the pin over the slider's line, y^2 = (l - h)(l + h),
u the unit vector of the rod and z the point in the rod's frame,

    P = p + z u,    u = (y - i h)/l,    phi' = -r cos(theta)/y,    phi'' = (r sin(theta) - h phi'^2)/y.
"""

import math
from typing import Any

from explore.base.compiling import compiled
from explore.mechanisms.targets.path_errors.curve import CURVE_SIGNATURE


@compiled(CURVE_SIGNATURE)
def rod_curve(shape, cosine, sine, out):
    """Fill the point and its derivatives; the shape has crank, rod and offset, and the place along and across."""
    crank, rod = shape[0], shape[1]
    px, py = crank * cosine, crank * sine
    height = py - shape[2]
    reach = math.sqrt(max((rod - height) * (rod + height), 0.0))
    ux, uy = reach / rod, -height / rod
    rx, ry = shape[3] * ux - shape[4] * uy, shape[3] * uy + shape[4] * ux
    rate = -px / reach
    next_rate = (py - rate * rate * height) / reach
    out[0], out[1] = px + rx, py + ry
    out[2], out[3] = -py - ry * rate, px + rx * rate
    out[4], out[5] = -px - ry * next_rate - rx * rate * rate, -py + rx * next_rate - ry * rate * rate
    out[6], out[7], out[8], out[9] = ux, uy, -uy * rate, ux * rate
    out[10], out[11] = -uy * next_rate - ux * rate * rate, ux * next_rate - uy * rate * rate


def find_rod_curve() -> Any:
    """The compiled curve, for workers that find this function by its name."""
    return rod_curve
