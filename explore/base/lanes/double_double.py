"""Arithmetic on pairs of doubles, some 32 digits, without branches: loops over lanes that call it vectorise.

A pair stands for the sum of its two numbers, the first of which is that sum rounded. The bounds are those of
M. Joldes, J.-M. Muller & V. Popescu (Tight and rigorous error bounds for basic building blocks of double-word
arithmetic, ACM TOMS 44, 2017), and for the root of V. Lefevre, N. Louvet, J.-M. Muller, J. Picot & L. Rideau
(Accurate calculation of Euclidean norms using double-word arithmetic, ACM TOMS 49, 2023), with u = 2^-53. No function
may be compiled with permission to reorder or to contract.
"""

import math
from fractions import Fraction

from numba import types
from numba.extending import intrinsic

from explore.base.subroutines import subroutine

#: Largest relative error of an operation on pairs: that of a quotient, 15 u^2, rounded up.
PAIR_ROUNDING = 2.0**-102


def pair_of(value: Fraction) -> tuple[float, float]:
    """A fraction as a pair."""
    return float(value), float(value - Fraction(float(value)))


def _coefficients(first: int) -> tuple[float, ...]:
    """Pairs of Taylor's coefficients of the cosine, or of the sine over the angle, by powers of the square."""
    return tuple(x for k in range(15) for x in pair_of(Fraction((-1) ** k, math.factorial(2 * k + first))))


# A degree, rad, as a pair.
_DEGREE, _DEGREE_REST = pair_of(Fraction("3.14159265358979323846264338327950288419716939937510582") / 180)
_OF_COSINE, _OF_SINE = _coefficients(0), _coefficients(1)


@intrinsic
def _fused(typing_context, a, b, c):  # noqa: ARG001  (the signature is Numba's)
    """A product and a sum, a b + c, rounded once."""

    def generate(context, builder, signature, arguments):  # noqa: ARG001  (the signature is Numba's)
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@subroutine(inlined=True)
def _ordered_sum(a, b):
    """The pair of a + b, exact where a is 0 or no smaller than b."""
    total = a + b
    return total, b - (total - a)


@subroutine(inlined=True)
def pair_of_sum(a, b):
    """The pair of a + b, exact."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@subroutine(inlined=True)
def add_pairs(a, a_rest, b, b_rest):
    """Sum, within 3 u^2 (algorithm 6)."""
    high, low = pair_of_sum(a, b)
    rest, rest_of_rest = pair_of_sum(a_rest, b_rest)
    high, low = _ordered_sum(high, low + rest)
    return _ordered_sum(high, rest_of_rest + low)


@subroutine(inlined=True)
def multiply_pairs(a, a_rest, b, b_rest):
    """Product, within 5 u^2 (algorithm 12)."""
    product = a * b
    error = _fused(a, b, -product)
    return _ordered_sum(product, error + _fused(a_rest, b, _fused(a, b_rest, a_rest * b_rest)))


@subroutine(inlined=True)
def divide_pairs(a, a_rest, b, b_rest):
    """Quotient, within 15 u^2 (algorithm 17)."""
    quotient = a / b
    product = b * quotient
    error = _fused(b, quotient, -product)
    product, error = _ordered_sum(product, _fused(b_rest, quotient, error))
    return _ordered_sum(quotient, ((a - product) + (a_rest - error)) / b)


@subroutine(inlined=True)
def root_of_pair(a, a_rest):
    """Square root, within 25/8 u^2."""
    root = math.sqrt(a)
    rest = (_fused(-root, root, a) + a_rest) / (2.0 * root)
    return _ordered_sum(root, rest if root > 0.0 else root)


@subroutine()
def sine_of_pair(x, x_rest, quarters):
    """Sine of an angle in degrees, plus so many quarters of a turn, by Taylor's polynomial of degree 29."""
    multiple = math.floor(x / 90.0 + 0.5)
    angle, angle_rest = add_pairs(x, x_rest, -90.0 * multiple, 0.0)
    angle, angle_rest = multiply_pairs(angle, angle_rest, _DEGREE, _DEGREE_REST)
    square, square_rest = multiply_pairs(angle, angle_rest, angle, angle_rest)
    quarter = (multiple + quarters) - 4.0 * math.floor(0.25 * (multiple + quarters))
    is_cosine = quarter == 1.0 or quarter == 3.0
    value, rest = 0.0, 0.0
    for k in range(14, -1, -1):
        value, rest = multiply_pairs(value, rest, square, square_rest)
        term, term_rest = _OF_SINE[2 * k], _OF_SINE[2 * k + 1]
        if is_cosine:
            term, term_rest = _OF_COSINE[2 * k], _OF_COSINE[2 * k + 1]
        value, rest = add_pairs(value, rest, term, term_rest)
    if not is_cosine:
        value, rest = multiply_pairs(value, rest, angle, angle_rest)
    return (-value, -rest) if quarter >= 2.0 else (value, rest)
