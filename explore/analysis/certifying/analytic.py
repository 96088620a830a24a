"""Functions of balls, power series and boxes of complex numbers; not finite on boxes in which they are not analytic."""

from typing import Any

from flint import acb, arb, arb_series

#: Number of coefficients of power series.
TERMS = 5
#: Value where there is none.
NOWHERE = arb("nan")


def nowhere(*numbers: Any) -> Any:
    """No value, as a power series if one of these numbers is one: added to others it leaves no coefficient."""
    is_series = any(isinstance(number, arb_series) for number in numbers)
    return arb_series([NOWHERE] * TERMS, TERMS) if is_series else NOWHERE


def coefficients(value: arb | arb_series) -> list[arb]:
    """The coefficients of a series, or of a number that does not depend on the angle."""
    if isinstance(value, arb_series):
        return [value[k] for k in range(TERMS)]
    return [value] + [arb(0) if value.is_finite() else value] * (TERMS - 1)


def divide(a: Any, b: Any) -> Any:
    """A quotient, or none."""
    try:
        return a / b
    except (ZeroDivisionError, ValueError):  # by a series that holds 0
        return nowhere(a, b)


def root(number: Any) -> Any:
    """The square root, or none."""
    try:
        return number.sqrt()
    except (ZeroDivisionError, ValueError):
        return nowhere(number)


def box_root(number: Any) -> Any:
    """The square root in a box of complex numbers, or of a number that is the same in all of it."""
    return number.sqrt(analytic=True) if isinstance(number, acb) else number.sqrt()


def _first(number: Any) -> arb:
    """What the sign of a number is told by."""
    if isinstance(number, arb_series):
        return number[0]
    return number.real if isinstance(number, acb) else number


def size(number: Any) -> Any:
    """The absolute value, as an analytic function: the number or its opposite."""
    first = _first(number)
    if first > 0:
        return number
    return -number if first < 0 else abs(number) if isinstance(number, arb) else number * nowhere(number)


def maximum(a: Any, b: Any) -> Any:
    """The larger of two numbers, as an analytic function."""
    return a.max(b) if isinstance(a, arb) and isinstance(b, arb) else (a + b + size(a - b)) / 2


def minimum(a: Any, b: Any) -> Any:
    """The smaller of two numbers, as an analytic function."""
    return -maximum(-a, -b)


def raised(number: Any, power: Any) -> Any:
    """A power of a positive number, as an analytic function."""
    return number**power if _first(number) > 0 else number * nowhere(number)


def choose(a: Any, b: Any, sign: Any) -> Any:
    """The first of two numbers where a sign is positive, the second where it is negative, else both."""
    if sign > 0:
        return a
    return b if sign < 0 else a.union(b)


def angle(y: Any, x: Any) -> Any:
    """The angle of a vector, 2 arctan(y/(r + x)) with its length r, which is 2 arctan((r - x)/y) too."""
    square = x * x + y * y
    if isinstance(square, acb):
        r = square.sqrt(analytic=True)
        return 2 * arctangent((r - x) / y if x.real < 0 else y / (r + x))
    r = square.sqrt()
    return 2 * ((r - x) / y if x < 0 else y / (r + x)).atan()


def angle_series(y: Any, x: Any) -> Any:
    """The angle of a vector as a power series, or none."""
    try:
        r = (x * x + y * y).sqrt()
        return 2 * ((r - x) / y if _first(x) < 0 else y / (r + x)).atan()
    except (ZeroDivisionError, ValueError):
        return nowhere(y, x)


def arctangent(number: acb) -> acb:
    """The arctangent, or no finite number on its branch cuts, where 1 + number^2 is real and negative."""
    return number.atan() if (1 + number * number).sqrt(analytic=True).is_finite() else acb("nan")
