"""Limits on the lengths of a four-bar as residuals of its search, where they are missed."""

import math
from typing import NamedTuple

import numpy as np

from explore.base.subroutines import subroutine
from explore.synthesis.paths.numbers import (
    ACROSS,
    ALONG,
    COUPLER,
    CRANK,
    GROUND,
    LARGEST,
    LEAST,
    LOG_COUPLER,
    LOG_ROCKER,
    LONG_BY,
    N_NUMBERS,
    ROCKER,
    SHORT_BY,
)


class Limits(NamedTuple):
    """Limits of lengths; infinite or zero ones are none.

    Of the links; of the distance of the coupler point from the pin of the crank; of the ratio of the longest link to
    the shortest; and the price of the square of the logarithm by which a limit is missed.
    """

    shortest: float = 0.0
    longest: float = np.inf
    arm: float = np.inf
    ratio: float = np.inf
    price: float = 0.0


@subroutine()
def _excess(length, shortest, longest):
    """The logarithm of a length over the limit that it misses; 0 within both."""
    if length > longest:
        return math.log(length / longest)
    return math.log(length / shortest) if length < shortest else 0.0


@subroutine()
def _extremes(constants):
    """The longest and the shortest link."""
    longest, shortest = CRANK, CRANK
    for link in (COUPLER, ROCKER, GROUND):
        if constants[link] > constants[longest]:
            longest = link
        if constants[link] < constants[shortest]:
            shortest = link
    return longest, shortest


@subroutine()
def price_of_limits(limits, numbers, constants):
    """The price of missed limits in the sum of squares."""
    total = 0.0
    for link in (CRANK, COUPLER, ROCKER, GROUND):
        total += _excess(constants[link], limits.shortest, limits.longest) ** 2
    total += _excess(math.hypot(numbers[ALONG], numbers[ACROSS]), 0.0, limits.arm) ** 2
    longest, shortest = _extremes(constants)
    total += _excess(constants[longest] / constants[shortest], 0.0, limits.ratio) ** 2
    return limits.price * total


@subroutine()
def log_slopes(constants, link, is_ground_longer, factor, slopes):
    """Add so many times the derivatives of the logarithm of a link by the numbers."""
    if link == COUPLER:
        slopes[LOG_COUPLER] += factor
    elif link == ROCKER:
        slopes[LOG_ROCKER] += factor
    else:
        half = 0.5 * factor / constants[link]
        sign = 1.0 if (link == GROUND) == is_ground_longer else -1.0
        slopes[LOG_COUPLER] += half * (constants[LONG_BY] + sign * constants[SHORT_BY])
        slopes[LOG_ROCKER] += half * (constants[LONG_BY + 1] + sign * constants[SHORT_BY + 1])
        slopes[LEAST] += half * sign * constants[SHORT_BY + 2]
        slopes[LARGEST] += half * constants[LONG_BY + 2]


@subroutine()
def _add(price, excess, slopes, matrix, right):
    """Add a residual to the normal equations, and clear its slopes."""
    for j in range(N_NUMBERS):
        right[j] += price * excess * slopes[j]
        for k in range(j + 1):
            matrix[j, k] += price * slopes[j] * slopes[k]
    slopes[:] = 0.0


@subroutine()
def add_limits(limits, numbers, constants, is_ground_longer, slopes, matrix, right):
    """Add the limits that are missed to the normal equations; `slopes` is room for one row."""
    slopes[:] = 0.0
    for link in (CRANK, COUPLER, ROCKER, GROUND):
        excess = _excess(constants[link], limits.shortest, limits.longest)
        if excess != 0.0:
            log_slopes(constants, link, is_ground_longer, 1.0, slopes)
            _add(limits.price, excess, slopes, matrix, right)
    arm = math.hypot(numbers[ALONG], numbers[ACROSS])
    excess = _excess(arm, 0.0, limits.arm)
    if excess != 0.0:
        slopes[ALONG], slopes[ACROSS] = numbers[ALONG] / arm**2, numbers[ACROSS] / arm**2
        _add(limits.price, excess, slopes, matrix, right)
    longest, shortest = _extremes(constants)
    excess = _excess(constants[longest] / constants[shortest], 0.0, limits.ratio)
    if excess != 0.0:
        log_slopes(constants, longest, is_ground_longer, 1.0, slopes)
        log_slopes(constants, shortest, is_ground_longer, -1.0, slopes)
        _add(limits.price, excess, slopes, matrix, right)
