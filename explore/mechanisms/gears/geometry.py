"""Pitch curves of a gear pair: radii, tilt, curvature, and how convex they are.

With the ratio i and its derivatives by the angle of gear 1, the radii are r1 = a/(1 + i) and r2 = a i/(1 + i). The
tangent is tilted against the circumferential direction by chi, tan chi = i'/(1 + i), the same for both gears. With
c = sqrt(1 + tan^2 chi) the curvatures, positive where convex, are (1 + i + i'')/(a c^3) and
(1 + i + i'^2 - i i'')/(a i c^3); their numerators are the convexities.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.gears import columns
from explore.mechanisms.gears.columns import (
    AMPLITUDE,
    DISTANCE,
    FREQUENCY,
    LOG_GROWTH,
    LOWEST,
    ORDER,
    SECTOR_ANGLE,
    START,
)
from explore.mechanisms.gears.law import ratio_at
from explore.mechanisms.gears.smoothstep_law import smoothstep_bend, smoothstep_logarithm, steepness

# Quantities whose least value in the return is looked for: the convexities of both gears, and minus the tangent of the
# tilt.
_DRIVER, _DRIVEN, _TILT = range(3)

#: Number of steps of the grid over the return sector, at which slopes are compared.
_GRID = 64
#: Largest number of steps to an angle where a slope is 0; bisection alone would take 34.
_MOST_STEPS = 60
#: Accepted error of such an angle, over a step of the grid: values there are off by its square.
_ACCEPTED = 1e-8


@subroutine(no_alias=True)
def fill_pitch_lengths(constants, out):
    """Fill the length of the pitch curves per radian at one node of each lane from the ratio and its derivative."""
    lengths = out[columns.PITCH_LENGTH * LANES : (columns.PITCH_LENGTH + 1) * LANES]
    # LLVM would unroll a loop of constant length with so short a body instead of vectorising it.
    for lane in range(len(lengths)):
        over = 1.0 / (1.0 + out[columns.RATIO * LANES + lane])
        tangent = out[columns.RATIO_RATE * LANES + lane] * over
        lengths[lane] = constants[DISTANCE * LANES + lane] * over * math.sqrt(1.0 + tangent * tangent)


@subroutine(no_alias=True)
def fill_pitch_curves(constants, out):
    """Fill the other signals of the pitch curves at one node of each lane from the ratio and its derivatives."""
    for lane in range(LANES):
        distance, ratio = constants[DISTANCE * LANES + lane], out[columns.RATIO * LANES + lane]
        rate, acceleration = out[columns.RATIO_RATE * LANES + lane], out[columns.RATIO_ACCELERATION * LANES + lane]
        tangent = rate / (1.0 + ratio)
        square = 1.0 + tangent * tangent
        length = math.sqrt(square)
        driver_radius = distance / (1.0 + ratio)
        factor = 1.0 / (distance * square * length)
        out[columns.DRIVER_RADIUS * LANES + lane] = driver_radius
        out[columns.DRIVEN_RADIUS * LANES + lane] = driver_radius * ratio
        out[columns.PITCH_TILT * LANES + lane] = arctangent(tangent, 1.0)
        bend, factor_2 = ratio * acceleration, factor / ratio
        out[columns.DRIVER_CURVATURE * LANES + lane] = (1.0 + ratio + acceleration) * factor
        out[columns.DRIVEN_CURVATURE * LANES + lane] = (1.0 + ratio + rate * rate - bend) * factor_2
        out[columns.DRIVER_TERMS * LANES + lane] = (1.0 + ratio + abs(acceleration)) * factor
        out[columns.DRIVEN_TERMS * LANES + lane] = (1.0 + ratio + rate * rate + abs(bend)) * factor_2


@subroutine()
def _jump_at(constants, lane, angle, angle_in_return):
    """The jump of curvature at a joint, whose angle is given in both sectors, 1/mm."""
    ratio, rate, working = ratio_at(constants, lane, angle, False)
    _, _, returning = ratio_at(constants, lane, angle_in_return, True)
    square = 1.0 + (rate / (1.0 + ratio)) ** 2
    return abs(returning - working) / (constants[DISTANCE * LANES + lane] * square * math.sqrt(square))


@subroutine()
def jump_of_curvature(constants, lane):
    """The larger of the jumps of curvature at both joints, the same in both gears, 1/mm."""
    if constants[ORDER * LANES + lane] >= 2.0:
        return 0.0
    sector = constants[SECTOR_ANGLE * LANES + lane]
    return max(_jump_at(constants, lane, 0.0, 2.0 * math.pi), _jump_at(constants, lane, sector, sector))


@subroutine()
def extremes_of_ratio(constants, lane):
    """The smallest and the largest ratio of the turn, both in the return sector."""
    order = constants[ORDER * LANES + lane]
    if order == 0.0:
        lowest = constants[LOWEST * LANES + lane]
        return lowest, lowest + 2.0 * constants[AMPLITUDE * LANES + lane]
    # where 2 pi S' = w
    sector = constants[SECTOR_ANGLE * LANES + lane]
    width = 2.0 * math.pi - sector
    product = (width / (2.0 * math.pi * steepness(order))) ** (1.0 / order)
    sigma = 2.0 * product / (1.0 + math.sqrt(1.0 - 4.0 * product))
    lowest, _, _ = ratio_at(constants, lane, sector + width * sigma, True)
    highest, _, _ = ratio_at(constants, lane, sector + width * (1.0 - sigma), True)
    return lowest, highest


@subroutine()
def _measure(constants, lane, angle, quantity):
    """One of the quantities in the return sector."""
    ratio, rate, acceleration = ratio_at(constants, lane, angle, True)
    if quantity == _DRIVER:
        return 1.0 + ratio + acceleration
    if quantity == _DRIVEN:
        # i'^2 - i i'' is -i^2 (ln i)'', whose terms do not cancel
        beyond = angle - constants[SECTOR_ANGLE * LANES + lane]
        return 1.0 + ratio - ratio * ratio * smoothstep_bend(constants, lane, beyond)
    return -abs(rate) / (1.0 + ratio)


@subroutine(inlined=True)
def _slopes(constants, lane, angle):
    """Numbers of the signs of the slopes of all quantities at an angle in the return sector, and their derivatives.

    With the derivatives u1 to u4 of ln i they are (1 + u1^2 + 3 u2) u1 + u3 and u1 - i (2 u1 u2 + u3), both slopes over
    i, and u1^2 + (1 + i) u2 against the sign of u1.
    """
    beyond = angle - constants[SECTOR_ANGLE * LANES + lane]
    ratio, u1, u2, u3, u4 = smoothstep_logarithm(constants, lane, beyond)
    driver, driven, tilt = u1 * (1.0 + u1 * u1 + 3.0 * u2) + u3, 2.0 * u1 * u2 + u3, u1 * u1 + (1.0 + ratio) * u2
    of_driver = u2 * (1.0 + 3.0 * (u1 * u1 + u2)) + 3.0 * u1 * u3 + u4
    of_driven = u2 - ratio * (u1 * driven + 2.0 * (u2 * u2 + u1 * u3) + u4)
    of_tilt, sign = (2.0 + ratio) * u1 * u2 + (1.0 + ratio) * u3, -1.0 if u1 > 0.0 else 1.0
    return driver, u1 - ratio * driven, sign * tilt, of_driver, of_driven, sign * of_tilt


@subroutine()
def _zero_between(constants, lane, low, high, at_low, at_high, which):
    """The angle between two where one of the slopes, or of their derivatives, is 0, by the secants of a bracket.

    The number at an end that stays is halved (the Illinois method).
    """
    allowed, angle, is_lower, stays = _ACCEPTED * (high - low), low, at_low < 0.0, 0
    for _ in range(_MOST_STEPS):
        angle, last = (low * at_high - high * at_low) / (at_high - at_low), angle
        at = _slopes(constants, lane, angle)[which]
        if abs(angle - last) <= allowed:
            break
        if (at < 0.0) == is_lower:
            low, at_low, at_high, stays = angle, at, 0.5 * at_high if stays == 1 else at_high, 1
        else:
            high, at_high, at_low, stays = angle, at, 0.5 * at_low if stays == -1 else at_low, -1
    return angle


@subroutine()
def _least_between(constants, lane, low, high, before, after, quantity):
    """The least value of a quantity where its slope is 0 between two steps of the grid; infinity if it is not.

    Two zeros between them have one of the slope's derivative.
    """
    at_low, at_high, derivative = before[quantity], after[quantity], quantity + 3
    if (at_low < 0.0) == (at_high < 0.0):
        sign = -1.0 if at_low < 0.0 else 1.0
        if not (sign * before[derivative] < 0.0 < sign * after[derivative]):
            return math.inf
        middle = _zero_between(constants, lane, low, high, before[derivative], after[derivative], derivative)
        at_middle = _slopes(constants, lane, middle)[quantity]
        if sign * at_middle >= 0.0:
            return math.inf
        low, at_low, high, at_high = (
            (middle, at_middle, high, at_high) if sign > 0.0 else (low, at_low, middle, at_middle)
        )
    if at_low >= 0.0:
        return math.inf
    return _measure(constants, lane, _zero_between(constants, lane, low, high, at_low, at_high, quantity), quantity)


@subroutine()
def _least_in_return(constants, lane):
    """The least values of all quantities in the return sector of a log-smoothstep law: at its ends or between them."""
    start = constants[SECTOR_ANGLE * LANES + lane]
    step = (2.0 * math.pi - start) / _GRID
    least_driver, least_driven, least_tilt = (
        min(_measure(constants, lane, start, _DRIVER), _measure(constants, lane, 2.0 * math.pi, _DRIVER)),
        min(_measure(constants, lane, start, _DRIVEN), _measure(constants, lane, 2.0 * math.pi, _DRIVEN)),
        min(_measure(constants, lane, start, _TILT), _measure(constants, lane, 2.0 * math.pi, _TILT)),
    )
    low, before = start, _slopes(constants, lane, start)
    for j in range(1, _GRID + 1):
        high = start + j * step
        after = _slopes(constants, lane, high)
        least_driver = min(least_driver, _least_between(constants, lane, low, high, before, after, _DRIVER))
        least_driven = min(least_driven, _least_between(constants, lane, low, high, before, after, _DRIVEN))
        least_tilt = min(least_tilt, _least_between(constants, lane, low, high, before, after, _TILT))
        low, before = high, after
    return least_driver, least_driven, least_tilt


@subroutine()
def least_convexities(constants, lane):
    """The least convexity of gear 1 and of gear 2, and the largest tilt, rad, over the turn.

    All are in the return, but the convexity of gear 1 may be less at the end of the working sector, which is convex.
    In the return by the sine law the convexities are linear in cos tau.
    """
    log_growth = constants[LOG_GROWTH * LANES + lane]
    end = constants[START * LANES + lane] * math.exp(-log_growth * constants[SECTOR_ANGLE * LANES + lane])
    if constants[ORDER * LANES + lane] == 0.0:
        amplitude, square = constants[AMPLITUDE * LANES + lane], constants[FREQUENCY * LANES + lane] ** 2
        lowest = constants[LOWEST * LANES + lane]
        highest = lowest + 2.0 * amplitude
        # C1 is above 1, its limit for a short sector, so that the ratio's peak is least convex
        driver = 1.0 + lowest + amplitude * (2.0 - square)
        driven = 1.0 + lowest * (1.0 - amplitude * square)
        tangent = math.sqrt(amplitude * square) * math.sqrt(amplitude / ((1.0 + lowest) * (1.0 + highest)))
    else:
        driver, driven, least = _least_in_return(constants, lane)
        tangent = -least
    driver = min(driver, 1.0 + end * (1.0 + log_growth * log_growth))
    return driver, driven, math.atan(tangent)
