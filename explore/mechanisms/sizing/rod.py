"""A hollow round rod, such as the coupler: sections, strength and stiffness in N, mm, MPa.

A rod has the outer diameter D and the hollow ratio a = d/D of inner to outer diameter.
"""

import numpy as np

from explore.mechanisms.sizing.arguments import Number, as_hollow_ratio, as_magnitude, as_positive


def rod_area(diameter: Number, hollow_ratio: Number = 0.0) -> Number:
    """Area of the section, mm^2: pi D^2 (1 - a^2) / 4.

    Parameters
    ----------
    diameter
        Outer diameter, mm.
    hollow_ratio
        Inner over outer diameter, at least 0 and below 1.

    Returns
    -------
    float or array
        With the broadcast shape; NaN where an argument is NaN.

    Raises
    ------
    RequestError
        If an argument is outside its range, as in all functions of `explore.mechanisms.sizing`.
    """
    d, a = as_magnitude("diameter", diameter), as_hollow_ratio(hollow_ratio)
    return 0.25 * np.pi * d**2 * (1.0 - a**2)


def rod_second_moment(diameter: Number, hollow_ratio: Number = 0.0) -> Number:
    """Second moment of area about a diameter, mm^4: pi D^4 (1 - a^4) / 64.

    Parameters are those of `rod_area`.
    """
    d, a = as_magnitude("diameter", diameter), as_hollow_ratio(hollow_ratio)
    return np.pi / 64.0 * d**4 * (1.0 - a**4)


def rod_section_modulus(diameter: Number, hollow_ratio: Number = 0.0) -> Number:
    """Section modulus in bending, mm^3: pi D^3 (1 - a^4) / 32.

    Parameters are those of `rod_area`.
    """
    d, a = as_magnitude("diameter", diameter), as_hollow_ratio(hollow_ratio)
    return np.pi / 32.0 * d**3 * (1.0 - a**4)


def rod_diameter(force: Number, allowed_stress: Number, hollow_ratio: Number = 0.0) -> Number:
    """Outer diameter of a hollow rod that carries an axial force, mm: sqrt(4 F / (pi s (1 - a^2))).

    Parameters
    ----------
    force
        Axial force, its magnitude, N.
    allowed_stress
        MPa.
    hollow_ratio
        Inner over outer diameter, at least 0 and below 1.

    Notes
    -----
    Plain tension or compression, F = s A (Shigley's Mechanical Engineering Design, 10th ed., section 3-9). For
    buckling see `buckling_factor`.
    """
    f, s = as_magnitude("force", force), as_positive("allowed_stress", allowed_stress)
    a = as_hollow_ratio(hollow_ratio)
    return np.sqrt(4.0 * f / (np.pi * s * (1.0 - a**2)))


def sleeve_diameter(force: Number, allowed_stress: Number, inner_diameter: Number) -> Number:
    """Outer diameter of a sleeve around a rod that carries the same axial force, mm: sqrt(Di^2 + 4 F / (pi s)).

    Parameters
    ----------
    force
        Axial force, its magnitude, N.
    allowed_stress
        MPa.
    inner_diameter
        Inner diameter of the sleeve, the outer one of the rod, mm.
    """
    f, s = as_magnitude("force", force), as_positive("allowed_stress", allowed_stress)
    return np.sqrt(as_magnitude("inner_diameter", inner_diameter) ** 2 + 4.0 * f / (np.pi * s))


def rod_stress(force: Number, diameter: Number, hollow_ratio: Number = 0.0) -> Number:
    """Axial stress of a given rod, its magnitude, MPa.

    Parameters
    ----------
    force
        Axial force, its magnitude, N.
    diameter
        Outer diameter, mm.
    hollow_ratio
        Inner over outer diameter, at least 0 and below 1.
    """
    return as_magnitude("force", force) / rod_area(as_positive("diameter", diameter), hollow_ratio)


def bending_stress(moment: Number, diameter: Number, hollow_ratio: Number = 0.0) -> Number:
    """Bending stress at the surface of a given round section, its magnitude, MPa: M / W.

    Parameters
    ----------
    moment
        Bending moment, its magnitude, N mm.
    diameter
        Outer diameter, mm.
    hollow_ratio
        Inner over outer diameter, at least 0 and below 1.
    """
    return as_magnitude("moment", moment) / rod_section_modulus(as_positive("diameter", diameter), hollow_ratio)


def rod_strain(force: Number, area: Number, modulus: Number) -> Number:
    """Strain of a rod, F / (E A).

    Parameters
    ----------
    force
        Axial force, its magnitude, N.
    area
        Area of the section, mm^2.
    modulus
        Young's modulus, MPa.
    """
    return as_magnitude("force", force) / (as_positive("modulus", modulus) * as_positive("area", area))


def rod_elongation(force: Number, area: Number, modulus: Number, length: Number) -> Number:
    """Elongation of a rod, mm: F L / (E A).

    Parameters
    ----------
    force, area, modulus
        As in `rod_strain`.
    length
        mm.
    """
    return rod_strain(force, area, modulus) * as_magnitude("length", length)
