"""Minima by polynomials through samples: each trial is at the minimum of one through the samples and former trials.

The first polynomial p is the one of order four through five samples. What a trial differs from it is a multiple of the
product w of the distances from these samples, p + g w with g through the last three trials: constant after one, linear
after two, then quadratic. Two or three trials reach most minima exact to rounding, where parabolas through three points
take six. With g through the last two alone, trials may come back to the third last, which would tell nothing new. Lanes
whose polynomials have no minimum within the bracket, or do not settle, are left to Brent's method.
"""

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.brent import (
    ACTIVE,
    AT_BEST,
    BEST,
    BRENT_ROWS,
    HIGH,
    LOW,
    TRIAL,
    count_lanes,
    fill_trial_tangents,
)
from explore.evaluation.quadrature.candidates import divided_differences
from explore.evaluation.quadrature.tiles import TILE_RESOLUTION

#: Largest number of trials.
_MOST_TRIALS = 6
#: Smallest number of trials: by chance the first may not move the minimum.
_FEWEST_TRIALS = 2
#: Drop of the polynomial below the best value, over its size, that rounding hides.
_DROP = 2.0**-50
#: Largest last step, relative to the resolution of the tile.
_LAST_STEP = 1e-4
#: Smallest ratio of a step to the one before, which keeps differences of trials from being all rounding.
_SHRINKAGE = 1e-4

# Rows of the state after those of Brent's method: whether the lane is at work, its samples as distances from the
# candidate and values, which p's coefficients replace; distances of the last and the best trial, the value of the
# latter, the last step; g at the last trial, its slope to the trial before, the distance of that, half g's curvature;
# where Newton's method starts.
FITS, DISTANCES, VALUES = BRENT_ROWS * LANES, (BRENT_ROWS + 1) * LANES, (BRENT_ROWS + 5) * LANES
_LAST, _NEAREST, _LEAST, _STEP, _FACTOR, _GROWTH, _FORMER, _BOW, _START = (
    (BRENT_ROWS + 10 + row) * LANES for row in range(9)
)
FIT_ROWS = 19


@subroutine(no_alias=True)
def _interpolate(state):
    """Replace the values of the samples by the coefficients of the polynomial through them."""
    for lane in range(LANES):
        y1, y2 = state[DISTANCES + lane], state[DISTANCES + LANES + lane]
        y3, y4 = state[DISTANCES + 2 * LANES + lane], state[DISTANCES + 3 * LANES + lane]
        f0, f1, f2 = state[VALUES + lane], state[VALUES + LANES + lane], state[VALUES + 2 * LANES + lane]
        f3, f4 = state[VALUES + 3 * LANES + lane], state[VALUES + 4 * LANES + lane]
        d01, d02, d03, d04 = divided_differences(f0, f1, f2, f3, f4, y1, y2, y3, y4)
        a1, a2 = d01 - y1 * (d02 - y2 * (d03 - y3 * d04)), d02 - (y1 + y2) * d03 + (y1 * y2 + (y1 + y2) * y3) * d04
        a3, a4 = d03 - (y1 + y2 + y3) * d04, d04
        state[VALUES + LANES + lane], state[VALUES + 2 * LANES + lane] = a1, a2
        state[VALUES + 3 * LANES + lane], state[VALUES + 4 * LANES + lane] = a3, a4
        y = -0.5 * a1 / a2
        slope = a1 + y * (2.0 * a2 + y * (3.0 * a3 + y * 4.0 * a4))
        state[_START + lane] = y - 0.5 * slope / (a2 + y * (3.0 * a3 + y * 6.0 * a4))
        state[_LAST + lane] = state[_NEAREST + lane] = state[_FACTOR + lane] = state[_GROWTH + lane] = 0.0
        state[_FORMER + lane] = state[_BOW + lane] = 0.0
        state[_LEAST + lane], state[_STEP + lane] = f0, state[HIGH + lane] - state[LOW + lane]


@subroutine(inlined=True)
def _product(y, y1, y2, y3, y4):
    """The product of distances from the samples, with its first and half its second derivative."""
    a, b = (y - y1) * (y - y2), (y - y3) * (y - y4)
    da, db = 2.0 * y - y1 - y2, 2.0 * y - y3 - y4
    c, dc, hc = a * b, da * b + a * db, a + b + da * db
    return y * c, c + y * dc, dc + y * hc


@subroutine(inlined=True)
def _improve(y, last, former, a1, a2, a3, a4, y1, y2, y3, y4, factor, growth, bow):
    """Take one of Newton's steps for the minimum of the polynomial; half the curvature at y is given too."""
    w, dw, hw = _product(y, y1, y2, y3, y4)
    g, dg = factor + (y - last) * (growth + bow * (y - former)), growth + bow * (2.0 * y - last - former)
    slope = a1 + y * (2.0 * a2 + y * (3.0 * a3 + y * 4.0 * a4)) + g * dw + dg * w
    bend = a2 + y * (3.0 * a3 + y * 6.0 * a4) + g * hw + dg * dw + bow * w
    return y - 0.5 * slope / bend, bend


