"""The graph of a linkage in balls: numbers of it at input angles that are real, complex, or power series.

The numbers of a table become inputs before the graph is traced, so that no operation on them is folded to a double.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from math import comb
from typing import Any

from flint import acb, arb, arb_series

from explore.analysis.certifying.balls import UnprovedError, exact
from explore.analysis.certifying.functions import BINARY, UNARY
from explore.analysis.certifying.integration import arctangent
from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import ANGLE, COSINE, SINE, VERSINES, Node, Number, operands
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.signals import find_quantities
from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import LinkageTable

#: Beginning of the names of inputs that are numbers.
_NUMBER = "="
#: Largest number of tables whose graphs are kept.
_MOST_KEPT = 16
#: Number of coefficients of power series.
_TERMS = 5
#: Value where there is none.
_NOWHERE = arb("nan")


@lru_cache(_MOST_KEPT)
def trace(table: LinkageTable) -> tuple[Equations, dict[str, Quantity]]:
    """The equations of a linkage without loads, and its signals by name."""
    equations = Equations(_with_inputs(replace(table, loads=None)), find_steps(table))
    return equations, {each.signal.name: each for each in find_quantities(equations)}


def _with_inputs(value: Any) -> Any:
    """The same parts of a table with an input in place of each number; zeros stay, which equations look for."""
    if isinstance(value, Coordinate):
        names, steps = list(value.names), []
        for operation, operand in value.steps:
            if operation == "number" and operand != 0.0:
                name = f"{_NUMBER}{operand!r}"
                names += [] if name in names else [name]
                steps.append(("input", float(names.index(name))))
            else:
                steps.append((operation, operand))
        return Coordinate(tuple(names), tuple(steps))
    if isinstance(value, tuple):
        return tuple(map(_with_inputs, value))
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: _with_inputs(getattr(value, each.name)) for each in fields(value)})
    return value


def angle_inputs(cosine: Any, sine: Any) -> dict[str, Any]:
    """The inputs of an angle by its cosine and sine."""
    versines = (1 - cosine, 1 - sine, 1 + cosine, 1 + sine)
    return {COSINE: cosine, SINE: sine, **dict(zip(VERSINES, versines, strict=True))}


class BallGraph:
    """The graph of a linkage of exact parameters, at the precision that is set."""

    def __init__(self, table: LinkageTable, parameters: Mapping[str, float]) -> None:
        self.equations, self.quantities = trace(table)
        self._parameters = parameters
        self._known: dict[int, Any] = {}

    def function(self, numbers: Sequence[Number], references: Mapping[str, arb] | None = None) -> Function:
        """Numbers as a function of the input angle; `references` are inputs that do not depend on it."""
        graph = self.equations.graph
        steps: list[tuple[int, str, Any, tuple[int, ...]]] = []
        for k in graph.needed(numbers):
            node = graph.nodes[k]
            if graph.levels[k] < ANGLE:
                if k not in self._known:
                    self._known[k] = self._of_design(node)
            elif node[0] == "input":
                steps.append((k, str(node[1]), None, ()))
            else:
                steps.append((k, "", _operation(str(node[0])), tuple(operands(node))))
        return Function([number.index for number in numbers], steps, self._known, references or {})

    def place_of_frame(self, point: str) -> list[Any]:
        """The coordinates of a point that does not move, mm."""
        return self.function([part.terms[0] for part in self.equations.points[point]]).at({})

    def _of_design(self, node: Node) -> arb:
        """A number that does not depend on the input angle."""
        name = str(node[0])
        if name == "input":
            given = str(node[1])
            number = float(given[1:]) if given.startswith(_NUMBER) else self._parameters[given]
            return arb(exact(number))
        if name == "constant":
            if node[2] != 0.0:
                raise UnprovedError("the table has functions of numbers that are rounded")
            return arb(exact(float(node[1])))
        values = [self._known[k] for k in operands(node)]
        if name == "exact_sum":
            return sum(values, arb(0))
        value = _operation(name)(*values)
        return _NOWHERE if value is None else value


@dataclass(frozen=True)
class Function:
    """Numbers of a graph as a function of the input angle.

    Attributes
    ----------
    outputs
        The numbers, as indices.
    steps
        For each node: its index, the name of an input or none, the operation, and the indices of its operands.
    known
        Values of nodes that do not depend on the angle.
    references
        Inputs that do not depend on the angle.
    """

    outputs: list[int]
    steps: list[tuple[int, str, Any, tuple[int, ...]]]
    known: Mapping[int, Any]
    references: Mapping[str, arb]

    def __call__(self, angle: Any) -> list[Any]:
        """The numbers at an angle, rad; no finite ones where they are undefined or not analytic."""
        return self.at(angle_inputs(angle.cos(), angle.sin()))

    def at(self, inputs: Mapping[str, Any]) -> list[Any]:
        """The numbers at the inputs of an angle."""
        done = self._nodes({**inputs, **self.references})
        return [done[k] for k in self.outputs]

    def _nodes(self, inputs: Mapping[str, Any]) -> dict[int, Any]:
        """All nodes at the inputs of an angle."""
        done = dict(self.known)
        for k, name, operation, places in self.steps:
            done[k] = inputs[name] if name else _result(operation, [done[place] for place in places])
        return done

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients of each number about an angle."""
        return [_coefficients(value) for value in self(arb_series([angle, arb(1)], _TERMS))]

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """Taylor coefficients of each number about an angle; the last one is that about all angles near it.

        What is divided by or has a root taken of is known from its series about the middle as well, so that what the
        angles have in common is not lost there.
        """
        offset = arb(0, half.upper())
        about_middle = self._nodes(self._inputs(arb_series([middle, arb(1)], _TERMS)))
        inputs, tight = self._inputs(arb_series([middle + offset, arb(1)], _TERMS)), set[int]()
        done = dict(self.known)
        for k, name, operation, places in self.steps:
            if name:
                done[k] = inputs[name]
                continue
            if operation in _NONLINEAR:
                for place in places:
                    if place not in tight and isinstance(done[place], arb_series):
                        done[place] = _tightened(done[place], about_middle[place], offset)
                        tight.add(place)
            done[k] = _result(operation, [done[place] for place in places])
        return [[*_coefficients(about_middle[k])[:-1], _coefficients(done[k])[-1]] for k in self.outputs]

    def _inputs(self, angle: Any) -> dict[str, Any]:
        return {**angle_inputs(angle.cos(), angle.sin()), **self.references}


