"""LLVM's language: types and statements for rows of LANES designs, or of one."""

import struct
from collections.abc import Iterable

from explore.base.compiling import LANES

#: Numba's structure of an array.
ARRAY = "{ptr, ptr, i64, i64, ptr, [1 x i64], [1 x i64]}"

#: Type of a row of LANES designs.
VECTOR = f"<{LANES} x double>"

#: Symbol of `operations.operate`.
OPERATE = "explore_linkage_operate"

#: Symbol of `following.follow`.
FOLLOW = "explore_linkage_follow"


def row_type(lanes: int) -> str:
    """The type of a row."""
    return "double" if lanes == 1 else VECTOR


def suffix(lanes: int) -> str:
    """The end of the names of LLVM's functions of rows."""
    return "f64" if lanes == 1 else f"v{lanes}f64"


def place(name: str, pointer: str, number: str | int, rows: int, lanes: int = LANES) -> str:
    """A pointer to so many rows behind another, times a number."""
    return f"  {name} = getelementptr [{rows * lanes} x double], ptr {pointer}, i64 {number}\n"


def load(name: str, pointer: str, lanes: int = LANES) -> str:
    """The row at a pointer."""
    return f"  {name} = load {row_type(lanes)}, ptr {pointer}, align 8\n"


def spread(name: str, number: str) -> str:
    """All lanes of a vector of one number."""
    return (
        f"  {name}.first = insertelement {VECTOR} undef, double {number}, i64 0\n"
        f"  {name} = shufflevector {VECTOR} {name}.first, {VECTOR} undef, <{LANES} x i32> zeroinitializer\n"
    )


def splat(value: float, lanes: int) -> str:
    """A constant row of one value."""
    return hexadecimal(value) if lanes == 1 else f"<{', '.join([f'double {hexadecimal(value)}'] * lanes)}>"


def hexadecimal(value: float) -> str:
    """A constant of all bits of a value."""
    return f"0x{struct.pack('>d', value).hex()}"


def table(name: str, values: Iterable[float]) -> str:
    """A constant array."""
    numbers = [f"double {hexadecimal(value)}" for value in values]
    return f"@{name} = private constant [{len(numbers)} x double] [{', '.join(numbers)}]\n"
