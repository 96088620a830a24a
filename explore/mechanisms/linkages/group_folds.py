"""How far a crank angle is between the two folds of a group of links, by p of `following`."""

import math

from explore.base.subroutines import subroutine

#: Least sine of half the angle between two folds.
_LEAST_SINE = 1e-15


@subroutine()
def distance_from_folds(place, low, high):
    """How far a crank angle is between two folds, all of them by p, and the slope of that by the angle.

    It is a first harmonic of the angle, negative in the gap beyond the folds, with the slopes 1 and -1 at them. The
    distance of the nearer fold has a kink in the gap, which cubics between nodes miss.
    """
    c, s = _half_direction(place)
    c0, s0 = _half_direction(low)
    c1, s1 = _half_direction(high)
    # sines and cosines of half the angles from the first fold, and to the second one
    sine, cosine, other_sine, other_cosine = s * c0 - c * s0, c * c0 + s * s0, s1 * c - c1 * s, c1 * c + s1 * s
    scale = 1.0 / max(s1 * c0 - c1 * s0, _LEAST_SINE)
    return 2.0 * sine * other_sine * scale, (cosine * other_sine - sine * other_cosine) * scale


@subroutine(inlined=True)
def _half_direction(place):
    """Cosine and sine of half the angle of a p."""
    half_turns = math.floor(0.5 * (place + 1.0))
    turns = math.floor(0.5 * half_turns)
    tangent, sign = place - 2.0 * half_turns, 1.0 - 2.0 * (turns - 2.0 * math.floor(0.5 * turns))
    cosine = sign / math.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    return (cosine, sine) if half_turns - 2.0 * turns < 0.5 else (-sine, cosine)
