"""The graph of a linkage in balls: numbers of it at input angles that are real, complex, or power series.

The numbers of a table become inputs before the graph is traced, so that no operation on them is folded to a double.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any

from flint import acb, arb, arb_series

from explore.analysis.certifying.analytic import TERMS, coefficients
from explore.analysis.certifying.ball_programs import Program
from explore.analysis.certifying.balls import UnprovedError
from explore.mechanisms.linkages.coordinate import ZERO, Coordinate
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.signals import find_quantities
from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import LinkageTable

#: Kind of functions that name numbers of a table as signals, `Declaration.table_signals`.
NamedSignals = Callable[[Equations, Mapping[str, Quantity]], dict[str, Quantity]]
#: Beginning of the names of inputs that are numbers.
_NUMBER = "="
#: Largest number of tables whose graphs are kept.
_MOST_KEPT = 16


@lru_cache(_MOST_KEPT)
def trace(table: LinkageTable, none: frozenset[str] = frozenset(), named: NamedSignals | None = None) -> TracedTable:
    """The graph of a linkage; the loads that these parameters are, are 0, and other signals have names too."""
    loads = table.loads and _with_none(table.loads, none)
    equations = Equations(_with_inputs(replace(table, loads=loads)), find_steps(table))
    equations.graph.is_exact = True
    own = {each.signal.name: each for each in find_quantities(equations)}
    others = named(equations, own) if named else {}
    renamed = {name: replace(each, signal=replace(each.signal, name=name)) for name, each in others.items()}
    return TracedTable(equations, own | renamed, {})


def _with_none(value: Any, none: frozenset[str]) -> Any:
    """The same parts of loads with 0 in place of each of these parameters."""
    if isinstance(value, Coordinate):
        return ZERO if len(value.steps) == 1 and {*value.names} & none else value
    return _each(value, lambda part: _with_none(part, none))


def _each(value: Any, function: Callable[[Any], Any]) -> Any:
    """Nested parts of a table with a function of each."""
    if isinstance(value, tuple):
        return tuple(map(function, value))
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: function(getattr(value, each.name)) for each in fields(value)})
    return value


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
    return _each(value, _with_inputs)


@dataclass(frozen=True)
class TracedTable:
    """The equations of a linkage, its signals by name, and programs of its graph."""

    equations: Equations
    quantities: dict[str, Quantity]
    programs: dict[tuple[tuple[int, ...], str, bool], Program]

    def program(self, numbers: Sequence[Number], name: str, *, is_cut: bool) -> Program:
        """The program of some numbers, which sentences call by a name."""
        key = tuple(number.index for number in numbers), name, is_cut
        if key not in self.programs:
            self.programs[key] = Program(self.equations.graph, *key)
        return self.programs[key]


class BallGraph:
    """The graph of a linkage of exact parameters, at the precision that is set."""

    def __init__(self, table: LinkageTable, parameters: Mapping[str, Any], named: NamedSignals | None = None) -> None:
        none = frozenset(name for name in table.load_names if parameters.get(name) == 0)  # not those of curves
        self._traced, self._parameters = trace(table, none, named), parameters
        self.equations, self.quantities = self._traced.equations, self._traced.quantities

    def function(
        self, numbers: Sequence[Number], references: Mapping[str, arb] | None = None, name: str = "the linkage",
        signs: Mapping[int, int | arb] | None = None,
    ) -> Function:  # fmt: skip
        """Numbers, called by a name, as a function of the input angle, on which `references` do not depend.

        With `signs` of the decisions of branches, which others need not have.
        """
        program = self._traced.program(numbers, name, is_cut=signs is not None)
        if any(name not in (references or {}) for name in program.references):
            words = "depends on an end of the stroke"
            raise UnprovedError(f"{program.name} {words} and cannot be certified: no enclosure is implemented")
        given = [references[name] for name in program.references] if references else []
        parameters = [
            arb(float(name[1:]) if name[0] == _NUMBER else self._parameters[name]) for name in program.parameters
        ]
        branches = [signs[k] for k in program.branches] if signs is not None else []
        return Function(program, (*given, *program.of_design(*parameters), *branches))

    def cut_program(self, number: Number, name: str) -> Program:
        """The program of a number, called by a name, to which the signs of decisions are given."""
        return self._traced.program([number], name, is_cut=True)

    def place_of_frame(self, point: str) -> Sequence[arb]:
        """The coordinates of a point that does not move, mm."""
        return self.function([part.terms[0] for part in self.equations.points[point]]).at(arb(0))


@dataclass(frozen=True)
class Function:
    """Numbers of a graph as a function of the input angle.

    Attributes
    ----------
    program
        The operations.
    known
        Numbers that do not depend on the angle, and signs of branches.
    """

    program: Program
    known: tuple[arb | int, ...]

    def at(self, angle: arb | acb) -> Sequence[Any]:
        """The numbers at an angle, rad; no finite ones where they are undefined or, in a box, not analytic."""
        sine, cosine = angle.sin_cos()
        if isinstance(angle, acb):
            return self.program.of_boxes(cosine, sine, angle, *(angle / 2).sin_cos(), *self.known)
        return self.program.of_numbers(cosine, sine, angle, *self.known)

    def value(self, angle: Any) -> Any:
        """The first number at an angle."""
        return self.at(angle)[0]

    def expanded(self, angle: arb) -> Sequence[arb_series | arb]:
        """The numbers as power series about an angle."""
        return self.program.of_series(*_inputs_at(angle), *self.known)

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients of each number about an angle."""
        return [coefficients(value) for value in self.expanded(angle)]

    def pairs_over(self, middle: arb, half: arb) -> Sequence[tuple[arb_series | arb, arb_series | arb]]:
        """The numbers as power series about an angle, and about all angles near it."""
        offset = arb(0, half.upper())
        inputs = (*_inputs_at(middle), *_inputs_at(middle + offset))
        return self.program.of_cells(offset, *inputs, *self.known)

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """Taylor coefficients of each number about an angle; the last one is that about all angles near it."""
        return [
            [*coefficients(about_middle)[:-1], coefficients(over)[-1]]
            for about_middle, over in self.pairs_over(middle, half)
        ]


def _inputs_at(angle: arb) -> tuple[arb_series, arb_series, arb_series]:
    """Cosine, sine and the angle itself as power series about an angle."""
    s, c = angle.sin_cos()
    return (
        arb_series([c, -s, -c / 2, s / 6, c / 24][:TERMS], TERMS),
        arb_series([s, c, -s / 2, -c / 6, s / 24][:TERMS], TERMS),
        arb_series([angle, 1], TERMS),
    )
