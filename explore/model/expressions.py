"""Arithmetic expressions of the formulas that users write, as data."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

_Value = TypeVar("_Value")

# Angles are in degrees, as in all columns.
#: Smallest and largest number of values of each function of a formula; None for any number.
FUNCTIONS: Mapping[str, tuple[int, int | None]] = MappingProxyType(
    {
        "abs": (1, 1), "sqrt": (1, 1), "min": (2, None), "max": (2, None), "log": (1, 1), "exp": (1, 1),
        "sin": (1, 1), "cos": (1, 1), "tan": (1, 1), "atan2": (2, 2), "hypot": (2, 2),
    }
)  # fmt: skip
#: Operations of one value.
OF_ONE = frozenset(["negate", *(name for name, counts in FUNCTIONS.items() if counts == (1, 1))])


@dataclass(frozen=True)
class Expression:
    """An expression in postfix order.

    Attributes
    ----------
    text
        The expression with even spaces.
    steps
        Pairs of an operation and its operand, in the order in which a stack computes them: "number" with its value,
        "input" with the position of the input among those of the formula, "negate", "+", "-", "*", "/", "**" and the
        names of `FUNCTIONS`, the operand of which is 0. All but the first three take two values, or one where the
        function takes no more.
    """

    text: str
    steps: tuple[tuple[str, float], ...]


def run(
    steps: Iterable[tuple[str, float]],
    number: Callable[[float], _Value],
    given: Callable[[int], _Value],
    apply: Callable[..., _Value],
) -> _Value:
    """What a stack makes of the steps of an `Expression`, whose values may be of any kind.

    They are made of numbers, of inputs by their position, and of an operation with its one or two values.
    """
    stack: list[_Value] = []
    for operation, operand in steps:
        if operation == "number":
            stack.append(number(operand))
        elif operation == "input":
            stack.append(given(int(operand)))
        elif operation in OF_ONE:
            stack.append(apply(operation, stack.pop()))
        else:
            second, first = stack.pop(), stack.pop()
            stack.append(apply(operation, first, second))
    return stack.pop()
