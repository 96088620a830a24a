"""Operations of programs that are no instructions of a processor, on a row at once."""

import math

from numba import types

from explore.base.compiling import compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.degrees import cosine_of_degrees, degrees_of, sine_of_degrees, tangent_of_degrees

_SIN, _COS, _TAN, _ATAN2, _POWER, _LOG, _EXP, _HYPOT, _ARCTANGENT = range(9)
#: Numbers of operations by their names.
CODES = {
    "sin": _SIN, "cos": _COS, "tan": _TAN, "atan2": _ATAN2, "power": _POWER, "log": _LOG, "exp": _EXP,
    "hypot": _HYPOT, "arctangent": _ARCTANGENT,
}  # fmt: skip

_ROW = types.CPointer(types.float64)

#: Signature of `operate`.
OPERATE_SIGNATURE = types.void(types.int64, types.int64, _ROW, _ROW, _ROW)


@compiled(OPERATE_SIGNATURE, no_alias=True)
def operate(code, lanes, first, second, out):
    """Fill the results of an operation on two rows; a function of one number takes the first.

    The number of lanes is an argument: a loop over a constant number of them is unrolled and not vectorised.
    """
    if code == _ARCTANGENT:
        for lane in range(lanes):
            out[lane] = arctangent(first[lane], second[lane])
    else:
        for lane in range(lanes):
            out[lane] = _of_formula(code, first[lane], second[lane])


@subroutine()
def _of_formula(code, x, y):
    """A function of a formula."""
    if code == _SIN:
        return sine_of_degrees(x)
    if code == _COS:
        return cosine_of_degrees(x)
    if code == _TAN:
        return tangent_of_degrees(x)
    if code == _ATAN2:
        return degrees_of(x, y)
    if code == _POWER:
        return x**y
    if code == _LOG:
        return math.log(x)
    if code == _EXP:
        return math.exp(x)
    return math.hypot(x, y)
