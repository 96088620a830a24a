"""The slider-crank whose crank length follows a groove, so that the slider moves at constant speed: its declaration."""

import math

from explore.mechanisms.load_metrics import ENERGY_FLUCTUATION, WORK_FORMULAS, largest, load_parameter
from explore.mechanisms.overall_size import declare_size
from explore.mechanisms.variable_crank import columns, fixed_crank, kernel, motion
from explore.mechanisms.variable_crank.columns import Row
from explore.mechanisms.variable_crank.loop import LOOP
from explore.model.drawing import INPUT, Drawing, Guide, Link, Panel, Path, Vector
from explore.model.mechanism import Mechanism
from explore.model.points import Extent, FloatingLink
from explore.model.quantities import FloatArray, Formula, Metric, Parameter, Signal
from explore.model.window import Window

_STROKES = ("outer_to_inner", "inner_to_outer")


#: Loads beside the slider's mass and friction: forces on the slider, and the masses of the other parts.
_LOADS = (
    load_parameter("constant_force", "N", "force on the slider, outward positive", lower=-math.inf),
    load_parameter("opposing_force", "N", "force against the slider's motion"),
    load_parameter("stiffness", "N/m", "spring between slider and ground, relaxed at mid-stroke"),
    load_parameter("damping", "N s/m", "viscous damper between slider and ground"),
    load_parameter("rod_mass", "kg", "mass of the rod"),
    load_parameter("rod_centroid", "1", "centroid of the rod as a share of its length from the crank's pin",
                   default=0.5, lower=-math.inf, zero_meaning="at the crank's pin"),
    load_parameter("rod_inertia", "kg m^2", "moment of inertia of the rod about its centroid"),
    load_parameter("pin_mass", "kg", "mass of the crank's pin with its roller"),
    load_parameter("disc_mass", "kg", "mass of the disc"),
    load_parameter("disc_centroid", "mm", "centroid of the disc, from its pivot along the slot", lower=-math.inf,
                   zero_meaning="at the pivot"),
)  # fmt: skip
#: Loads of which a design gives at least one where a force is requested.
_REQUIRED_LOADS = (
    "mass", "constant_force", "opposing_force", "stiffness", "damping", "rod_mass", "rod_inertia", "pin_mass",
    "disc_mass",
)  # fmt: skip


def _force(name: str, unit: str, long_name: str, row: int, terms_row: int, corners_at: tuple[str, ...] = ()) -> Signal:
    """Declare a signal under load."""
    needs = columns.FORCES | columns.PINS if row in columns.PIN_ROWS else columns.FORCES
    return Signal(name, unit, long_name, row, needs, pole_order=4, depends_on_load=True,
                  required_loads=_REQUIRED_LOADS, is_magnitude=row in columns.SQUARES, terms_row=terms_row,
                  has_corners=bool(corners_at), corners_at=corners_at,
                  has_fluctuation=row == columns.TORQUE)  # fmt: skip


