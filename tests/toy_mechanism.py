"""A mechanism whose signal has a peak at a crank angle of 1 rad, where the quadrature expects no singularity."""

import math
from enum import IntEnum

from explore.compiling import FILL_SIGNATURE, PIECES_SIGNATURE, compiled
from explore.model.mechanism import Mechanism
from explore.model.quantities import Metric, Parameter, Signal, Window

#: Starts a study of the peak; smaller distances make it higher and narrower.
STUDY = """mechanism = "peak"
[parameters]
distance = { start = 1e-4, stop = 2e-4, num = 3 }
[evaluate]
metrics = ["peak", "height_variance"]
[rank]
metrics = ["peak", "height_variance"]
"""


class ParameterColumn(IntEnum):
    DISTANCE = 0


class MetricColumn(IntEnum):
    PEAK = 0


@compiled("void(float64[:, ::1], float64[:, ::1], int8[::1], float64[:, ::1], float64[:, ::1], float64[::1])")
def closed_form(parameters, metrics, status, kernel, _singular, _noise):
    for i in range(parameters.shape[0]):
        kernel[i, 0] = parameters[i, 0]
        metrics[0, i] = 1.0 / parameters[i, 0]
        status[i] = 1


@compiled(PIECES_SIGNATURE)
def pieces(_row, _window, _drive, _start, _stop, out):
    out[0, 0], out[0, 1], out[0, 2] = 0.0, -1.0, 1.0
    out[1, 0], out[1, 1], out[1, 2] = 1.0, -1.0, 1.0
    out[3, 0], out[3, 1] = 2.0 * math.pi, 0.0
    return 2


@compiled(FILL_SIGNATURE, fast=True)
def fill(row, sin_half, cos_half, count, _needs, out):
    for j in range(count):
        cosine = cos_half[j] * cos_half[j] - sin_half[j] * sin_half[j]
        sine = 2.0 * sin_half[j] * cos_half[j]
        out[0, j] = 1.0 / (1.0 + row[0] - cosine * math.cos(1.0) - sine * math.sin(1.0))


PEAK = Mechanism(
    name="peak",
    summary="a peak where the quadrature expects none",
    parameters=(
        Parameter("distance", "1", "distance of the singularity from the real axis"),
        Parameter("speed", "rad/s", "constant crank velocity", default=1.0, scales_speed=True),
    ),
    signals=(Signal("height", "1", "height of the peak", 0, 1),),
    metrics=(Metric("peak", "1", "largest height", "min"),),
    windows=(Window("cycle", 0, "the full turn", needs_stroke=False),),
    drives={"none": 0},
    output_signals={"": "height"},
    zero_mean=frozenset(),
    default_metrics={"": ("peak", "height_mean")},
    objectives=("peak", "height_variance"),
    kernel_version="1",
    kernel_size=1,
    signal_rows=1,
    parameter_columns=ParameterColumn,
    metric_columns=MetricColumn,
    closed_form=closed_form,
    pieces=pieces,
    fill=fill,
    default_window="cycle",
    default_drive="none",
)
