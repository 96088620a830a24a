"""Errors of output angles of designs against those that a function asks for."""

import math

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE

# Measures of a design: the root mean square error and the largest one, rad.
RMS, LARGEST = range(2)
N_MEASURES = 2

#: Number of the starts, of input and output, rad, that end a row of designs.
STARTS_SIZE = 2

_TURN = 2.0 * math.pi
_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@compiled(types.void(CURVE, _F2, _F1, _F1, _F2), allocates=True)
def measure_outputs(output, designs, inputs, outputs, measures):
    """Measure designs against pairs of a function: fill `measures` (n, N_MEASURES).

    It is NaN where the first number of a design is, or where it cannot be assembled.

    `output` is a curve whose first two numbers are cosine and sine of the output's angle in the frame, times a positive
    number, NaN where the linkage cannot be assembled. `designs` (n, p) have what it takes, then the angles of crank and
    output at the start, rad; `inputs` and `outputs` (m,) are what these have turned from there, rad.
    """
    out = np.empty(CURVE_SIZE)
    for k in range(len(designs)):
        measures[k, :] = math.nan
        if math.isnan(designs[k, 0]):
            continue
        shape = designs[k, : designs.shape[1] - STARTS_SIZE]
        start, first = designs[k, designs.shape[1] - 2], designs[k, designs.shape[1] - 1]
        total, largest = 0.0, 0.0
        for i in range(len(inputs)):
            angle = start + inputs[i]
            output(shape, math.cos(angle), math.sin(angle), out)
            error = math.atan2(out[1], out[0]) - first - outputs[i]
            error -= _TURN * math.floor(error / _TURN + 0.5)
            total += error * error  # NaN stays NaN
            largest = max(largest, abs(error))
        measures[k, RMS] = math.sqrt(total / len(inputs))
        measures[k, LARGEST] = largest if total == total else math.nan
