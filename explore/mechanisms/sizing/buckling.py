"""Buckling of a rod with hinged ends, such as a coupler between two pins, in N, mm, MPa.

Euler's force holds for slender rods. Below the limiting slenderness sqrt(2 pi^2 E / Re), where Euler's stress is half
the yield strength, it is too large. There Johnson's parabola applies, which joins it with the same slope (Shigley's
Mechanical Engineering Design, 10th ed., sections 4-12 and 4-13). The parabola replaces Tetmajer's straight line of
Roloff/Matek, which needs two more constants of the material.
"""

import numpy as np

from explore.mechanisms.sizing.arguments import Number, as_hollow_ratio, as_magnitude, as_positive
from explore.mechanisms.sizing.rod import rod_area, rod_second_moment


def slenderness(length: Number, diameter: Number, hollow_ratio: Number = 0.0) -> Number:
    """Length over radius of gyration, 1: L / i with i = D sqrt(1 + a^2) / 4.

    Parameters
    ----------
    length
        Between the pins, mm.
    diameter
        Outer diameter, mm.
    hollow_ratio
        Inner over outer diameter, at least 0 and below 1.
    """
    a = as_hollow_ratio(hollow_ratio)
    return 4.0 * as_magnitude("length", length) / (as_positive("diameter", diameter) * np.sqrt(1.0 + a**2))


def limiting_slenderness(modulus: Number, yield_strength: Number) -> Number:
    """Slenderness from which Euler's force holds, 1: sqrt(2 pi^2 E / Re).

    Parameters
    ----------
    modulus
        Young's modulus, MPa.
    yield_strength
        Re, MPa.
    """
    return np.pi * np.sqrt(2.0 * as_positive("modulus", modulus) / as_positive("yield_strength", yield_strength))


def euler_force(length: Number, diameter: Number, modulus: Number, hollow_ratio: Number = 0.0) -> Number:
    """Euler's buckling force of a rod with hinged ends, N: pi^2 E I / L^2.

    Parameters
    ----------
    length
        Between the pins, mm.
    diameter
        Outer diameter, mm.
    modulus
        Young's modulus, MPa.
    hollow_ratio
        Inner over outer diameter, at least 0 and below 1.
    """
    stiffness = as_positive("modulus", modulus) * rod_second_moment(diameter, hollow_ratio)
    return np.pi**2 * stiffness / as_positive("length", length) ** 2


def buckling_force(
    length: Number, diameter: Number, modulus: Number, yield_strength: Number, hollow_ratio: Number = 0.0
) -> Number:
    """Buckling force of a rod with hinged ends, N: Euler's, or Johnson's where the rod is not slender enough for it.

    Parameters
    ----------
    length, diameter, modulus, hollow_ratio
        As in `euler_force`.
    yield_strength
        Re, MPa.

    Notes
    -----
    Johnson: F = A (Re - (Re lambda / (2 pi))^2 / E) with the slenderness lambda.
    """
    slender, e = slenderness(length, diameter, hollow_ratio), as_positive("modulus", modulus)
    strength = as_positive("yield_strength", yield_strength)
    johnson = rod_area(diameter, hollow_ratio) * (strength - (strength * slender / (2.0 * np.pi)) ** 2 / e)
    euler = euler_force(length, diameter, modulus, hollow_ratio)
    # For a yield strength of NaN the comparison is false and selects Johnson's force, which is NaN.
    return np.where(slender >= limiting_slenderness(modulus, yield_strength), euler, johnson)[()]


def buckling_factor(
    force: Number,
    length: Number,
    diameter: Number,
    modulus: Number,
    hollow_ratio: Number = 0.0,
    *,
    yield_strength: Number | None = None,
) -> Number:
    """Buckling force over the force, 1; infinite for a force of 0.

    Parameters
    ----------
    force
        Compression, its magnitude, N.
    length, diameter, modulus, hollow_ratio
        As in `euler_force`.
    yield_strength
        Re, MPa, for `buckling_force`. With None it is Euler's force at any slenderness.
    """
    if yield_strength is None:
        limit = euler_force(length, diameter, modulus, hollow_ratio)
    else:
        limit = buckling_force(length, diameter, modulus, yield_strength, hollow_ratio)
    with np.errstate(divide="ignore"):
        return np.divide(limit, as_magnitude("force", force))


def rod_diameter_for_buckling(
    force: Number, factor: Number, length: Number, modulus: Number, hollow_ratio: Number = 0.0
) -> Number:
    """Outer diameter at which Euler's force is `factor` times the force, mm: (64 n F L^2 / (pi^3 E (1 - a^4)))^(1/4).

    Parameters
    ----------
    force
        Compression, its magnitude, N.
    factor
        Required safety n, such as 3.
    length, modulus, hollow_ratio
        As in `euler_force`.
    """
    load = as_positive("factor", factor) * as_magnitude("force", force) * as_positive("length", length) ** 2
    a = as_hollow_ratio(hollow_ratio)
    return (64.0 * load / (np.pi**3 * as_positive("modulus", modulus) * (1.0 - a**4))) ** 0.25
