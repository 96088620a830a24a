"""The slider-crank of presses, pumps and slicers: its declaration."""

import math
from dataclasses import replace

import numpy as np

from explore.mechanisms.linkages.added_points import with_points
from explore.mechanisms.linkages.motions import declare_targets_of_link
from explore.mechanisms.overall_size import declare_size
from explore.mechanisms.prescribed_strokes import lengths_of_stroke
from explore.mechanisms.rates import rates_of
from explore.mechanisms.slider_crank import columns, extended, kernel, loads
from explore.mechanisms.slider_crank.columns import ExtendedRow, Row
from explore.mechanisms.slider_crank.exact import exact_slider_crank
from explore.mechanisms.slider_crank.loop import LOOP
from explore.mechanisms.slider_crank.table import LOADED_TABLE, TABLE, signals_of_slider_crank
from explore.model.drawing import INPUT, Drawing, Guide, Link, Panel, Path, Vector
from explore.model.mechanism import Mechanism
from explore.model.points import Extent, FloatingLink
from explore.model.quadrature import Graded
from explore.model.quantities import FloatArray, Metric, Parameter, Signal
from explore.model.window import Window

_STROKES = ("outer_to_inner", "inner_to_outer")
_METRICS = (
    Metric(
        "stroke",
        "mm",
        "stroke of the slider",
        lower=0.0,
        closed_form_of="slider_position_peak_to_peak_cycle",
        lengths=lengths_of_stroke,
    ),
    Metric("time_ratio", "1", "time ratio: longer crank interval over shorter", lower=1.0),
    Metric("outer_angle", "deg", "crank angle of the outer dead centre", lower=-90.0, upper=90.0),
    Metric("inner_angle", "deg", "crank angle of the inner dead centre", lower=90.0, upper=270.0),
    Metric(
        "pressure_angle_max",
        "deg",
        "largest angle between the rod and the slider's line over the turn",
        "min",
        lower=0.0,
        upper=90.0,
        closed_form_of="rod_angle_peak_cycle",
    ),
    Metric(
        "transmission_angle_min",
        "deg",
        "smallest angle between the rod and the normal of the slider's line over the turn",
        "max",
        lower=0.0,
        upper=90.0,
    ),
    Metric("turning_margin", "mm", "length of the rod beyond crank plus offset", "max"),
)
_CLOSED_NAMES = tuple(metric.name for metric in _METRICS)
_SAMPLED_DEFAULTS = ("slider_velocity_mean", "slider_velocity_peak", "slider_acceleration_peak")


