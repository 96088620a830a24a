"""Numbers of a graph as programs: the operations that a function does one after the other, in whatever language."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from explore.mechanisms.linkages.following import GROUP_ROWS
from explore.mechanisms.linkages.graph import (
    ANGLE,
    COSINE,
    FOLLOWS,
    GREATEST_PLACE,
    LEAST_PLACE,
    PARTS,
    SENSES,
    SINE,
    VERSINES,
    Graph,
    Number,
    operands,
)
from explore.mechanisms.linkages.trace import REFERENCE

#: Operations that round nothing.
EXACT = frozenset({"neg", "abs", "max", "maximum", "minimum", *SENSES, *FOLLOWS, *PARTS})
#: Row of the error of the lengths of strokes, relative, or of the ends of intervals of assembly of a blocked one, rad.
CLOSED_ERROR_ROW = 0
#: Row of the constant with the half-tangent of the reversal of the output at its least place.
LEAST_ROW = 1
#: Row of the constant with that at its greatest place.
GREATEST_ROW = 2
#: Row of the constant with the middle of the interval that a design is moved over, rad; 1 for the turn.
MIDDLE_ROW = 3
#: Row of the constant with half its length, rad; 1 for the turn.
REACH_ROW = 4
#: Row of the constant with the least place or angle of the output, mm or rad.
LEAST_PLACE_ROW = 5
#: Row of the constant with the greatest one.
GREATEST_PLACE_ROW = 6
#: Row of the constant with the distance of the nearest singularity.
DISTANCE_ROW = 7
#: Row of the constant with the angle above which it stands, rad; not a number where that is not known.
SINGULAR_ANGLE_ROW = 8
#: Row of the constant with the distance of all other singularities, where that angle is known.
OTHERS_ROW = 9
#: Row of the first of three constants of each link's reference.
FIRST_REFERENCE = 10


class Operation(NamedTuple):
    """An operation on numbers, which gives the number `result`; "input" copies its operand."""

    result: int
    name: str
    operands: tuple[int, ...]


@dataclass(frozen=True)
class Program:
    """Operations that fill rows.

    Attributes
    ----------
    name
        Name of the function.
    operations
        In an order in which operands come first. "tangent" and "mirror" take the half-tangent of the angle, and 1 or -1
        for its anchor; "choose" gives its first operand at the anchor and its second at the opposite. Of
        `graph.SENSES` number k follows bits 2k and 2k + 1 of the law: 1 for 1, 2 for -1, 0 for the sign of the operand.
    literals, reads
        Values of numbers that are written out, and rows of numbers that are read.
    writes
        Row and number of each result, in the order of the rows.
    rests
        What the literals are rounded by, where that is not 0.
    first_group
        First of the constants that groups of links are followed by.
    """

    name: str
    operations: tuple[Operation, ...]
    literals: Mapping[int, float]
    reads: Mapping[int, int]
    writes: tuple[tuple[int, int], ...]
    rests: Mapping[int, float]
    first_group: int


class Rows:
    """Constants of a design, from the row `first` on: numbers that functions of the angle use, and not of the angle.

    Those of `groups` of links are behind the references of `links`.
    """

    def __init__(self, graph: Graph, links: Sequence[str], first: int = FIRST_REFERENCE, groups: int = 0) -> None:
        self._graph, self._first, self._of_groups = graph, first, groups * GROUP_ROWS
        self.first_group = first + 3 * len(links)
        # The rows before are written at the end; references follow one after the other, whether used or not.
        references = [graph.input(f"{REFERENCE}{link}:{part}").index for link in links for part in range(3)]
        self._rows = {k: row for row, k in enumerate(references, first)}
        for name, row in ((LEAST_PLACE, LEAST_PLACE_ROW), (GREATEST_PLACE, GREATEST_PLACE_ROW)):
            self._rows[graph.input(name).index] = row
        self._written_last = frozenset(self._rows)

    @property
    def count(self) -> int:
        """Number of constants, with those before."""
        return self._first - 2 + len(self._rows) + self._of_groups

    def add(self, outputs: Sequence[Number]) -> None:
        """Add the constants that outputs need."""
        graph = self._graph
        found = {output.index for output in outputs}
        for k in graph.needed(outputs):
            if graph.levels[k] == ANGLE:
                found.update(operands(graph.nodes[k]))
        for k in sorted(found):
            if graph.levels[k] < ANGLE and graph.nodes[k][0] != "constant":
                self._rows.setdefault(k, self.count)

    def add_parameters(self, outputs: Sequence[Number]) -> None:
        """Add the parameters that outputs need."""
        graph = self._graph
        for k in graph.needed(outputs):
            if graph.nodes[k][0] == "input" and graph.levels[k] < ANGLE:
                self._rows.setdefault(k, self.count)

    def of_design(self, name: str, parameters: Mapping[str, int]) -> Program:
        """The program that fills the constants from the rows of parameters."""
        writes = [(row, k) for k, row in self._rows.items() if k not in self._written_last]
        return self._of_record(name, writes, parameters)

    def of_ties(self, name: str, ties: Sequence[Number], parameters: Mapping[str, int]) -> Program:
        """The program that fills rows of the ties of groups from the rows of parameters."""
        return self._of_record(name, [(row, each.index) for row, each in enumerate(ties)], parameters)

    def _of_record(self, name: str, writes: Sequence[tuple[int, int]], parameters: Mapping[str, int]) -> Program:
        """The program that fills rows from the rows of parameters."""
        graph = self._graph
        order = graph.needed(Number(graph, k) for _, k in writes)
        reads = {k: parameters[str(graph.nodes[k][1])] for k in order if graph.nodes[k][0] == "input"}
        computed = [k for k in order if k not in reads]
        return _program(name, graph, computed, reads, writes, _inputs_of_angle(), self.first_group)

    def of_angle(self, name: str, outputs: Sequence[Number], *, quarters: int = 0, is_ray: bool = False) -> Program:
        """The program that fills outputs at an angle from the constants, its anchor so many quarters of a turn on.

        Of a ray cosine and sine of the angle are given, beside its half-tangent.
        """
        levels, angle = self._graph.levels, _inputs_of_angle(is_ray=is_ray, quarters=quarters)
        return self._at_angle(name, outputs, lambda k: levels[k] == ANGLE, angle)

    def from_parameters(self, name: str, outputs: Sequence[Number]) -> Program:
        """The same from the parameters among the constants."""
        graph = self._graph
        return self._at_angle(name, outputs, lambda k: graph.nodes[k][0] != "input" or graph.levels[k] == ANGLE)

    def _at_angle(
        self, name: str, outputs: Sequence[Number], computes: Callable[[int], bool], angle: _Angle | None = None
    ) -> Program:
        graph = self._graph
        waiting, order = [output.index for output in outputs], set[int]()
        while waiting:
            k = waiting.pop()
            if k not in order and computes(k) and k not in self._written_last:
                order.add(k)
                waiting += operands(graph.nodes[k])
        writes = [(row, each.index) for row, each in enumerate(outputs)]
        angle = angle or _inputs_of_angle()
        return _program(name, graph, sorted(order), self._rows, writes, angle, self.first_group)


def _program(
    name: str,
    graph: Graph,
    order: Iterable[int],
    rows: Mapping[int, int],
    writes: Sequence[tuple[int, int]],
    angle: _Angle,
    first_group: int,
) -> Program:
    """The program of the numbers of an order, which reads or writes out the others."""
    nodes, of_angle = graph.nodes, angle.graph.nodes
    computed = [k for k in order if nodes[k][0] != "constant"]
    used = {each for k in computed for each in operands(nodes[k])}.union(k for _, k in writes).difference(computed)
    inputs = [k for k in computed if nodes[k][0] == "input"]
    before = [
        Operation(~k, str(of_angle[k][1 if of_angle[k][0] == "input" else 0]),
                  tuple(~each for each in operands(of_angle[k])))
        for k in angle.graph.needed(angle.inputs[str(nodes[k][1])] for k in inputs) if of_angle[k][0] != "constant"
    ]  # fmt: skip
    operations = [
        Operation(k, "input", (~angle.inputs[str(nodes[k][1])].index,))
        if nodes[k][0] == "input"
        else Operation(k, str(nodes[k][0]), tuple(operands(nodes[k])))
        for k in computed
    ]
    literals = {k: float(nodes[k][1]) for k in used if nodes[k][0] == "constant"}
    literals |= {~k: float(node[1]) for k, node in enumerate(of_angle) if node[0] == "constant"}
    reads = {k: rows[k] for k in sorted(used) if nodes[k][0] != "constant"}
    rests = {k: float(nodes[k][2]) for k in literals if k >= 0 and nodes[k][2] != 0.0}
    return Program(name, (*before, *operations), literals, reads, tuple(sorted(writes)), rests, first_group)


class _Angle(NamedTuple):
    """The inputs of the angle as numbers of a graph of their own."""

    graph: Graph
    inputs: dict[str, Number]


@cache
def _inputs_of_angle(*, is_ray: bool = False, quarters: int = 0) -> _Angle:
    """The inputs from the half-tangent u of the angle, from the anchor or its opposite, and of a ray from more.

    The anchor is so many quarters of a turn on.
    """
    graph = Graph()
    u, mirror = graph.input("tangent"), graph.input("mirror")
    square = u * u
    # of the magnitude of the cosine, 1/(1 + u^2) = (1 + |cos|)/2
    inverse = graph.input("half.more") if is_ray else 1.0 / (1.0 + square)
    less, more, signed = (square + square) * inverse, inverse + inverse, mirror * inverse
    behind, ahead = (1.0 - u) * (1.0 - u) * inverse, (1.0 + u) * (1.0 + u) * inverse
    pairs = ((less, more), (behind, ahead), (more, less), (ahead, behind))
    versines = [one.call("choose", other) for one, other in pairs]
    cosine = graph.input("cosine") if is_ray else (1.0 - square) * signed
    sine = graph.input("sine") if is_ray else (u + u) * signed
    for _ in range(quarters):
        cosine, sine, versines = -sine, cosine, [versines[-1], *versines[:-1]]
    named = dict(zip(VERSINES, versines, strict=True))
    return _Angle(graph, {COSINE: cosine, SINE: sine, **named})
