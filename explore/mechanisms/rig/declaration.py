"""The oscillating-torque test rig: an eccentric crank-rocker that twists an elastic coupling. Its declaration."""

import math

from explore.mechanisms import four_bar, four_bar_drawing, four_bar_integrals, rocking
from explore.mechanisms.rig import columns, forces, kernel
from explore.mechanisms.rig.columns import Row
from explore.mechanisms.rig.formulas import FORMULAS, SIZING_PARAMETERS
from explore.model.drawing import Panel
from explore.model.mechanism import Mechanism
from explore.model.quadrature import Graded
from explore.model.quantities import Metric, Parameter, Signal, Window

_LOADS = (
    Parameter("constant_torque", "N m", "torque on the rocker, counter-clockwise positive", 0.0, -math.inf,
              affects="load", zero_meaning="none"),
    Parameter("opposing_torque", "N m", "torque against the rocker's motion", 0.0, affects="load", zero_meaning="none"),
    Parameter("stiffness", "N m/rad", "spring between rocker and ground, relaxed at the mid-angle", 0.0,
              affects="load", zero_meaning="none"),
    Parameter("damping", "N m s/rad", "viscous damper between rocker and ground", 0.0,
              affects="load", zero_meaning="none", is_dynamic=True),
    Parameter("inertia", "kg m^2", "moment of inertia that turns with the rocker", 0.0,
              affects="load", zero_meaning="none", is_dynamic=True),
)  # fmt: skip
_LINKS = (
    *(
        Parameter(f"{link}_mass", "kg", f"mass of the {link}", 0.0,
                  affects="load", zero_meaning="none", is_dynamic=True)
        for link in ("crank", "coupler", "rocker")
    ),
    *(
        Parameter(f"{link}_centroid", "1", f"centroid of the {link} as a share of its length from {pin}", 0.5,
                  -math.inf, affects="load", zero_meaning=f"at {pin}")
        for link, pin in (("crank", "pin a"), ("coupler", "pin b"), ("rocker", "pin d"))
    ),
    Parameter("coupler_inertia", "kg m^2", "moment of inertia of the coupler about its centroid", 0.0,
              affects="load", zero_meaning="none", is_dynamic=True),
    Parameter("rocker_inertia", "kg m^2", "moment of inertia of the rocker about pin d", 0.0,
              affects="load", zero_meaning="none", is_dynamic=True),
    Parameter("gravity", "m/s^2", "acceleration of free fall, across the line of the ground pivots", 9.80665,
              affects="load", zero_meaning="none"),
)  # fmt: skip
#: One of these must not be 0 where a force is requested.
_REQUIRED_LOADS = (
    *(p.name for p in _LOADS),
    "crank_mass",
    "coupler_mass",
    "rocker_mass",
    "coupler_inertia",
    "rocker_inertia",
)


def _signal_under_load(
    name: str,
    unit: str,
    long_name: str,
    row: int,
    *,
    torque: bool = False,
    squares: bool = False,
    power: int = 0,
    shares_row_with: str = "",
) -> Signal:
    """Declare a signal that depends on the load."""
    return Signal(
        name, unit, long_name, row, columns.TORQUE if torque else columns.FORCES, power, pole_order=6,
        depends_on_load=True, required_loads=_REQUIRED_LOADS, is_magnitude=squares, shares_row_with=shares_row_with,
        terms_row=columns.TORQUE_TERMS if torque else columns.FORCE_TERMS,
    )  # fmt: skip


_SIGNALS = (
    Signal("rocker_angle", "deg", "rocker angle", four_bar.ROCKER_ANGLE, four_bar.ANGLES),
    Signal("rocker_velocity", "rad/s", "rocker angular velocity", four_bar.ROCKER_VELOCITY, four_bar.VELOCITIES, 1,
           derivative_of="rocker_angle"),
    Signal("rocker_acceleration", "rad/s^2", "rocker angular acceleration", four_bar.ROCKER_ACCELERATION,
           four_bar.ACCELERATIONS, 2, pole_order=4, derivative_of="rocker_velocity"),
    Signal("transmission_angle", "deg", "transmission angle", four_bar.TRANSMISSION_ANGLE, four_bar.TRANSMISSION,
           extremes_at=("anchor", "opposite")),
    *(
        Signal(f"velocity_deviation{suffix}", "rad/s", f"deviation of the rocker's velocity from a sine{factor}", row,
               columns.HARMONICS, 1, order, terms_row=four_bar.ROCKER_VELOCITY, is_residual=True)
        for suffix, factor, row, order in (
            ("", "", columns.DEVIATION, 2),
            ("_cosine", ", times twice the crank angle's cosine", columns.DEVIATION_COSINE, 4),
            ("_sine", ", times twice the crank angle's sine", columns.DEVIATION_SINE, 4),
        )
    ),
    _signal_under_load("coupler_force", "N", "force along the coupler at its rocker end, compression positive",
            columns.COUPLER_FORCE),
    *(
        _signal_under_load(f"pin_force_{pin}", "N", f"force in the pin of {bodies}, its magnitude", row, squares=True)
        for pin, bodies, row in (
            ("a", "ground and crank", columns.PIN_A), ("b", "crank and coupler", columns.PIN_B),
            ("c", "coupler and rocker", columns.PIN_C), ("d", "rocker and ground", columns.PIN_D),
        )
    ),
    _signal_under_load("rocker_axial_force", "N", "force of the coupler along the rocker, outward positive",
                       columns.ROCKER_FORCE),
    _signal_under_load("rocker_moment", "N m", "moment of the coupler's force about pin d", columns.ROCKER_MOMENT),
    _signal_under_load("drive_torque", "N m", "torque that turns the crank", columns.DRIVE_TORQUE, torque=True),
    _signal_under_load("power", "W", "power that turns the crank", columns.DRIVE_TORQUE, torque=True, power=1,
            shares_row_with="drive_torque"),
)  # fmt: skip

