"""Points of a floating link: position, velocity, acceleration and curvature of the path, for many lanes.

The link is at the base point B, and turns by the angle of its unit vector u, at the rate w with the derivative a. Of
a point at the place s along the link and t across it, with r = s u + t u*, u* the vector across u,

    P = B + r,    P' = B' + w r*,    P'' = B'' + a r* - w^2 r,    curvature = (P' x P'')/|P'|^3.

Where the path stops, P' is 0 and the curvature infinite. The sizes of the terms bound the rounding of these sums.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.model import points


@subroutine(inlined=True)
def fill_places(record, lane, places, first_parameter):
    """Fill the constants of the places of points, from the row `places` on, of one lane."""
    for k in range(points.PLACES_SIZE):
        record[(places + k) * LANES + lane] = record[(first_parameter + k) * LANES + lane]


@subroutine(inlined=True)
def fill_place(point, lane, bx, by, rx, ry, terms):
    """Fill the position of a point from base point and r, and the size of its terms."""
    point[points.X * LANES + lane], point[points.Y * LANES + lane] = bx + rx, by + ry
    point[points.POSITION_TERMS * LANES + lane] = terms


@subroutine(inlined=True)
def fill_rates(point, lane, bvx, bvy, bax, bay, rx, ry, rate, rate_of_rate, velocity_terms, acceleration_terms):
    """Fill velocity, acceleration and curvature of a point from the rates of the base point, r, and w and a."""
    vx, vy = bvx - rate * ry, bvy + rate * rx
    ax, ay = bax - rate_of_rate * ry - rate * rate * rx, bay + rate_of_rate * rx - rate * rate * ry
    square, acceleration_square = vx * vx + vy * vy, ax * ax + ay * ay
    speed = math.sqrt(square)
    one_over_cube = 1.0 / (square * speed)
    point[points.VELOCITY_X * LANES + lane], point[points.VELOCITY_Y * LANES + lane] = vx, vy
    point[points.VELOCITY_SQUARE * LANES + lane] = square
    point[points.ACCELERATION_X * LANES + lane], point[points.ACCELERATION_Y * LANES + lane] = ax, ay
    point[points.ACCELERATION_SQUARE * LANES + lane] = acceleration_square
    point[points.CURVATURE * LANES + lane] = (vx * ay - vy * ax) * one_over_cube
    point[points.VELOCITY_TERMS * LANES + lane] = velocity_terms
    point[points.ACCELERATION_TERMS * LANES + lane] = acceleration_terms
    # of the product by both factors, and of the cube by the velocity
    terms = 4.0 * velocity_terms * math.sqrt(acceleration_square) + speed * acceleration_terms
    point[points.CURVATURE_TERMS * LANES + lane] = terms * one_over_cube
