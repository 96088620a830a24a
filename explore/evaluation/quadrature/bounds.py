"""Bounds of the errors of moments, for many designs at once.

Rows of one buffer with constant offsets, one number for each design of a chunk; see `quadrature.panels`.
"""

import math

from explore.base.subroutines import subroutine

#: Number of designs of one chunk.
CHUNK = 2048
#: Rounding error of one statistic relative to the rms of its signal, from the accuracy campaign.
ROUNDING = 4e-15
#: Length of a window below which a signal that varies may have samples that are all equal, rad.
_SHORT = 1e-3
#: Smallest standard deviation that samples can show, relative to the rms.
_LEAST_DEVIATION = 1e-16

# Flags of a row, or-ed: its moments are computed; its error bound includes that of the cv, or of the standard
# deviation; its extremes are computed; it holds squares; it only bounds the errors of another row; it is small beside
# its terms and has their singularities.
FLAG_MOMENTS, FLAG_CV, FLAG_STD, FLAG_EXTREMES, FLAG_SQUARES, FLAG_TERMS, FLAG_RESIDUAL = 1, 2, 4, 8, 16, 32, 64

# Rows: moments, rms and bound of the row at hand, its part by rounding, rounding of one statistic, size of the terms,
# and the model's error; whether more nodes can lower a bound; noise; largest rms of all and of the slow signals; worst
# bound; the model's errors by pole order; length, rest, nodes, and whether no rule has more; the length that the row at
# hand is relative to, 1 without one; sums of tails, and how many times their share exceeds the model.
MEAN, VARIANCE, RMS, BOUND, LEAST, ROUNDING_OF_ROW, TERMS, QUADRATURE, IMPROVABLE, NOISE = (
    row * CHUNK for row in range(10)
)
LARGEST_RMS, SLOW_RMS, WORST, SECOND, FOURTH, SIXTH, AVERAGING, REST, TOTAL, IS_FINEST = (
    row * CHUNK for row in range(10, 20)
)
REFERENCE, TAILS, EXCESS = (row * CHUNK for row in range(20, 23))
BOUNDS_SIZE = 23 * CHUNK


@subroutine(contract=True)
def collect_rms(b, n):
    """Raise the largest rms by that of the row at hand."""
    for k in range(n):
        rms = math.sqrt(b[MEAN + k] * b[MEAN + k] + b[VARIANCE + k])
        b[LARGEST_RMS + k] = rms if rms > b[LARGEST_RMS + k] else b[LARGEST_RMS + k]


@subroutine(contract=True)
def _choose_model(b, n, order):
    """Fill the model's error for a pole order, and the largest terms of signals of that order.

    Intermediate terms and signals of the same order and reference may be larger than this signal, and so their
    rounding.
    """
    if order == 2:
        for k in range(n):
            noise = b[NOISE + k] * b[REFERENCE + k]
            b[QUADRATURE + k], b[TERMS + k] = b[SECOND + k], b[SLOW_RMS + k] + noise
    else:
        for k in range(n):
            b[QUADRATURE + k] = b[FOURTH + k] if order == 4 else b[SIXTH + k]
            noise = b[NOISE + k] * b[REFERENCE + k]
            b[TERMS + k] = b[LARGEST_RMS + k] + noise * (1.0 + b[NOISE + k])


@subroutine(contract=True)
def _include_std(b, n):
    """Raise the bound by that of the standard deviation, |error|/std."""
    for k in range(n):
        std = math.sqrt(b[VARIANCE + k])
        of_rounding = 2.0 * b[ROUNDING_OF_ROW + k]
        of_std = 0.5 * b[QUADRATURE + k] * b[RMS + k] / std + of_rounding
        b[BOUND + k] = of_std if (std > 0.0) & (of_std > b[BOUND + k]) else b[BOUND + k]
        b[LEAST + k] = of_rounding if std > 0.0 else b[LEAST + k]


