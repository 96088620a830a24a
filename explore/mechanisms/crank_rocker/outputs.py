"""The rocker's angle of a crank-rocker in its frame, the crank's pivot at 0 and the rocker's along x.

With p the crank's pin, d = ground - p and v the unit vector of the rocker, coupler and rocker form a triangle with d:
coupler^2 = |d + rocker v|^2, so that d* v = -(|d|^2 + rocker^2 - coupler^2)/(2 rocker) + i branch h.
"""

import math
from typing import Any

from explore.base.compiling import compiled
from explore.mechanisms.targets.function_errors.measuring import OUTPUT_SIGNATURE


@compiled(OUTPUT_SIGNATURE)
def rocker_output(shape, cosine, sine):
    """The angle of the rocker; the shape has four lengths and the branch."""
    crank, coupler, rocker, ground, branch = shape[0], shape[1], shape[2], shape[3], shape[4]
    dx, dy = ground - crank * cosine, -crank * sine
    square = dx * dx + dy * dy
    near = square - (coupler - rocker) * (coupler - rocker)
    far = (coupler + rocker) * (coupler + rocker) - square
    if not near * far >= 0.0:  # both are negative for no linkage
        return math.nan
    along = square + (rocker - coupler) * (rocker + coupler)
    across = branch * math.sqrt(near * far)
    return math.atan2(dx * across - dy * along, -dx * along - dy * across)


def find_rocker_output() -> Any:
    """The compiled output, for workers that find this function by its name."""
    return rocker_output
