"""Fatigue of steel under a stress that alternates about a mean: Haigh diagram with Goodman's line, in MPa and mm.

After Shigley's Mechanical Engineering Design, 10th ed., chapter 6. The factors multiply the endurance limit of a
polished specimen; the notch factor multiplies the stress amplitude.
"""

import numpy as np

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.mechanisms.sizing.arguments import Number, as_magnitude, as_positive

#: Factor and exponent of the surface factor, strengths in MPa (table 6-2).
SURFACES = {
    "ground": (1.58, -0.085),
    "machined": (4.51, -0.265),
    "hot-rolled": (57.7, -0.718),
    "forged": (272.0, -0.995),
}
#: Load factors of the endurance limit (equation 6-26).
LOADS = {"bending": 1.0, "axial": 0.85, "torsion": 0.59}


def surface_factor(tensile_strength: Number, surface: str) -> Number:
    """Surface factor, 1: a Rm^b, at most 1.

    Parameters
    ----------
    tensile_strength
        Rm, MPa.
    surface
        "ground", "machined" (also cold-drawn), "hot-rolled" or "forged".

    Raises
    ------
    RequestError
        For any other surface.
    """
    if surface not in SURFACES:
        raise RequestError(f"surface: unknown {surface!r}; {suggestion(surface, SURFACES)}")
    factor, exponent = SURFACES[surface]
    return np.minimum(1.0, factor * as_positive("tensile_strength", tensile_strength) ** exponent)


def size_factor(diameter: Number) -> Number:
    """Size factor of a round part that rotates in bending or torsion, 1; for an axial load it is 1.

    Parameters
    ----------
    diameter
        mm, at most 254, the largest measured; NaN above.

    Notes
    -----
    Equation 6-20: 1.24 d^-0.107 up to 51 mm, 1.51 d^-0.157 above, and 1 below 2.79 mm. A part that bends without
    turning has the effective diameter 0.370 d (equation 6-24).
    """
    d = as_positive("diameter", diameter)
    small = np.where(d < 2.79, 1.0, 1.24 * d**-0.107)
    return np.where(d <= 51.0, small, np.where(d <= 254.0, 1.51 * d**-0.157, np.nan))[()]


def notch_factor(stress_concentration: Number, sensitivity: Number = 1.0) -> Number:
    """Fatigue notch factor, 1: Kf = 1 + q (Kt - 1).

    Parameters
    ----------
    stress_concentration
        Kt, at least 1 for a notch.
    sensitivity
        q, from 0 to 1; 1 is conservative.

    Notes
    -----
    Equation 6-32. Cut threads have Kf of about 3 (table 8-16).
    """
    q = as_magnitude("sensitivity", sensitivity)
    if np.any(q > 1.0):
        raise RequestError(f"sensitivity: must be at most 1, got {np.max(q[q > 1.0]):g}")
    return 1.0 + q * (as_positive("stress_concentration", stress_concentration) - 1.0)


def endurance_limit(tensile_strength: Number, surface: str, load: str, size: Number = 1.0) -> Number:
    """Endurance limit of a steel part under fully reversed stress, its amplitude, MPa.

    Parameters
    ----------
    tensile_strength
        Rm, MPa.
    surface
        As in `surface_factor`.
    load
        "bending", "axial" or "torsion".
    size
        Size factor, from `size_factor`.

    Notes
    -----
    Half the tensile strength, 700 MPa at most (equation 6-8), times surface, size and load factor (6-18).

    Raises
    ------
    RequestError
        For an unknown surface or load.
    """
    if load not in LOADS:
        raise RequestError(f"load: unknown {load!r}; {suggestion(load, LOADS)}")
    specimen = np.minimum(0.5 * as_positive("tensile_strength", tensile_strength), 700.0)
    return specimen * surface_factor(tensile_strength, surface) * LOADS[load] * as_positive("size", size)


def goodman_factor(
    amplitude: Number, mean: Number, endurance: Number, tensile_strength: Number, notch: Number = 1.0
) -> Number:
    """Safety against fatigue, 1, when amplitude and mean grow in proportion; infinite for a stress of 0.

    Parameters
    ----------
    amplitude
        Half the range of the nominal stress, MPa.
    mean
        Mean nominal stress, MPa, tension positive.
    endurance
        Endurance limit, from `endurance_limit`, MPa.
    tensile_strength
        Rm, MPa.
    notch
        From `notch_factor`. It multiplies the amplitude alone: under the mean, ductile steel yields at the notch.

    Notes
    -----
    Goodman's line of the Haigh diagram, Kf sa/Se + sm/Rm = 1/n (equation 6-46). A compressive mean
    counts as 0.
    """
    share = as_magnitude("amplitude", amplitude) * as_positive("notch", notch) / as_positive("endurance", endurance)
    share = share + np.maximum(np.asarray(mean, np.float64), 0.0) / as_positive("tensile_strength", tensile_strength)
    with np.errstate(divide="ignore"):
        return np.divide(1.0, share)


def fatigue_factor(
    amplitude: Number,
    mean: Number,
    endurance: Number,
    tensile_strength: Number,
    yield_strength: Number,
    notch: Number = 1.0,
) -> Number:
    """Safety in the Haigh diagram, 1: the smaller of Goodman's and that against yield, Re / (sa + |sm|).

    Parameters
    ----------
    amplitude, mean, endurance, tensile_strength, notch
        As in `goodman_factor`.
    yield_strength
        Re, MPa, compared with the nominal stress (equation 6-49).
    """
    goodman = goodman_factor(amplitude, mean, endurance, tensile_strength, notch)
    largest = as_magnitude("amplitude", amplitude) + np.abs(np.asarray(mean, np.float64))
    with np.errstate(divide="ignore"):
        return np.minimum(goodman, np.divide(as_positive("yield_strength", yield_strength), largest))
