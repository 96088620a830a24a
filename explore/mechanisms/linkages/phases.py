"""An interval of crank angles as a turn: the angle is its middle and half its length times cos(phi).

Functions of it repeat with phi. Where one of them has a zero at the distance delta above phi, exp(delta) is the sum of
the semi-axes, in half lengths, of the ellipse through the zero with the ends of the interval as foci.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.mechanisms.linkages.cells import NODES, place_lanes

#: Angles phi of the nodes of a turn.
_PHASES = [math.pi * (half - 0.5 + j / (NODES - 1)) for half in range(2) for j in range(NODES)]
#: Cosines of these angles.
_COSINES = tuple(map(math.cos, _PHASES))
#: Sines of these angles.
_SINES = tuple(map(math.sin, _PHASES))
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"void(float64, float64, int64, {_F1}, {_F1})")
def place_phase(start, length, j, tangents, anchors):
    """Fill the half-tangent and the anchor of the angle at node j in all lanes."""
    place_lanes(start + 0.5 * length * (1.0 + _COSINES[j]), tangents, anchors)


@compiled(f"void({_F1}, int64, float64, int64)")
def slope_by_phase(values, functions, length, j):
    """Make slopes by the angle those by phi, at node j; `values` has the rows of the node, see `turning`."""
    factor = -0.5 * length * _SINES[j]
    for k in range(functions * LANES, 2 * functions * LANES):
        values[k] *= factor
