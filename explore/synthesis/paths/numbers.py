"""The ten numbers of a four-bar whose crank turns, and its coupler point and body with all derivatives.

The numbers are the crank's pivot, the angle of the frame, the logarithms of coupler and rocker, the transmission angles
with the crank along the frame towards the other pivot and away from it, the coupler point from the crank's pin, along
and across the coupler, and the angle of the body from the coupler, which a path leaves at 0. Crank and ground follow
from the two triangles that coupler and rocker then form::

    |ground - crank|^2 = coupler^2 + rocker^2 - 2 coupler rocker cos(least transmission angle)
    (ground + crank)^2 = coupler^2 + rocker^2 - 2 coupler rocker cos(largest transmission angle)

So every choice with 0 < least < largest < pi is a linkage whose crank turns, each such linkage occurs once, and a bound
of the transmission angle is a bound of a number.
"""

import math

from explore.base.subroutines import subroutine

PIVOT_X, PIVOT_Y, FRAME, LOG_COUPLER, LOG_ROCKER, LEAST, LARGEST, ALONG, ACROSS, BODY = range(10)
N_NUMBERS = 10
# Rows of the constants of a shape: lengths, and derivatives of the sides |ground -+ crank| by four of the numbers.
CRANK, COUPLER, ROCKER, GROUND = range(4)
SHORT_BY, LONG_BY = 4, 7
N_CONSTANTS = 10
#: Least size of the sine between coupler and rocker that derivatives are divided by.
_LEAST_SINE = 1e-9
#: Relative distance from its bound up to which a link is at it.
_NEAR = 1e-12


@subroutine()
def close_shape(numbers, is_ground_longer, constants):
    """Fill the constants of a shape; `is_ground_longer` chooses between crank and ground for the longer of them."""
    coupler, rocker = math.exp(numbers[LOG_COUPLER]), math.exp(numbers[LOG_ROCKER])
    cos_least, cos_largest = math.cos(numbers[LEAST]), math.cos(numbers[LARGEST])
    squares = coupler * coupler + rocker * rocker
    short = math.sqrt(squares - 2.0 * coupler * rocker * cos_least)
    long = math.sqrt(squares - 2.0 * coupler * rocker * cos_largest)
    larger, smaller = 0.5 * (long + short), 0.5 * (long - short)
    constants[CRANK] = smaller if is_ground_longer else larger
    constants[GROUND] = larger if is_ground_longer else smaller
    constants[COUPLER], constants[ROCKER] = coupler, rocker
    # By log coupler, log rocker and the angle of the same triangle.
    constants[SHORT_BY] = coupler * (coupler - rocker * cos_least) / short
    constants[SHORT_BY + 1] = rocker * (rocker - coupler * cos_least) / short
    constants[SHORT_BY + 2] = coupler * rocker * math.sin(numbers[LEAST]) / short
    constants[LONG_BY] = coupler * (coupler - rocker * cos_largest) / long
    constants[LONG_BY + 1] = rocker * (rocker - coupler * cos_largest) / long
    constants[LONG_BY + 2] = coupler * rocker * math.sin(numbers[LARGEST]) / long


@subroutine()
def longer_and_shorter(numbers):
    """The longer and the shorter of crank and ground."""
    coupler, rocker = math.exp(numbers[LOG_COUPLER]), math.exp(numbers[LOG_ROCKER])
    squares, product = coupler * coupler + rocker * rocker, 2.0 * coupler * rocker
    short = math.sqrt(squares - product * math.cos(numbers[LEAST]))
    long = math.sqrt(squares - product * math.cos(numbers[LARGEST]))
    return 0.5 * (long + short), 0.5 * (long - short)


@subroutine()
def outward_slopes(constants, shortest, longest, slopes):
    """Derivatives by the numbers, rows of `slopes`, of the logarithms of the longer of crank and ground, and of the
    inverse of the shorter one; zero where the length is within its bound.
    """
    slopes[:] = 0.0
    longer, shorter = max(constants[CRANK], constants[GROUND]), min(constants[CRANK], constants[GROUND])
    for number, k, side in ((LOG_COUPLER, 0, 0), (LOG_ROCKER, 1, 0), (LEAST, 2, -1), (LARGEST, 2, 1)):
        by_short = constants[SHORT_BY + k] if side <= 0 else 0.0
        by_long = constants[LONG_BY + k] if side >= 0 else 0.0
        if longer >= longest * (1.0 - _NEAR):
            slopes[0, number] = 0.5 * (by_long + by_short) / longer
        if shorter <= shortest * (1.0 + _NEAR):
            slopes[1, number] = -0.5 * (by_long - by_short) / shorter


