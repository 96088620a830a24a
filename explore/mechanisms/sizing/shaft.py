"""Pins and the eccentric shaft, in N, mm, MPa."""

import numpy as np

from explore.mechanisms.sizing.arguments import Number, as_magnitude, as_positive
from explore.mechanisms.sizing.rod import rod_section_modulus


def pin_diameter(force: Number, allowed_shear: Number) -> Number:
    """Diameter of a pin in double shear, mm: sqrt(2 F / (pi tau)).

    Parameters
    ----------
    force
        Magnitude of the force on the pin, N.
    allowed_shear
        MPa.

    Notes
    -----
    Mean shear over two sections (Roloff/Matek, Maschinenelemente, chapter on bolts and pins).
    """
    return np.sqrt(2.0 * as_magnitude("force", force) / (np.pi * as_positive("allowed_shear", allowed_shear)))


def pin_shear_stress(force: Number, diameter: Number) -> Number:
    """Mean shear stress of a given pin in double shear, MPa: 2 F / (pi d^2).

    Parameters
    ----------
    force
        Magnitude of the force on the pin, N.
    diameter
        mm.
    """
    return 2.0 * as_magnitude("force", force) / (np.pi * as_positive("diameter", diameter) ** 2)


def pin_pressure(force: Number, diameter: Number, width: Number) -> Number:
    """Bearing pressure between pin and eye over the projected area, MPa: F / (d b).

    Parameters
    ----------
    force
        Magnitude of the force on the pin, N.
    diameter
        mm.
    width
        Width of the eye, mm.
    """
    return as_magnitude("force", force) / (as_positive("diameter", diameter) * as_positive("width", width))


def pin_bending_stress(force: Number, diameter: Number, eye_width: Number, fork_width: Number) -> Number:
    """Bending stress of a pin that fits loosely in fork and eye, MPa: F (b + 2 t) / 8 over W.

    Parameters
    ----------
    force
        Magnitude of the force on the pin, N.
    diameter
        mm.
    eye_width
        b, of the eye in the middle, mm.
    fork_width
        t, of each of the two cheeks, mm.

    Notes
    -----
    Loads spread evenly over eye and cheeks: case 1 of Roloff/Matek, chapter on bolts and pins.
    """
    reach = as_positive("eye_width", eye_width) + 2.0 * as_positive("fork_width", fork_width)
    return as_magnitude("force", force) * reach / (8.0 * rod_section_modulus(as_positive("diameter", diameter)))


def shaft_moment(force: Number, arm: Number) -> Number:
    """Bending moment in the middle of a shaft on two supports, N mm: F a / 2.

    Parameters
    ----------
    force
        Magnitude of the force in the middle, N; half of it acts on each support.
    arm
        a, from a support to the load, mm.
    """
    return 0.5 * as_magnitude("force", force) * as_magnitude("arm", arm)


def shaft_diameter(moment: Number, torque: Number, allowed_stress: Number) -> Number:
    """Diameter of a solid shaft, mm: (32 sqrt(M^2 + 0.75 T^2) / (pi s))^(1/3).

    Parameters
    ----------
    moment
        Bending moment, its magnitude, N mm.
    torque
        Its magnitude, N mm.
    allowed_stress
        MPa.

    Notes
    -----
    Distortion-energy theory, sqrt(sigma^2 + 3 tau^2) <= s with tau = T / (2 W) (Shigley, 10th ed.,
    sections 5-5 and 7-4; Roloff/Matek, chapter on shafts).
    """
    s = as_positive("allowed_stress", allowed_stress)
    return np.cbrt(32.0 * _equivalent_moment(moment, torque) / (np.pi * s))


def shaft_stress(moment: Number, torque: Number, diameter: Number) -> Number:
    """Equivalent stress of a given solid shaft by the distortion-energy theory, MPa: sqrt(M^2 + 0.75 T^2) / W.

    Parameters
    ----------
    moment, torque
        As in `shaft_diameter`.
    diameter
        mm.
    """
    return _equivalent_moment(moment, torque) / rod_section_modulus(as_positive("diameter", diameter))


def journal_capacity(diameter: Number, allowed_stress: Number) -> Number:
    """Equivalent moment that a journal carries, N mm: s W.

    Parameters
    ----------
    diameter
        mm.
    allowed_stress
        MPa.
    """
    return as_positive("allowed_stress", allowed_stress) * rod_section_modulus(diameter)


def journal_torque(moment: Number, diameter: Number, allowed_stress: Number) -> Number:
    """Torque that a journal carries beside its bending moment, N mm; NaN where the moment alone is too large.

    Parameters
    ----------
    moment
        Bending moment, its magnitude, N mm.
    diameter
        mm.
    allowed_stress
        MPa.
    """
    capacity, m = journal_capacity(diameter, allowed_stress), as_magnitude("moment", moment)
    with np.errstate(invalid="ignore"):
        # the difference of the two squares would lose digits near the capacity
        return np.sqrt((capacity - m) * (capacity + m) / 0.75)


def _equivalent_moment(moment: Number, torque: Number) -> Number:
    """Bending moment with the equivalent stress of both, N mm."""
    m, t = as_magnitude("moment", moment), as_magnitude("torque", torque)
    return np.sqrt(m**2 + 0.75 * t**2)
