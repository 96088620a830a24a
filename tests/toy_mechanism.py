"""A mechanism whose signal has a peak at a crank angle of 1 rad, where no graded quadrature expects a singularity."""

import math
from dataclasses import replace
from enum import IntEnum

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.model.mechanism import Mechanism
from explore.model.quadrature import Graded
from explore.model.quantities import Metric, Parameter, Signal
from explore.model.window import Window

#: Starts a study of the peak; smaller distances make it higher and narrower.
STUDY = """mechanism = "peak"
[parameters]
distance = { start = 1e-4, stop = 2e-4, num = 3 }
[evaluate]
metrics = ["peak", "height_variance"]
[rank]
metrics = ["peak", "height_variance"]
"""


class Row(IntEnum):
    FAR = 1
    STATUS = 2
    DISTANCE = 3
    PEAK = 4


@compiled(CLOSE_SIGNATURE)
def close(record):
    for lane in range(LANES):
        distance = record[Row.DISTANCE * LANES + lane]
        record[lane] = distance
        record[Row.FAR * LANES + lane] = 0.9
        record[Row.PEAK * LANES + lane] = 1.0 / distance
        record[Row.STATUS * LANES + lane] = 1.0


@compiled(FILL_SIGNATURE, fast=True)
def fill(constants, tangents, anchor, _law, _variant, count, _needs, out):
    sign = 1.0 if anchor == 0 else -1.0
    for j in range(count):
        for lane in range(LANES):
            tangent = tangents[j * LANES + lane]
            scale = sign / (1.0 + tangent * tangent)
            cosine, sine = (1.0 - tangent * tangent) * scale, 2.0 * tangent * scale
            out[j * LANES + lane] = 1.0 / (1.0 + constants[lane] - cosine * math.cos(1.0) - sine * math.sin(1.0))


PEAK = Mechanism(
    name="peak",
    summary="a peak at a crank angle of 1 rad",
    parameters=(Parameter("distance", "1", "distance of the singularity from the real axis"),),
    signals=(Signal("height", "1", "height of the peak", 0, 1),),
    metrics=(Metric("peak", "1", "largest height", "min"),),
    windows=(Window("cycle", "the full turn", "turn", needs_stroke=False),),
    output_signals={"": "height"},
    zero_mean=frozenset(),
    default_metrics={"": ("peak", "height_mean")},
    objectives=("peak", "height_variance"),
    kernel_version="1",
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=1,
    close=close,
    fill=fill,
    default_window="cycle",
)

#: The same with a wrong declaration: that the only singularity is far away.
WRONG_PEAK = replace(PEAK, quadrature=Graded(((Row.FAR, 0),)))
