"""Rows of numbers of chords, LANES_OF_TURN parts of a turn side by side, so that a processor's vectors hold them.

Chord k of a turn of so many `parts` times LANES_OF_TURN chords is at place `place_of(k, parts)` of its row. A row of
two turns has twice as many lanes, and chord k at `place_in_two(k, parts)`. LLVM does not find vectors in these loops,
whose lanes are few, by itself.
"""

import math

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from explore.base.subroutines import subroutine

#: Number of chords of a turn that are side by side.
LANES_OF_TURN = 8
#: The same of two turns.
LANES = 2 * LANES_OF_TURN
#: Number of doubles of a line of the cache.
_LINE = 8
#: Number of parts that a chord is divided into.
_PARTS = 4

_DOUBLE = ir.DoubleType()
_INFINITE = ir.Constant(ir.VectorType(_DOUBLE, LANES), [math.inf] * LANES)


@subroutine(allocates=True)
def make_rows(n, size):
    """Room for n rows, each from the beginning of a line of the cache on, else loads of vectors take twice as long."""
    numbers = np.empty(n * size + _LINE)
    first = (_LINE - np.int64(numbers.ctypes.data) // numbers.itemsize % _LINE) % _LINE
    return numbers[first : first + n * size].reshape(n, size)


@subroutine()
def place_of(chord, parts):
    """The place of a chord of a turn in its row."""
    return chord % parts * LANES_OF_TURN + chord // parts


@subroutine()
def place_in_two(chord, parts):
    """The place of a chord of two turns in its row."""
    return chord % parts * LANES + chord // parts


@subroutine()
def chord_at(place, parts):
    """The chord at a place of the row of a turn."""
    return place % LANES_OF_TURN * parts + place // LANES_OF_TURN


@subroutine()
def divide(corners, spare, excess, count, limit, most):
    """Divide the chords whose excess is above a limit; return the number of all, or 0 if none is or there is no room.

    The number is one of whole rows of lanes: the last corner is repeated. Of a new corner the first row is filled, the
    place of its chord, and the second is infinite.
    """
    marked = 0
    for k in range(count):
        marked += 1 if abs(excess[k]) > limit else 0
    total = count + marked * (_PARTS - 1)
    if marked == 0 or total + LANES_OF_TURN > most:
        return 0
    k = 0
    for old in range(count):
        for row in range(len(corners)):
            spare[row, k] = corners[row, old]
        k += 1
        if abs(excess[old]) > limit:
            start, width = corners[0, old], corners[0, old + 1] - corners[0, old]
            for part in range(1, _PARTS):
                spare[0, k], spare[1, k] = start + width * (part / _PARTS), math.inf
                k += 1
    total += -total % LANES_OF_TURN
    for row in range(len(corners)):
        last = corners[row, count]
        for j in range(total + 1):
            corners[row, j] = spare[row, j] if j < k else last
    return total


def _address(builder, array, part, lanes):
    """The address of a part of a row."""
    place = builder.gep(array, [builder.mul(part, part.type(lanes))])
    return builder.bitcast(place, ir.VectorType(_DOUBLE, lanes).as_pointer())


def _least(builder, first, second):
    return builder.select(builder.fcmp_ordered("<", first, second), first, second)


def _shuffle(builder, first, second, lanes):
    return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), lanes))


def _arrays(context, builder, signature, arguments):
    """The addresses of arrays of arguments; others as they are."""
    return [
        context.make_array(kind)(context, builder, value).data if isinstance(kind, types.Array) else value
        for kind, value in zip(signature.args, arguments, strict=True)
    ]


@intrinsic
def least_of(typing_context, row, parts):  # noqa: ARG001  (the signature is Numba's)
    """The least number of a row of a turn of so many parts."""

    def generate(context, builder, signature, arguments):
        numbers, count = _arrays(context, builder, signature, arguments)
        beyond = ir.Constant(ir.VectorType(_DOUBLE, LANES_OF_TURN), [math.inf] * LANES_OF_TURN)
        least = cgutils.alloca_once_value(builder, beyond)
        with cgutils.for_range(builder, count) as loop:
            own = builder.load(_address(builder, numbers, loop.index, LANES_OF_TURN), align=8)
            builder.store(_least(builder, own, builder.load(least)), least)
        found, shift = builder.load(least), LANES_OF_TURN // 2
        while shift:
            other = _shuffle(builder, found, found, [(k + shift) % LANES_OF_TURN for k in range(LANES_OF_TURN)])
            found, shift = _least(builder, found, other), shift // 2
        return builder.extract_element(found, ir.Constant(ir.IntType(32), 0))

    return types.float64(row, types.int64), generate


@intrinsic
def fill_sums(typing_context, row, before, entering, parts, sums, leaving):  # noqa: ARG001  (the signature is Numba's)
    """Fill sums of two turns: each the least up to its chord of the row's number, periodic, and the sum `before`.

    Sums are the least of what is in their row, which is that of their lane, and of what enters the lane: `entering`
    before, `leaving` (LANES,) for the next row.
    """

    def generate(context, builder, signature, arguments):
        numbers, old, enters, count, new, leaves = _arrays(context, builder, signature, arguments)
        zero = ir.Constant(ir.IntType(64), 0)
        entered = builder.load(_address(builder, enters, zero, LANES), align=8)
        least = cgutils.alloca_once_value(builder, _INFINITE)
        with cgutils.for_range(builder, count) as loop:
            own = builder.load(_address(builder, numbers, loop.index, LANES_OF_TURN), align=8)
            own = _shuffle(builder, own, own, [k % LANES_OF_TURN for k in range(LANES)])
            base = _least(builder, builder.load(_address(builder, old, loop.index, LANES), align=8), entered)
            found = _least(builder, builder.fadd(base, own), builder.load(least))
            builder.store(found, least)
            builder.store(found, _address(builder, new, loop.index, LANES), align=8)
        found, shift = builder.load(least), 1
        while shift < LANES:
            found = _least(builder, found, _shift(builder, found, shift))
            shift *= 2
        builder.store(_shift(builder, found, 1), _address(builder, leaves, zero, LANES), align=8)
        return context.get_dummy_value()

    return types.void(row, before, entering, types.int64, sums, leaving), generate


def _shift(builder, vector, count):
    """A vector moved by so many lanes; infinity enters."""
    return _shuffle(builder, vector, _INFINITE, [k - count if k >= count else LANES + k for k in range(LANES)])