_SIGNALS = (
    Signal("slider_position", "mm", "position of the slider, from the crank's pivot", columns.POSITION, columns.SLIDER,
           relative_to="rod", extremes_at=("outer", "inner")),
    Signal("slider_velocity", "mm/s", "velocity of the slider", columns.VELOCITY, columns.SLIDER,
           relative_to="slider_speed"),
    Signal("slider_acceleration", "mm/s^2", "acceleration of the slider", columns.ACCELERATION, columns.SLIDER,
           pole_order=4, terms_row=columns.ACCELERATION_TERMS),
    Signal("crank", "mm", "length of the crank", columns.CRANK_LENGTH, columns.CRANK, relative_to="rod"),
    Signal("crank_rate", "mm/s", "rate of the crank's length", columns.CRANK_RATE, columns.CRANK,
           terms_row=columns.RATE_TERMS),
    Signal("rod_angle", "deg", "angle of the rod from the slider's line", columns.ROD_ANGLE, columns.GROOVE),
    Signal("groove_pressure_angle", "deg", "angle between the groove and a circle about the pivot, outward positive",
           columns.PRESSURE_ANGLE, columns.GROOVE, terms_row=columns.PRESSURE_TERMS),
    Signal("groove_curvature", "1/mm", "curvature of the groove's centre line, convex positive", columns.CURVATURE,
           columns.GROOVE, pole_order=4, terms_row=columns.CURVATURE_TERMS),
    _force("thrust", "N", "force on the slider along its line", columns.THRUST, columns.FORCE_TERMS),
    _force("guide_force", "N", "force of the guide on the slider, upward positive", columns.GUIDE_FORCE,
           columns.FORCE_TERMS),
    _force("groove_force", "N", "force of the groove on the pin, outward positive", columns.GROOVE_FORCE,
           columns.FORCE_TERMS),
    _force("slot_force", "N", "force of the disc's slot on the pin, in the direction of turning", columns.SLOT_FORCE,
           columns.FORCE_TERMS),
    _force("crank_pin_force", "N", "force in the joint of pin and rod, its magnitude", columns.CRANK_PIN,
           columns.FORCE_TERMS),
    _force("slider_pin_force", "N", "force in the joint of rod and slider, its magnitude", columns.SLIDER_PIN,
           columns.FORCE_TERMS),
    _force("disc_pivot_force", "N", "force in the pivot of the disc, its magnitude", columns.DISC_PIVOT,
           columns.DISC_TERMS),
    _force("drive_torque", "N m", "torque that turns the disc", columns.TORQUE, columns.TORQUE_TERMS),
    _force("drive_power", "W", "power that turns the disc", columns.POWER, columns.POWER_TERMS),
    _force("positive_power", "W", "power that turns the disc where it drives, else 0", columns.POSITIVE_POWER,
           columns.POWER_TERMS, ("drive_power",)),
    _force("friction_power", "W", "power lost to friction, in the damper and to the opposing force",
           columns.FRICTION_POWER, columns.POWER_TERMS),
)  # fmt: skip


def _clearance(curvature: FloatArray, roller_radius: FloatArray) -> FloatArray:
    return 1.0 / curvature - roller_radius


