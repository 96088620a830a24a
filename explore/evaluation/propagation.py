"""Values of expressions with bounds of their errors, operation by operation.

The bound of an operation covers all values that its operands can have within their bounds, to any order, and the
rounding of the operation. What is not finite, such as a quotient by 0, is undefined (NaN) at once, so that no later
operation makes a number of it. Where the operands may have values with which the operation is undefined, the bound is
infinite; but the root of what may be negative counts as 0 there, since many a sum of squares is 0.

`Bounded.scale` is what the error is compared with: the size that the value has if no terms of a sum cancel, as the
error of a mean is compared with the root mean square. It is at least 1 for sines, cosines, tangents and logarithms, and
at least 1 rad for angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from explore.model.expressions import Expression, run
from explore.model.quantities import FloatArray

#: Relative rounding of an exact operation: half the distance of 1 from the next double.
_UNIT = 2.0**-53
#: Relative rounding of NumPy's elementary functions: at most 4 units in the last place.
_ELEMENTARY = 2.0**-50
#: Smallest normal double: bound of the error of a product or a function that is too small for one.
_TINY = 2.0**-1022
#: Factor for the rounding of the bounds themselves: a few operations for each of a thousand steps.
_OWN_ROUNDING = 1.0 + 1e-11
#: Largest whole exponent of a power that is computed by multiplications.
_LARGEST_EXPONENT = 64
#: Number of designs that are evaluated at once: 128 kB for each intermediate result.
_PIECE = 16_384

_RADIAN = math.pi / 180.0


class Bounded(NamedTuple):
    """Values, bounds of their absolute errors, and the scales of these errors, each of shape (n,); a number is ()."""

    value: FloatArray
    bound: FloatArray
    scale: FloatArray

    @classmethod
    def exact(cls, value: FloatArray) -> Bounded:
        """Values without errors."""
        return cls(value, np.array(0.0), np.abs(value))

    @property
    def is_exact(self) -> bool:
        """Whether no value has an error."""
        return self.bound.ndim == 0 and not self.bound


def propagate(expression: Expression, inputs: Sequence[Bounded]) -> Bounded:
    """Evaluate an expression of at least one input; `inputs` are those that its steps name by position.

    The result is of shape (n,); where the value is not NaN, the bound may be infinite.
    """
    count = len(inputs[0].value)
    result = Bounded(*np.empty((3, count)))
    # In pieces, so that intermediate results stay in the processor's cache.
    for start in range(0, count, _PIECE):
        piece = slice(start, start + _PIECE)
        pieces = [Bounded(*(array[piece] if array.ndim else array for array in source)) for source in inputs]
        for target, source in zip(result, _run(expression, pieces), strict=True):
            target[piece] = source
    return result


def _run(expression: Expression, inputs: Sequence[Bounded]) -> Bounded:
    """`propagate` for a few designs."""
    with np.errstate(all="ignore"):
        value, bound, scale = run(
            expression.steps, _number, inputs.__getitem__, lambda operation, *values: _OPERATIONS[operation](*values)
        )
        bound = np.where(np.isnan(bound), np.inf, bound * _OWN_ROUNDING)
        # A scale this small is that of a value that was too small for a normal double.
        return Bounded(value, bound, np.maximum(scale, _TINY / _UNIT))


def _number(value: float) -> Bounded:
    number = np.array(value)
    rounding = 0.0 if value.is_integer() and abs(value) < 1.0 / _UNIT else _UNIT * abs(value)
    return Bounded(number, np.array(rounding), np.abs(number))


def _defined(value: FloatArray) -> FloatArray:
    """The values, NaN where they are not finite."""
    if math.isfinite(np.add.reduce(value, axis=None)):  # one pass where all are finite
        return value
    return np.where(np.isfinite(value), value, np.nan)


def _rounding(value: FloatArray, unit: float, *factors: FloatArray) -> FloatArray:
    """Rounding of an operation that may underflow, unless one of `factors` is 0, which makes the value exactly 0."""
    size = np.abs(value)
    rounding = unit * size
    if not np.minimum.reduce(size, axis=None) >= _TINY:  # one pass where none is small
        is_small = size < _TINY
        for factor in factors:
            is_small = is_small & (factor != 0.0)
        rounding = np.where(is_small, _TINY, rounding)
    return rounding


def _magnitude(a: Bounded) -> Bounded:
    return Bounded(np.abs(a.value), a.bound, a.scale)


def _add(a: Bounded, b: Bounded) -> Bounded:
    return _sum(a, b, a.value + b.value)


def _sum(a: Bounded, b: Bounded, total: FloatArray) -> Bounded:
    value = _defined(total)
    return Bounded(value, a.bound + b.bound + _UNIT * np.abs(value), a.scale + b.scale)


def _multiply(a: Bounded, b: Bounded) -> Bounded:
    value = _defined(a.value * b.value)
    bound = _rounding(value, _UNIT, a.value, b.value)
    for factor, other in ((a, b), (b, a)):
        if not other.is_exact:
            bound = bound + (np.abs(factor.value) + factor.bound) * other.bound
    return Bounded(value, bound, a.scale * b.scale)


def _divide(a: Bounded, b: Bounded) -> Bounded:
    value, size = _defined(a.value / b.value), np.abs(b.value)
    bound = _rounding(value, _UNIT, a.value)
    if not (a.is_exact and b.is_exact):
        bound = bound + _or_infinite((a.bound + np.abs(value) * b.bound) / _positive(size - b.bound))
    return Bounded(value, bound, a.scale / size)


def _positive(value: FloatArray) -> FloatArray:
    """The values, 0 where they are negative."""
    return np.maximum(value, 0.0)


def _or_infinite(bound: FloatArray) -> FloatArray:
    """The bounds, infinite where they are 0 / 0."""
    return np.where(np.isnan(bound), np.inf, bound)


def _power(a: Bounded, b: Bounded) -> Bounded:
    """A power; one with a small whole number as its exponent is a product, so that its base may have any sign."""
    if b.value.ndim == 0 and b.is_exact and abs(b.value) <= _LARGEST_EXPONENT and float(b.value).is_integer():
        power = _whole_power(a, abs(int(b.value)))
        return power if float(b.value) >= 0.0 else _divide(_number(1.0), power)
    # 1 to any power, and any number to the power 0, is 1 for NumPy, also where the other one is undefined
    is_undefined = np.isnan(a.value) | np.isnan(b.value)
    value, size = _defined(np.where(is_undefined, np.nan, np.power(a.value, b.value))), np.abs(a.value)
    # The logarithm of the base changes by at most this; where the base may be 0 it is infinite.
    change = a.bound / _positive(size - a.bound)
    exponent = np.abs(b.value) * change
    if not b.is_exact:  # a negative base has whole exponents only
        exponent = np.where(a.value > 0.0, exponent + b.bound * (np.abs(np.log(size)) + change), np.inf)
    bound = np.where((size == 0.0) & (a.bound == 0.0), 0.0, np.abs(value) * np.expm1(exponent))
    scale = np.maximum(np.abs(value), np.power(a.scale, b.value))
    return Bounded(value, _or_infinite(bound) + _rounding(value, _ELEMENTARY, size), scale)


def _whole_power(a: Bounded, exponent: int) -> Bounded:
    if exponent == 0:
        one = np.where(np.isnan(a.value), np.nan, 1.0)
        return Bounded(one, 0.0 * a.bound, one)  # an infinite bound, of what may be undefined, remains
    power = a
    for bit in bin(exponent)[3:]:
        power = _multiply(power, power)
        if bit == "1":
            power = _multiply(power, a)
    return power


def _root(a: Bounded) -> Bounded:
    value = np.sqrt(a.value)
    # |sqrt(x') - sqrt(x)| is at most |x' - x| / sqrt(x), and at most sqrt(|x' - x|).
    bound = np.where(a.bound == 0.0, 0.0, a.bound / np.sqrt(np.maximum(a.value, a.bound)))
    return Bounded(value, bound + _UNIT * value, np.sqrt(a.scale))


def _smaller(a: Bounded, b: Bounded) -> Bounded:
    return Bounded(np.minimum(a.value, b.value), np.maximum(a.bound, b.bound), np.maximum(a.scale, b.scale))


def _larger(a: Bounded, b: Bounded) -> Bounded:
    return Bounded(np.maximum(a.value, b.value), np.maximum(a.bound, b.bound), np.maximum(a.scale, b.scale))


def _logarithm(a: Bounded) -> Bounded:
    value = _defined(np.log(a.value))
    bound = np.where(a.bound == 0.0, 0.0, _or_infinite(a.bound / _positive(a.value - a.bound)))
    return Bounded(value, bound + _ELEMENTARY * np.abs(value), np.maximum(np.abs(value), 1.0))


def _exponential(a: Bounded) -> Bounded:
    value = _defined(np.exp(a.value))
    return Bounded(value, value * np.expm1(a.bound) + _rounding(value, _ELEMENTARY), value)


def _radians(a: Bounded) -> tuple[FloatArray, FloatArray]:
    """An angle in rad from one in degrees, and the bound of its error."""
    angle = a.value * _RADIAN
    return angle, a.bound * _RADIAN + 3.0 * _UNIT * np.abs(angle)


def _circular(function: Callable[[FloatArray], FloatArray]) -> Callable[[Bounded], Bounded]:
    """The rule of sine or cosine, which change by no more than their angle."""

    def rule(a: Bounded) -> Bounded:
        angle, bound = _radians(a)
        value = function(angle)
        return Bounded(value, bound + _ELEMENTARY * np.abs(value), np.array(1.0))

    return rule


def _tangent(a: Bounded) -> Bounded:
    angle, bound = _radians(a)
    value = np.tan(angle)
    # tan(x + h) - tan(x) = tan(h) (1 + tan(x)^2) / (1 - tan(x) tan(h)), up to the pole
    change = np.tan(np.minimum(bound, 1.0))
    largest = change * (1.0 + value * value) / _positive(1.0 - np.abs(value) * change)
    bound = np.where(bound < 1.0, largest, np.inf) + _ELEMENTARY * np.abs(value)
    return Bounded(value, bound, np.maximum(np.abs(value), 1.0))


def _direction(a: Bounded, b: Bounded) -> Bounded:
    """The angle in degrees of the vector (b, a); undefined where its length is 0."""
    length = np.hypot(a.value, b.value)
    # plus 0.0: the angle of (-1, -0.0) is 180 degrees, not -180
    value = np.where(length > 0.0, np.arctan2(a.value + 0.0, b.value) / _RADIAN, np.nan)
    error = a.bound + b.bound
    # asin(t) is at most t times half of pi; an error across the negative axis changes the angle by a turn
    bound = 90.0 * np.where(error == 0.0, 0.0, error / length)
    crosses = (np.abs(a.value) <= a.bound) & (a.bound > 0.0) & (b.value <= b.bound)
    bound = np.where((error >= length) | crosses, np.inf, bound) + 2.0 * _ELEMENTARY * np.abs(value)
    return Bounded(value, bound, np.maximum(np.abs(value), 1.0 / _RADIAN))


def _length(a: Bounded, b: Bounded) -> Bounded:
    value = _defined(np.hypot(a.value, b.value))
    scale = np.maximum(value, np.maximum(a.scale, b.scale))
    return Bounded(value, a.bound + b.bound + _ELEMENTARY * value, scale)


_OPERATIONS: dict[str, Callable[..., Bounded]] = {
    "negate": lambda a: Bounded(-a.value, a.bound, a.scale), "abs": _magnitude, "sqrt": _root,
    "log": _logarithm, "exp": _exponential,
    "sin": _circular(np.sin), "cos": _circular(np.cos), "tan": _tangent,
    "+": _add, "-": lambda a, b: _sum(a, b, a.value - b.value), "*": _multiply, "/": _divide, "**": _power,
    "min": _smaller, "max": _larger, "atan2": _direction, "hypot": _length,
}  # fmt: skip
