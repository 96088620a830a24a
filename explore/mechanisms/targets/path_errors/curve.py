"""The curve of a point of a floating link: how it is called."""

import math

from explore.base.compiling import LANES, function_type
from explore.base.subroutines import subroutine

# ``curve(shape, cosine, sine, out)`` fills the point at a crank angle and both derivatives by it, ``x, y, x', y', x'',
# y''``, in the frame of the linkage; then the same of the unit vector of its link, which only poses read.
#: Signature of the curve of a mechanism.
CURVE_SIGNATURE = "void(float64[::1], float64, float64, float64[::1])"
#: Type of the curve of a mechanism.
CURVE = function_type(CURVE_SIGNATURE)
#: Number of the numbers that a curve fills.
CURVE_SIZE = 12

# ``rows_of_curve(shapes, cosines, sines, count, out)`` fills the same at so many rows of LANES angles: each number of
# the shape is LANES times in `shapes`, and `out` has CURVE_SIZE rows for each row of angles.
#: Signature of the curve of a mechanism at rows of angles.
ROWS_SIGNATURE = "void(float64[::1], float64[::1], float64[::1], int64, float64[::1])"
#: Type of the curve of a mechanism at rows of angles.
ROWS = function_type(ROWS_SIGNATURE)

TURN = 2.0 * math.pi

#: Least second derivative of half a sum of squares by the crank angle in Newton's steps, over that of its linear part.
LEAST_BEND = 1e-3
#: Longest step that is taken whatever sums say, whose changes may be rounding, rad.
SURE_STEP = 1e-6


@subroutine()
def fill_rows(rows_of_curve, shape, rays, shapes, rows):
    """Fill rows of the curve of a shape at `rays`, cosines and sines of whole rows of angles, (2, n).

    `shapes` is room for the shape in all lanes.
    """
    for k in range(len(shape)):
        for lane in range(LANES):
            shapes[k * LANES + lane] = shape[k]
    rows_of_curve(shapes, rays[0], rays[1], rays.shape[1] // LANES, rows)


@subroutine(no_alias=True)
def take_row(rows, number, row):
    """Fill one of the numbers of the curve at all angles from its rows."""
    for first in range(0, len(row), LANES):
        own, numbers = row[first : first + LANES], rows[first * CURVE_SIZE + number * LANES :]
        for lane in range(len(own)):
            own[lane] = numbers[lane]
