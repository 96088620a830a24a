"""Derived metrics of the test rig: peaks, distortion, sizes, stresses, safety factors and life.

Sizes, stresses, factors and life follow from the forces over the cycle, whatever the window of a study is, by the rules
of `mechanisms.sizing`, whose docstrings give formulas and sources. Lengths in mm, forces in N, stresses in MPa; torques
and moments of the signals in N m.
"""

import math

import numpy as np

from explore.mechanisms import sizing
from explore.mechanisms.four_bar_loads import LOAD_FORMULAS
from explore.mechanisms.load_metrics import largest, largest_magnitude
from explore.model.quantities import OMITTED, FloatArray, Formula, Parameter

_MM = 1e3  # N mm per N m


def _sizing_parameter(
    name: str, unit: str, long_name: str, default: float = 0.0, zero_meaning: str = "", upper: float = math.inf
) -> Parameter:
    if default == 0.0:
        zero_meaning = OMITTED
    return Parameter(name, unit, long_name, default, upper=upper, zero_meaning=zero_meaning, affects="sizing")


SIZING_PARAMETERS = (
    _sizing_parameter("allowed_stress", "MPa", "allowed normal stress"),
    _sizing_parameter("allowed_shear", "MPa", "allowed shear stress"),
    _sizing_parameter("elastic_modulus", "MPa", "Young's modulus", 206e3),
    _sizing_parameter("yield_strength", "MPa", "yield strength"),
    _sizing_parameter("tensile_strength", "MPa", "tensile strength"),
    _sizing_parameter("endurance_limit", "MPa", "amplitude that the part endures fully reversed, without its notch"),
    _sizing_parameter("notch_factor", "1", "fatigue notch factor of the rod, 3 for cut threads", 1.0),
    _sizing_parameter("hollow_ratio", "1", "inner over outer diameter of the rod", 0.5, "solid", upper=0.999),
    _sizing_parameter("plate_thickness", "mm", "thickness of one of the rocker's two plates", 20.0),
    _sizing_parameter("shaft_arm", "mm", "distance from a support of the eccentric shaft to the load", 67.0),
    _sizing_parameter("bearing_rating", "N", "basic dynamic load rating of one bearing of the eccentric shaft"),
    _sizing_parameter("bearing_count", "1", "bearings that share the force in pin a", 4.0),
    _sizing_parameter("built_rod", "mm", "outer diameter of the rod as built"),
    _sizing_parameter("built_rocker", "mm", "height of the rocker's plates as built"),
    _sizing_parameter("built_pin", "mm", "diameter of the pins as built"),
    _sizing_parameter("built_shaft", "mm", "diameter of the eccentric shaft as built"),
)


def _distortion(variance: FloatArray, deviation: FloatArray, cosine: FloatArray, sine: FloatArray) -> FloatArray:
    """Harmonics from the second on over the fundamental, roots of sums of squares; the mean is 0.

    Computed from the velocity's deviation from a sine close to its fundamental, because from the velocity itself the
    harmonics would be a small difference of large numbers. `cosine` and `sine` are the deviation's own fundamental.
    """
    harmonics = np.maximum(2.0 * deviation - cosine**2 - sine**2, 0.0)
    return np.sqrt(harmonics / (2.0 * variance - harmonics))


def _rod_diameter(built: FloatArray, sized: FloatArray) -> FloatArray:
    """Diameter of the rod as built, or as sized for strength where none is given."""
    return np.where(np.isnan(built), sized, built)


def _buckling(
    high: FloatArray, coupler: FloatArray, built: FloatArray, sized: FloatArray, modulus: FloatArray,
    hollow: FloatArray, strength: FloatArray,
) -> FloatArray:  # fmt: skip
    rod = _rod_diameter(built, sized)
    rod = np.where(rod > 0.0, rod, np.nan)  # a diameter of 0 belongs to no force
    compression = np.maximum(high, 0.0)  # keeps NaN
    euler = sizing.buckling_factor(compression, coupler, rod, modulus, hollow)
    johnson = sizing.buckling_factor(compression, coupler, rod, modulus, hollow, yield_strength=strength)
    return np.where(np.isnan(strength), euler, johnson)


def _fatigue(
    low: FloatArray, high: FloatArray, built: FloatArray, sized: FloatArray, hollow: FloatArray,
    endurance: FloatArray, tensile: FloatArray, strength: FloatArray, notch: FloatArray,
) -> FloatArray:  # fmt: skip
    area = sizing.rod_area(_rod_diameter(built, sized), hollow)
    # Errors may swap the extremes of a nearly constant force. Compression is positive in the signal.
    amplitude, mean = 0.5 * np.maximum(high - low, 0.0) / area, -0.5 * (high + low) / area
    return np.asarray(sizing.fatigue_factor(amplitude, mean, endurance, tensile, strength, notch))


def _life(load: FloatArray, count: FloatArray, rating: FloatArray, speed: FloatArray) -> FloatArray:
    return np.asarray(sizing.bearing_life_hours(rating, load / count, speed * 30.0 / np.pi))


def _shaft_diameter(load: FloatArray, torque: FloatArray, arm: FloatArray, stress: FloatArray) -> FloatArray:
    return np.asarray(sizing.shaft_diameter(sizing.shaft_moment(load, arm), _MM * torque, stress))


def _shaft_stress(load: FloatArray, torque: FloatArray, arm: FloatArray, diameter: FloatArray) -> FloatArray:
    return np.asarray(sizing.shaft_stress(sizing.shaft_moment(load, arm), _MM * torque, diameter))