_METRICS = (
    Metric("linkage_class", "", "class of the linkage", labels=four_bar.CLASS_LABELS),
    Metric("grashof_margin", "mm", "Grashof margin: middle two lengths minus shortest and longest", "max"),
    Metric("swing_angle", "deg", "swing of the rocker", "max", lower=0.0, upper=180.0),
    Metric("mid_angle", "deg", "mean of the rocker's two limit angles", lower=-180.0, upper=180.0),
    Metric("time_ratio", "1", "time ratio: longer crank interval over shorter", "min", lower=1.0),
    Metric("transmission_angle_worst", "deg", "smallest of transmission angle and 180 deg less it in a turn", "max",
           lower=0.0, upper=90.0, worst_of="transmission_angle"),
    Metric("size", "mm", "coupler and rocker length together", "min"),
    *(
        Metric(f"swing_sensitivity_{link}", "deg/mm", f"change of the swing with the {word}")
        for link, word in (("crank", "crank"), ("coupler", "coupler"), ("rocker", "rocker"),
                           ("ground", "distance of the ground pivots"))
    ),
)  # fmt: skip
_STROKES = ("overlapped_to_extended", "extended_to_overlapped")
_SAMPLED_DEFAULTS = (
    *(f"rocker_{signal}_{extreme}" for signal in ("velocity", "acceleration") for extreme in ("max", "min")),
    "velocity_thd",
)

TEST_RIG = Mechanism(
    name="test-rig",
    summary="eccentric crank-rocker that twists an elastic coupling to and fro: forces, drive torque and sizes",
    parameters=(
        Parameter("crank", "mm", "crank length: the eccentricity"),
        Parameter("coupler", "mm", "coupler length"),
        Parameter("rocker", "mm", "rocker length"),
        Parameter("ground", "mm", "distance of the ground pivots"),
        Parameter("speed", "rad/s", "constant crank velocity", default=60.0, scales_speed=True),
        *_LOADS,
        *_LINKS,
        *SIZING_PARAMETERS,
    ),
    signals=_SIGNALS,
    metrics=_METRICS,
    formulas=FORMULAS,
    loop_lengths=("crank", "coupler", "rocker", "ground"),
    statuses=rocking.STATUSES,
    windows=(
        Window("cycle", "the full turn", "turn"),
        Window(_STROKES[0], "from coupler over crank to coupler in line with it", "arc", ("overlapped", "extended")),
        Window(_STROKES[1], "from coupler in line with crank to coupler over it", "arc", ("extended", "overlapped")),
    ),
    strokes=_STROKES,
    marks={"overlapped": rocking.OVERLAPPED, "extended": rocking.EXTENDED},
    # A torque against the motion jumps between the strokes.
    breaks=("overlapped", "extended"),
    quadrature=Graded(((rocking.SINGULAR_P, 0), (rocking.SINGULAR_Q, 1), (rocking.SINGULAR_D, 0))),
    noise_row=rocking.NOISE,
    variant_row=Row.VARIANT,
    output_signals={"": "rocker_velocity"},
    zero_mean=frozenset(
        [(f"rocker_{signal}", "cycle") for signal in ("velocity", "acceleration")]
        + [("rocker_acceleration", window) for window in _STROKES]
    ),
    default_metrics={"": (*(metric.name for metric in _METRICS), *_SAMPLED_DEFAULTS)},
    objectives=("pin_force_peak", "velocity_thd", "size"),
    kernel_version="2",
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=columns.SIGNAL_ROWS,
    close=kernel.close,
    fill=forces.fill,
    integrals=four_bar_integrals.integrals,
    integrated_rows=four_bar_integrals.ROWS,
    default_window="cycle",
    drawing=four_bar_drawing.DRAWING,
    panels=(
        Panel("rocker angle", ("rocker_angle",)),
        Panel("transmission angle", ("transmission_angle",), limits=(0.0, 180.0)),
        Panel("rocker velocity", ("rocker_velocity",)),
        Panel("pin forces", tuple(f"pin_force_{pin}" for pin in "abcd"), "kN", 1e-3),
        Panel("rocker acceleration", ("rocker_acceleration",)),
        Panel("drive torque", ("drive_torque",), shows_mean=True),
        Panel("coupler force", ("coupler_force",), "kN", 1e-3),
        Panel("power", ("power",), "kW", 1e-3, shows_mean=True),
    ),
)
