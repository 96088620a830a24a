"""The slider-crank under load: parameters, signals and derived metrics, declared."""

import math
from functools import partial

from explore.mechanisms.load_metrics import ENERGY_FLUCTUATION, WORK_FORMULAS, largest, load_parameter
from explore.mechanisms.slider_crank import columns
from explore.model.drawing import Panel
from explore.model.quantities import Formula, Signal

#: Parameters of the load, in the order of `columns.ExtendedRow`, which has the speed after them.
PARAMETERS = (
    load_parameter("constant_force", "N", "force on the slider, outward positive", lower=-math.inf),
    load_parameter("opposing_force", "N", "force against the slider's motion", adds_jumps=True),
    load_parameter("stiffness", "N/m", "spring between slider and ground, relaxed at mid-stroke"),
    load_parameter("damping", "N s/m", "viscous damper between slider and ground", is_dynamic=True),
    load_parameter("mass", "kg", "mass of the slider", is_dynamic=True),
    load_parameter("friction", "1", "coefficient of friction of the slider's guide", upper=1.0, adds_corners=True,
                   corners_at=("guide_force",), adds_jumps=True),
    load_parameter("gravity", "m/s^2", "acceleration of free fall, across the slider's line, towards negative offsets",
                   default=9.80665),
    load_parameter("crank_mass", "kg", "mass of the crank", is_dynamic=True),
    load_parameter("crank_centroid", "1", "centroid of the crank as a share of its length from its pivot", default=0.5,
                   lower=-math.inf, zero_meaning="at the pivot"),
    load_parameter("rod_mass", "kg", "mass of the rod", is_dynamic=True),
    load_parameter("rod_centroid", "1", "centroid of the rod as a share of its length from the crank pin", default=0.5,
                   lower=-math.inf, zero_meaning="at the crank pin"),
    load_parameter("rod_inertia", "kg m^2", "moment of inertia of the rod about its centroid", is_dynamic=True),
)  # fmt: skip
#: Loads of which a design gives at least one where a force is requested.
_REQUIRED_LOADS = (
    "constant_force", "opposing_force", "stiffness", "damping", "mass", "crank_mass", "rod_mass", "rod_inertia",
)  # fmt: skip
#: A force under load.
_force = partial(
    Signal, needs=columns.FORCES, pole_order=6, depends_on_load=True, required_loads=_REQUIRED_LOADS,
    terms_row=columns.FORCE_TERMS,
)  # fmt: skip
#: A torque on the crank; with a power of the speed of 1 its power.
_torque = partial(_force, terms_row=columns.TORQUE_TERMS)

SIGNALS = (
    _force("thrust", "N", "force of the rod on the slider along its line, outward positive", columns.THRUST),
    _force("guide_force", "N", "force of the guide on the slider, upward positive", columns.GUIDE_FORCE),
    *(
        _force(f"{pin}_force", "N", f"force in the {words}, its magnitude", row, is_magnitude=True)
        for pin, words, row in (
            ("crank_pivot", "pivot of the crank", columns.CRANK_PIVOT),
            ("crank_pin", "pin of crank and rod", columns.CRANK_PIN),
            ("slider_pin", "pin of rod and slider", columns.SLIDER_PIN),
        )
    ),
    _torque("drive_torque", "N m", "torque that turns the crank", columns.TORQUE, has_fluctuation=True),
    _torque("drive_power", "W", "power that turns the crank", columns.TORQUE, speed_power=1,
            shares_row_with="drive_torque"),
    _torque("positive_power", "W", "power that turns the crank where it drives, else 0", columns.POSITIVE_TORQUE,
            speed_power=1, has_corners=True, corners_at=("drive_torque",)),
    _torque("friction_power", "W", "power lost to friction, in the damper and to the opposing force",
            columns.LOST_TORQUE, speed_power=1),
)  # fmt: skip


FORMULAS = (
    *WORK_FORMULAS,
    ENERGY_FLUCTUATION,
    Formula("pin_force_peak", "N", "largest force in a pin over the turn, of the three", "min",
            ("crank_pivot_force_max_cycle", "crank_pin_force_max_cycle", "slider_pin_force_max_cycle"), largest,
            selects_one=True),
)  # fmt: skip

PANELS = (
    Panel("pin forces", ("crank_pivot_force", "crank_pin_force", "slider_pin_force")),
    Panel("guide force", ("guide_force",)),
    Panel("drive torque", ("drive_torque",), shows_mean=True),
    Panel("drive power", ("drive_power",), shows_mean=True),
)