@subroutine(no_alias=True)
def _propose(state, trials, resolutions):
    """Fill the trial points with the minima, if not too near to the last ones; lanes that are done, or fail, rest."""
    for lane in range(LANES):
        y1, y2 = state[DISTANCES + lane], state[DISTANCES + LANES + lane]
        y3, y4 = state[DISTANCES + 2 * LANES + lane], state[DISTANCES + 3 * LANES + lane]
        a1, a2 = state[VALUES + LANES + lane], state[VALUES + 2 * LANES + lane]
        a3, a4 = state[VALUES + 3 * LANES + lane], state[VALUES + 4 * LANES + lane]
        last, nearest, least = state[_LAST + lane], state[_NEAREST + lane], state[_LEAST + lane]
        factor, growth, before = state[_FACTOR + lane], state[_GROWTH + lane], state[_STEP + lane]
        former, bow = state[_FORMER + lane], state[_BOW + lane]
        low, high, best, at_best = state[LOW + lane], state[HIGH + lane], state[BEST + lane], state[AT_BEST + lane]
        fits, active = state[FITS + lane], state[ACTIVE + lane]
        y, bend = _improve(state[_START + lane], last, former, a1, a2, a3, a4, y1, y2, y3, y4, factor, growth, bow)
        y, bend = _improve(y, last, former, a1, a2, a3, a4, y1, y2, y3, y4, factor, growth, bow)
        is_near = (trials >= _FEWEST_TRIALS) & (abs(before) <= _LAST_STEP * resolutions[lane])
        is_inside = (bend > 0.0) & (best + y > low) & (best + y < high) & (fits != 0.0)
        is_done = is_inside & is_near & (bend * (y - nearest) * (y - nearest) <= _DROP * abs(least))
        step, finest = y - last, _SHRINKAGE * abs(before)
        finest_step = finest if step > 0.0 else -finest
        step = finest_step if abs(step) < finest else step
        goes_on = is_inside & (not is_done) & (trials < _MOST_TRIALS)
        # a least step may be longer than the bracket, beyond which the signal may have another law
        trial = best + (last + step if goes_on else 0.0)
        trial = low if trial < low else trial
        state[TRIAL + lane] = high if trial > high else trial
        state[_STEP + lane] = step if goes_on else before
        state[FITS + lane] = 1.0 if goes_on else 0.0
        state[BEST + lane] = best + (nearest if is_done else 0.0)
        state[AT_BEST + lane] = least if is_done else at_best
        state[ACTIVE + lane] = 0.0 if is_done else active


@subroutine(no_alias=True)
def _accept(state, signal, sign, trials):
    """Take the values at the trial points, before which there were so many."""
    for lane in range(LANES):
        y1, y2 = state[DISTANCES + lane], state[DISTANCES + LANES + lane]
        y3, y4 = state[DISTANCES + 2 * LANES + lane], state[DISTANCES + 3 * LANES + lane]
        a0, a1, a2 = state[VALUES + lane], state[VALUES + LANES + lane], state[VALUES + 2 * LANES + lane]
        a3, a4 = state[VALUES + 3 * LANES + lane], state[VALUES + 4 * LANES + lane]
        last, nearest, least = state[_LAST + lane], state[_NEAREST + lane], state[_LEAST + lane]
        value, before = sign * signal[lane], state[_FACTOR + lane]
        y = state[TRIAL + lane] - state[BEST + lane]
        w, _, _ = _product(y, y1, y2, y3, y4)
        factor = (value - (a0 + y * (a1 + y * (a2 + y * (a3 + y * a4))))) / w
        growth = (factor - before) / (y - last)
        bow = (growth - state[_GROWTH + lane]) / (y - state[_FORMER + lane])
        state[_FACTOR + lane], state[_GROWTH + lane] = factor, growth if trials > 0 else 0.0
        state[_FORMER + lane], state[_BOW + lane] = last, bow if trials > 1 else 0.0
        state[_LAST + lane] = state[_START + lane] = y
        state[_NEAREST + lane] = y if value <= least else nearest
        state[_LEAST + lane] = value if value <= least else least


@subroutine()
def fit_minimum(fill, constants, shape, anchor, law, variant, needs, row, sign, state, tangents, signals):
    """Look for the minimum of ``sign * signal`` in all lanes that fit; in those that find it Brent's method rests.

    DISTANCES of such a lane hold those of its samples from the first one, its candidate, VALUES those of all five.
    """
    if count_lanes(state[FITS:]) == 0.0:
        return
    resolutions = shape[TILE_RESOLUTION:]
    _interpolate(state)
    for trials in range(_MOST_TRIALS + 1):
        _propose(state, trials, resolutions)
        if count_lanes(state[FITS:]) == 0.0:
            return
        fill_trial_tangents(shape, state, tangents)
        fill(constants, tangents, anchor, law, variant, 1, needs, signals)
        _accept(state, signals[row * LANES :], sign, trials)
