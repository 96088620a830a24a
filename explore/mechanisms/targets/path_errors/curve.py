"""The curve of a point of a floating link: how it is called."""

import math

from explore.base.compiling import function_type

# ``curve(shape, cosine, sine, out)`` fills the point at a crank angle and both derivatives by it, ``x, y, x', y', x'',
# y''``, in the frame of the linkage; then the same of the unit vector of its link, which only poses read.
#: Signature of the curve of a mechanism.
CURVE_SIGNATURE = "void(float64[::1], float64, float64, float64[::1])"
#: Type of the curve of a mechanism.
CURVE = function_type(CURVE_SIGNATURE)
#: Number of the numbers that a curve fills.
CURVE_SIZE = 12

TURN = 2.0 * math.pi

#: Least second derivative of half a sum of squares by the crank angle in Newton's steps, over that of its linear part.
LEAST_BEND = 1e-3
#: Longest step that is taken whatever sums say, whose changes may be rounding, rad.
SURE_STEP = 1e-6