def _result(operation: Callable[..., Any], values: list[Any]) -> Any:
    try:
        return operation(*values)
    except (ZeroDivisionError, ValueError):  # of power series by one that holds 0
        return _NOWHERE


def _tightened(series: arb_series, about_middle: Any, offset: arb) -> arb_series:
    """A series about all angles near a middle, whose coefficients but the last follow from those about it too."""
    terms, others = _coefficients(series), _coefficients(about_middle)
    if not all(term.is_finite() for term in terms[-1:] + others):
        return series
    others[-1] = terms[-1]
    for k in range(_TERMS - 1):
        value = arb(0)
        for j in range(_TERMS - 1, k - 1, -1):
            value = value * offset + comb(j, k) * others[j]
        terms[k] = terms[k].intersection(value) if terms[k].is_finite() else value
    return arb_series(terms, _TERMS)


def _coefficients(value: arb | arb_series) -> list[arb]:
    """The coefficients of a series, or of a number that does not depend on the angle."""
    if isinstance(value, arb_series):
        return [value[k] for k in range(_TERMS)]
    return [value] + [arb(0) if value.is_finite() else value] * (_TERMS - 1)


def _root(number: Any) -> Any:
    return number.sqrt(analytic=True) if isinstance(number, acb) else number.sqrt()


def _size(number: Any) -> Any:
    """The absolute value, as an analytic function: the number or its opposite."""
    first = number[0] if isinstance(number, arb_series) else number.real
    if first > 0:
        return number
    return -number if first < 0 else abs(number) if isinstance(number, arb) else number * _NOWHERE


def _angle(y: Any, x: Any) -> Any:
    """The angle of a vector, 2 arctan(y/(r + x)) with its length r, which is 2 arctan((r - x)/y) too."""
    r = _root(x * x + y * y)
    first = x[0] if isinstance(x, arb_series) else x.real
    tangent = (r - x) / y if first < 0 else y / (r + x)
    return 2 * (arctangent(tangent, analytic=True) if isinstance(tangent, acb) else tangent.atan())


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
    "sqrt": _root, "abs": _size, "arctangent": _angle,
}  # fmt: skip
#: Operations before which series are tightened.
_NONLINEAR = (_root, operator.truediv, _angle)
#: Names of functions of formulas that graphs call otherwise.
_FORMULA_NAMES = {"power": "**", "minimum": "min", "maximum": "max"}


def _operation(name: str) -> Callable[..., Any]:
    if name in _OPERATIONS:
        return _OPERATIONS[name]
    name = _FORMULA_NAMES.get(name, name)
    return UNARY[name] if name in UNARY else BINARY[name]
