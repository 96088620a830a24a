"""The pose of a link: its point and its angle, from the curve of the point."""

import math

from explore.base.subroutines import subroutine
from explore.mechanisms.targets.path_errors.curve import TURN

# Rows of a pose: the point and both of its derivatives by the crank angle, then the same of the angle, rad.
X, Y, X_1, Y_1, X_2, Y_2, ANGLE, ANGLE_1, ANGLE_2 = range(9)
LINK_SIZE = 9


@subroutine()
def wrap(angle):
    """The angle within half a turn."""
    return angle - TURN * math.floor(angle / TURN + 0.5)


@subroutine()
def fill_link(curve, shape, angle, out, link):
    """Fill the pose of the `link` (LINK_SIZE,) at a crank angle, by the curve that the mechanism declares for paths."""
    curve(shape, math.cos(angle), math.sin(angle), out)
    for k in range(6):
        link[k] = out[k]
    # u = exp(i phi), so that phi' = u x u' and phi'' = u x u''
    ux, uy = out[6], out[7]
    link[ANGLE] = math.atan2(uy, ux)
    link[ANGLE_1], link[ANGLE_2] = ux * out[9] - uy * out[8], ux * out[11] - uy * out[10]
