"""The pair of non-circular gears of a phase-adjustable stepless drive: its declaration."""

import math

from explore.mechanisms.gears import columns, kernel
from explore.mechanisms.gears.columns import Row
from explore.mechanisms.gears.formulas import FORMULAS
from explore.model.drawing import INPUT, Drawing, Panel, Path, Profile, Vector
from explore.model.mechanism import Mechanism
from explore.model.quantities import OMITTED, Metric, Parameter, Signal
from explore.model.window import Window

_PARAMETERS = (
    Parameter("growth", "1", "factor by which the driven gear speeds up per radian in the working sector, above 1"),
    Parameter("sector", "rad", "angle of gear 1 over the working sector, below a full turn", 4.2),
    Parameter("centre_distance", "mm", "distance of the axes", 150.0),
    Parameter("return_order", "1", "law of the return: 0: a sine; 1 to 3: the ratio's logarithm follows a smoothstep "
              "of that order", 0.0, -1.0, choices=(0.0, 1.0, 2.0, 3.0)),
    Parameter("branch", "1", "solution of the sine law, whole; above 1 the ratio oscillates", 1.0, upper=100.0),
    Parameter("trains", "1", "trains of two pairs that share the output through clutches", 3.0,
              choices=tuple(map(float, range(1, 13)))),
    Parameter("phase_shift", "rad", "angle between the gears 1 of a train", 0.0, upper=2.0 * math.pi,
              zero_meaning="no shift"),
    Parameter("module", "mm", "module of the teeth", 0.0, affects="sizing", zero_meaning=OMITTED),
)  # fmt: skip

_METRICS = (
    Metric("law_constant", "1", "constant k of the working sector, driven angle = k (growth^angle - 1)", lower=0.0),
    Metric("return_amplitude", "1", "amplitude C0 of the sine law; NaN with other laws", lower=0.0),
    Metric("return_frequency", "1", "periods of the sine law per turn, C1; NaN with other laws", lower=0.0),
    Metric("return_shift", "rad", "rise of the sine law through its mean, C2; NaN with other laws", lower=0.0),
    Metric("return_mean", "1", "mean C3 of the sine law's lowest and highest ratio; NaN with other laws", lower=0.0),
    Metric("ratio_start", "1", "ratio at the start of the working sector", lower=0.0),
    Metric("ratio_end", "1", "ratio at the end of the working sector", lower=0.0),
    Metric("ratio_min", "1", "smallest ratio of the turn", lower=0.0, closed_form_of="ratio_min_cycle"),
    Metric("ratio_max", "1", "largest ratio of the turn", lower=0.0, closed_form_of="ratio_max_cycle"),
    Metric("driven_sector", "deg", "angle of gear 2 over the working sector", "max", lower=0.0, upper=360.0),
    Metric("convexity_driver", "1", "least convexity 1 + i + i'' of gear 1; its pitch curve is convex at 0 or above",
           "max"),
    Metric("convexity_driven", "1", "least convexity 1 + i + i'^2 - i i'' of gear 2; its pitch curve is convex at 0 or "
           "above", "max"),
    Metric("tangent_tilt_max", "deg", "largest angle of the pitch curves to the circumferential direction", "min",
           lower=0.0, upper=90.0, closed_form_of="pitch_tilt_peak_cycle"),
    Metric("curvature_jump", "1/mm", "larger jump of curvature at the joints of working sector and return", "min",
           lower=0.0),
    Metric("phase_shift_max", "rad", "largest phase shift without ripple, on branch 1", "max", lower=0.0),
    Metric("drive_ratio_max", "1", "ratio of the drive at that phase shift", "max", lower=1.0),
    Metric("ripple", "1", "change of the drive's ratio at `phase_shift` over the turn, over its largest value", "min",
           lower=0.0, upper=1.0),
)  # fmt: skip

