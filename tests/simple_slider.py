"""A slider-crank: a mechanism with a signed parameter, statuses of its own, lengths as signals, and no speed.

The slider runs along a line parallel to the axis of crank angle 0, at a distance from the pivot.
"""

import math
from enum import IntEnum

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.model.drawing import INPUT, Drawing, Guide, Link, Vector
from explore.model.mechanism import Mechanism
from explore.model.quantities import Metric, Parameter, Signal
from explore.model.status import OwnStatus
from explore.model.window import Window

PARAMETERS = (
    Parameter("crank", "mm", "crank length"),
    Parameter("rod", "mm", "length of the connecting rod"),
    Parameter("offset", "mm", "distance of the slider's line from the pivot", 0.0, -math.inf),
)
SIGNALS = (
    Signal("position", "mm", "position of the slider", 0, 1, relative_to="rod"),
    Signal("velocity", "mm", "its rate by the crank angle", 1, 1, relative_to="crank", derivative_of="position"),
)
DRAWING = Drawing(
    points={
        "pivot": (),
        "pin": (Vector("crank", INPUT),),
        "slider": (Vector("position"), Vector("offset", 90.0)),
    },
    links=(Link("crank", ("pivot", "pin")), Link("rod", ("pin", "slider"))),
    pivots=("pivot",),
    guides=(Guide("slider"),),
)
TOO_SHORT, LINED_UP = 20, 21
STATUSES = {
    TOO_SHORT: OwnStatus("too_short", "the rod is too short for the crank to turn"),
    LINED_UP: OwnStatus("lined_up", "crank and rod fall onto one line across that of the slider"),
}
STUDY = """mechanism = "simple-slider"
[parameters]
crank = { start = 40, stop = 60, num = 3 }
rod = [110, 150]
offset = { start = -40, stop = 20, num = 4 }
[evaluate]
metrics = ["stroke", "position_mean", "velocity_max"]
[rank]
metrics = ["stroke:max", "velocity_max"]
"""


class Row(IntEnum):
    LENGTH = 1
    SHIFT = 2
    NOISE = 3
    STATUS = 4
    CRANK = 5
    ROD = 6
    OFFSET = 7
    STROKE = 8
    MARGIN = 9


@compiled(CLOSE_SIGNATURE)
def close(record):
    for lane in range(LANES):
        crank, rod = record[Row.CRANK * LANES + lane], record[Row.ROD * LANES + lane]
        offset = record[Row.OFFSET * LANES + lane]
        margin = rod - crank - abs(offset)
        # the difference of two roots, as that of their squares over their sum
        far = math.sqrt((rod + crank - offset) * (rod + crank + offset))
        near = math.sqrt((rod - crank - offset) * (rod - crank + offset))
        stroke = 4.0 * rod * crank / (far + near)
        record[lane] = crank
        record[Row.LENGTH * LANES + lane] = rod
        record[Row.SHIFT * LANES + lane] = offset
        # the largest tangent of the angle between the rod and the slider's line
        reach = crank + abs(offset)
        record[Row.NOISE * LANES + lane] = reach / math.sqrt((rod - reach) * (rod + reach))
        status = 1.0 * TOO_SHORT if margin < 0.0 else 1.0
        record[Row.STATUS * LANES + lane] = 1.0 * LINED_UP if margin == 0.0 else status
        record[Row.STROKE * LANES + lane] = stroke if margin > 0.0 else math.nan
        record[Row.MARGIN * LANES + lane] = margin


@compiled(FILL_SIGNATURE, fast=True)
def fill(constants, tangents, anchor, _law, _variant, count, _needs, out):
    sign = 1.0 if anchor == 0 else -1.0
    for j in range(count):
        for lane in range(LANES):
            crank, rod = constants[lane], constants[Row.LENGTH * LANES + lane]
            tangent = tangents[j * LANES + lane]
            scale = sign / (1.0 + tangent * tangent)
            cosine, sine = (1.0 - tangent * tangent) * scale, 2.0 * tangent * scale
            height = crank * sine - constants[Row.SHIFT * LANES + lane]
            along = math.sqrt((rod - height) * (rod + height))
            out[2 * j * LANES + lane] = crank * cosine + along
            out[(2 * j + 1) * LANES + lane] = -crank * sine - height * crank * cosine / along


SIMPLE_SLIDER = Mechanism(
    name="simple-slider",
    summary="a crank that moves a slider to and fro",
    parameters=PARAMETERS,
    signals=SIGNALS,
    metrics=(
        Metric("stroke", "mm", "stroke of the slider", lower=0.0, closed_form_of="position_peak_to_peak_cycle"),
        Metric("margin", "mm", "length of the rod beyond crank and offset", "max"),
    ),
    windows=(Window("cycle", "the full turn", "turn", needs_stroke=False),),
    output_signals={"": "velocity"},
    zero_mean=frozenset([("velocity", "cycle")]),
    default_metrics={"": ("stroke", "position_mean")},
    objectives=("stroke:max",),
    kernel_version="1",
    noise_row=Row.NOISE,
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=2,
    close=close,
    fill=fill,
    default_window="cycle",
    loop_lengths=("crank", "rod", "offset"),
    starter=STUDY,
    statuses=STATUSES,
    drawing=DRAWING,
)