@subroutine()
def coupler_direction(constants, branch, pin):
    """The unit vector of the coupler for a pin of the crank in the frame."""
    diagonal = constants[GROUND] - pin
    square = diagonal.real * diagonal.real + diagonal.imag * diagonal.imag
    coupler, rocker = constants[COUPLER], constants[ROCKER]
    along = 0.5 * (square + (coupler - rocker) * (coupler + rocker)) / square
    across = math.sqrt(max(coupler * coupler / square - along * along, 0.0))
    return diagonal * complex(along, branch * across) / coupler


@subroutine()
def place_at(numbers, constants, branch, angle):
    """The coupler point at a crank angle from the frame, and the unit vector of the coupler."""
    pin = constants[CRANK] * complex(math.cos(angle), math.sin(angle))
    u = coupler_direction(constants, branch, pin)
    turn = complex(math.cos(numbers[FRAME]), math.sin(numbers[FRAME]))
    point = pin + complex(numbers[ALONG], numbers[ACROSS]) * u
    return complex(numbers[PIVOT_X], numbers[PIVOT_Y]) + turn * point, turn * u


@subroutine()
def place_and_slopes(numbers, constants, branch, is_ground_longer, angle, slopes, turns):
    """The coupler point, the unit vector of the coupler, and the derivatives of point and body by the crank angle.

    `slopes` receives the derivatives of the point by the numbers, `turns` those of the body's angle. The angle phi of
    the coupler follows from the loop: with unit vectors u of coupler and v of rocker, and any change of the pin of the
    crank, the coupler, the rocker and the ground,

        coupler Im(v' u) d phi = Re(v' d pin) + Re(v' u) d coupler - Re(v) d ground - d rocker
    """
    turn = complex(math.cos(numbers[FRAME]), math.sin(numbers[FRAME]))
    ray = complex(math.cos(angle), math.sin(angle))
    pin = constants[CRANK] * ray
    u = coupler_direction(constants, branch, pin)
    v = (pin + constants[COUPLER] * u - constants[GROUND]) / constants[ROCKER]
    sine = v.real * u.imag - v.imag * u.real
    if abs(sine) < _LEAST_SINE:
        sine = _LEAST_SINE if sine >= 0.0 else -_LEAST_SINE
    k = 1.0 / (constants[COUPLER] * sine)
    arm = complex(numbers[ALONG], numbers[ACROSS]) * u
    whole = turn * (pin + arm)
    lever = turn * complex(-arm.imag, arm.real)  # change of the point per radian of the coupler
    spin = k * (-v.real * pin.imag + v.imag * pin.real)  # change of the coupler's angle per radian of the crank
    sign = 1.0 if is_ground_longer else -1.0
    by_crank, by_ground = k * (v.real * ray.real + v.imag * ray.imag), -k * v.real
    by_short, by_long = 0.5 * sign * (by_ground - by_crank), 0.5 * (by_ground + by_crank)
    pin_by_short, pin_by_long = -0.5 * sign * turn * ray, 0.5 * turn * ray
    turns[:] = 0.0
    turns[FRAME], turns[BODY] = 1.0, 1.0
    turns[LOG_COUPLER] = constants[COUPLER] * k * (v.real * u.real + v.imag * u.imag)
    turns[LOG_ROCKER] = -k * constants[ROCKER]
    for number, k_short, k_long in (
        (LOG_COUPLER, constants[SHORT_BY], constants[LONG_BY]),
        (LOG_ROCKER, constants[SHORT_BY + 1], constants[LONG_BY + 1]),
        (LEAST, constants[SHORT_BY + 2], 0.0),
        (LARGEST, 0.0, constants[LONG_BY + 2]),
    ):
        turns[number] += by_short * k_short + by_long * k_long
        slopes[number] = lever * turns[number] + pin_by_short * k_short + pin_by_long * k_long
    slopes[PIVOT_X], slopes[PIVOT_Y], slopes[BODY] = complex(1.0, 0.0), complex(0.0, 1.0), 0j
    slopes[FRAME] = complex(-whole.imag, whole.real)
    slopes[ALONG] = turn * u
    slopes[ACROSS] = turn * complex(-u.imag, u.real)
    by_angle = turn * complex(-pin.imag, pin.real) + lever * spin
    return complex(numbers[PIVOT_X], numbers[PIVOT_Y]) + whole, turn * u, by_angle, spin
