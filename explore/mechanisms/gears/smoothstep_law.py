"""The log-smoothstep law of the return sector: the ratio's logarithm follows a smoothstep of order 1 to 3.

With s = phi - b, w = 2 pi - b and sigma = s/w

    ln i = ln i(0) - L (b + s) + 2 pi L S(sigma),  S' = c (sigma (1 - sigma))^order,  c = 6, 30 or 140,

so that all derivatives of i up to the order join the working sector. Only the law constant is unknown, and explicit;
its integral, and that of the driven angle, are by the Gauss-Legendre rule.
"""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential
from explore.base.subroutines import subroutine
from explore.mechanisms.gears.columns import (
    CONSTANT,
    DRIVEN_SECTOR,
    LOG_GROWTH,
    N_PANELS,
    ORDER,
    SECTOR_ANGLE,
    START,
    TURNED,
)

#: Number of Gauss-Legendre nodes of a panel: enough for growths up to 1e15, the largest parameters.
_NODES = 16

_X, _WEIGHTS = np.polynomial.legendre.leggauss(_NODES)
_MOST_STEPS = 60
#: Largest last step of Halley's method: the cube of it is below rounding, times the square of the growth's logarithm.
_LAST_STEP = 1e-7


@subroutine(inlined=True)
def steepness(order):
    """The factor c of the smoothstep's slope."""
    return 6.0 if order == 1.0 else 30.0 if order == 2.0 else 140.0


@subroutine(inlined=True)
def _smoothstep(sigma, order):
    """The smoothstep of an order at sigma, and its first and second derivatives, without branches."""
    p, c, turn = sigma * (1.0 - sigma), steepness(order), 1.0 - 2.0 * sigma
    # by the end that is nearer, where terms of the polynomial would cancel
    low = sigma if sigma < 1.0 - sigma else 1.0 - sigma
    first, second = low * low * (3.0 - 2.0 * low), low * low * low * (10.0 + low * (6.0 * low - 15.0))
    third = low * low * low * low * (35.0 + low * (low * (70.0 - 20.0 * low) - 84.0))
    value = first if order == 1.0 else second if order == 2.0 else third
    power = 1.0 if order == 1.0 else p if order == 2.0 else p * p
    return value if low == sigma else 1.0 - value, c * p * power, order * c * power * turn