_SIGNALS = (
    Signal("ratio", "1", "ratio of the pair, velocity of gear 1 over that of gear 2", columns.RATIO, columns.RATIOS),
    Signal("ratio_rate", "1", "derivative of the ratio by the angle of gear 1", columns.RATIO_RATE, columns.RATIOS,
           derivative_of="ratio"),
    Signal("ratio_acceleration", "1", "second derivative of the ratio by the angle of gear 1",
           columns.RATIO_ACCELERATION, columns.RATIOS, derivative_of="ratio_rate"),
    Signal("speed_ratio", "1", "velocity of gear 2 over that of gear 1", columns.SPEED_RATIO, columns.RATIOS),
    Signal("speed_ratio_rate", "1", "acceleration of gear 2 over the squared velocity of gear 1",
           columns.SPEED_RATIO_RATE, columns.RATIOS, derivative_of="speed_ratio"),
    Signal("driven_angle", "deg", "angle of gear 2, from 0 at the start of the working sector", columns.DRIVEN_ANGLE,
           columns.ANGLES, starts_anew=True),
    Signal("driver_radius", "mm", "pitch radius of gear 1", columns.DRIVER_RADIUS, columns.PITCH_CURVES,
           relative_to="centre_distance"),
    Signal("driven_radius", "mm", "pitch radius of gear 2", columns.DRIVEN_RADIUS, columns.PITCH_CURVES,
           relative_to="centre_distance"),
    Signal("pitch_tilt", "deg", "angle of the pitch curves to the circumferential direction", columns.PITCH_TILT,
           columns.PITCH_CURVES),
    Signal("pitch_length", "mm", "length of the pitch curves per radian of gear 1", columns.PITCH_LENGTH,
           columns.PITCH_LENGTHS, relative_to="centre_distance"),
    Signal("driver_curvature", "1/mm", "curvature of gear 1's pitch curve, convex positive", columns.DRIVER_CURVATURE,
           columns.PITCH_CURVES, terms_row=columns.DRIVER_TERMS),
    Signal("driven_curvature", "1/mm", "curvature of gear 2's pitch curve, convex positive", columns.DRIVEN_CURVATURE,
           columns.PITCH_CURVES, terms_row=columns.DRIVEN_TERMS),
    Signal("train_ratio", "1", "output over input velocity of one train of two pairs", columns.TRAIN_RATIO,
           columns.TRAIN, has_corners=True, corners_at=("train_joints",)),
    Signal("overall_ratio", "1", "output over input velocity of all trains, behind the clutches",
           columns.OVERALL_RATIO, columns.DRIVE, has_corners=True, corners_at=("first_joints", "second_joints")),
    Signal("train_joints", "1", "0 where the second pair of the first train is at a joint of working sector and return",
           columns.TRAIN_JOINTS, columns.JOINTS),
    Signal("first_joints", "1", "0 where the first pair of a train is at a joint, and always 1 without ripple",
           columns.FIRST_JOINTS, columns.JOINTS),
    Signal("second_joints", "1", "0 where the second pair of a train is at a joint, and always 1 without ripple",
           columns.SECOND_JOINTS, columns.JOINTS),
)  # fmt: skip

_WINDOWS = (
    Window("cycle", "the full turn of gear 1", "turn", needs_stroke=False),
    Window("working", "the working sector", "arc", ("start", "end"), needs_stroke=False),
    Window("return", "the return sector", "arc", ("end", "start"), needs_stroke=False),
    Window("interval", "an explicit interval of angles of gear 1, { from = 0, to = 90 }", "interval",
           needs_stroke=False),
)  # fmt: skip

_DEFAULT_METRICS = (
    "law_constant", "ratio_min", "ratio_max", "ratio_start", "ratio_end", "convexity_driver", "convexity_driven",
    "tangent_tilt_max", "curvature_jump", "phase_shift_max", "drive_ratio_max",
)  # fmt: skip

#: Drawing of both pitch curves in mesh: the pitch point of an angle of gear 1 is on the line of centres at that angle.
_DRAWING = Drawing(
    points={
        "driver axis": (),
        "driven axis": (Vector("centre_distance"),),
        "pitch point": (Vector("driver_radius"),),
    },
    pivots=("driver axis", "driven axis"),
    paths=(Path("pitch point", "path of the pitch point", "output"),),
    profiles=(
        Profile("gear 1", (Vector("driver_radius", INPUT, sense=-1),), "driver axis", INPUT),
        Profile("gear 2", (Vector("driven_radius", "driven_angle", -1.0),), "driven axis", "driven_angle", sense=-1),
    ),
)

GEARS = Mechanism(
    name="gears",
    summary="pair of non-circular gears whose ratio is exponential over a sector: a stepless drive from shifted pairs",
    input_angle="driver angle",
    parameters=_PARAMETERS,
    signals=_SIGNALS,
    metrics=_METRICS,
    windows=_WINDOWS,
    marks={"start": columns.START_JOINT, "end": columns.END_JOINT},
    breaks=("start", "end"),
    output_signals={"": "ratio"},
    zero_mean=frozenset((f"{name}_rate", "cycle") for name in ("ratio", "speed_ratio"))
    | {("ratio_acceleration", "cycle")},
    default_metrics={"": _DEFAULT_METRICS},
    objectives=("drive_ratio_max:max", "tangent_tilt_max:min", "convexity_driven:max"),
    kernel_version="16",
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=columns.SIGNAL_ROWS,
    close=kernel.close,
    fill=kernel.fill,
    default_window="cycle",
    formulas=FORMULAS,
    drawing=_DRAWING,
    panels=(
        Panel("ratio", ("ratio",)),
        Panel("driven angle", ("driven_angle",)),
        Panel("pitch radius", ("driver_radius", "driven_radius")),
        Panel("curvature", ("driver_curvature", "driven_curvature")),
        Panel("tilt of the tangent", ("pitch_tilt",)),
        Panel("ratio of the drive", ("train_ratio", "overall_ratio")),
    ),
    statuses=kernel.STATUSES,
)