def _along_x(crank_max: FloatArray, rod: FloatArray, crank_outer: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The circle of the longest crank and the slider at its outer dead centre, which is beyond the circle."""
    return -crank_max, rod + crank_outer


def _along_y(crank_max: FloatArray, _rod: FloatArray, _crank_outer: FloatArray) -> tuple[FloatArray, FloatArray]:
    return -crank_max, crank_max


_FORMULAS = (
    *WORK_FORMULAS,
    ENERGY_FLUCTUATION,
    Formula("pin_force_peak", "N", "largest force in a pin over the turn, of the three", "min",
            ("disc_pivot_force_max_cycle", "crank_pin_force_max_cycle", "slider_pin_force_max_cycle"), largest,
            selects_one=True),
    Formula("groove_clearance", "mm", "smallest radius of curvature of the groove, less that of the roller", "max",
            ("groove_curvature_peak_cycle", "roller_radius"), _clearance),
    *fixed_crank.FORMULAS,
    *declare_size("the slider's line", ("crank_max_cycle", "rod", "crank_outer"), Extent("x", _along_x),
                  Extent("y", _along_y)),
)  # fmt: skip

_METRICS = (
    Metric("stroke", "mm", "stroke of the slider", "max", lower=0.0,
           closed_form_of="slider_position_peak_to_peak_cycle"),
    Metric("regular_angle", "deg", "crank angle where crank and rod are perpendicular", lower=0.0, upper=90.0),
    Metric("regular_crank", "mm", "length of the crank that the slider's speed demands there", lower=0.0),
    Metric("crank_outer", "mm", "length of the crank at the outer dead centre", lower=0.0),
    Metric("crank_inner", "mm", "length of the crank at the inner dead centre", lower=0.0),
    Metric("slider_acceleration_max", "mm/s^2", "largest acceleration of the slider", "min", lower=0.0,
           closed_form_of="slider_acceleration_peak_cycle"),
    Metric("steady_share", "1", "share of the turn at the wanted speed", "max", lower=0.0, upper=1.0),
    *(
        Metric(f"speed_share_{percent}", "1", f"share of the turn within {percent} % of the wanted speed", "max",
               lower=0.0, upper=1.0)
        for percent in (1, 2, 5)
    ),
)  # fmt: skip

_DRAWING = Drawing(
    points={
        "pivot": (),
        "pin": (Vector("crank", INPUT),),
        "slider": (Vector("slider_position"),),
    },
    links=(Link("crank", ("pivot", "pin")), Link("rod", ("pin", "slider"))),
    pivots=("pivot",),
    guides=(Guide("slider"),),
    paths=(Path("pin", "groove", "point"), Path("slider", "path of the slider", "output")),
)

VARIABLE_CRANK = Mechanism(
    name="variable-crank",
    summary="crank whose length follows a groove, so that the slider moves at constant speed between its reversals",
    parameters=(
        Parameter("rod", "mm", "length of the connecting rod"),
        Parameter("slider_speed", "mm/s", "wanted speed of the slider"),
        Parameter("speed", "rad/s", "constant speed of the disc"),
        Parameter("reversal_time", "s", "duration of each reversal, about a dead centre"),
        Parameter("blend_order", "1", "order of the reversal's smoothstep: so many derivatives of the velocity are "
                  "continuous", 2.0, choices=(1.0, 2.0, 3.0)),
        load_parameter("mass", "kg", "mass of the slider", default=1.0),
        load_parameter("friction", "1", "coefficient of friction of the slider's guide", upper=1.0, adds_corners=True,
                       corners_at=("guide_force",)),
        load_parameter("gravity", "m/s^2", "acceleration of free fall, towards the guide", default=9.80665),
        *_LOADS,
        Parameter("roller_radius", "mm", "radius of the roller in the groove", 0.0, affects="sizing",
                  zero_meaning="none"),
    ),
    signals=_SIGNALS,
    metrics=_METRICS,
    formulas=_FORMULAS,
    windows=(
        Window("cycle", "the full turn", "turn"),
        Window(_STROKES[0], "from the outer to the inner dead centre", "arc", ("outer", "inner")),
        Window(_STROKES[1], "from the inner to the outer dead centre", "arc", ("inner", "outer")),
        Window("steady", "the part of the way to the inner dead centre at constant speed", "arc",
               ("steady_start", "steady_stop")),
        Window("interval", "an explicit interval of crank angles, { from = 0, to = 90 }", "interval"),
    ),
    strokes=_STROKES,
    marks={name: Row[name.upper()] for name in
           ("outer", "steady_start", "steady_stop", "inner", "back_start", "back_stop")},
    breaks=("outer", "steady_start", "steady_stop", "inner", "back_start", "back_stop"),
    output_signals={"": "slider_velocity"},
    zero_mean=frozenset([
        *((name, "cycle") for name in ("slider_velocity", "crank_rate", "rod_angle", "groove_pressure_angle")),
        *(("slider_acceleration", window) for window in ("cycle", *_STROKES, "steady")),
    ]),
    default_metrics={"": (*(metric.name for metric in _METRICS), "crank_min", "crank_max",
                          "groove_pressure_angle_max", "drive_torque_max", "positive_work")},
    objectives=("speed_share_1:max", "slider_acceleration_max", "groove_pressure_angle_max"),
    kernel_version="17",
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=columns.SIGNAL_ROWS,
    close=kernel.close,
    fill=motion.fill,
    default_window="cycle",
    floating_link=FloatingLink("rod", "the crank's pin", "pin", "rod_angle", columns.FIRST_POINT, columns.POINTS, 0),
    loop=LOOP,
    statuses=kernel.STATUSES,
    drawing=_DRAWING,
    panels=(
        Panel("slider velocity", ("slider_velocity",)),
        Panel("slider acceleration", ("slider_acceleration",), "m/s^2", 1e-3),
        Panel("crank length", ("crank",)),
        Panel("groove pressure angle", ("groove_pressure_angle",)),
        Panel("groove curvature", ("groove_curvature",)),
        Panel("groove and slot force", ("groove_force", "slot_force")),
        Panel("pin forces", ("crank_pin_force", "slider_pin_force", "disc_pivot_force")),
        Panel("drive torque", ("drive_torque",), shows_mean=True),
        Panel("drive power", ("drive_power",), shows_mean=True),
    ),
)  # fmt: skip
