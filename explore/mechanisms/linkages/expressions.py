"""The expressions of a table as numbers of a graph, and their functions of constants."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.graph import Graph, Number
from explore.model.expressions import run
from explore.model.quantities import FloatArray


def read_expression(graph: Graph, coordinate: Coordinate, given: Mapping[str, Number] | None = None) -> Number:
    """A coordinate as a number, from its operations; names are parameters, but for those `given`."""

    def named(place: int) -> Number:
        name = coordinate.names[place]
        return given[name] if given and name in given else graph.input(name)

    return run(coordinate.steps, graph.constant, named, _applied)


def _applied(operation: str, *values: Number) -> Number:
    if len(values) == 2:
        return _combined(operation, *values)
    (number,) = values
    match operation:
        case "negate":
            return -number
        case "sqrt":
            return number.sqrt()
        case "abs":
            return abs(number)
    if number.value is not None:
        return _rounded(number.graph, evaluate_function(operation, number.value))
    return number.call(operation)


def _rounded(graph: Graph, value: float) -> Number:
    """A constant of which only its double is known, but for 0 and 1, which are exact."""
    graph.has_rounded_constants |= value not in (-1.0, 0.0, 1.0)
    return graph.constant(value)


def _combined(operation: str, first: Number, second: Number) -> Number:
    match operation:
        case "+":
            return first + second
        case "-":
            return first - second
        case "*":
            return first * second
        case "/":
            return first / second
        case "**" if second.value == 2.0:
            return first * first
    if first.value is not None and second.value is not None:
        return _rounded(first.graph, evaluate_function(operation, first.value, second.value))
    return first.call({"**": "power", "min": "minimum", "max": "maximum"}.get(operation, operation), second)


def evaluate_coordinate(coordinate: Coordinate, columns: Mapping[str, FloatArray]) -> FloatArray:
    """A coordinate of designs with these parameters, each of shape (n,); of shape () where it takes none of them."""

    def apply(operation: str, *values: FloatArray) -> FloatArray:
        if operation in _OF_ARRAYS:
            return np.asarray(_OF_ARRAYS[operation](*values))
        return np.asarray(_OF_NUMBERS(operation, *values, *[0.0] * (2 - len(values))), dtype=np.float64)

    with np.errstate(all="ignore"):
        return run(coordinate.steps, np.array, lambda place: columns[coordinate.names[place]], apply)


def evaluate_function(function: str, x: float, y: float = 0.0) -> float:
    """A function of a formula; angles in degrees, exact at multiples of 90 deg; NaN where it is undefined."""
    try:
        return _evaluate(function, x, y)
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


def _evaluate(function: str, x: float, y: float) -> float:
    if function in ("sin", "cos"):
        turned = math.remainder(x + (90.0 if function == "cos" else 0.0), 360.0)
        exact = {0.0: 0.0, 90.0: 1.0, 180.0: 0.0, -90.0: -1.0, -180.0: 0.0}
        angle = math.radians(math.remainder(x, 360.0))
        return exact.get(turned, math.sin(angle) if function == "sin" else math.cos(angle))
    if function == "tan":
        return math.tan(math.radians(math.remainder(x, 180.0)))
    if function == "atan2":
        return math.degrees(math.atan2(x, y))
    of_two: dict[str, Callable[[float, float], float]] = {
        "**": math.pow, "min": min, "max": max, "hypot": math.hypot
    }  # fmt: skip
    of_one: dict[str, Callable[[float], float]] = {"log": math.log, "exp": math.exp}
    return of_two[function](x, y) if function in of_two else of_one[function](x)


#: Operations of whole columns.
_OF_ARRAYS: dict[str, np.ufunc] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "negate": np.negative, "sqrt": np.sqrt,
    "abs": np.abs,
}  # fmt: skip
#: The other ones, number after number.
_OF_NUMBERS = np.frompyfunc(evaluate_function, 3, 1)
