"""A stepless drive of trains of two gear pairs, whose gears 1 turn together, with a phase shift between the pairs.

The input turns gear 2 of the first pair of each train, and gear 2 of the second pair turns the output: the ratio of a
train is i(phi)/i(phi + shift), and m^shift as long as both pairs are in the working sector. The trains follow each
other by equal input angles, and overrunning clutches let the fastest drive the output.

i m^phi is constant in the working sector. Where it never falls in the return, as by the sine law on branch 1 and by all
log-smoothstep laws, m^shift is the largest ratio of a train.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.elementary import sine
from explore.base.subroutines import subroutine
from explore.mechanisms.gears.columns import (
    CONSTANT,
    DRIVEN_SECTOR,
    LOG_GROWTH,
    N_TRAINS,
    SECOND_END,
    SECOND_START,
    SECTOR_ANGLE,
    SHIFT,
    STEADY,
)
from explore.mechanisms.gears.law import driven_angle_at, driver_angle_at, ratio_in_turn
from explore.mechanisms.golden import least_of

#: Number of steps of a grid on which the lowest ratio is looked for, per period of the return.
_GRID = 32


@subroutine()
def train_ratio_at(constants, lane, angle):
    """Output over input velocity of one train at an angle of its gears 1 between 0 and a full turn."""
    shifted = angle + constants[SHIFT * LANES + lane]
    return ratio_in_turn(constants, lane, angle) / ratio_in_turn(constants, lane, shifted)


@subroutine()
def overall_ratio_at(constants, lane, angle, driven_angle):
    """Output over input velocity of all trains, at the angles of the first train's gear 1 and input, rad."""
    if constants[STEADY * LANES + lane] > 0.0:
        return constants[STEADY * LANES + lane]
    largest = train_ratio_at(constants, lane, angle)
    trains = int(constants[N_TRAINS * LANES + lane])
    for train in range(1, trains):
        other = driven_angle + 2.0 * math.pi * train / trains
        other = other - 2.0 * math.pi if other >= 2.0 * math.pi else other
        largest = max(largest, train_ratio_at(constants, lane, driver_angle_at(constants, lane, other)))
    return largest


@subroutine()
def _value(constants, lane, angle, of_one):
    """Minus the ratio of one train, or the ratio of all, at an angle of the first train's gear 1."""
    if of_one:
        return -train_ratio_at(constants, lane, angle)
    driven_angle = driven_angle_at(constants, lane, angle, angle > constants[SECTOR_ANGLE * LANES + lane])
    return overall_ratio_at(constants, lane, angle, driven_angle)


#: Search for the least `_value`, also at the corner between two trains.
_least = least_of(_value)


@subroutine()
def solve_second_joints(constants, lane):
    """Fill the input angles at which the second pair of the first train is at the ends of its working sector."""
    shift, sector, turn = constants[SHIFT * LANES + lane], constants[SECTOR_ANGLE * LANES + lane], 2.0 * math.pi
    end, start = sector - shift, turn - shift
    end = end + turn if end < 0.0 else end
    constants[SECOND_END * LANES + lane] = driven_angle_at(constants, lane, end, end > sector)
    constants[SECOND_START * LANES + lane] = driven_angle_at(constants, lane, start, start > sector)


@subroutine(inlined=True)
def joints_at(constants, lane, driven_angle):
    """Three numbers that change their signs at an input angle where a pair is at a joint.

    These are the second pair of the first train, the first and the second pairs of all trains. The latter are 1 where
    the drive has no ripple.
    """
    half, is_steady = 0.5 * constants[N_TRAINS * LANES + lane], constants[STEADY * LANES + lane] > 0.0
    beyond = driven_angle - constants[DRIVEN_SECTOR * LANES + lane]
    to_end = driven_angle - constants[SECOND_END * LANES + lane]
    to_start = driven_angle - constants[SECOND_START * LANES + lane]
    train = sine(0.5 * to_end) * sine(0.5 * to_start)
    first, second = sine(half * driven_angle) * sine(half * beyond), sine(half * to_end) * sine(half * to_start)
    return train, 1.0 if is_steady else first, 1.0 if is_steady else second


@subroutine()
def solve_shift(log_growth, sector, constant, trains):
    """The largest phase shift without ripple, rad, and the ratio of the drive at it.

    A train has the ratio of the plateau over an input angle of k (m^(sector - shift) - 1), and must keep it until the
    next train has it. Without a shift the drive runs at 1 and has no ripple.
    """
    shift = sector - math.log1p(2.0 * math.pi / (trains * constant)) / log_growth
    shift = max(shift, 0.0)
    return shift, math.exp(log_growth * shift)


@subroutine()
def solve_ripple(constants, lane, branch, largest_shift):
    """The change of the ratio of all trains over the turn, over its largest value; fill the ratio where it is 0."""
    shift, sector = constants[SHIFT * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    if shift == 0.0 or (branch == 1.0 and shift <= largest_shift):
        constants[STEADY * LANES + lane] = math.exp(constants[LOG_GROWTH * LANES + lane] * shift)
        return 0.0
    trains, first = int(constants[N_TRAINS * LANES + lane]), 0.0
    spacing, log_growth = 2.0 * math.pi / trains, constants[LOG_GROWTH * LANES + lane]
    if shift < sector:
        # between the end of one train's plateau and the start of the next one's
        first = min(constants[CONSTANT * LANES + lane] * math.expm1(log_growth * (sector - shift)), spacing)
    lowest = math.inf
    # The trains in turn: where one turns much faster than the input, its own angles resolve the ratio.
    for train in range(trains):
        low = driver_angle_at(constants, lane, first + train * spacing)
        high = 2.0 * math.pi if train == trains - 1 else driver_angle_at(constants, lane, (train + 1) * spacing)
        lowest = min(lowest, _least(constants, lane, low, high, _GRID, False))
    if branch == 1.0 and shift < sector:
        highest = math.exp(log_growth * shift)
    else:
        highest = -_least_off_plateau(constants, lane, branch, True)
        lowest = min(lowest, _least_off_plateau(constants, lane, branch, False))
    return (highest - min(lowest, highest)) / highest


@subroutine()
def _least_off_plateau(constants, lane, branch, of_one):
    """The least `_value` with the first or the second pair of a train in its return, which oscillates on a branch."""
    shift, sector = constants[SHIFT * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    turn, steps = 2.0 * math.pi, _GRID * int(branch)
    least = _least(constants, lane, sector, turn, steps, of_one)
    least = min(least, _least(constants, lane, max(sector - shift, 0.0), turn - shift, steps, of_one))
    if shift > sector:
        least = min(least, _least(constants, lane, turn + sector - shift, turn, steps, of_one))
    return least