@subroutine(contract=True)
def _include_cv(b, n, tolerance):
    """Raise the bound by that of the coefficient of variation, relative, where it is defined."""
    for k in range(n):
        rms, std, magnitude = b[RMS + k], math.sqrt(b[VARIANCE + k]), abs(b[MEAN + k])
        is_hidden = (std == 0.0) & (b[AVERAGING + k] - b[REST + k] < _SHORT)
        std = _LEAST_DEVIATION * rms if is_hidden else std
        of_std, of_mean = rms / std, rms / magnitude
        of_rounding = b[ROUNDING_OF_ROW + k] * (of_std + of_mean)
        of_cv = b[QUADRATURE + k] * (0.5 * of_std * of_std + of_mean) + of_rounding
        defined = (magnitude >= 1e3 * tolerance * rms) & (std > 0.0)
        b[BOUND + k] = of_cv if defined & (of_cv > b[BOUND + k]) else b[BOUND + k]
        b[LEAST + k] = of_rounding if defined & (of_rounding > b[LEAST + k]) else b[LEAST + k]


@subroutine(contract=True)
def _finish_bound(b, n, flags, tolerance):
    """Fill the bound of the worst flagged statistic of a row, in the norms of `explore.evaluation.evaluate`.

    Raise the worst bound of all rows, and note where more nodes can lower a bound above the tolerance.
    """
    for k in range(n):
        b[BOUND + k], b[LEAST + k] = b[QUADRATURE + k] + b[ROUNDING_OF_ROW + k], b[ROUNDING_OF_ROW + k]
    if flags & FLAG_STD and not flags & FLAG_SQUARES:
        _include_std(b, n)
    if flags & FLAG_CV and not flags & FLAG_SQUARES:
        _include_cv(b, n, tolerance)
    for k in range(n):
        bound = b[BOUND + k]
        b[WORST + k] = bound if bound > b[WORST + k] else b[WORST + k]
        least = b[LEAST + k]
        improvable = (bound > tolerance) & ((bound > 2.0 * least) | (least < 0.9 * tolerance))
        b[IMPROVABLE + k] = 1.0 if improvable else b[IMPROVABLE + k]


@subroutine(contract=True, inlined=True)
def _shift(b, k):
    """Change of the row at hand from an angle to the next double, times what the rounding of the row is relative to.

    It tells in windows shorter than 1 rad alone, where a signal passes 0 or jumps.
    """
    excess = 1.0 / (b[AVERAGING + k] - b[REST + k]) - 1.0
    # no branch around the root, or the last designs of a loop would be rounded otherwise than those in its lanes
    return math.sqrt(b[VARIANCE + k]) * (excess if excess > 0.0 else 0.0)


@subroutine(contract=True)
def bound_row(b, n, flags, order, tolerance):
    """Fill the bound of a row from MEAN and VARIANCE. An extreme is one sample, whose rounding no sum averages."""
    _choose_model(b, n, order)
    least = ROUNDING * (2.0 if flags & FLAG_EXTREMES else 1.0)
    for k in range(n):
        rms = math.sqrt(b[MEAN + k] * b[MEAN + k] + b[VARIANCE + k])
        rounding = least * (1.0 + (0.2 * b[TERMS + k] + _shift(b, k)) / rms)
        b[RMS + k], b[ROUNDING_OF_ROW + k] = rms, rounding if rms > 0.0 else least
    _finish_bound(b, n, flags, tolerance)


@subroutine(contract=True)
def bound_sum_of_terms(b, n, flags, order, tolerance, terms):
    """Like `bound_row` for a signal that is a sum of terms with these rms.

    The terms round at most like accelerations. Their sum may be much smaller than a term.
    """
    _choose_model(b, n, order)
    squares, is_residual = flags & FLAG_SQUARES != 0, flags & FLAG_RESIDUAL != 0
    for k in range(n):
        mean, noise = b[MEAN + k], b[NOISE + k]
        rms = math.sqrt(abs(mean)) if squares else math.sqrt(mean * mean + b[VARIANCE + k])
        excess = terms[k] / rms if rms > 0.0 else 0.0
        shift = _shift(b, k) / (abs(mean) if squares else rms) if rms > 0.0 else 0.0
        rounding = ROUNDING * (1.0 + 0.2 * excess * (1.0 + noise * (1.0 + noise)) + shift)
        b[RMS + k], b[ROUNDING_OF_ROW + k] = rms, rounding
        if is_residual and rms > 0.0:
            b[QUADRATURE + k] *= excess * excess
    _finish_bound(b, n, flags, tolerance)
