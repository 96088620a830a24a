"""Errors of output angles of designs against those that a function asks for."""

import math

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.mechanisms.targets.path_errors.curve import CURVE, CURVE_SIZE
from explore.mechanisms.targets.rounding import ROUNDING, SHARE, curve_nearby, disturb

# Measures of a design: the root mean square error and the largest one, then the bounds of their rounding, rad.
RMS, LARGEST, RMS_ROUNDING, LARGEST_ROUNDING = range(4)
N_MEASURES = 4

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
    out, near, size = np.empty(CURVE_SIZE), np.empty(CURVE_SIZE), designs.shape[1] - STARTS_SIZE
    disturbed = np.empty(size)
    for k in range(len(designs)):
        measures[k, :] = math.nan
        if math.isnan(designs[k, 0]):
            continue
        shape, start, first = designs[k, :size], designs[k, size], designs[k, size + 1]
        disturb(shape, disturbed)
        total, largest, roundings, most = 0.0, 0.0, 0.0, 0.0
        for i in range(len(inputs)):
            angle = start + inputs[i]
            cosine, sine = math.cos(angle), math.sin(angle)
            output(shape, cosine, sine, out)
            error = math.atan2(out[1], out[0]) - first - outputs[i]
            turned = abs(first) + abs(outputs[i]) + _TURN
            error -= _TURN * math.floor(error / _TURN + 0.5)
            curve_nearby(output, disturbed, angle, cosine, sine, near)
            change = (out[0] * near[1] - out[1] * near[0]) / (out[0] * out[0] + out[1] * out[1])
            rounding = SHARE * abs(change) + ROUNDING * turned
            total, largest = total + error * error, max(largest, abs(error))  # NaN stays NaN
            roundings, most = roundings + rounding * rounding, max(most, rounding)
        measures[k, RMS] = math.sqrt(total / len(inputs))
        measures[k, LARGEST] = largest if total == total else math.nan
        measures[k, RMS_ROUNDING] = math.sqrt(roundings / len(inputs))
        measures[k, LARGEST_ROUNDING] = most if roundings == roundings else math.inf
