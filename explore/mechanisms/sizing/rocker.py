"""The rocker: two plates of thickness t and height h in the plane of motion, together a cantilever.

N, mm, MPa. Area A = 2 t h, section modulus W = t h^2 / 3, second moment of area I = t h^3 / 6.
"""

import numpy as np

from explore.mechanisms.sizing.arguments import Number, as_magnitude, as_positive


def rocker_height(moment: Number, axial_force: Number, allowed_stress: Number, thickness: Number) -> Number:
    """Height of the plates, mm: (F/2t + sqrt((F/2t)^2 + 12 s M/t)) / (2 s).

    Parameters
    ----------
    moment
        At the root, its magnitude, N mm.
    axial_force
        Along the rocker, its magnitude, N.
    allowed_stress
        MPa.
    thickness
        Thickness of one of the two plates, mm.

    Notes
    -----
    The positive root of s = F/A + M/W: bending and axial stress add up (Shigley, 10th ed., section 3-10).
    """
    s, t = as_positive("allowed_stress", allowed_stress), as_positive("thickness", thickness)
    along = as_magnitude("axial_force", axial_force) / (2.0 * t)
    return (along + np.sqrt(along**2 + 12.0 * s * as_magnitude("moment", moment) / t)) / (2.0 * s)


def rocker_stress(moment: Number, axial_force: Number, thickness: Number, height: Number) -> Number:
    """Largest stress at the root of given plates, its magnitude, MPa: F/A + M/W.

    Parameters
    ----------
    moment, axial_force, thickness
        As in `rocker_height`.
    height
        mm.
    """
    t, h = as_positive("thickness", thickness), as_positive("height", height)
    return as_magnitude("axial_force", axial_force) / (2.0 * t * h) + 3.0 * as_magnitude("moment", moment) / (t * h**2)


def rocker_deflection(force: Number, length: Number, modulus: Number, thickness: Number, height: Number) -> Number:
    """Deflection of the tip, mm: F L^3 / (3 E I).

    Parameters
    ----------
    force
        Across the rocker at its tip, its magnitude, N.
    length
        mm.
    modulus
        Young's modulus, MPa.
    thickness, height
        Size of one of the two plates, mm.

    Notes
    -----
    Cantilever with a load at its end (Roark's Formulas for Stress and Strain; Shigley, 10th ed., table A-9, case 1).
    """
    stiffness = _stiffness(modulus, thickness, height)
    return as_magnitude("force", force) * as_magnitude("length", length) ** 3 / (3.0 * stiffness)


def rocker_slope(force: Number, length: Number, modulus: Number, thickness: Number, height: Number) -> Number:
    """Slope of the tip, rad: F L^2 / (2 E I).

    Parameters are those of `rocker_deflection`.
    """
    stiffness = _stiffness(modulus, thickness, height)
    return as_magnitude("force", force) * as_magnitude("length", length) ** 2 / (2.0 * stiffness)


def _stiffness(modulus: Number, thickness: Number, height: Number) -> Number:
    """Bending stiffness E I, N mm^2."""
    return (
        as_positive("modulus", modulus) * as_positive("thickness", thickness) * as_positive("height", height) ** 3 / 6.0
    )
