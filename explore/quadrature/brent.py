"""Brent's method for minima in all lanes: parabolas through the three best points within a bracket.

R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5. It starts from three samples, so that its
first step is a parabola's. A step of relative size 3e-8 ends it, on a panel of the adaptive rule also relative to its
half length: the value is then exact to rounding.
"""

import math

from explore.compiling import LANES
from explore.lanes.elementary import exponential
from explore.quadrature.tiles import TILE_RESOLUTION, TILE_SCALE
from explore.subroutines import subroutine

_GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))
_MOST_STEPS = 60
#: Last step, relative to 1 + |t| and the resolution of the tile.
_LAST_STEP = 3e-8
#: Steps shrink by no more than this factor, of order 1.3 from one of 0.1.
_SHRINKAGE = 1e-4

# Rows of the state: bracket, the three best points and their values, this step and the one before, trial point, whether
# the lane is at work.
LOW, HIGH, BEST, SECOND, THIRD, AT_BEST, AT_SECOND, AT_THIRD, STEP, PREVIOUS, TRIAL, ACTIVE = (
    row * LANES for row in range(12)
)
BRENT_ROWS = 12


@subroutine(fast=True)
def fill_trial_tangents(shape, state, tangents):
    """Fill the half-tangents of the trial points."""
    for lane in range(LANES):
        growth = exponential(state[TRIAL + lane])
        tangents[lane] = 0.5 * shape[TILE_SCALE + lane] * (growth - 1.0 / growth)


@subroutine()
def _propose(state, lane, last_step):
    """Fill the trial point of one lane: the parabola's vertex, or a golden section."""
    low, high, best = state[LOW + lane], state[HIGH + lane], state[BEST + lane]
    tolerance = last_step * (1.0 + abs(best))
    previous = state[PREVIOUS + lane]
    golden = True
    if abs(previous) > tolerance:
        second, third = state[SECOND + lane], state[THIRD + lane]
        r = (best - second) * (state[AT_BEST + lane] - state[AT_THIRD + lane])
        q = (best - third) * (state[AT_BEST + lane] - state[AT_SECOND + lane])
        p = (best - third) * q - (best - second) * r
        q = 2.0 * (q - r)
        p = -p if q > 0.0 else p
        q = abs(q)
        if abs(p) < abs(0.5 * q * previous) and p > q * (low - best) and p < q * (high - best):
            state[PREVIOUS + lane], state[STEP + lane] = state[STEP + lane], p / q
            golden = False
    if golden:
        previous = (low if best >= 0.5 * (low + high) else high) - best
        state[PREVIOUS + lane], state[STEP + lane] = previous, _GOLDEN * previous
    step = state[STEP + lane]
    # A vertex much nearer to the best point than steps shrink is a coincidence.
    least = max(0.1 * tolerance, _SHRINKAGE * abs(state[PREVIOUS + lane]))
    if abs(step) < least:
        step = least if step > 0.0 else -least
        step = -step if not low < best + step < high else step
        state[STEP + lane] = step
    state[TRIAL + lane] = best + step


@subroutine()
def _accept(state, lane, value, last_step):
    """Update one lane by the value at its trial point; the lane rests after a step at the limit of precision."""
    trial, best, at_best = state[TRIAL + lane], state[BEST + lane], state[AT_BEST + lane]
    if abs(trial - best) <= last_step * (1.0 + abs(best)):
        state[AT_BEST + lane], state[ACTIVE + lane] = min(value, at_best), 0.0
        return
    if value <= at_best:
        if trial >= best:
            state[LOW + lane] = best
        else:
            state[HIGH + lane] = best
        state[THIRD + lane], state[AT_THIRD + lane] = state[SECOND + lane], state[AT_SECOND + lane]
        state[SECOND + lane], state[AT_SECOND + lane] = best, at_best
        state[BEST + lane], state[AT_BEST + lane] = trial, value
        return
    if trial < best:
        state[LOW + lane] = trial
    else:
        state[HIGH + lane] = trial
    if value <= state[AT_SECOND + lane] or state[SECOND + lane] == best:
        state[THIRD + lane], state[AT_THIRD + lane] = state[SECOND + lane], state[AT_SECOND + lane]
        state[SECOND + lane], state[AT_SECOND + lane] = trial, value
    elif value <= state[AT_THIRD + lane] or state[THIRD + lane] == best or state[THIRD + lane] == state[SECOND + lane]:
        state[THIRD + lane], state[AT_THIRD + lane] = trial, value


@subroutine()
def minimise(fill, constants, shape, anchor, law, variant, needs, row, sign, state, tangents, signals):
    """Run Brent's method in all active lanes; BEST and AT_BEST hold the minimum of ``sign * signal``."""
    for _ in range(_MOST_STEPS):
        working = False
        for lane in range(LANES):
            if state[ACTIVE + lane] != 0.0:
                _propose(state, lane, _LAST_STEP * shape[TILE_RESOLUTION + lane])
                working = True
            else:
                state[TRIAL + lane] = state[BEST + lane]
        if not working:
            break
        fill_trial_tangents(shape, state, tangents)
        fill(constants, tangents, anchor, law, variant, 1, needs, signals)
        for lane in range(LANES):
            if state[ACTIVE + lane] != 0.0:
                value = sign * signals[row * LANES + lane]
                _accept(state, lane, value, _LAST_STEP * shape[TILE_RESOLUTION + lane])


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
