"""How far rounding moves a curve: what it changes by where its shape and the crank angle are disturbed."""

from explore.base.lanes.disturbance import DISTURBANCE, FACTORS
from explore.base.subroutines import subroutine

#: Bound of an error over what a disturbance changes: a few roundings for each number of a shape.
SHARE = 1.6e-15 / DISTURBANCE
#: Rounding of the few operations between a curve and an error, relative to what they are done on.
ROUNDING = 1e-15


@subroutine()
def disturb(shape, disturbed):
    """Fill a disturbed copy of a shape."""
    for k in range(len(shape)):
        disturbed[k] = shape[k] * FACTORS[k % len(FACTORS)]


@subroutine()
def curve_nearby(curve, disturbed, angle, cosine, sine, out):
    """Fill the curve of a disturbed shape at a crank angle that is disturbed, too; cosine and sine are not."""
    step = DISTURBANCE * angle
    curve(disturbed, cosine - step * sine, sine + step * cosine, out)
