"""The coupler curve and rocker's angle of a crank-rocker or double-crank, in its frame.

The crank's pivot is at 0, the rocker's along x.

With p the crank's pin, u and v the unit vectors of coupler and rocker, and z the point in the coupler's frame,

    P = p + z u,    P' = p' + i z u phi',    P'' = p'' + z u (i phi'' - phi'^2),
    coupler Im(v* u) phi' = Re(v* p'),    rocker psi' = Im(v* p') + coupler Re(v* u) phi',
    coupler Im(v* u) phi'' = Re(v* p'') - coupler Re(v* u) phi'^2 + rocker psi'^2.

With d = ground - p, coupler and rocker form a triangle with d: coupler^2 = |d + rocker v|^2, so that d* v =
-(|d|^2 + rocker^2 - coupler^2)/(2 rocker) + i branch h.
"""

import math
from typing import Any

from explore.base.compiling import compiled
from explore.mechanisms.targets.path_errors.curve import CURVE_SIGNATURE


@compiled(CURVE_SIGNATURE)
def coupler_curve(shape, cosine, sine, out):
    """Fill the point and its derivatives; the shape has four lengths, the branch, and the place along and across."""
    crank, coupler, rocker, ground, branch = shape[0], shape[1], shape[2], shape[3], shape[4]
    px, py = crank * cosine, crank * sine
    dx, dy = ground - px, -py
    square = dx * dx + dy * dy
    along = 0.5 * (square + (coupler - rocker) * (coupler + rocker))
    near = square - (coupler - rocker) * (coupler - rocker)
    far = (coupler + rocker) * (coupler + rocker) - square
    across = 0.5 * branch * math.sqrt(max(near * far, 0.0))
    scale = 1.0 / (square * coupler)
    ux, uy = (dx * along - dy * across) * scale, (dy * along + dx * across) * scale
    rx, ry = shape[5] * ux - shape[6] * uy, shape[5] * uy + shape[6] * ux
    vx, vy = (coupler * ux - dx) / rocker, (coupler * uy - dy) / rocker
    cross, dot = vx * uy - vy * ux, vx * ux + vy * uy
    one_over = 1.0 / (coupler * cross)
    rate = (vy * px - vx * py) * one_over
    rocker_rate = (vx * px + vy * py + coupler * dot * rate) / rocker
    # Re(v* p'') = -Re(v* p)
    next_rate = (rocker * rocker_rate * rocker_rate - coupler * dot * rate * rate - vx * px - vy * py) * one_over
    out[0], out[1] = px + rx, py + ry
    out[2], out[3] = -py - ry * rate, px + rx * rate
    out[4], out[5] = -px - ry * next_rate - rx * rate * rate, -py + rx * next_rate - ry * rate * rate
    out[6], out[7], out[8], out[9] = ux, uy, -uy * rate, ux * rate
    out[10], out[11] = -uy * next_rate - ux * rate * rate, ux * next_rate - uy * rate * rate


def find_coupler_curve() -> Any:
    """The compiled curve, for workers that find this function by its name."""
    return coupler_curve


@compiled(CURVE_SIGNATURE)
def rocker_output(shape, cosine, sine, out):
    """Fill cosine and sine of the rocker's angle, times a positive number; the shape is four lengths and the branch."""
    crank, coupler, rocker, ground, branch = shape[0], shape[1], shape[2], shape[3], shape[4]
    dx, dy = ground - crank * cosine, -crank * sine
    square = dx * dx + dy * dy
    near = square - (coupler - rocker) * (coupler - rocker)
    far = (coupler + rocker) * (coupler + rocker) - square
    if not near * far >= 0.0:  # both are negative for no linkage
        out[0] = out[1] = math.nan
        return
    along = square + (rocker - coupler) * (rocker + coupler)
    across = branch * math.sqrt(near * far)
    out[0], out[1] = -dx * along - dy * across, dx * across - dy * along


def find_rocker_output() -> Any:
    """The compiled output, for workers that find this function by its name."""
    return rocker_output
