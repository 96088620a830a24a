"""The pose of the floating link: its point and its angle, from the curves of its pin and of another of its points."""

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
def fill_link(curve, shape, room, angle, pin, end, link):
    """Fill the pose of the `link` (LINK_SIZE,) at a crank angle, by the curve that the mechanism declares for paths.

    Its shape begins with the crank and ends with the point's place; `room`, `pin` and `end` are room for a shape, and
    for two points of the curve.
    """
    n, cosine, sine = len(shape), math.cos(angle), math.sin(angle)
    along, across, length = shape[n - 2], shape[n - 1], shape[0]
    for k in range(n - 2):
        room[k] = shape[k]
    room[n - 2], room[n - 1] = 0.0, 0.0
    curve(room, cosine, sine, pin)
    room[n - 2] = length
    curve(room, cosine, sine, end)
    for k in range(0, 6, 2):
        ux, uy = (end[k] - pin[k]) / length, (end[k + 1] - pin[k + 1]) / length
        link[k], link[k + 1] = pin[k] + along * ux - across * uy, pin[k + 1] + along * uy + across * ux
    # u = exp(i phi), so that phi' = u x u' and phi'' = u x u''
    ux, uy = (end[0] - pin[0]) / length, (end[1] - pin[1]) / length
    link[ANGLE] = math.atan2(uy, ux)
    link[ANGLE_1] = (ux * (end[3] - pin[3]) - uy * (end[2] - pin[2])) / length
    link[ANGLE_2] = (ux * (end[5] - pin[5]) - uy * (end[4] - pin[4])) / length