@subroutine(fast=True)
def _turned(constants, lane, first, last):
    """The integral of i(0)/i between two sigmas of a panel of the return, rad."""
    log_growth, sector = constants[LOG_GROWTH * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    order, width = constants[ORDER * LANES + lane], 2.0 * math.pi - sector
    middle, half, total = 0.5 * (first + last), 0.5 * (last - first), 0.0
    # of low^2 to low^7 in the smoothstep, as one polynomial, so that the loop over nodes vectorises
    second, third = 3.0 if order == 1.0 else 0.0, -2.0 if order == 1.0 else 10.0 if order == 2.0 else 0.0
    fourth, fifth = -15.0 if order == 2.0 else 35.0 if order == 3.0 else 0.0, 6.0 if order == 2.0 else 0.0
    fifth, sixth, seventh = (-84.0, 70.0, -20.0) if order == 3.0 else (fifth, 0.0, 0.0)
    for node in range(_NODES):
        at = middle + half * _X[node]
        low = at if at < 0.5 else 1.0 - at
        step = fourth + low * (fifth + low * (sixth + low * seventh))
        step = low * low * (second + low * (third + low * step))
        step = step if at < 0.5 else 1.0 - step
        total += _WEIGHTS[node] * exponential(log_growth * (sector + width * at - 2.0 * math.pi * step))
    return total * half * width


@subroutine()
def _turned_before(constants, lane, panel):
    """The integral of i(0)/i up to the start of a panel, rad."""
    return constants[(TURNED + panel - 1) * LANES + lane] if panel > 0 else 0.0


@subroutine()
def solve_smoothstep_law(constants, lane):
    """Fill the constants of one lane from LOG_GROWTH, SECTOR_ANGLE and ORDER."""
    log_growth, sector = constants[LOG_GROWTH * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    for panel in range(N_PANELS):
        turned = _turned(constants, lane, panel / N_PANELS, (panel + 1) / N_PANELS)
        constants[(TURNED + panel) * LANES + lane] = _turned_before(constants, lane, panel) + turned
    working = math.expm1(log_growth * sector)
    constant = 2.0 * math.pi / (working + log_growth * _turned_before(constants, lane, N_PANELS))
    constants[CONSTANT * LANES + lane] = constant
    constants[START * LANES + lane] = 1.0 / (constant * log_growth)
    constants[DRIVEN_SECTOR * LANES + lane] = constant * working


@subroutine(inlined=True)
def smoothstep_ratio(constants, lane, beyond):
    """The ratio at an angle beyond the end of the working sector, and its first and second derivatives by the angle."""
    log_growth, sector = constants[LOG_GROWTH * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    width = 2.0 * math.pi - sector
    value, slope, bend = _smoothstep(beyond / width, constants[ORDER * LANES + lane])
    ratio = constants[START * LANES + lane] * exponential(log_growth * (2.0 * math.pi * value - (sector + beyond)))
    rate = log_growth * (2.0 * math.pi * slope / width - 1.0)
    return ratio, ratio * rate, ratio * (rate * rate + 2.0 * math.pi * log_growth * bend / (width * width))


@subroutine(inlined=True)
def smoothstep_logarithm(constants, lane, beyond):
    """The ratio at an angle beyond the end of the working sector, and four derivatives of its logarithm."""
    log_growth, sector = constants[LOG_GROWTH * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    width, order = 2.0 * math.pi - sector, constants[ORDER * LANES + lane]
    sigma, c = beyond / width, steepness(order)
    value, slope, bend = _smoothstep(sigma, order)
    p, turn = sigma * (1.0 - sigma), 1.0 - 2.0 * sigma
    square = turn * turn
    third = -2.0 if order == 1.0 else 2.0 * (square - 2.0 * p) if order == 2.0 else 6.0 * p * (square - p)
    fourth = 0.0 if order == 1.0 else -12.0 * turn if order == 2.0 else 6.0 * turn * (square - 6.0 * p)
    ratio = constants[START * LANES + lane] * exponential(log_growth * (2.0 * math.pi * value - (sector + beyond)))
    factor, over = 2.0 * math.pi * log_growth / width, 1.0 / width
    third, fourth = factor * c * third * over * over, factor * c * fourth * over * over * over
    return ratio, factor * slope - log_growth, factor * bend * over, third, fourth


@subroutine()
def smoothstep_bend(constants, lane, beyond):
    """The second derivative of the ratio's logarithm at an angle beyond the end of the working sector."""
    width = 2.0 * math.pi - constants[SECTOR_ANGLE * LANES + lane]
    _, _, bend = _smoothstep(beyond / width, constants[ORDER * LANES + lane])
    return 2.0 * math.pi * constants[LOG_GROWTH * LANES + lane] * bend / (width * width)


@subroutine()
def smoothstep_driven_angle(constants, lane, beyond):
    """The driven angle at an angle beyond the end of the working sector, rad."""
    sigma = beyond / (2.0 * math.pi - constants[SECTOR_ANGLE * LANES + lane])
    panel = min(int(N_PANELS * sigma), N_PANELS - 1)
    turned = _turned_before(constants, lane, panel) + _turned(constants, lane, panel / N_PANELS, sigma)
    return constants[DRIVEN_SECTOR * LANES + lane] + turned / constants[START * LANES + lane]


@subroutine()
def _slope_of_turned(constants, lane, sigma):
    """The slope of `_turned` by its last sigma, and the derivative of the slope's logarithm."""
    log_growth, sector = constants[LOG_GROWTH * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    width = 2.0 * math.pi - sector
    value, slope, _ = _smoothstep(sigma, constants[ORDER * LANES + lane])
    bend = log_growth * (width - 2.0 * math.pi * slope)
    return width * exponential(log_growth * (sector + width * sigma - 2.0 * math.pi * value)), bend


@subroutine()
def smoothstep_driver_angle(constants, lane, driven_angle):
    """The angle in the return sector at a driven angle, rad: Halley's method, kept in a panel by bisection.

    It begins at a cubic through both ends of the panel, with the slopes there.
    """
    sector, panel = constants[SECTOR_ANGLE * LANES + lane], 0
    width = 2.0 * math.pi - sector
    target = (driven_angle - constants[DRIVEN_SECTOR * LANES + lane]) * constants[START * LANES + lane]
    while panel < N_PANELS - 1 and constants[(TURNED + panel) * LANES + lane] < target:
        panel += 1
    before = _turned_before(constants, lane, panel)
    whole, start = constants[(TURNED + panel) * LANES + lane] - before, panel / N_PANELS
    target, low, high = target - before, start, (panel + 1) / N_PANELS
    f, (at_low, _), (at_high, _) = (
        target / whole, _slope_of_turned(constants, lane, low), _slope_of_turned(constants, lane, high)
    )  # fmt: skip
    sigma = low + f * f * (3.0 - 2.0 * f) / N_PANELS
    sigma += f * (1.0 - f) * whole * ((1.0 - f) / at_low - f / at_high)
    sigma = sigma if low <= sigma <= high else 0.5 * (low + high)
    for _ in range(_MOST_STEPS):
        excess = _turned(constants, lane, start, sigma) - target
        if excess > 0.0:
            high = sigma
        else:
            low = sigma
        slope, bend = _slope_of_turned(constants, lane, sigma)
        step = excess / slope
        step = step / (1.0 - 0.5 * step * bend)
        if abs(step) <= _LAST_STEP:
            # rounding may lead out of the panel at its ends
            return sector + width * min(max(sigma - step, low), high)
        sigma = sigma - step if low <= sigma - step <= high else 0.5 * (low + high)
    return sector + width * sigma