def _pin_diameter(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, shear: FloatArray) -> FloatArray:
    return np.asarray(sizing.pin_diameter(largest(a, b, c, d), shear))


def _pin_stress(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, diameter: FloatArray) -> FloatArray:
    return np.asarray(sizing.pin_shear_stress(largest(a, b, c, d), diameter))


def _rocker_height(moment: FloatArray, axial: FloatArray, stress: FloatArray, thickness: FloatArray) -> FloatArray:
    return np.asarray(sizing.rocker_height(_MM * moment, axial, stress, thickness))


def _rocker_stress(moment: FloatArray, axial: FloatArray, thickness: FloatArray, height: FloatArray) -> FloatArray:
    return np.asarray(sizing.rocker_stress(_MM * moment, axial, thickness, height))


def _safety(stress: FloatArray, strength: FloatArray) -> FloatArray:
    return strength / stress


def _shear_safety(stress: FloatArray, strength: FloatArray) -> FloatArray:
    """Safety against yield in shear, which begins at the yield strength over the root of 3 (von Mises)."""
    return strength / (math.sqrt(3.0) * stress)


_PEAKS = tuple(
    Formula(
        f"{name}_peak",
        unit,
        f"largest magnitude of {words}",
        "min",
        (f"{name}_min", f"{name}_max"),
        largest_magnitude,
        selects_one=True,
    )
    for name, unit, words in (
        ("coupler_force", "N", "the force along the coupler"),
        ("rocker_axial_force", "N", "the force along the rocker"),
        ("rocker_moment", "N m", "the rocker's root moment"),
        ("drive_torque", "N m", "the drive torque"),
    )
)
#: The largest forces in the pins over the turn.
_PIN_PEAKS = tuple(f"pin_force_{pin}_max_cycle" for pin in "abcd")

_SIZES = (
    Formula("rod_diameter", "mm", "outer diameter of the coupler's rod", "min",
            ("coupler_force_peak_cycle", "allowed_stress", "hollow_ratio"), sizing.rod_diameter),
    Formula("sleeve_diameter", "mm", "outer diameter of a sleeve around the rod", "min",
            ("coupler_force_peak_cycle", "allowed_stress", "rod_diameter"), sizing.sleeve_diameter),
    Formula("rocker_height", "mm", "height of the rocker's plates, both peaks taken at once", "min",
            ("rocker_moment_peak_cycle", "rocker_axial_force_peak_cycle", "allowed_stress", "plate_thickness"),
            _rocker_height),
    Formula("pin_diameter", "mm", "diameter of a pin in double shear", "min",
            (*_PIN_PEAKS, "allowed_shear"), _pin_diameter),
    Formula("shaft_diameter", "mm", "diameter of the eccentric shaft, both peaks taken at once", "min",
            ("pin_force_b_max_cycle", "drive_torque_peak_cycle", "shaft_arm", "allowed_stress"), _shaft_diameter),
)  # fmt: skip
_ROD_SOURCES = ("built_rod", "allowed_stress")
_CHECKS = (
    Formula("buckling_factor", "1", "buckling force of the rod, as built or as its strength asks for, over the largest "
            "compression: Euler's, or with a yield strength Johnson's where the rod is not slender", "max",
            ("coupler_force_max_cycle", "coupler", "built_rod", "rod_diameter", "elastic_modulus", "hollow_ratio",
            "yield_strength"), _buckling, alternatives=_ROD_SOURCES, optional=("yield_strength",)),
    Formula("fatigue_factor", "1", "safety of the rod, as built or as its strength asks for, against fatigue and yield",
            "max", ("coupler_force_min_cycle", "coupler_force_max_cycle", "built_rod", "rod_diameter", "hollow_ratio",
            "endurance_limit", "tensile_strength", "yield_strength", "notch_factor"), _fatigue,
            alternatives=_ROD_SOURCES),
    Formula("bearing_life", "h", "basic rating life of a bearing of the eccentric shaft", "max",
            ("pin_force_a_power_mean_cycle", "bearing_count", "bearing_rating", "speed"), _life),
    Formula("rod_stress", "MPa", "largest stress of the rod as built", "min",
            ("coupler_force_peak_cycle", "built_rod", "hollow_ratio"), sizing.rod_stress),
    Formula("rocker_stress", "MPa", "largest stress of the rocker as built, both peaks taken at once", "min",
            ("rocker_moment_peak_cycle", "rocker_axial_force_peak_cycle", "plate_thickness", "built_rocker"),
            _rocker_stress),
    Formula("pin_stress", "MPa", "largest shear stress of a pin as built", "min",
            (*_PIN_PEAKS, "built_pin"), _pin_stress),
    Formula("shaft_stress", "MPa", "largest equivalent stress of the eccentric shaft as built", "min",
            ("pin_force_b_max_cycle", "drive_torque_peak_cycle", "shaft_arm", "built_shaft"), _shaft_stress),
    *(
        Formula(f"{part}_safety", "1", f"yield strength over the {part}'s stress", "max",
                (f"{part}_stress", "yield_strength"), _shear_safety if part == "pin" else _safety)
        for part in ("rod", "rocker", "pin", "shaft")
    ),
)  # fmt: skip

FORMULAS = (
    Formula("velocity_thd", "1", "distortion of the rocker's velocity: harmonics over fundamental", "min",
            ("rocker_velocity_variance_cycle", "velocity_deviation_variance_cycle",
             "velocity_deviation_cosine_mean_cycle", "velocity_deviation_sine_mean_cycle"), _distortion),
    *_PEAKS,
    *LOAD_FORMULAS,
    *_SIZES,
    *_CHECKS,
)  # fmt: skip
