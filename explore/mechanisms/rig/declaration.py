"""The oscillating-torque test rig: an eccentric crank-rocker that twists an elastic coupling. Its declaration."""

from explore.mechanisms import four_bar, four_bar_drawing, four_bar_integrals, rocking
from explore.mechanisms.four_bar_exact import exact_four_bar
from explore.mechanisms.four_bar_forces import Load
from explore.mechanisms.four_bar_loads import LOAD_SIGNALS, LOADS
from explore.mechanisms.four_bar_size import declare_four_bar_size
from explore.mechanisms.four_bar_table import loaded_four_bar, signals_of_four_bar
from explore.mechanisms.linkages.added_points import with_points
from explore.mechanisms.prescribed_strokes import lengths_of_swing
from explore.mechanisms.rates import rates_of
from explore.mechanisms.rig import columns, kernel
from explore.mechanisms.rig.columns import Row
from explore.mechanisms.rig.formulas import FORMULAS, SIZING_PARAMETERS
from explore.model.drawing import Panel
from explore.model.mechanism import Mechanism
from explore.model.points import FloatingLink
from explore.model.quadrature import Graded
from explore.model.quantities import Metric, Parameter, Signal
from explore.model.window import Window

_SIGNALS = (
    Signal("coupler_angle", "deg", "coupler angle", four_bar.COUPLER_ANGLE, four_bar.ANGLES),
    Signal("rocker_angle", "deg", "rocker angle", four_bar.ROCKER_ANGLE, four_bar.ANGLES),
    *rates_of("rocker_angle", "rad", "rocker angular {}", (four_bar.ROCKER_VELOCITY, four_bar.ROCKER_ACCELERATION),
              (four_bar.VELOCITIES, four_bar.ACCELERATIONS)),
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
    *LOAD_SIGNALS,
)  # fmt: skip

_METRICS = (
    Metric("linkage_class", "", "class of the linkage", labels=four_bar.CLASS_LABELS),
    Metric("grashof_margin", "mm", "Grashof margin: middle two lengths minus shortest and longest", "max"),
    Metric("swing_angle", "deg", "swing of the rocker", "max", lower=0.0, upper=180.0,
           closed_form_of="rocker_angle_peak_to_peak_cycle", lengths=lengths_of_swing),
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
        *LOADS,
        *SIZING_PARAMETERS,
    ),
    signals=_SIGNALS,
    metrics=_METRICS,
    formulas=(*FORMULAS, *declare_four_bar_size("transmission_angle_worst")),
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
    variant_row=Load.VARIANT,
    output_signals={"": "rocker_velocity"},
    zero_mean=frozenset(
        [(f"rocker_{signal}", "cycle") for signal in ("velocity", "acceleration")]
        + [("rocker_acceleration", window) for window in _STROKES]
    ),
    default_metrics={"": (*(metric.name for metric in _METRICS), *_SAMPLED_DEFAULTS)},
    objectives=("pin_force_peak", "velocity_thd", "size"),
    kernel_version="19",
    table=loaded_four_bar(),
    table_signals=signals_of_four_bar,
    exact=exact_four_bar,
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=columns.SIGNAL_ROWS,
    close=kernel.close,
    fill=kernel.fill,
    integrals=four_bar_integrals.integrals,
    integrated_rows=four_bar_integrals.ROWS,
    default_window="cycle",
    drawing=four_bar_drawing.DRAWING,
    floating_link=FloatingLink("coupler", "the crank's pin", "crank joint", "coupler_angle", kernels=with_points),
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
