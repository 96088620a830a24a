"""Life of roller bearings after ISO 281: L10 = (C / P)^(10/3) million turns at a reliability of 90 %."""

import numpy as np

from explore.mechanisms.sizing.arguments import Number, as_magnitude, as_positive

#: Exponent of the life of roller bearings; that of ball bearings is 3.
ROLLER_EXPONENT = 10.0 / 3.0


def bearing_life(rating: Number, load: Number) -> Number:
    """Basic rating life, million turns; infinite for a load of 0.

    Parameters
    ----------
    rating
        Basic dynamic load rating C, kN or N.
    load
        Equivalent dynamic load P of one bearing, its magnitude, in the same unit. For a varying load, its mean of the
        power 10/3 over the turns.

    Notes
    -----
    ISO 281:2007, equation for roller bearings, L10 = (C / P)^(10/3).
    """
    with np.errstate(divide="ignore"):
        return np.divide(as_positive("rating", rating), as_magnitude("load", load)) ** ROLLER_EXPONENT


def bearing_life_hours(rating: Number, load: Number, speed: Number) -> Number:
    """Basic rating life, h: 10^6 L10 / (60 n).

    Parameters
    ----------
    rating, load
        As in `bearing_life`.
    speed
        n, turns per minute.
    """
    return 1e6 * bearing_life(rating, load) / (60.0 * as_positive("speed", speed))


def bearing_rating(load: Number, hours: Number, speed: Number) -> Number:
    """Basic dynamic load rating for a required life, in the unit of the load: P (60 n Lh / 10^6)^(3/10).

    Parameters
    ----------
    load
        As in `bearing_life`.
    hours
        Required life, h.
    speed
        n, turns per minute.
    """
    turns = 60e-6 * as_positive("speed", speed) * as_positive("hours", hours)
    return as_magnitude("load", load) * turns ** (1.0 / ROLLER_EXPONENT)
