"""Both pivots of a four-bar as numbers of its search, in place of the frame's angle and the sizes of its links.

In these coordinates the places of frame, log coupler and log rocker are the other pivot's x and y, and the logarithm of
rocker over coupler; the size of the links follows from the distance of the pivots. So boxes of both pivots are bounds.
"""

import math

from explore.base.subroutines import subroutine
from explore.synthesis.paths.numbers import (
    FRAME,
    GROUND,
    LARGEST,
    LEAST,
    LOG_COUPLER,
    LOG_ROCKER,
    N_NUMBERS,
    PIVOT_X,
    PIVOT_Y,
    close_shape,
)

OTHER_X, OTHER_Y, LOG_RATIO = FRAME, LOG_COUPLER, LOG_ROCKER
_TINY = 1e-300


@subroutine(allocates=True)
def to_pivots(numbers, constants, coordinates):
    """Fill the coordinates of numbers."""
    coordinates[:] = numbers
    coordinates[OTHER_X] = numbers[PIVOT_X] + constants[GROUND] * math.cos(numbers[FRAME])
    coordinates[OTHER_Y] = numbers[PIVOT_Y] + constants[GROUND] * math.sin(numbers[FRAME])
    coordinates[LOG_RATIO] = numbers[LOG_ROCKER] - numbers[LOG_COUPLER]


@subroutine(allocates=True)
def from_pivots(coordinates, is_ground_longer, constants, numbers):
    """Fill the numbers of coordinates; the constants are overwritten."""
    numbers[:] = coordinates
    across, up = coordinates[OTHER_X] - coordinates[PIVOT_X], coordinates[OTHER_Y] - coordinates[PIVOT_Y]
    numbers[FRAME], numbers[LOG_COUPLER] = math.atan2(up, across), 0.0
    close_shape(numbers, is_ground_longer, constants)
    size = math.log((math.hypot(across, up) + _TINY) / (constants[GROUND] + _TINY))
    numbers[LOG_COUPLER], numbers[LOG_ROCKER] = size, coordinates[LOG_RATIO] + size


@subroutine()
def slopes_by_pivots(numbers, constants, ground_slopes, change):
    """Fill the derivatives of the numbers, rows, by the coordinates; those of the log of the ground are given."""
    change[:] = 0.0
    for j in range(N_NUMBERS):
        change[j, j] = 1.0
    # The inverse of the vector of the frame: its change times it is that of the log of the distance, and of the angle.
    along = math.cos(numbers[FRAME]) / (constants[GROUND] + _TINY)
    across = -math.sin(numbers[FRAME]) / (constants[GROUND] + _TINY)
    change[FRAME, OTHER_X], change[FRAME, OTHER_Y] = across, along
    change[FRAME, PIVOT_X], change[FRAME, PIVOT_Y] = -across, -along
    for row in (LOG_COUPLER, LOG_ROCKER):
        change[row, OTHER_X], change[row, OTHER_Y] = along, -across
        change[row, PIVOT_X], change[row, PIVOT_Y] = -along, across
        change[row, LOG_RATIO] = -ground_slopes[LOG_ROCKER] + (1.0 if row == LOG_ROCKER else 0.0)
        change[row, LEAST], change[row, LARGEST] = -ground_slopes[LEAST], -ground_slopes[LARGEST]


@subroutine(allocates=True)
def change_coordinates(change, matrix, right, room, turned):
    """Turn normal equations in the numbers into equations in the coordinates; the lower triangle is used."""
    n = N_NUMBERS
    for i in range(n):
        for k in range(n):
            total = 0.0
            for j in range(n):
                total += (matrix[i, j] if j <= i else matrix[j, i]) * change[j, k]
            room[i, k] = total
    for i in range(n):
        turned[i] = 0.0
        for j in range(n):
            turned[i] += change[j, i] * right[j]
        for k in range(i + 1):
            total = 0.0
            for j in range(n):
                total += change[j, i] * room[j, k]
            matrix[i, k] = total
    right[:] = turned
