"""A straight-line program as a graph without repetitions, and numbers that record what is done to them.

The equations of a linkage are written once, as functions of numbers with + - * / and `sqrt`. Run on `Number` they give
a graph, which is split into what depends on the design only and what depends on the input angle too. `Series` are
numbers with their first and second derivatives by the input angle.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

from explore.model.quadrature import MOST_SENSES

#: Level of a number.
CONSTANT = 0
#: Level of a node that depends on the design.
DESIGN = 1
#: Level of a node that depends on the input angle as well.
ANGLE = 2
#: Input of the cosine of the input angle.
COSINE = "@cos"
#: Input of the sine of the input angle.
SINE = "@sin"
#: Input of the input angle itself, rad, which only a graph that is exact has.
INPUT_ANGLE = "@angle"
#: Inputs of 1 - cos(theta - k pi/2), k = 0 ... 3, of the input angle theta, as sums of positive terms.
VERSINES = ("@versine0", "@versine1", "@versine2", "@versine3")

#: Operations that give the sense of a rate, 1 or where it is negative -1; or the one that the law of a panel says.
SENSES = tuple(f"sense{k}" for k in range(MOST_SENSES))
#: Input of the least place or angle of the output, mm or rad; no number where there are no strokes.
LEAST_PLACE = "@least_place"
#: Input of the greatest one.
GREATEST_PLACE = "@greatest_place"
#: Largest number of groups of links that are followed.
MOST_GROUPS = 4
#: Operations that follow a group to a cosine and sine: positive where it assembles, 0 where that is not decided.
FOLLOWS = tuple(f"follow{k}" for k in range(MOST_GROUPS))
#: Operations that give what was followed: cosine and sine of both links, nearly; the slope of the result and its size.
PARTS = tuple(f"followed{k}" for k in range(6))
#: Operation that gives the lengths z with z_i = |a_i + sum_j G_ij z_j|, of the parts of all a_i and then of all G_ij.
LENGTHS = "lengths"
#: Operations that give one of these lengths.
LENGTHS_OF = tuple(f"length{k}" for k in range(MOST_SENSES))
#: Operation that gives the same number, which is not negative and has a corner where it is 0.
CORNER = "corner"

Node = tuple[str | int | float, ...]


class Graph:
    """Operations without repetition, in the order in which they were first needed.

    A node is ("constant", value, rest), ("input", name), or an operation and the numbers of its operands. The rest of a
    constant is what its value is rounded by, rounded; of some only the value is known: then `has_rounded_constants`.
    What only sees to rounding is left out of a graph that `is_exact`, as one in balls.
    """

    def __init__(self) -> None:
        self.has_rounded_constants = self.is_exact = False
        self.nodes: list[Node] = []
        self.levels: list[int] = []
        self._numbers: dict[Node, int] = {}

    def put(self, *node: str | float) -> Number:
        """The number of a node, which is added unless it is there."""
        if node[0] in ("add", "mul", "max") and node[1] > node[2]:  # type: ignore[operator]  # numbers of nodes
            node = (node[0], node[2], node[1])
        if node not in self._numbers:
            self._numbers[node] = len(self.nodes)
            self.nodes.append(node)
            self.levels.append(self._level(node))
        return Number(self, self._numbers[node])

    def _level(self, node: Node) -> int:
        if node[0] == "constant":
            return CONSTANT
        if node[0] == "input":
            return ANGLE if str(node[1]).startswith("@") else DESIGN
        return max(self.levels[int(k)] for k in node[1:])

    def constant(self, value: float | Fraction) -> Number:
        """A number; a fraction with what it is rounded by."""
        rounded = float(value) + 0.0  # + 0.0: no negative zero beside a positive one
        return self.put("constant", rounded, float(value - Fraction(rounded)) if isinstance(value, Fraction) else 0.0)

    def folded(self, function: Callable[..., Any], *operands: Number) -> Number:
        """The constant that a function gives of constants; what is 0 of their values is 0."""
        value = function(*(each.value for each in operands))
        is_exact = value == 0.0 or not math.isfinite(value)
        return self.constant(value if is_exact else function(*(each.exact for each in operands)))

    def input(self, name: str) -> Number:
        """A parameter, or an input of the angle."""
        return self.put("input", name)

    def exact_sum(self, *terms: Number) -> Number:
        """The sum of four terms of the design, rounded once."""
        if all(term.value is not None for term in terms):
            return self.folded(_total, *terms)
        return self.put("exact_sum", *(term.index for term in terms))

    def needed(self, outputs: Iterable[Number]) -> list[int]:
        """Numbers of the nodes that outputs need, ascending."""
        marked: set[int] = set()
        waiting = [output.index for output in outputs]
        while waiting:
            k = waiting.pop()
            if k not in marked:
                marked.add(k)
                waiting += operands(self.nodes[k])
        return sorted(marked)


def operands(node: Node) -> list[int]:
    """Numbers of the nodes that an operation takes."""
    return [] if node[0] in ("constant", "input") else [int(k) for k in node[1:]]


def _total(*terms: Any) -> Any:
    """The sum of doubles, rounded once, or of fractions."""
    return math.fsum(terms) if isinstance(terms[0], float) else sum(terms)


def _root(value: Any) -> Any:
    """The square root of a double, or of a fraction to at least 128 bits."""
    if isinstance(value, float):
        return math.sqrt(value) if value >= 0.0 else math.nan
    return Fraction(math.isqrt(value.numerator * value.denominator << 256), value.denominator << 128)


class Number:
    """A node of a graph, as a number."""

    __slots__ = ("graph", "index")

    def __init__(self, graph: Graph, index: int) -> None:
        self.graph, self.index = graph, index

    @property
    def node(self) -> Node:
        """The node itself."""
        return self.graph.nodes[self.index]

    @property
    def value(self) -> float | None:
        """The value of a constant; None of others."""
        return float(self.node[1]) if self.node[0] == "constant" else None

    @property
    def exact(self) -> Fraction:
        """The value of a constant with its rest."""
        return Fraction(self.node[1]) + Fraction(self.node[2])

    @property
    def order(self) -> float:
        """Order of a trigonometric polynomial of the input angle; infinite where it is none, or not seen to be one."""
        graph, orders = self.graph, dict[int, float]()
        for k in graph.needed([self]):
            name, own = graph.nodes[k][0], [orders[each] for each in operands(graph.nodes[k])]
            if graph.levels[k] < ANGLE:
                orders[k] = 0.0
            elif name in ("add", "sub", "neg", "mul"):
                orders[k] = sum(own) if name == "mul" else max(own)
            else:
                orders[k] = 1.0 if name == "input" and graph.nodes[k][1] != INPUT_ANGLE else math.inf
        return orders[self.index]

    def _of(self, other: Number | float) -> Number:
        return other if isinstance(other, Number) else self.graph.constant(other)

    def _folded(self, other: Number | float, function: Callable[..., Any]) -> tuple[Number, Number | None]:
        """The other operand, and the result if both are constants."""
        second = self._of(other)
        are_constants = self.value is not None and second.value is not None
        return second, self.graph.folded(function, self, second) if are_constants else None

    def __add__(self, other: Number | float) -> Number:
        second, result = self._folded(other, operator.add)
        if result is not None:
            return result
        if second.value == 0.0:
            return self
        return second if self.value == 0.0 else self.graph.put("add", self.index, second.index)

    def __sub__(self, other: Number | float) -> Number:
        second, result = self._folded(other, operator.sub)
        if result is not None:
            return result
        if second.value == 0.0:
            return self
        if self.value == 0.0:
            return -second
        if self.index == second.index:
            return self.graph.constant(0.0)
        if self.node[0] == "add" and second.index in operands(self.node):  # (a + b) - a, without rounding a + b
            first, other = operands(self.node)
            return Number(self.graph, other if first == second.index else first)
        return self.graph.put("sub", self.index, second.index)

    def __mul__(self, other: Number | float) -> Number:
        second, result = self._folded(other, operator.mul)
        if result is not None:
            return result
        for one, rest in ((self, second), (second, self)):
            if one.value == 0.0:
                return one
            if one.value == 1.0 and one.exact == 1:
                return rest
            if one.value == -1.0 and one.exact == -1:
                return -rest
        return self.graph.put("mul", self.index, second.index)

    def __truediv__(self, other: Number | float) -> Number:
        second, result = self._folded(other, lambda x, y: x / y if y else math.nan)
        if result is not None:
            return result
        if self.value == 0.0:
            return self
        return self if second.value == 1.0 and second.exact == 1 else self.graph.put("div", self.index, second.index)

    def __radd__(self, other: float) -> Number:
        return self._of(other) + self

    def __rsub__(self, other: float) -> Number:
        return self._of(other) - self

    def __rmul__(self, other: float) -> Number:
        return self._of(other) * self

    def __rtruediv__(self, other: float) -> Number:
        return self._of(other) / self

    def __neg__(self) -> Number:
        if self.value is not None:
            return self.graph.folded(operator.neg, self)
        if self.node[0] == "neg":
            return Number(self.graph, operands(self.node)[0])
        return self.graph.put("neg", self.index)

    def sqrt(self) -> Number:
        """The square root."""
        if self.value is not None:
            return self.graph.folded(_root, self)
        return self.graph.put("sqrt", self.index)

    def __abs__(self) -> Number:
        if self.value is not None:
            return self.graph.folded(abs, self)
        inner = Number(self.graph, operands(self.node)[0]) if self.node[0] == "neg" else self
        return inner if inner.node[0] == "abs" else self.graph.put("abs", inner.index)

    def call(self, function: str, *others: Number) -> Number:
        """A function of `explore.model.expressions`, or "maximum" or "arctangent" of two numbers."""
        return self.graph.put(function, self.index, *(other.index for other in others))


class Series:
    """A number and its first and second derivatives by the input angle."""

    __slots__ = ("terms",)

    def __init__(self, value: Number, first: Number, second: Number) -> None:
        self.terms = (value, first, second)

    @classmethod
    def still(cls, number: Number) -> Series:
        """A number that does not depend on the angle."""
        zero = number.graph.constant(0.0)
        return cls(number, zero, zero)

    def _of(self, other: Series | Number | float) -> Series:
        if isinstance(other, Series):
            return other
        return Series.still(other if isinstance(other, Number) else self.terms[0].graph.constant(other))

    def __add__(self, other: Series | Number | float) -> Series:
        return Series(*(a + b for a, b in zip(self.terms, self._of(other).terms, strict=True)))

    def __sub__(self, other: Series | Number | float) -> Series:
        return Series(*(a - b for a, b in zip(self.terms, self._of(other).terms, strict=True)))

    def __neg__(self) -> Series:
        return Series(*(-a for a in self.terms))

    def __abs__(self) -> Series:
        a, da, dda = self.terms
        size = abs(a)
        sign = a / size
        return Series(size, da * sign, dda * sign)

    @property
    def is_zero(self) -> bool:
        """Whether it is 0 in all designs, at all angles."""
        return all(term.value == 0.0 for term in self.terms)

    @property
    def is_still(self) -> bool:
        """Whether it does not depend on the angle."""
        return self.terms[1].value == self.terms[2].value == 0.0

    def __mul__(self, other: Series | Number | float) -> Series:
        if not isinstance(other, Series):
            return Series(*(a * other for a in self.terms))
        (a, da, dda), (b, db, ddb) = self.terms, other.terms
        cross = da * db
        return Series(a * b, da * b + a * db, (dda * b + a * ddb) + (cross + cross))

    def inverse(self) -> Series:
        """1 over the number."""
        a, da, dda = self.terms
        inverse = 1.0 / a
        rate = da * inverse
        return Series(inverse, -(inverse * rate), inverse * (2.0 * (rate * rate) - dda * inverse))

    def __truediv__(self, other: Series) -> Series:
        return self * other.inverse()

    def sqrt(self) -> Series:
        """The square root."""
        a, da, dda = self.terms
        root = a.sqrt()
        half = 0.5 / root
        rate = da * half
        return Series(root, rate, (dda - 2.0 * (rate * rate)) * half)
