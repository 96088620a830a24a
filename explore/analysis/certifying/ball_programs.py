"""Numbers of a graph as Python functions of balls: real, complex, or power series, over an angle or over a cell.

The operations of a graph are written as one function, which takes a third of the time of looking each of them up.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Any

from flint import acb, arb, arb_series

from explore.analysis.certifying.analytic import (
    NOWHERE,
    TERMS,
    angle,
    angle_series,
    box_root,
    choose,
    coefficients,
    divide,
    maximum,
    minimum,
    raised,
    root,
    size,
)
from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.fixed_points import lengths
from explore.analysis.certifying.functions import BINARY, UNARY
from explore.mechanisms.linkages.graph import (
    ANGLE,
    CORNER,
    COSINE,
    INPUT_ANGLE,
    LENGTHS,
    LENGTHS_OF,
    SENSES,
    SINE,
    VERSINES,
    Graph,
    Number,
    operands,
)

_SYMBOLS = {"add": "+", "exact_sum": "+", "sub": "-", "mul": "*", "div": "/"}
#: Operations that give an operand, or a part of it.
_TAKEN = {CORNER: "{0}", **{name: f"{{}}[{k}]" for k, name in enumerate(LENGTHS_OF)}}
#: Operations that are written otherwise, of balls.
_OF_BALLS = {"neg": "-{}", "sqrt": "{}.sqrt()", "arctangent": "angle({}, {})", **_TAKEN}
#: Operations that are written otherwise, of series.
_OF_SERIES = _OF_BALLS | {"sqrt": "root({})", "div": "divide({}, {})", "arctangent": "angle_series({}, {})"}
#: Inputs that follow from the angle, its cosine and its sine, which have these names after that of their side.
_OF_ANGLE = {
    COSINE: "{0}c", SINE: "{0}s", INPUT_ANGLE: "{0}a",
    **dict(zip(VERSINES, ("1 - {0}c", "1 - {0}s", "1 + {0}c", "1 + {0}s"), strict=True)),
}  # fmt: skip
#: Inputs 1 - cos(angle - k pi/2) by the sine h and the cosine g of half the angle, as squares, which are narrow.
_BY_HALVES = ("2 * th * th", "(th - tg) * (th - tg)", "2 * tg * tg", "(th + tg) * (th + tg)")
#: Branches by the signs of their decisions, which come last: 1 or -1, or a ball with both.
_BRANCHES = {
    **dict.fromkeys(SENSES, "{1}"), CORNER: "{0}", "abs": "{1} * {0}", "minimum": "choose({1}, {0}, {2})",
    **dict.fromkeys(("max", "maximum"), "choose({0}, {1}, {2})"),
}  # fmt: skip
#: Operations before which series over cells are tightened.
_NONLINEAR = ("div", "sqrt", "arctangent", LENGTHS)


@dataclass(frozen=True)
class Program:
    """Numbers of a graph as functions of the inputs of an angle and of numbers that do not depend on it.

    Attributes
    ----------
    graph
        The graph.
    outputs
        The numbers, as indices.
    name
        What they are: a signal, or factors.
    is_cut
        Whether the signs of `branches` are given.
    """

    graph: Graph
    outputs: tuple[int, ...]
    name: str
    is_cut: bool = False

    @cached_property
    def _steps(self) -> list[int]:
        return self.graph.needed([Number(self.graph, k) for k in self.outputs])

    @cached_property
    def references(self) -> dict[str, int]:
        """Inputs that do not follow from the angle alone, and their numbers."""
        names = {str(self.graph.nodes[k][1]): k for k in self._moving if self.graph.nodes[k][0] == "input"}
        return {name: k for name, k in names.items() if name not in _OF_ANGLE}

    @cached_property
    def branches(self) -> list[int]:
        """Numbers that depend on the angle with one form or another by the sign of a number, their decision."""
        return [k for k in self._moving if self.graph.nodes[k][0] in _BRANCHES]

    @cached_property
    def _still(self) -> list[int]:
        return [k for k in self._steps if self.graph.levels[k] < ANGLE]

    @cached_property
    def parameters(self) -> list[str]:
        """Inputs that do not depend on the angle."""
        return [str(self.graph.nodes[k][1]) for k in self._still if self.graph.nodes[k][0] == "input"]

    @cached_property
    def of_design(self) -> Callable[..., tuple[arb, ...]]:
        """The numbers `known` of parameters."""
        inputs = [f"k{k}" for k in self._still if self.graph.nodes[k][0] == "input"]
        steps = [k for k in self._still if self.graph.nodes[k][0] != "input"]
        lines = [f"    k{k} = {self._expression(k, _OF_BALLS, 'k')}" for k in steps]
        return _written(inputs, lines, [f"k{k}" for k in self.known])

    @cached_property
    def known(self) -> list[int]:
        """Numbers that do not depend on the angle, of those that operations take and of the outputs."""
        taken = {j for k in self._steps if self.graph.levels[k] == ANGLE for j in operands(self.graph.nodes[k])}
        return [k for k in self._still if k in taken or k in self.outputs]

    @cached_property
    def of_numbers(self) -> Callable[..., tuple[arb, ...]]:
        """The numbers at a real angle."""
        return self._of_angle(_OF_BALLS)

    @cached_property
    def of_boxes(self) -> Callable[..., tuple[acb, ...]]:
        """The numbers in a box of complex angles; not finite where they are not analytic."""
        forms = _OF_BALLS | {"sqrt": "box_root({})"}
        return self._of_angle(forms | dict(zip(VERSINES, _BY_HALVES, strict=True)), ["th", "tg"])

    @cached_property
    def of_series(self) -> Callable[..., tuple[arb_series, ...]]:
        """The numbers as power series about an angle."""
        return self._of_angle(_OF_SERIES)

    def _of_angle(self, forms: dict[str, str], others: Sequence[str] = ()) -> Callable[..., Any]:
        lines = [f"    t{k} = {self._expression(k, forms, 't')}" for k in self._moving]
        return _written(["tc", "ts", "ta", *others, *self._arguments], lines, self._results("t"))

    @cached_property
    def of_cells(self) -> Callable[..., tuple[tuple[arb_series, arb_series], ...]]:
        """The numbers as power series about the middle of a cell, and about all of its angles.

        What is divided by or has a root taken of is known from its series about the middle as well, so that what the
        angles have in common is not lost there.
        """
        lines, tight = [], set[int]()
        for k in self._moving:
            operation = self.graph.nodes[k][0]
            for j in operands(self.graph.nodes[k]) if operation in _NONLINEAR else ():
                if j not in tight and self.graph.levels[j] == ANGLE:
                    lines.append(f"    w{j} = tightened(w{j}, m{j}, offset)")
                    tight.add(j)
            lines += [f"    {side}{k} = {self._expression(k, _OF_SERIES, side)}" for side in "mw"]
        pairs = zip(self._results("m"), self._results("w"), strict=True)
        arguments = ["offset", "mc", "ms", "ma", "wc", "ws", "wa", *self._arguments]
        return _written(arguments, lines, [f"({m}, {w})" for m, w in pairs])

    @cached_property
    def _arguments(self) -> list[str]:
        signs = [f"b{k}" for k in self.branches] if self.is_cut else []
        return [*(f"r{k}" for k in self.references.values()), *(f"k{k}" for k in self.known), *signs]

    @cached_property
    def _moving(self) -> list[int]:
        """Numbers that depend on the angle."""
        return [k for k in self._steps if self.graph.levels[k] == ANGLE]

    def _results(self, side: str) -> list[str]:
        return [f"{side}{k}" if self.graph.levels[k] == ANGLE else f"k{k}" for k in self.outputs]

    def _expression(self, k: int, forms: dict[str, str], side: str) -> str:
        """The operation of a node, on variables of a side and on numbers of the design."""
        node = self.graph.nodes[k]
        names = [f"{side}{j}" if self.graph.levels[j] == ANGLE else f"k{j}" for j in operands(node)]
        operation = str(node[0])
        if operation == "input":
            name = str(node[1])
            return forms.get(name, _OF_ANGLE[name]).format(side) if name in _OF_ANGLE else f"r{k}"
        if operation == "constant":
            return f"constant({node[1]!r}, {node[2]!r})"
        if self.is_cut and k in self.branches:
            return _BRANCHES[operation].format(*names, f"b{k}")
        if operation == "power" and self.graph.levels[k] == ANGLE:
            return f"raised({', '.join(names)})"
        if operation in forms:
            return forms[operation].format(*names)
        if operation in _SYMBOLS:
            return f" {_SYMBOLS[operation]} ".join(names)
        if operation in _FUNCTIONS or (self.graph.levels[k] < ANGLE and operation in _FORMULA_NAMES):
            return f"{operation}({', '.join(names)})"
        what = "jumps where a motion turns back" if operation in SENSES else f"takes {operation} of what moves"
        raise UnprovedError(f"{self.name} {what} and cannot be certified: no enclosure is implemented")


def _written(arguments: Sequence[str], lines: list[str], results: list[str]) -> Callable[..., Any]:
    """The function of these lines."""
    last = f"    return ({''.join(f'{result}, ' for result in results)})"  # () where there are none
    text = "\n".join([f"def program({', '.join(arguments)}):", *lines, last])
    found: dict[str, Callable[..., Any]] = {}
    exec(text, _NAMES, found)  # noqa: S102  # the text has names and operations of a graph only
    return found["program"]


def _tightened(series: Any, about_middle: Any, offset: arb) -> Any:
    """A series about all angles near a middle, whose coefficients but the last follow from those about it too."""
    if not isinstance(series, arb_series):
        return series
    terms, others = coefficients(series), coefficients(about_middle)
    if not all(term.is_finite() for term in terms[-1:] + others):
        return series
    others[-1] = terms[-1]
    for k in range(TERMS - 1):
        value = others[-1] * comb(TERMS - 1, k)
        for j in range(TERMS - 2, k - 1, -1):
            value = value * offset + comb(j, k) * others[j]
        terms[k] = terms[k].intersection(value) if terms[k].is_finite() else value
    return arb_series(terms, TERMS)


def _constant(value: float, rest: float) -> arb:
    """A constant with what its value is rounded by, which is rounded itself."""
    return arb(value) + arb(rest) + arb(0, abs(rest) * 2.0**-52) if rest else arb(value)


def _or_nowhere(function: Callable[..., arb | None]) -> Callable[..., arb]:
    def call(*numbers: arb) -> arb:
        value = function(*numbers)
        return NOWHERE if value is None else value

    return call


#: Operations that depend on the angle or not.
_FUNCTIONS = {LENGTHS: lengths, "abs": size, "max": maximum, "maximum": maximum, "minimum": minimum}
#: Names in formulas of operations that do not depend on the angle.
_FORMULA_NAMES = {"power": "**"} | {name: name for name in ("sin", "cos", "tan", "log", "exp", "atan2", "hypot")}
#: Functions that written functions call, by their names.
_NAMES = {
    **_FUNCTIONS, "choose": choose, "raised": raised, "root": root, "box_root": box_root, "divide": divide,
    "angle": angle, "angle_series": angle_series, "tightened": _tightened, "constant": _constant,
    "nan": math.nan, "inf": math.inf,
    **{name: _or_nowhere((UNARY | BINARY)[other]) for name, other in _FORMULA_NAMES.items()},
}  # fmt: skip
