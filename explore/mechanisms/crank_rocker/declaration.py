"""The crank-rocker, also of a pulsating stepless transmission: its declaration."""

from dataclasses import replace

from explore.mechanisms import four_bar, four_bar_drawing, four_bar_integrals, rocking
from explore.mechanisms.crank_rocker import extended, kernel
from explore.mechanisms.crank_rocker.columns import ExtendedRow, Row
from explore.mechanisms.crank_rocker.loop import LOOP
from explore.mechanisms.crank_rocker.second_differences import SECOND_DIFFERENCES
from explore.mechanisms.four_bar_exact import exact_four_bar
from explore.mechanisms.four_bar_forces import LOADED_SIGNAL_ROWS, Load
from explore.mechanisms.four_bar_loads import LOAD_FORMULAS, LOAD_PANELS, LOAD_SIGNALS, LOADS
from explore.mechanisms.four_bar_size import declare_four_bar_size
from explore.mechanisms.four_bar_table import four_bar_table, loaded_four_bar, signals_of_four_bar
from explore.mechanisms.linkages.added_points import with_points
from explore.mechanisms.linkages.motions import declare_targets_of_link
from explore.mechanisms.prescribed_strokes import lengths_of_swing
from explore.mechanisms.rates import rates_of
from explore.model.drawing import Panel
from explore.model.mechanism import Mechanism
from explore.model.points import FloatingLink
from explore.model.quadrature import Graded
from explore.model.quantities import Metric, Parameter, Signal
from explore.model.window import INTERVAL, Window

_RATES = (four_bar.VELOCITIES, four_bar.ACCELERATIONS)
_COUPLER_ROWS = (four_bar.COUPLER_VELOCITY, four_bar.COUPLER_ACCELERATION)
_ROCKER_ROWS = (four_bar.ROCKER_VELOCITY, four_bar.ROCKER_ACCELERATION)
_VELOCITY_SIGNALS, _ACCELERATION_SIGNALS = zip(
    rates_of("coupler_angle", "rad", "coupler angular {}", _COUPLER_ROWS, _RATES),
    rates_of("rocker_angle", "rad", "rocker angular {}", _ROCKER_ROWS, _RATES),
    strict=True,
)
_STROKES = ("overlapped_to_extended", "extended_to_overlapped")
_STROKE_WINDOWS = ("drive", "return", *_STROKES)
_GEOMETRY_METRICS = (
    Metric("linkage_class", "", "class of the linkage", labels=four_bar.CLASS_LABELS),
    Metric("grashof_margin", "mm", "Grashof margin: middle two lengths minus shortest and longest", "max"),
    Metric("swing_angle", "deg", "swing of the rocker", "max", lower=0.0, upper=180.0, needs_stroke=True,
           closed_form_of="rocker_angle_peak_to_peak_cycle", lengths=lengths_of_swing),
    Metric("mid_angle", "deg", "mean of the rocker's two limit angles", lower=-180.0, upper=180.0, needs_stroke=True),
    Metric("time_ratio", "1", "time ratio: longer crank interval over shorter", lower=1.0, needs_stroke=True),
    Metric("mean_output_ratio", "1", "mean output speed over input speed with one clutch", "max", lower=0.0, upper=0.5,
           needs_stroke=True),
    Metric("transmission_angle_min", "deg", "smallest transmission angle over the turn", "max", lower=0.0, upper=180.0,
           closed_form_of="transmission_angle_min_cycle"),
    Metric("transmission_angle_max", "deg", "largest transmission angle over the turn", "min", lower=0.0, upper=180.0,
           closed_form_of="transmission_angle_max_cycle"),
)  # fmt: skip
_CLOSED_NAMES = tuple(metric.name for metric in _GEOMETRY_METRICS)
_STROKELESS_NAMES = tuple(metric.name for metric in _GEOMETRY_METRICS if not metric.needs_stroke)
_SAMPLED_DEFAULTS = (
    *(
        f"{signal.name}_{statistic}"
        for signal in (*_VELOCITY_SIGNALS, *_ACCELERATION_SIGNALS)
        for statistic in ("mean", "variance", "cv")
        if (signal.name, statistic) != ("rocker_acceleration", "cv")
    ),
    *(f"velocity_ratio_{statistic}" for statistic in ("mean", "variance", "cv")),
    "cv",
)
_CYCLE_DEFAULTS = tuple(name for name in _SAMPLED_DEFAULTS if not name.endswith("cv"))
_CLUTCH_DEFAULTS = ("output_velocity_mean", "output_velocity_variance", "output_velocity_cv", "cv")

