"""Statistics of one sampled signal: two-pass moments and refined extremes."""

import math

from explore.compiling import compiled

_GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))

#: Flags of a row, or-ed: its moments are computed; its error bound includes that of the cv, or of the standard
#: deviation; its extremes are computed; it holds squares; it only bounds the errors of another row; it is small beside
#: its terms and has their singularities.
FLAG_MOMENTS, FLAG_CV, FLAG_STD, FLAG_EXTREMES, FLAG_SQUARES, FLAG_TERMS, FLAG_RESIDUAL = 1, 2, 4, 8, 16, 32, 64


@compiled("UniTuple(float64, 2)(float64[:, ::1], int64, float64[::1], int64, float64, float64)", fast=True)
def mean_and_variance(signals, row, weights, count, length, rest):
    """Mean and population variance of one row over `length`; over the part `rest` of it the signal is 0.

    The variance is a sum of squared deviations, in a second pass, so that a swing of a fraction of a degree loses no
    digits.
    """
    total = 0.0
    for j in range(count):
        total += weights[j] * signals[row, j]
    mean = total / length
    total = 0.0
    for j in range(count):
        deviation = signals[row, j] - mean
        total += weights[j] * deviation * deviation
    return mean, (total + rest * mean * mean) / length


@compiled()
def _value_at(fill, kernel, shape, anchor, row, needs, t, node, scratch):
    """The signal at one t of a panel."""
    tangent = shape[2] * math.sinh(t)
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    if anchor == 0:
        node[0, 0], node[1, 0] = tangent * cosine, cosine
    else:
        node[0, 0], node[1, 0] = cosine, -tangent * cosine
    fill(kernel, node[0], node[1], 1, needs, scratch)
    return scratch[row, 0]


@compiled()
def refined_minimum(fill, kernel, shape, anchor, row, needs, sign, low, best, high, value, node, scratch):
    """Smallest ``sign * signal`` between low and high (in t), and its position, by Brent's method without derivatives.

    `best` is a sample between them with the value `value`. R. P. Brent, Algorithms for Minimization without
    Derivatives, 1973, chapter 5. The position is accurate to about 1e-8, hence the value to rounding.
    """
    # One long function, because its parts would exchange the ten numbers of the iteration's state.
    if best == low or best == high:
        # In most cases the minimum is at the end of a panel. One evaluation inside confirms it, where Brent's method
        # would need forty golden sections to converge to the end.
        inside = best + math.copysign(1e-8 * (1.0 + abs(best)), low + high - 2.0 * best)
        if sign * _value_at(fill, kernel, shape, anchor, row, needs, inside, node, scratch) >= value:
            return value, best
    second, third = best, best
    at_best, at_second, at_third = value, value, value
    step, previous = 0.0, 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        tolerance = 1e-9 * abs(best) + 1e-9
        if abs(best - middle) <= 2.0 * tolerance - 0.5 * (high - low):
            break
        golden = True
        if abs(previous) > tolerance:
            r = (best - second) * (at_best - at_third)
            q = (best - third) * (at_best - at_second)
            p = (best - third) * q - (best - second) * r
            q = 2.0 * (q - r)
            p = -p if q > 0.0 else p
            q = abs(q)
            if abs(p) < abs(0.5 * q * previous) and p > q * (low - best) and p < q * (high - best):
                previous, step = step, p / q
                golden = False
        if golden:
            previous = (low if best >= middle else high) - best
            step = _GOLDEN * previous
        if abs(step) < tolerance:
            step = tolerance if step > 0.0 else -tolerance
        trial = best + step
        at_trial = sign * _value_at(fill, kernel, shape, anchor, row, needs, trial, node, scratch)
        if at_trial <= at_best:
            low, high = (best, high) if trial >= best else (low, best)
            third, at_third, second, at_second, best, at_best = second, at_second, best, at_best, trial, at_trial
        else:
            low, high = (trial, high) if trial < best else (low, trial)
            if at_trial <= at_second or second == best:
                third, at_third, second, at_second = second, at_second, trial, at_trial
            elif at_trial <= at_third or third == best or third == second:
                third, at_third = trial, at_trial
    return at_best, best
