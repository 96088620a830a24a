"""Whip of a coupler: bending by the inertia of its own mass between the pins."""

import numpy as np

from explore.mechanisms.sizing.arguments import Number, as_magnitude


def whip_moment(
    mass_per_length: Number,
    length: Number,
    acceleration_start: Number,
    acceleration_end: Number,
    position: Number,
) -> Number:
    """Bending moment in a uniform rod between two pins, N mm, with the sign of the accelerations.

    Parameters
    ----------
    mass_per_length
        kg/m.
    length
        Between the pins, mm.
    acceleration_start, acceleration_end
        Across the rod at its two pins, m/s^2, in the same direction positive.
    position
        Position of the section, from 0 at the start to 1 at the end.

    Notes
    -----
    The acceleration across a rigid rod, and with it the load of d'Alembert, varies linearly from pin to pin. A beam on
    two supports then has M(x) = m L^2 ((2 a + b) x/6 - a x^2/2 - (b - a) x^3/6). Factored as
    m L^2 x (1 - x) (a (2 - x) + b (1 + x)) / 6 it is exactly 0 at both pins.
    """
    a, b = np.asarray(acceleration_start, np.float64), np.asarray(acceleration_end, np.float64)
    x = np.asarray(position, np.float64)
    m, long = as_magnitude("mass_per_length", mass_per_length), as_magnitude("length", length)
    # A kilogram times a millimetre per second squared is a thousandth of a newton.
    return 1e-3 * m * long**2 * x * (1.0 - x) * (a * (2.0 - x) + b * (1.0 + x)) / 6.0


def whip_moment_peak(
    mass_per_length: Number, length: Number, acceleration_start: Number, acceleration_end: Number
) -> Number:
    """Largest bending moment of `whip_moment` between the pins, its magnitude, N mm.

    Parameters
    ----------
    mass_per_length, length, acceleration_start, acceleration_end
        As in `whip_moment`. The accelerations are those of one instant: their peaks over the turn do not coincide.

    Notes
    -----
    With r the smaller acceleration over the larger and x measured from the pin of the larger one, the moment is largest
    at x = (2 + r) / (3 + sqrt(3 (1 + r + r^2))), the stable form of the root of dM/dx.
    """
    a, b = np.asarray(acceleration_start, np.float64), np.asarray(acceleration_end, np.float64)
    first_is_larger = np.abs(a) >= np.abs(b)
    larger, smaller = np.where(first_is_larger, a, b), np.where(first_is_larger, b, a)
    r = np.divide(smaller, larger, out=np.zeros(np.shape(larger)), where=larger != 0.0)
    x = (2.0 + r) / (3.0 + np.sqrt(3.0 * (1.0 + r + r**2)))
    return np.abs(whip_moment(mass_per_length, length, larger, smaller, x))
