"""Where one of several equal mechanisms behind one-way clutches hands the output over to the next.

Newton's method in all lanes, within a bracket that is halved where a step leaves it or the steps do not shrink (W. H.
Press et al., Numerical Recipes, 2007, section 9.4). A point of the stroke is tan(offset/2) = T sinh(t).
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential, inverse_sinh
from explore.base.subroutines import subroutine

_MOST_STEPS = 100
#: Largest last step of Newton's method, whose square is below rounding, relative to 1 + |t|.
_LAST_STEP = 1e-9
#: Largest last step of halving, which is rounding, relative to 1 + |t|.
_LEAST_STEP = 4e-16

# Rows of the state. Of a stroke: half-tangents of its ends, T, 1 where the magnitude of the rate is that of a positive
# rate and -1 of a negative one, period (rad). Of the search: sine and cosine of half the shift, sign of the difference,
# bracket, point, last step and the one before, whether the lane is done, T cosh(t), the ends that were found.
FIRST, LAST, SCALE, RISING, PERIOD = (row * LANES for row in range(5))
_SINE, _COSINE, _SIGN, _LOW, _HIGH, _POINT, _STEP, _PREVIOUS, _DONE, _SPREAD, _BEGIN, _END = (
    row * LANES for row in range(5, 17)
)
HAND_OVER_SIZE = 17 * LANES


@subroutine(contract=True, inlined=True)
def _rotate(tangent, sine, cosine):
    """The half-tangent of a shifted angle. A sum of angles would lose the last bits next to a singularity."""
    return (tangent * cosine + sine) / (cosine - tangent * sine)


@subroutine(contract=True)
def _place_points(state, tangents):
    """Fill the half-tangents of the points and of those shifted from them."""
    for lane in range(LANES):
        growth, half_scale = exponential(state[_POINT + lane]), 0.5 * state[SCALE + lane]
        decay = 1.0 / growth
        tangent = half_scale * (growth - decay)
        state[_SPREAD + lane], tangents[lane] = half_scale * (growth + decay), tangent
        tangents[LANES + lane] = _rotate(tangent, state[_SINE + lane], state[_COSINE + lane])


@subroutine(contract=True)
def _improve(state, tangents, rates, shifted_rates, slopes, shifted_slopes):
    """One step of every lane that is not done: the difference of the rates is negative at LOW, positive at HIGH."""
    for lane in range(LANES):
        point, low, high, sign = state[_POINT + lane], state[_LOW + lane], state[_HIGH + lane], state[_SIGN + lane]
        value = sign * (rates[lane] - shifted_rates[lane])
        # d theta/dt = 2 T cosh(t)/(1 + tan^2)
        slope = 2.0 * sign * state[_SPREAD + lane] * (slopes[lane] - shifted_slopes[lane])
        slope = slope / (1.0 + tangents[lane] * tangents[lane])
        low, high = point if value < 0.0 else low, point if value > 0.0 else high
        by_newton = point - value / slope
        shrinks = 2.0 * abs(value) <= abs(state[_PREVIOUS + lane] * slope)
        is_newton = (by_newton > low) & (by_newton < high) & shrinks
        following = by_newton if is_newton else 0.5 * (low + high)
        step, was_done = abs(following - point), state[_DONE + lane] == 1.0
        is_last = step <= (_LAST_STEP if is_newton else _LEAST_STEP) * (1.0 + abs(point))
        state[_POINT + lane] = point if was_done else following
        state[_LOW + lane], state[_HIGH + lane] = low, high
        state[_PREVIOUS + lane], state[_STEP + lane] = state[_STEP + lane], step
        state[_DONE + lane] = 1.0 if was_done | is_last else 0.0


@subroutine(contract=True)
def _bracket(state, first, last):
    """Start the search between two half-tangents, at the middle."""
    for lane in range(LANES):
        low, high = inverse_sinh(first[lane] / state[SCALE + lane]), inverse_sinh(last[lane] / state[SCALE + lane])
        state[_LOW + lane], state[_HIGH + lane], state[_POINT + lane] = low, high, 0.5 * (low + high)
        state[_STEP + lane] = state[_PREVIOUS + lane] = high - low
        state[_DONE + lane] = 0.0


@subroutine()
def _search(fill, constants, anchor, law, variant, needs, rows, row, rate_row, state, tangents, signals):
    """Find the point of every lane, and fill its half-tangents."""
    for _ in range(_MOST_STEPS):
        done = 0.0
        for lane in range(LANES):
            done += state[_DONE + lane]
        if done == LANES:
            break
        _place_points(state, tangents)
        fill(constants, tangents, anchor, law, variant, 2, needs, signals)
        _improve(
            state, tangents, signals[row * LANES :], signals[(rows + row) * LANES :], signals[rate_row * LANES :],
            signals[(rows + rate_row) * LANES :],
        )  # fmt: skip
    _place_points(state, tangents)


@subroutine()
def find_hand_overs(fill, constants, anchor, law, variant, needs, rows, row, rate_row, state, tangents, signals):
    """Replace the ends of strokes by the two points, a period apart, where one clutch hands over to the next.

    A period has one such pair, because the rate has one extreme on each stroke. The point where the rate changes more
    is solved for; the other follows. Of the signals that `fill` writes, `row` is the rate of the output and `rate_row`
    its derivative. FIRST and LAST of `state` (HAND_OVER_SIZE,) are replaced, its rows FIRST to PERIOD given; `tangents`
    and `signals` are work space for two nodes of each lane.
    """
    for lane in range(LANES):
        sine, cosine = math.sin(0.5 * state[PERIOD + lane]), math.cos(0.5 * state[PERIOD + lane])
        cosine = 0.0 if abs(cosine) < 1e-15 else cosine
        state[_SINE + lane], state[_COSINE + lane], state[_SIGN + lane] = sine, cosine, state[RISING + lane]
        state[_END + lane] = _rotate(state[LAST + lane], -sine, cosine)
    _bracket(state, state[FIRST:], state[_END:])
    _search(fill, constants, anchor, law, variant, needs, rows, row, rate_row, state, tangents, signals)
    fill(constants, tangents, anchor, law, variant, 2, needs, signals)
    for lane in range(LANES):
        sine, cosine = state[_SINE + lane], state[_COSINE + lane]
        state[_BEGIN + lane], state[_END + lane] = tangents[lane], tangents[LANES + lane]
        state[_SINE + lane], state[_SIGN + lane] = -sine, -state[RISING + lane]
        tangents[lane] = _rotate(state[FIRST + lane], sine, cosine)
    _bracket(state, tangents, state[LAST:])
    for lane in range(LANES):
        is_steeper = abs(signals[(rows + rate_row) * LANES + lane]) > abs(signals[rate_row * LANES + lane])
        state[_DONE + lane] = 0.0 if is_steeper else 1.0
        state[_POINT + lane] = inverse_sinh(state[_END + lane] / state[SCALE + lane])
        state[FIRST + lane] = 1.0 if is_steeper else 0.0
    _search(fill, constants, anchor, law, variant, needs, rows, row, rate_row, state, tangents, signals)
    for lane in range(LANES):
        is_steeper = state[FIRST + lane] == 1.0
        state[FIRST + lane] = tangents[LANES + lane] if is_steeper else state[_BEGIN + lane]
        state[LAST + lane] = tangents[lane] if is_steeper else state[_END + lane]