def _along_x(
    crank: FloatArray, rod: FloatArray, offset: FloatArray, stroke: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The circle of the crank and the slider at its outer dead centre, which is beyond the circle."""
    square = (rod + crank - offset) * (rod + crank + offset)
    return -crank, np.sqrt(np.where(np.isnan(stroke), np.nan, square))


def _along_y(
    crank: FloatArray, _rod: FloatArray, offset: FloatArray, stroke: FloatArray
) -> tuple[FloatArray, FloatArray]:
    reach = np.where(np.isnan(stroke), np.nan, crank)
    return -np.maximum(reach, -offset), np.maximum(reach, offset)


_SIZE = declare_size(
    "the slider's line", ("crank", "rod", "offset", "stroke"), Extent("x", _along_x), Extent("y", _along_y)
)
_DRAWING = Drawing(
    points={
        "crank pivot": (),
        "crank pin": (Vector("crank", INPUT),),
        "slider pin": (Vector("slider_position"), Vector("offset", 90.0)),
    },
    links=(Link("crank", ("crank pivot", "crank pin")), Link("rod", ("crank pin", "slider pin"))),
    pivots=("crank pivot",),
    guides=(Guide("slider pin"),),
    paths=(
        Path("crank pin", "path of the joint of crank and rod"),
        Path("slider pin", "path of the slider", "output"),
    ),
    stroke_point="crank pin",
)

_EXTENDED = Mechanism(
    name="slider-crank",
    summary="crank that drives a slider to and fro through a rod: presses, pumps, slicers",
    parameters=(
        Parameter("crank", "mm", "crank length"),
        Parameter("rod", "mm", "length of the connecting rod"),
        Parameter(
            "offset", "mm", "distance of the slider's line from the crank's pivot, to either side", 0.0, -math.inf
        ),
        Parameter("speed", "rad/s", "constant crank velocity", default=1.0, scales_speed=True),
        *loads.PARAMETERS,
    ),
    signals=(
        Signal(
            "slider_position",
            "mm",
            "position of the slider along its line, from the crank's pivot",
            columns.POSITION,
            columns.SLIDER,
            relative_to="rod",
            extremes_at=("outer", "inner"),
        ),
        *rates_of(
            "slider_position",
            "mm",
            "{} of the slider",
            (columns.VELOCITY, columns.ACCELERATION),
            (columns.SLIDER, columns.SLIDER_ACCELERATION),
        ),
        Signal(
            "rod_angle",
            "deg",
            "angle of the rod from the slider's line",
            columns.ROD_ANGLE,
            columns.ANGLE,
            extremes_at=("anchor", "opposite"),
        ),
        *rates_of(
            "rod_angle",
            "rad",
            "angular {} of the rod",
            (columns.ROD_VELOCITY, columns.ROD_ACCELERATION),
            (columns.ROD_RATES, columns.ROD_RATES),
        ),
        *loads.SIGNALS,
    ),
    metrics=_METRICS,
    formulas=(*_SIZE, *loads.FORMULAS),
    windows=(
        Window("cycle", "the full turn", "turn"),
        Window("drive", "the stroke that works (setting `drive`)", "drive"),
        Window("return", "the other stroke", "return"),
        Window(_STROKES[0], "from the outer to the inner dead centre", "arc", ("outer", "inner")),
        Window(_STROKES[1], "from the inner to the outer dead centre", "arc", ("inner", "outer")),
        Window("interval", "an explicit interval of crank angles, { from = 0, to = 90 }", "interval"),
    ),
    strokes=_STROKES,
    drives=("slow", "fast", *_STROKES),
    marks={"outer": Row.OUTER, "inner": Row.INNER},
    anchor_angle=0.5 * math.pi,
    quadrature=Graded(((Row.SINGULAR_ABOVE, 0), (Row.SINGULAR_BELOW, 1))),
    noise_row=Row.NOISE,
    output_signals={"": "slider_velocity"},
    zero_mean=frozenset(
        [(f"{link}_{rate}", "cycle") for link in ("slider", "rod") for rate in ("velocity", "acceleration")]
        + [("slider_acceleration", window) for window in ("drive", "return", *_STROKES)]
    ),
    default_metrics={
        "": (*_CLOSED_NAMES, *_SAMPLED_DEFAULTS, "cv"),
        "cycle": (*_CLOSED_NAMES, *_SAMPLED_DEFAULTS[1:], "slider_velocity_rms"),
    },
    objectives=("cv", "slider_acceleration_peak", "pressure_angle_max"),
    kernel_version="23",
    table=LOADED_TABLE,
    table_signals=signals_of_slider_crank,
    exact=exact_slider_crank,
    n_constants=ExtendedRow.STATUS,
    rows=ExtendedRow,
    signal_rows=columns.EXTENDED_SIGNAL_ROWS,
    # Friction and a force against the motion jump between the strokes.
    breaks=("outer", "inner"),
    close=extended.close,
    fill=extended.fill,
    loop_lengths=("crank", "rod", "offset"),
    loop=LOOP,
    statuses=kernel.STATUSES,
    drawing=_DRAWING,
    floating_link=FloatingLink("rod", "the crank's pin", "crank pin", "rod_angle", kernels=with_points),
    targets=declare_targets_of_link(TABLE, "rod", "transmission_angle_min", "stroke"),
    panels=(
        Panel("slider position", ("slider_position",)),
        Panel("slider velocity", ("slider_velocity",)),
        Panel("slider acceleration", ("slider_acceleration",)),
        Panel("rod angle", ("rod_angle",)),
        *loads.PANELS,
    ),
)

SLIDER_CRANK = replace(
    _EXTENDED,
    n_constants=Row.STATUS,
    n_fill_constants=columns.FILL_SIZE,
    rows=Row,
    signal_rows=columns.SIGNAL_ROWS,
    breaks=(),
    close=kernel.close,
    fill=kernel.fill,
    extended=_EXTENDED,
)
