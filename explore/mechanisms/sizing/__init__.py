"""Sizing rules of machine elements: pure functions of numbers or arrays, usable alone.

Forces in N, lengths in mm, stresses in MPa (N/mm^2), moments in N mm. Arguments broadcast against each other; NaN in
any of them gives NaN. A value without physical meaning, such as a negative allowed stress, raises
`explore.base.errors.RequestError`.
"""

from explore.mechanisms.sizing.bearings import bearing_life, bearing_life_hours, bearing_rating
from explore.mechanisms.sizing.buckling import (
    buckling_factor,
    buckling_force,
    euler_force,
    limiting_slenderness,
    rod_diameter_for_buckling,
    slenderness,
)
from explore.mechanisms.sizing.fatigue import (
    endurance_limit,
    fatigue_factor,
    goodman_factor,
    notch_factor,
    size_factor,
    surface_factor,
)
from explore.mechanisms.sizing.rocker import rocker_deflection, rocker_height, rocker_slope, rocker_stress
from explore.mechanisms.sizing.rod import (
    bending_stress,
    rod_area,
    rod_diameter,
    rod_elongation,
    rod_second_moment,
    rod_section_modulus,
    rod_strain,
    rod_stress,
    sleeve_diameter,
)
from explore.mechanisms.sizing.shaft import (
    journal_capacity,
    journal_torque,
    pin_bending_stress,
    pin_diameter,
    pin_pressure,
    pin_shear_stress,
    shaft_diameter,
    shaft_moment,
    shaft_stress,
)
from explore.mechanisms.sizing.whip import whip_moment, whip_moment_peak

__all__ = [
    "bearing_life",
    "bearing_life_hours",
    "bearing_rating",
    "bending_stress",
    "buckling_factor",
    "buckling_force",
    "endurance_limit",
    "euler_force",
    "fatigue_factor",
    "goodman_factor",
    "journal_capacity",
    "journal_torque",
    "limiting_slenderness",
    "notch_factor",
    "pin_bending_stress",
    "pin_diameter",
    "pin_pressure",
    "pin_shear_stress",
    "rocker_deflection",
    "rocker_height",
    "rocker_slope",
    "rocker_stress",
    "rod_area",
    "rod_diameter",
    "rod_diameter_for_buckling",
    "rod_elongation",
    "rod_second_moment",
    "rod_section_modulus",
    "rod_strain",
    "rod_stress",
    "shaft_diameter",
    "shaft_moment",
    "shaft_stress",
    "size_factor",
    "sleeve_diameter",
    "slenderness",
    "surface_factor",
    "whip_moment",
    "whip_moment_peak",
]
