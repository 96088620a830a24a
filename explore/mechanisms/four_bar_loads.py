"""Loads of a four-bar: the parameters, signals and formulas that every mechanism with such a rocker declares."""

import math
from functools import partial

import numpy as np

from explore.mechanisms import four_bar_forces
from explore.mechanisms.load_metrics import ENERGY_FLUCTUATION, WORK_FORMULAS, largest, load_parameter
from explore.model.drawing import Panel
from explore.model.quantities import Formula, Signal

_TORQUES = (
    load_parameter("constant_torque", "N m", "torque on the rocker, counter-clockwise positive", lower=-math.inf),
    load_parameter("opposing_torque", "N m", "torque against the rocker's motion", adds_jumps=True),
    load_parameter("stiffness", "N m/rad", "spring between rocker and ground, relaxed at the mid-angle"),
    load_parameter("damping", "N m s/rad", "viscous damper between rocker and ground", is_dynamic=True),
    load_parameter("inertia", "kg m^2", "moment of inertia that turns with the rocker", is_dynamic=True),
)
_LINKS = (
    *(
        load_parameter(f"{link}_mass", "kg", f"mass of the {link}", is_dynamic=True)
        for link in ("crank", "coupler", "rocker")
    ),
    *(
        load_parameter(f"{link}_centroid", "1", f"centroid of the {link} as a share of its length from {pin}",
                       default=0.5, lower=-math.inf, zero_meaning=f"at {pin}")
        for link, pin in (("crank", "pin a"), ("coupler", "pin b"), ("rocker", "pin d"))
    ),
    load_parameter("coupler_inertia", "kg m^2", "moment of inertia of the coupler about its centroid", is_dynamic=True),
    load_parameter("rocker_inertia", "kg m^2", "moment of inertia of the rocker about pin d", is_dynamic=True),
    load_parameter("gravity", "m/s^2", "acceleration of free fall, across the line of the ground pivots",
                   default=9.80665),
)  # fmt: skip
#: Parameters of the load, in the order of `four_bar_forces.Load`, which has the speed after them.
LOADS = (*_TORQUES, *_LINKS)
#: Loads of which a design gives at least one where a force is requested.
_REQUIRED_LOADS = (
    *(p.name for p in _TORQUES),
    "crank_mass",
    "coupler_mass",
    "rocker_mass",
    "coupler_inertia",
    "rocker_inertia",
)
#: A force or moment under load.
_force = partial(
    Signal, needs=four_bar_forces.FORCES, pole_order=6, needs_stroke=True, depends_on_load=True,
    required_loads=_REQUIRED_LOADS, terms_row=four_bar_forces.FORCE_TERMS,
)  # fmt: skip
#: A torque on the crank; with a power of the speed of 1 its power.
_torque = partial(_force, needs=four_bar_forces.TORQUE, terms_row=four_bar_forces.TORQUE_TERMS)

LOAD_SIGNALS = (
    _force("coupler_force", "N", "force along the coupler at its rocker end, compression positive",
           four_bar_forces.COUPLER_FORCE),
    *(
        _force(f"pin_force_{pin}", "N", f"force in the pin of {bodies}, its magnitude", row, is_magnitude=True)
        for pin, bodies, row in (
            ("a", "ground and crank", four_bar_forces.PIN_A), ("b", "crank and coupler", four_bar_forces.PIN_B),
            ("c", "coupler and rocker", four_bar_forces.PIN_C), ("d", "rocker and ground", four_bar_forces.PIN_D),
        )
    ),
    _force("rocker_axial_force", "N", "force of the coupler along the rocker, outward positive",
           four_bar_forces.ROCKER_FORCE),
    _force("rocker_moment", "N m", "moment of the coupler's force about pin d", four_bar_forces.ROCKER_MOMENT),
    _torque("drive_torque", "N m", "torque that turns the crank", four_bar_forces.DRIVE_TORQUE, has_fluctuation=True),
    _torque("power", "W", "power that turns the crank", four_bar_forces.DRIVE_TORQUE,
            speed_power=1, shares_row_with="drive_torque"),
    _torque("positive_power", "W", "power that turns the crank where it drives, else 0",
            four_bar_forces.POSITIVE_TORQUE, speed_power=1, has_corners=True, corners_at=("drive_torque",)),
    _torque("friction_power", "W", "power lost to the opposing torque and in the damper",
            four_bar_forces.FRICTION_TORQUE, speed_power=1),
)  # fmt: skip


_PINS = "abcd"
LOAD_FORMULAS = (
    *(
        Formula(f"pin_force_{word}_{pin}", "N", f"{meaning} force in pin {pin}", "min",
                (f"pin_force_{pin}_{statistic}",), np.positive)
        for word, meaning, statistic in (("peak", "largest", "max"), ("rms", "root mean square", "rms"))
        for pin in _PINS
    ),
    *(
        Formula(f"pin_force_{word}", "N", f"{meaning} force in a pin, of the four", "min",
                tuple(f"pin_force_{word}_{pin}" for pin in _PINS), largest, selects_one=True)
        for word, meaning in (("peak", "largest"), ("rms", "largest root mean square"))
    ),
    Formula("bearing_mean_force", "N", "mean of power 10/3 of the force in pin a, by which bearings are sized", "min",
            ("pin_force_a_power_mean",), np.positive),
    *WORK_FORMULAS,
    ENERGY_FLUCTUATION,
)  # fmt: skip

#: Panels of a machine of a hand's size; heavier ones have panels in kN.
LOAD_PANELS = (
    Panel("drive torque", ("drive_torque",), shows_mean=True),
    Panel("pin forces", tuple(f"pin_force_{pin}" for pin in _PINS)),
    Panel("coupler force", ("coupler_force",)),
    Panel("power", ("power",), shows_mean=True),
)
