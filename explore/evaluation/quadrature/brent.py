"""Brent's method for minima in all lanes: parabolas through the three best points within a bracket.

R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5. It starts from three samples, so that its
first step is a parabola's. A step of relative size 3e-8 through near points ends it, on a panel of the adaptive rule
also relative to its half length: the value is then exact to rounding.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential, tangent
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.tiles import TILE_RESOLUTION, TILE_SCALE, turn_nodes

_GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))
_MOST_STEPS = 60
#: Largest last step, relative to 1 + |t| and the resolution of the tile.
_LAST_STEP = 3e-8
# A vertex errs by the product times third over second derivative, and far points may give a small step by chance.
#: Largest product of the best point's distances from the other two at the last step, over the resolution's square.
_NEAREST = 1e-10
#: Smallest ratio of a step to the one before: a vertex that is nearer to the best point is a coincidence.
_SHRINKAGE = 1e-4

# Rows of the state: bracket, the three best points and their values, this step and the one before, trial point, whether
# the lane is at work.
LOW, HIGH, BEST, SECOND, THIRD, AT_BEST, AT_SECOND, AT_THIRD, STEP, PREVIOUS, TRIAL, ACTIVE = (
    row * LANES for row in range(12)
)
BRENT_ROWS = 12


@subroutine(fast=True, no_alias=True)
def fill_trial_tangents(shape, state, tangents):
    """Fill the half-tangents of the trial points."""
    if shape[TILE_SCALE] == 0.0:
        for lane in range(LANES):
            tangents[lane] = tangent(state[TRIAL + lane])
        return
    for lane in range(LANES):
        growth = exponential(state[TRIAL + lane])
        tangents[lane] = 0.5 * shape[TILE_SCALE + lane] * (growth - 1.0 / growth)
    turn_nodes(shape, 1, tangents)


@subroutine(no_alias=True)
def _propose(state, resolutions):
    """Fill the trial points: the parabola's vertex, or a golden section; the best points of lanes that rest.

    Without branches, like `_accept`, so that loops over lanes vectorise.
    """
    for lane in range(LANES):
        low, high, best = state[LOW + lane], state[HIGH + lane], state[BEST + lane]
        second, third, previous = state[SECOND + lane], state[THIRD + lane], state[PREVIOUS + lane]
        tolerance = _LAST_STEP * resolutions[lane] * (1.0 + abs(best))
        r = (best - second) * (state[AT_BEST + lane] - state[AT_THIRD + lane])
        q = (best - third) * (state[AT_BEST + lane] - state[AT_SECOND + lane])
        p = (best - third) * q - (best - second) * r
        q = 2.0 * (q - r)
        p = -p if q > 0.0 else p
        q = abs(q)
        is_inside = (p > q * (low - best)) & (p < q * (high - best))
        is_parabola = (abs(previous) > tolerance) & (abs(p) < abs(0.5 * q * previous)) & is_inside
        larger_part = (low if best >= 0.5 * (low + high) else high) - best
        step, before = (p / q, state[STEP + lane]) if is_parabola else (_GOLDEN * larger_part, larger_part)
        shrunk, finest = _SHRINKAGE * abs(before), 0.1 * tolerance
        least = shrunk if shrunk > finest else finest
        least_step = least if step > 0.0 else -least
        stays = (low < best + least_step) & (best + least_step < high)
        least_step = least_step if stays else -least_step
        step = least_step if abs(step) < least else step
        # A least step may be longer than the bracket, beyond which the signal may have another law.
        trial = best + step
        trial = low if trial < low else trial
        trial = high if trial > high else trial
        is_active = state[ACTIVE + lane] != 0.0
        state[PREVIOUS + lane] = before if is_active else previous
        state[STEP + lane] = step if is_active else state[STEP + lane]
        state[TRIAL + lane] = trial if is_active else best


@subroutine(no_alias=True)
def _accept(state, signal, sign, resolutions):
    """Update the lanes at work by the signal at their trial points.

    A lane rests after a step at the limit of precision.
    """
    for lane in range(LANES):
        value, trial = sign * signal[lane], state[TRIAL + lane]
        best, second, third = state[BEST + lane], state[SECOND + lane], state[THIRD + lane]
        at_best, at_second, at_third = state[AT_BEST + lane], state[AT_SECOND + lane], state[AT_THIRD + lane]
        is_active = state[ACTIVE + lane] != 0.0
        is_last = is_active & (abs(trial - best) <= _LAST_STEP * resolutions[lane] * (1.0 + abs(best)))
        distances = abs(second - best) * abs(third - best)
        is_last = is_last & (distances <= _NEAREST * resolutions[lane] * resolutions[lane])
        goes_on = is_active & (not is_last)
        is_better, is_right = value <= at_best, trial >= best
        inner = best if is_better else trial
        replaces_low = goes_on & (is_better == is_right)
        replaces_high = goes_on & (is_better != is_right)
        is_best = goes_on & is_better
        is_second = goes_on & (not is_better) & ((value <= at_second) | (second == best))
        is_third = goes_on & (not is_better) & (not is_second)
        is_third = is_third & ((value <= at_third) | (third == best) | (third == second))
        moves = is_best | is_second
        state[LOW + lane] = inner if replaces_low else state[LOW + lane]
        state[HIGH + lane] = inner if replaces_high else state[HIGH + lane]
        new_third, new_at_third = (trial, value) if is_third else (third, at_third)
        state[THIRD + lane] = second if moves else new_third
        state[AT_THIRD + lane] = at_second if moves else new_at_third
        new_second, new_at_second = (trial, value) if is_second else (second, at_second)
        state[SECOND + lane] = best if is_best else new_second
        state[AT_SECOND + lane] = at_best if is_best else new_at_second
        state[BEST + lane] = trial if is_best else best
        state[AT_BEST + lane] = value if is_best | (is_last & (value < at_best)) else at_best
        state[ACTIVE + lane] = 0.0 if is_last else state[ACTIVE + lane]


@subroutine(fast=True)
def count_lanes(flags):
    """The number of lanes with a flag of 1, where others have 0."""
    total = 0.0
    for lane in range(LANES):
        total += flags[lane]
    return total


@subroutine()
def minimise(fill, constants, shape, anchor, law, variant, needs, row, sign, state, tangents, signals):
    """Run Brent's method in all active lanes; BEST and AT_BEST hold the minimum of ``sign * signal``."""
    resolutions = shape[TILE_RESOLUTION:]
    for _ in range(_MOST_STEPS):
        if count_lanes(state[ACTIVE:]) == 0.0:
            break
        _propose(state, resolutions)
        fill_trial_tangents(shape, state, tangents)
        fill(constants, tangents, anchor, law, variant, 1, needs, signals)
        _accept(state, signals[row * LANES :], sign, resolutions)


@subroutine()
def start_lane(state, lane, low, best, high, at_low, at_best, at_high, previous):
    """Start Brent's method in a lane from three points."""
    state[LOW + lane], state[HIGH + lane], state[BEST + lane], state[AT_BEST + lane] = low, high, best, at_best
    if at_low <= at_high:
        state[SECOND + lane], state[AT_SECOND + lane], state[THIRD + lane], state[AT_THIRD + lane] = (
            low,
            at_low,
            high,
            at_high,
        )
    else:
        state[SECOND + lane], state[AT_SECOND + lane], state[THIRD + lane], state[AT_THIRD + lane] = (
            high,
            at_high,
            low,
            at_low,
        )
    state[STEP + lane], state[PREVIOUS + lane], state[ACTIVE + lane] = previous, previous, 1.0
