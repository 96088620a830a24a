"""A mechanism whose signals have the shapes that an adaptive quadrature meets, at an angle that is not declared."""

import math
from enum import IntEnum

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.model.mechanism import Mechanism
from explore.model.quantities import Metric, Parameter, Signal
from explore.model.window import Window

NAMES = ("peak", "corner", "step", "polynomial", "wave", "constant")
#: Row of a signal that is nothing but rounding errors of terms up to 1; and number of all rows.
ROUNDING, ROWS = 6, 7


class Row(IntEnum):
    STATUS = 3
    PLACE = 4
    DISTANCE = 5
    ORDER = 6
    HEIGHT = 7


@compiled(CLOSE_SIGNATURE)
def close(record):
    for lane in range(LANES):
        for row in range(3):
            record[row * LANES + lane] = record[(Row.PLACE + row) * LANES + lane]
        record[Row.HEIGHT * LANES + lane] = 1.0 / record[Row.DISTANCE * LANES + lane]
        record[Row.STATUS * LANES + lane] = 1.0


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, _law, _variant, count, _needs, out):
    for j in range(count):
        for lane in range(LANES):
            angle = math.pi * anchor + 2.0 * math.atan(tangents[j * LANES + lane]) - constants[lane]
            sine, at = math.sin(0.5 * angle), ROWS * j * LANES + lane
            out[at] = 1.0 / (constants[LANES + lane] + 2.0 * sine * sine)
            out[at + LANES] = abs(sine)
            out[at + 2 * LANES] = 1.0 if math.sin(angle) > 0.0 else 0.0
            out[at + 3 * LANES] = 1.0 + math.cos(angle) + 0.3 * math.cos(2.0 * angle)
            out[at + 4 * LANES] = math.cos(constants[2 * LANES + lane] * angle)
            out[at + 5 * LANES] = 0.3
            out[at + ROUNDING * LANES] = (1.0 + sine) - 1.0 - sine


SHAPES = Mechanism(
    name="shapes",
    summary="signals of known statistics",
    parameters=(
        Parameter("place", "rad", "angle of the peak, the corner and the step"),
        Parameter("distance", "1", "distance of the peak's singularity from the real axis", default=0.1),
        Parameter("order", "1", "waves of a turn", default=1.0),
    ),
    signals=tuple(Signal(name, "1", name, row, 1) for row, name in enumerate(NAMES)),
    metrics=(Metric("height", "1", "height of the peak"),),
    windows=(
        Window("cycle", "the full turn", "turn", needs_stroke=False),
        Window("interval", "an explicit interval", "interval", needs_stroke=False),
    ),
    output_signals={"": "peak"},
    zero_mean=frozenset(),
    default_metrics={"": ("height",)},
    objectives=("height",),
    kernel_version="1",
    n_constants=Row.STATUS,
    rows=Row,
    signal_rows=ROWS,
    close=close,
    fill=fill,
    default_window="cycle",
)