_EXTENDED = Mechanism(
    name="crank-rocker",
    summary="four-bar whose crank turns and whose rocker swings: wipers, coupler curves, pulsating transmissions",
    parameters=(
        Parameter("crank", "mm", "crank length"),
        Parameter("coupler", "mm", "coupler length"),
        Parameter("rocker", "mm", "rocker length"),
        Parameter("ground", "mm", "distance of the ground pivots"),
        Parameter("speed", "rad/s", "constant crank velocity", default=1.0, scales_speed=True),
        Parameter(
            "phases",
            "1",
            "linkages that share the output through clutches",
            3.0,
            choices=tuple(map(float, range(1, 13))),
            only_in=("clutch",),
        ),
        Parameter(
            "branch",
            "1",
            "1: coupler joint left of the line crank pin to rocker pivot; -1: right",
            1.0,
            -2.0,
            choices=(1.0, -1.0),
        ),
        *LOADS,
    ),
    signals=(
        Signal("coupler_angle", "deg", "coupler angle", four_bar.COUPLER_ANGLE, four_bar.ANGLES, needs_stroke=True),
        Signal(
            "rocker_angle",
            "deg",
            "rocker angle",
            four_bar.ROCKER_ANGLE,
            four_bar.ANGLES,
            needs_stroke=True,
            extremes_at=("overlapped", "extended"),
        ),
        Signal(
            "transmission_angle",
            "deg",
            "transmission angle",
            four_bar.TRANSMISSION_ANGLE,
            four_bar.TRANSMISSION,
            extremes_at=("anchor", "opposite"),
        ),
        *_VELOCITY_SIGNALS,
        Signal(
            "output_velocity",
            "rad/s",
            "velocity of the output behind the clutches",
            four_bar.ROCKER_VELOCITY,
            four_bar.VELOCITIES,
            speed_power=1,
            shares_row_with="rocker_velocity",
            is_rectified=True,
            only_in=("clutch",),
        ),
        *_ACCELERATION_SIGNALS,
        Signal(
            "velocity_ratio",
            "1",
            "rocker velocity over crank velocity",
            four_bar.ROCKER_VELOCITY,
            four_bar.VELOCITIES,
            shares_row_with="rocker_velocity",
            derivative_of="rocker_angle",
        ),
        *LOAD_SIGNALS,
    ),
    formulas=(*LOAD_FORMULAS, *declare_four_bar_size("transmission_angle_min"), SECOND_DIFFERENCES),
    metrics=_GEOMETRY_METRICS,
    windows=(
        Window("cycle", "the full turn", "turn", needs_stroke=False),
        Window("drive", "the stroke that the clutch transmits (setting `drive`)", "drive"),
        Window("return", "the other stroke", "return"),
        Window(_STROKES[0], "from coupler over crank to coupler in line with it", "arc", ("overlapped", "extended")),
        Window(_STROKES[1], "from coupler in line with crank to coupler over it", "arc", ("extended", "overlapped")),
        Window("clutch", "the output of `phases` linkages through one-way clutches", "clutch"),
        INTERVAL,
    ),
    strokes=_STROKES,
    drives=("slow", "fast", *_STROKES),
    marks={"overlapped": rocking.OVERLAPPED, "extended": rocking.EXTENDED},
    # A torque against the motion jumps between the strokes.
    breaks=("overlapped", "extended"),
    quadrature=Graded(((rocking.SINGULAR_P, 0), (rocking.SINGULAR_Q, 1), (rocking.SINGULAR_D, 0))),
    noise_row=rocking.NOISE,
    phases_row=ExtendedRow.N_LINKAGES,
    variant_row=Load.VARIANT,
    output_signals={"": "rocker_velocity", "clutch": "output_velocity"},
    zero_mean=frozenset(
        [(s.name, "cycle") for s in (*_VELOCITY_SIGNALS, *_ACCELERATION_SIGNALS)]
        + [("velocity_ratio", "cycle")]
        + [("rocker_acceleration", window) for window in _STROKE_WINDOWS]
    ),
    default_metrics={
        "": (*_CLOSED_NAMES, *_SAMPLED_DEFAULTS),
        "cycle": (*_STROKELESS_NAMES, *_CYCLE_DEFAULTS),
        "interval": (*_STROKELESS_NAMES, *_SAMPLED_DEFAULTS),
        "clutch": (*_CLOSED_NAMES, *_CLUTCH_DEFAULTS),
    },
    objectives=("cv", "swing_angle:max", "transmission_angle_min:max"),
    kernel_version="26",
    table=loaded_four_bar("branch"),
    table_signals=signals_of_four_bar,
    exact=exact_four_bar,
    n_constants=ExtendedRow.STATUS,
    rows=ExtendedRow,
    signal_rows=LOADED_SIGNAL_ROWS,
    close=extended.close,
    fill=extended.fill,
    integrals=four_bar_integrals.integrals,
    integrated_rows=four_bar_integrals.ROWS,
    loop_lengths=("crank", "coupler", "rocker", "ground"),
    loop=LOOP,
    statuses=rocking.STATUSES,
    drawing=four_bar_drawing.DRAWING,
    floating_link=FloatingLink("coupler", "the crank's pin", "crank joint", "coupler_angle", kernels=with_points),
    targets=declare_targets_of_link(four_bar_table("branch"), "coupler", "transmission_angle_min", "swing_angle"),
    panels=(
        Panel("angle", ("coupler_angle", "rocker_angle")),
        Panel("transmission angle", ("transmission_angle",), limits=(0.0, 180.0)),
        Panel("angular velocity", ("coupler_velocity", "rocker_velocity")),
        Panel("angular acceleration", ("coupler_acceleration", "rocker_acceleration")),
        Panel("rocker over crank velocity", ("velocity_ratio",), with_clutch=True),
        Panel("output velocity", ("output_velocity",), with_clutch=True),
        *LOAD_PANELS,
    ),
)

CRANK_ROCKER = replace(
    _EXTENDED,
    breaks=(),
    phases_row=Row.N_LINKAGES,
    variant_row=-1,
    n_constants=Row.STATUS,
    n_fill_constants=four_bar.FOUR_BAR_SIZE,
    rows=Row,
    signal_rows=four_bar.SIGNAL_ROWS,
    close=kernel.close,
    fill=kernel.fill,
    extended=_EXTENDED,
)
