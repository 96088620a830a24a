"""Functions of the angle that are first harmonics, a - b cos(theta - phi): all of them by four values each.

Their least value is a - b, and their complex zeros are at the distance arcosh(a/b) above phi.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine

#: Least margin of a factor that is surely positive, relative to a and the size of its terms.
_SURE = 1e-9
#: Largest number of functions of which is told whether they are first harmonics: bits of a number.
MOST_HARMONICS = 30
#: Type of an array of numbers.
_F1 = "float64[::1]"


@subroutine(contract=True, inlined=True)
def amplitude_ratio(first, second, third, fourth):
    """Square of b/a, from the values at four angles, a quarter of a turn apart."""
    mean = 0.5 * (first + third)
    one, other = 0.5 * (first - third), 0.5 * (second - fourth)
    return (one * one + other * other) / (mean * mean)


@subroutine(contract=True, inlined=True)
def zero_tangent(ratio):
    """Half-tangent of the distance of the zeros, tanh(distance/2), from the square of b/a."""
    modulus = math.sqrt(ratio) / (1.0 + math.sqrt(1.0 - ratio if ratio < 1.0 else 0.0))
    return (1.0 - modulus) / (1.0 + modulus) if modulus < 1.0 else 0.0


@compiled(f"int64({_F1}, int64, int64, {_F1})", no_alias=True)
def decide_harmonics(values, factors, functions, distances):
    """Fill the half-tangent of the distance of the nearest zero of functions that are all first harmonics.

    `values` has the rows of four nodes, a quarter of a turn apart; see `turning`. Return the number of lanes in which
    some factor is not surely positive all over the turn.
    """
    size, doubtful = (2 * functions + factors) * LANES, 0
    for lane in range(LANES):
        distances[lane] = 1.0
    for s in range(functions):
        first, second = values[s * LANES :], values[size + s * LANES :]
        third, fourth = values[2 * size + s * LANES :], values[3 * size + s * LANES :]
        for lane in range(LANES):
            ratio = amplitude_ratio(first[lane], second[lane], third[lane], fourth[lane])
            tangent = zero_tangent(ratio)
            distances[lane] = tangent if tangent < distances[lane] else distances[lane]
        if s < factors:
            terms = values[(2 * functions + s) * LANES :]
            for lane in range(LANES):
                mean = 0.5 * (first[lane] + third[lane])
                one, other = 0.5 * (first[lane] - third[lane]), 0.5 * (second[lane] - fourth[lane])
                least = mean - math.sqrt(one * one + other * other)
                doubtful += 0 if least > _SURE * (mean + terms[lane]) else 1
    return doubtful
