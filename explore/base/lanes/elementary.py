"""Exact sums, exponential, logarithm, sine, tangent and the like without calls or branches, to vectorise loops.

The C library's functions take one number at a time: a loop that calls them stays scalar. The exponent and mantissa of a
double are read as the bits of an integer.
"""

import math

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from explore.base.subroutines import subroutine

_LOG2_E = 1.4426950408889634
# ln 2 in two parts, for the logarithm and for the exponential; the product of the first with any exponent is exact.
_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_EXP_LN2_HIGH, _EXP_LN2_LOW = 6.93145751953125e-1, 1.42860682030941723212e-6

_MANTISSA_BITS = 52
_EXPONENT_MASK = 0x7FF0000000000000
#: 1.5 * 2^52: a sum with it is rounded to an integer, which is in its low bits.
_ROUNDING_SHIFT = 6755399441055744.0
#: Bits of `_ROUNDING_SHIFT`.
_INTEGER_OF_SHIFT = 0x4338000000000000
#: Bits of the root of 1/2, so that a mantissa is between that and its double.
_ROOT_HALF_BITS = 0x3FE6A09E667F3BCD
#: pi/2 but for its last bits, so that the product with a number of quarters of a turn is exact.
_QUARTER_HIGH = 1.57079632673412561417
#: The rest of pi/2.
_QUARTER_LOW = 6.07710050650619224932e-11
#: pi/2 minus its nearest double.
_HALF_PI_ERROR = 6.123233995736766e-17


@intrinsic
def bits_of(typing_context, x):  # noqa: ARG001  (the signature is Numba's)
    """The bits of a double as an integer."""

    def generate(context, builder, signature, arguments):  # noqa: ARG001  (the signature is Numba's)
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def double_of(typing_context, bits):  # noqa: ARG001  (the signature is Numba's)
    """The double with these bits."""

    def generate(context, builder, signature, arguments):  # noqa: ARG001  (the signature is Numba's)
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@subroutine(contract=True, inlined=True)
def _growth(x):
    """The exponent n and the rest s of 2^n (1 + s), which is e to the power x.

    Range reduction by multiples of ln 2 and the Taylor polynomial of degree 13 in Estrin's scheme.
    """
    shifted = x * _LOG2_E + _ROUNDING_SHIFT
    exponent = bits_of(shifted)
    multiple = shifted - _ROUNDING_SHIFT
    r = x - multiple * _EXP_LN2_HIGH
    r = r - multiple * _EXP_LN2_LOW
    r2 = r * r
    r4 = r2 * r2
    low = (r * (1.0 / 6.0) + 0.5) + r2 * (r * (1.0 / 120.0) + 1.0 / 24.0)
    middle = (r * (1.0 / 5040.0) + 1.0 / 720.0) + r2 * (r * (1.0 / 362880.0) + 1.0 / 40320.0)
    high = (r * (1.0 / 39916800.0) + 1.0 / 3628800.0) + r2 * (r * (1.0 / 6227020800.0) + 1.0 / 479001600.0)
    series = low + r4 * (middle + r4 * high)
    return exponent, r2 * series + r


@subroutine(contract=True, inlined=True)
def exponential(x):
    """E to the power x, for -700 < x < 700; within 1 unit in the last place."""
    exponent, rest = _growth(x)
    return double_of(bits_of(rest + 1.0) + (exponent << _MANTISSA_BITS))


@subroutine(contract=True, inlined=True)
def exponential_less_one(x):
    """E to the power x, less 1, for -700 < x < 700; within 2 units in the last place."""
    exponent, rest = _growth(x)
    power = double_of(bits_of(1.0) + (exponent << _MANTISSA_BITS))
    return power * rest + (power - 1.0)


@subroutine(contract=True, inlined=True)
def _sine_of_quarter(x, first):
    """Sine of x and so many quarters of a turn, for sizes of x below 10^5.

    Within 2 units in the last place, but for 3e-27 of x next to the zeros, by what is left of pi/2.
    The polynomials of FreeBSD's ``k_sin.c`` and ``k_cos.c`` (Sun Microsystems, 1993).
    """
    shifted = x * (2.0 / math.pi) + _ROUNDING_SHIFT
    quarters = bits_of(shifted) + first
    multiple = shifted - _ROUNDING_SHIFT
    r = x - multiple * _QUARTER_HIGH
    r = r - multiple * _QUARTER_LOW
    z = r * r
    odd = 2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
    odd = -1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * odd))
    even = -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
    even = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * even))
    half_square = 0.5 * z
    whole = 1.0 - half_square
    of_cosine, of_sine = whole + (((1.0 - whole) - half_square) + z * z * even), r + r * z * odd
    value = of_cosine if quarters & 1 == 1 else of_sine
    return -value if quarters & 2 == 2 else value


