"""Programs on pairs of doubles, operation after operation: for the few designs whose digits doubles lose.

Written once for all linkages: what a table differs by are its operations. Numbers are rows of LANES pairs. What does
not depend on the angle is computed once for all nodes.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from explore.base.compiling import LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.disturbance import FACTORS, OF_TANGENTS, first_factor
from explore.base.lanes.double_double import (
    PAIR_ROUNDING,
    add_pairs,
    divide_pairs,
    multiply_pairs,
    root_of_pair,
    sine_of_pair,
)
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.following import GROUP_ROWS, follow_group
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS

(
    _ADD, _SUB, _MUL, _DIV, _NEG, _SQRT, _ABS, _MAX, _MIN, _INPUT, _TANGENT, _MIRROR, _CHOOSE, _ARCTANGENT, _SIN, _COS,
    _FOLLOW,
) = range(17)  # fmt: skip
#: Numbers of operations by their names.
PAIR_CODES = {
    "add": _ADD, "sub": _SUB, "mul": _MUL, "div": _DIV, "neg": _NEG, "sqrt": _SQRT, "abs": _ABS, "max": _MAX,
    "maximum": _MAX, "minimum": _MIN, "input": _INPUT, "tangent": _TANGENT, "mirror": _MIRROR, "choose": _CHOOSE,
    "arctangent": _ARCTANGENT, "sin": _SIN, "cos": _COS,
    **{
        f"{group}{part}": _FOLLOW + (1 + len(PARTS)) * number + k
        for number, group in enumerate(FOLLOWS)
        for k, part in enumerate(("", *PARTS))
    },
}  # fmt: skip
#: Number of parts of what is followed.
_PARTS = len(PARTS)
#: Columns of an operation: code, numbers of its operands and of its result, and place of its factor; -1 for none.
COLUMNS = 5
#: Relative change of a disturbed operation over DISTURBANCE: as much less as pairs round less than doubles.
_PAIR_SHARE = PAIR_ROUNDING * 2.0**53


class PairSizes(NamedTuple):
    """What programs differ by.

    Attributes
    ----------
    literals, reads, numbers
        Number of literals, which are the first numbers; of numbers that are read, which follow; and of all.
    still
        Number of the operations that do not depend on the angle, which come first.
    operations, rows
        Number of operations, and of rows that are written.
    first_group
        First of the constants that groups of links are followed by.
    """

    literals: int
    reads: int
    numbers: int
    still: int
    operations: int
    rows: int
    first_group: int


_F1, _I1 = types.float64[::1], types.int64[::1]
#: Type of sizes.
PAIR_SIZES = types.NamedUniTuple(types.int64, len(PairSizes._fields), PairSizes)
#: Type of `fill_pairs`.
PAIRS_SIGNATURE = types.void(_F1, _F1, types.int64, types.int64, _F1, PAIR_SIZES, _F1, _I1, types.int64)


@compiled(PAIRS_SIGNATURE, allocates=True)
def fill_pairs(constants, tangents, anchor, count, out, sizes, literals, integers, is_disturbed):
    """Fill the rows of `count` nodes, as `explore.model.mechanism.Mechanism.fill` or `disturbed_fill`.

    Disturbed, half-tangents are off as well, which are doubles, and each operation by as much less as it is rounded.
    """
    space, row = np.empty(2 * sizes.numbers * LANES), 2 * LANES
    for k in range(sizes.literals):
        for lane in range(LANES):
            space[k * row + lane], space[k * row + LANES + lane] = literals[k], literals[sizes.literals + k]
    for k in range(sizes.reads):
        at, read = (sizes.literals + k) * row, integers[k] * LANES
        for lane in range(LANES):
            space[at + lane], space[at + LANES + lane] = constants[read + lane], 0.0
    steps = integers[sizes.reads :]
    written = steps[sizes.operations * COLUMNS :]
    node = np.empty(LANES)
    for j in range(count):
        first = first_factor(j)
        change = OF_TANGENTS * (FACTORS[first] - 1.0) if is_disturbed > 0 else 0.0
        for lane in range(LANES):
            node[lane] = tangents[j * LANES + lane] + change
        for k in range(0 if j == 0 or is_disturbed > 0 else sizes.still, sizes.operations):
            step = steps[k * COLUMNS :]
            if step[0] >= _FOLLOW:
                _follow(step, space, constants, sizes.first_group)
            else:
                _operate(step, space, node, anchor)
            if is_disturbed > 0 and step[4] >= 0:
                share = 1.0 if step[0] == _ARCTANGENT else _PAIR_SHARE
                _disturb(space[step[3] * row :], share * (FACTORS[first + step[4]] - 1.0))
        for k in range(sizes.rows):
            result, place = space[written[k] * row :], out[(j * sizes.rows + k) * LANES :]
            for lane in range(LANES):
                place[lane] = result[lane]


@subroutine(allocates=True)
def _follow(step, space, constants, first_group):
    """Fill the result of following a group of links: about where it is, as doubles."""
    row, number = 2 * LANES, step[0] - _FOLLOW
    cosine, sine, out = space[step[1] * row :], space[step[2] * row :], space[step[3] * row :]
    rows, group, part = np.empty((1 + _PARTS) * LANES), number // (1 + _PARTS), number % (1 + _PARTS)
    follow_group(constants, first_group + group * GROUP_ROWS, LANES, cosine, sine, rows)
    for lane in range(LANES):
        out[lane], out[LANES + lane] = rows[part * LANES + lane], 0.0


@subroutine()
def _operate(step, space, node, anchor):
    """Fill the result of an operation."""
    row = 2 * LANES
    code, x, y, out = step[0], space[step[1] * row :], space[step[2] * row :], space[step[3] * row :]
    if code == _ADD:
        _add(x, y, 1.0, out)
    elif code == _SUB:
        _add(x, y, -1.0, out)
    elif code == _MUL:
        _multiply(x, y, out)
    elif code == _DIV:
        _divide(x, y, out)
    elif code == _SQRT:
        _root(x, out)
    elif code == _NEG:
        _scale(x, -1.0, out)
    elif code == _INPUT:
        _scale(x, 1.0, out)
    elif code == _ABS:
        _magnitude(x, out)
    elif code == _MAX:
        _larger(x, y, 1.0, out)
    elif code == _MIN:
        _larger(x, y, -1.0, out)
    elif code == _ARCTANGENT:
        _angle(x, y, out)
    elif code == _SIN or code == _COS:
        _sine(x, 1.0 if code == _COS else 0.0, out)
    elif code == _CHOOSE:
        _scale(x if anchor == 0 else y, 1.0, out)
    else:
        _place(node, anchor, code == _TANGENT, out)


@subroutine(no_alias=True)
def _add(x, y, sign, out):
    for lane in range(LANES):
        out[lane], out[LANES + lane] = add_pairs(x[lane], x[LANES + lane], sign * y[lane], sign * y[LANES + lane])


@subroutine(no_alias=True)
def _multiply(x, y, out):
    for lane in range(LANES):
        out[lane], out[LANES + lane] = multiply_pairs(x[lane], x[LANES + lane], y[lane], y[LANES + lane])


@subroutine(no_alias=True)
def _divide(x, y, out):
    for lane in range(LANES):
        out[lane], out[LANES + lane] = divide_pairs(x[lane], x[LANES + lane], y[lane], y[LANES + lane])


@subroutine(no_alias=True)
def _root(x, out):
    for lane in range(LANES):
        out[lane], out[LANES + lane] = root_of_pair(x[lane], x[LANES + lane])


@subroutine(no_alias=True)
def _scale(x, sign, out):
    for k in range(2 * LANES):
        out[k] = sign * x[k]


@subroutine(no_alias=True)
def _magnitude(x, out):
    for lane in range(LANES):
        sign = -1.0 if x[lane] < 0.0 else 1.0
        out[lane], out[LANES + lane] = sign * x[lane], sign * x[LANES + lane]


@subroutine(no_alias=True)
def _larger(x, y, sign, out):
    """The larger one, or with a negative sign the smaller one; NaN if one is."""
    for lane in range(LANES):
        difference = sign * ((x[lane] - y[lane]) + (x[LANES + lane] - y[LANES + lane]))
        takes_first = (difference >= 0.0) | (x[lane] != x[lane])
        out[lane] = x[lane] if takes_first else y[lane]
        out[LANES + lane] = x[LANES + lane] if takes_first else y[LANES + lane]


@subroutine(no_alias=True)
def _angle(x, y, out):
    """The angle of a vector, as a double."""
    for lane in range(LANES):
        out[lane], out[LANES + lane] = arctangent(x[lane], y[lane]), 0.0


@subroutine(no_alias=True)
def _sine(x, quarters, out):
    for lane in range(LANES):
        out[lane], out[LANES + lane] = sine_of_pair(x[lane], x[LANES + lane], quarters)


@subroutine(no_alias=True)
def _place(node, anchor, is_tangent, out):
    """The half-tangent, or the sign of its anchor."""
    for lane in range(LANES):
        out[lane] = node[lane] if is_tangent else 1.0 - 2.0 * anchor
        out[LANES + lane] = 0.0


@subroutine(no_alias=True)
def _disturb(out, change):
    """Change a result by a part of itself."""
    for lane in range(LANES):
        out[lane], out[LANES + lane] = add_pairs(out[lane], out[LANES + lane], change * out[lane], 0.0)
