"""Formulas and their functions in ball arithmetic; angles in degrees."""

from collections.abc import Callable, Sequence

from flint import arb

from explore.analysis.certifying.balls import UndecidedError, exact, sure_sign
from explore.model.expressions import Expression


def compute(expression: Expression, inputs: Sequence[arb]) -> arb | None:
    """The value of an expression; None where it is undefined."""
    stack: list[arb] = []
    for operation, operand in expression.steps:
        if operation == "number":
            stack.append(arb(exact(operand)))
        elif operation == "input":
            stack.append(inputs[int(operand)])
        elif operation in UNARY:
            stack.append(UNARY[operation](stack.pop()))
        else:
            second, first = stack.pop(), stack.pop()
            stack.append(BINARY[operation](first, second))
        if stack[-1] is None:
            return None
    return stack.pop()


def _divide(a: arb, b: arb) -> arb | None:
    return a / b if sure_sign(b) != 0 else None


def _power(a: arb, b: arb) -> arb | None:
    if b.is_exact() and b.is_integer():
        exponent = int(b.unique_fmpz())
        return a**exponent if exponent >= 0 or sure_sign(a) != 0 else None
    if sure_sign(a) > 0:
        return (b * a.log()).exp()
    if a.is_zero():
        return arb(0) if sure_sign(b) > 0 else None
    if b.contains_integer():  # to which a negative number has a power
        raise UndecidedError
    return None


def _root(a: arb) -> arb | None:
    if a.is_zero():
        return arb(0)
    return a.sqrt() if sure_sign(a) > 0 else None


def _logarithm(a: arb) -> arb | None:
    return a.log() if sure_sign(a) > 0 else None


def _tangent(a: arb) -> arb:
    value = (a * arb.pi() / 180).tan()
    if not value.is_finite():
        raise UndecidedError
    return value


def _direction(a: arb, b: arb) -> arb | None:
    if a.is_zero() and b.is_zero():
        return None
    if a.contains(0) and not b > 0 and not a.is_zero():
        raise UndecidedError
    return arb.atan2(a, b) * 180 / arb.pi()


#: Functions of one number by their names in formulas; None where undefined.
UNARY: dict[str, Callable[[arb], arb | None]] = {
    "negate": lambda a: -a,
    "abs": abs,
    "sqrt": _root,
    "log": _logarithm,
    "exp": lambda a: a.exp(),
    "sin": lambda a: (a * arb.pi() / 180).sin(),
    "cos": lambda a: (a * arb.pi() / 180).cos(),
    "tan": _tangent,
}
#: Functions of two numbers by their names in formulas; None where undefined.
BINARY: dict[str, Callable[[arb, arb], arb | None]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": _divide,
    "**": _power,
    "min": lambda a, b: a.min(b),
    "max": lambda a, b: a.max(b),
    "atan2": _direction,
    "hypot": lambda a, b: (a * a + b * b).sqrt(),
}
