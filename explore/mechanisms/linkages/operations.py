"""Operations of programs that are no instructions of a processor, on WIDTH numbers at once."""

import math

from numba import types

from explore.base.compiling import LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import exact_sum
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.degrees import cosine_of_degrees, degrees_of, sine_of_degrees, tangent_of_degrees

#: Number of designs that an instruction works on.
WIDTH = LANES // 2
#: Largest number of operands.
MOST_OPERANDS = 4


@subroutine()
def _power(x, y):
    return x**y


#: Functions of operations by their names; `operate` knows them by their numbers.
FUNCTIONS = {
    "exact_sum": exact_sum, "arctangent": arctangent, "sin": sine_of_degrees, "cos": cosine_of_degrees,
    "tan": tangent_of_degrees, "atan2": degrees_of, "power": _power, "log": math.log, "exp": math.exp,
    "hypot": math.hypot,
}  # fmt: skip
#: Numbers of operations by their names.
CODES = {name: code for code, name in enumerate(FUNCTIONS)}

_EXACT_SUM, _ARCTANGENT, _SIN, _COS, _TAN, _ATAN2, _POWER, _LOG, _EXP = range(9)
_ROW = types.CPointer(types.float64)
#: Signature of `operate`.
OPERATE_SIGNATURE = types.void(types.int64, _ROW, _ROW, _ROW, _ROW, _ROW)


@compiled(OPERATE_SIGNATURE)
def operate(code, a, b, c, d, out):
    """Fill the results of an operation from the rows of its operands; those that it has not are not read."""
    for lane in range(WIDTH):
        if code == _EXACT_SUM:
            out[lane] = exact_sum(a[lane], b[lane], c[lane], d[lane])
        elif code == _ARCTANGENT:
            out[lane] = arctangent(a[lane], b[lane])
        elif code == _SIN:
            out[lane] = sine_of_degrees(a[lane])
        elif code == _COS:
            out[lane] = cosine_of_degrees(a[lane])
        elif code == _TAN:
            out[lane] = tangent_of_degrees(a[lane])
        elif code == _ATAN2:
            out[lane] = degrees_of(a[lane], b[lane])
        elif code == _POWER:
            out[lane] = a[lane] ** b[lane]
        elif code == _LOG:
            out[lane] = math.log(a[lane])
        elif code == _EXP:
            out[lane] = math.exp(a[lane])
        else:
            out[lane] = math.hypot(a[lane], b[lane])