@subroutine(contract=True, inlined=True)
def sine(x):
    """Sine; see `_sine_of_quarter`."""
    return _sine_of_quarter(x, 0)


@subroutine(contract=True, inlined=True)
def cosine(x):
    """Cosine; see `_sine_of_quarter`."""
    return _sine_of_quarter(x, 1)


@subroutine(contract=True, inlined=True)
def logarithm(x):
    """Natural logarithm of a normal positive number; within 1 unit in the last place.

    The polynomials of FreeBSD's ``e_log.c`` (Sun Microsystems, 1993).
    """
    bits = bits_of(x)
    exponent = (bits - _ROOT_HALF_BITS) >> _MANTISSA_BITS
    f = double_of(bits - (exponent << _MANTISSA_BITS)) - 1.0
    k = double_of(exponent + _INTEGER_OF_SHIFT) - _ROUNDING_SHIFT
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01))
    odd = z * (
        6.666666666666735130e-01
        + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860510658591e-01))
    )
    half_square = 0.5 * f * f
    return k * _LN2_HIGH - ((half_square - (s * (half_square + even + odd) + k * _LN2_LOW)) - f)


@subroutine(inlined=True)
def spacing(x):
    """Distance from a normal number to the next larger one in magnitude."""
    return double_of((bits_of(x) & _EXPONENT_MASK) - (_MANTISSA_BITS << _MANTISSA_BITS))


@subroutine(inlined=True)
def exact_sum(a, b, c, d):
    """Sum of four numbers with compensated rounding errors (Ogita, Rump & Oishi 2005, Sum2).

    The result is as if summed in twice the precision and rounded once; plain summation loses the margin of a
    linkage near the change point.
    """
    two = a + b
    part = two - a
    compensation = (a - (two - part)) + (b - part)
    three = two + c
    part = three - two
    compensation += (two - (three - part)) + (c - part)
    four = three + d
    part = four - three
    compensation += (three - (four - part)) + (d - part)
    return four + compensation


@subroutine(contract=True, inlined=True)
def inverse_cosh(x):
    """Inverse hyperbolic cosine; an argument rounded to below 1 counts as 1."""
    square = x * x - 1.0
    return logarithm(x + math.sqrt(square if square > 0.0 else 0.0))


@subroutine(contract=True, inlined=True)
def inverse_sinh(x):
    """Inverse hyperbolic sine, by its series for small arguments, where the logarithm would lose digits."""
    magnitude, square = abs(x), x * x
    large = logarithm(magnitude + math.sqrt(square + 1.0))
    small = magnitude * (
        1.0
        + square
        * (
            -1.0 / 6.0
            + square * (3.0 / 40.0 + square * (-15.0 / 336.0 + square * (105.0 / 3456.0 - square * 945.0 / 42240.0)))
        )
    )
    value = small if magnitude < 0.04 else large
    return -value if x < 0.0 else value


@subroutine(contract=True, inlined=True)
def tangent(x):
    """Tangent, for arguments between -2 and 2; within 3 units in the last place.

    Beyond pi/4, minus the inverse of the tangent of the distance from the pole. The rational function is that of
    S. L. Moshier (Cephes Math Library, tan.c, 1995).
    """
    is_steep = abs(x) > 0.25 * math.pi
    pole = 0.5 * math.pi if x > 0.0 else -0.5 * math.pi
    pole_error = _HALF_PI_ERROR if x > 0.0 else -_HALF_PI_ERROR
    y = (x - pole) - pole_error if is_steep else x
    z = y * y
    numerator = (-1.30936939181383734205e4 * z + 1.15351664838587416140e6) * z - 1.79565251976484877988e7
    denominator = (
        ((z + 1.36812963470692954678e4) * z - 1.32089234440210967447e6) * z + 2.50083801823357915839e7
    ) * z - 5.38695755929454629881e7
    value = y + y * (z * numerator / denominator)
    return -1.0 / value if is_steep else value
