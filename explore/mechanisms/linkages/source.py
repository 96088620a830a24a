"""The functions of a linkage as the text of a module, for the signals that are asked for.

Names of the table never enter the text: parameters, links and signals are rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from explore.base.lanes.disturbance import PERIOD
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import ANGLE, COSINE, SINE, VERSINES, Graph, Number, operands
from explore.mechanisms.linkages.signals import REFERENCE

_SYMBOLS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "power": "**"}
_INPUTS = {COSINE: "cosine", SINE: "sine", **{name: name[1:] for name in VERSINES}}
_CALLS = {
    "sqrt": "math.sqrt", "abs": "abs", "exact_sum": "exact_sum", "sin": "sine_of_degrees", "cos": "cosine_of_degrees",
    "tan": "tangent_of_degrees", "log": "math.log", "exp": "math.exp", "atan2": "degrees_of", "hypot": "math.hypot",
    "max": "larger", "maximum": "larger", "minimum": "smaller", "arctangent": "arctangent",
}  # fmt: skip
#: Operations that round nothing.
_EXACT = ("neg", "abs", "max", "maximum", "minimum")
#: Row of the constant with the distance of the nearest singularity.
DISTANCE_ROW = 0
#: Longest expression that is written into the one that uses it, characters.
_LONGEST = 160

_HEAD = '''"""Made from the table of a linkage by explore.mechanisms.linkages.source."""

import math

import numpy as np

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.disturbance import FACTORS, first_factor
from explore.base.lanes.elementary import exact_sum
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.degrees import (
    cosine_of_degrees,
    degrees_of,
    larger,
    sine_of_degrees,
    smaller,
    tangent_of_degrees,
)
from explore.mechanisms.linkages.turning import (
    DIRECTION_NODES,
    DOUBTFUL,
    MOST_CELLS,
    NODES,
    collect_cells,
    direction_node,
    follow_directions,
    halve_cells,
    locate,
    node_tangent,
    place_middles,
    place_references,
    sift,
)
'''

_CLOSE = """

@compiled(CLOSE_SIGNATURE, allocates=True)
def close(record):
    constants = np.empty({n_constants} * LANES)
    for lane in range(LANES):
{constants}
    values, tangents = np.empty(2 * NODES * {rows} * LANES), np.empty(LANES)
    verdicts = np.empty(LANES)
    for j in range(2 * NODES):
        for lane in range(LANES):
            tangents[lane] = node_tangent(j % NODES)
        check(constants, tangents, j // NODES, values[j * {rows} * LANES :])
    sift(values, {factors}, {functions}, verdicts)
    locate(values, {factors}, {functions}, constants[{distance} * LANES :])
    doubtful = 0
    for lane in range(LANES):
        doubtful += 1 if verdicts[lane] == DOUBTFUL else 0
    if doubtful > 0:
        tile, middles = np.empty({n_constants} * LANES), np.empty({rows} * LANES)
        cells, children = np.empty(MOST_CELLS * {cell}), np.empty(2 * LANES * {cell})
        for lane in range(LANES):
            if verdicts[lane] == DOUBTFUL:
                for row in range({n_constants}):
                    for other in range(LANES):
                        tile[row * LANES + other] = constants[row * LANES + lane]
                for half in range(2):
                    count = collect_cells(values, {factors}, {functions}, half, lane, cells)
                    while count > 0 and count < MOST_CELLS - LANES:
                        taken = place_middles(cells, {factors}, count, tangents)
                        check(tile, tangents, half, middles)
                        count, verdict = halve_cells(
                            cells, {factors}, {functions}, count, taken, middles, children
                        )
                        if verdict != DOUBTFUL and verdicts[lane] == DOUBTFUL:
                            verdicts[lane] = verdict
                    if count > 0 and verdicts[lane] == DOUBTFUL:
                        verdicts[lane] = 1.0 * {undecided}
                if verdicts[lane] == DOUBTFUL:
                    verdicts[lane] = 1.0
{references}
    for lane in range(LANES):
        verdict = verdicts[lane]
        status = STATUS_OF_FACTOR[0] + 1.0
        for s in range({factors}):
            status = 1.0 * STATUS_OF_FACTOR[s] if verdict == -1.0 - s else status
            status = 1.0 * STATUS_OF_FACTOR[s] + 1.0 if verdict == 2.0 + s else status
        status = {undecided} if verdict == {undecided} else status
        record[{status} * LANES + lane] = 1.0 if verdict == 1.0 else status
    for k in range({status} * LANES):
        record[k] = constants[k]
"""

_REFERENCES = """    directions, before = np.empty({two} * LANES), np.empty({two} * LANES)
    ranges = np.empty({five} * LANES)
    for j in range(DIRECTION_NODES + 1):
        tangent, anchor = direction_node(j)
        for lane in range(LANES):
            tangents[lane] = tangent
        direct(constants, tangents, anchor, directions)
        follow_directions(j, {links}, directions, before, ranges)
    place_references({links}, ranges, constants[{first} * LANES :])"""


@dataclass(frozen=True)
class Source:
    """The text of a module and the rows of its records.

    Attributes
    ----------
    text
        Defines `close`, `fill` and `disturbed_fill`.
    n_constants
        Constants of a design that `fill` reads; `close` computes more than it keeps.
    """

    text: str
    n_constants: int


def write_source(
    equations: Equations, outputs: Sequence[Number], links: Sequence[str], joints: Sequence[str], first_status: int
) -> Source:
    """Write the functions that fill these rows of signals.

    Parameters
    ----------
    outputs
        Rows of the signals.
    links
        Links whose angles are among them, in the order of their references.
    joints
        Joints in the order of their statuses: `first_status` is that of a crank blocked at the first one, the next that
        of two assemblies that meet there, and so on; the last is that of a turn that is not decided.
    """
    graph = equations.graph
    checks = _check_rows(equations)
    directions = [term.terms[0] for link in links for term in equations.directions[link]]
    rows = _Rows(graph, links)
    rows.add(outputs)
    rows.add_parameters(outputs)
    n_fill = rows.count
    rows.add(checks)
    rows.add(directions)
    factors, n_constants = len(equations.factors), rows.count
    status = n_fill
    parameters = {p.name: status + 1 + k for k, p in enumerate(equations.table.parameters)}
    undecided = first_status + 2 * len(joints)
    statuses = [first_status + 2 * joints.index(factor.joint) for factor in equations.factors]
    parts = [
        _HEAD,
        f"\nSTATUS_OF_FACTOR = ({', '.join(map(str, statuses))},)\n",
        _node_function("check", rows, checks),
        _node_function("direct", rows, directions) if links else "",
        _CLOSE.format(
            constants="\n".join(rows.constant_lines(parameters)), rows=len(checks), factors=factors,
            n_constants=n_constants, cell=2 + 4 * factors, distance=DISTANCE_ROW,
            functions=factors + len(equations.squares), undecided=undecided,
            status=status, references=_references(rows, links),
        ),
        _fill_function(rows, outputs),
        _disturbed_function(rows, outputs),
    ]  # fmt: skip
    return Source("".join(parts), n_fill)


def _references(rows: _Rows, links: Sequence[str]) -> str:
    if not links:
        return ""
    first = rows.row_of_reference(links[0])
    return _REFERENCES.format(two=2 * len(links), five=5 * len(links), links=len(links), first=first)


def _check_rows(equations: Equations) -> list[Number]:
    """The rows that `turning` takes."""
    zero = equations.graph.constant(0.0)
    factors = equations.factors
    functions = [*(factor.value for factor in factors), *equations.squares]
    return [
        *(function.terms[0] for function in functions),
        *(function.terms[1] for function in functions),
        *(factor.size or zero for factor in factors),
    ]


class _Rows:
    """Constants of a design: the numbers that do not depend on the angle, and that functions of the angle use."""

    def __init__(self, graph: Graph, links: Sequence[str]) -> None:
        self._graph = graph
        self._rows: dict[int, int] = {}
        self._references = {f"{REFERENCE}{link}:{part}": None for link in links for part in range(3)}
        # Row 0 is written at the end; references follow one after the other, whether used or not.
        for row, name in enumerate(self._references, 1):
            self._rows[graph.input(name).index] = row

    @property
    def count(self) -> int:
        """Number of constants."""
        return 1 + len(self._rows)

    def row_of_reference(self, link: str) -> int:
        """The first of the three rows of a link's reference."""
        return self._rows[self._graph.input(f"{REFERENCE}{link}:0").index]

    def add(self, outputs: Sequence[Number]) -> None:
        """Add the constants that outputs need."""
        graph = self._graph
        found = {output.index for output in outputs}
        for k in graph.needed(outputs):
            if graph.levels[k] == ANGLE:
                found.update(operands(graph.nodes[k]))
        for k in sorted(found):
            if graph.levels[k] < ANGLE and graph.nodes[k][0] != "constant" and k not in self._rows:
                self._rows[k] = self.count

    def add_parameters(self, outputs: Sequence[Number]) -> None:
        """Add the parameters that outputs need."""
        graph = self._graph
        for k in graph.needed(outputs):
            if graph.nodes[k][0] == "input" and graph.levels[k] < ANGLE:
                self._rows.setdefault(k, self.count)

    def operand(self, k: int) -> str:
        """How a function of the angle reads a number that it does not compute."""
        node = self._graph.nodes[k]
        return _literal(float(node[1])) if node[0] == "constant" else f"constants[{self._rows[k]} * LANES + lane]"

    def constant_lines(self, parameters: Mapping[str, int]) -> list[str]:
        """Statements that compute the constants of one lane."""
        graph, texts, lines = self._graph, {}, []
        wanted = [Number(graph, k) for k in self._rows if not self._is_reference(k)]
        for k in graph.needed(wanted):
            node = graph.nodes[k]
            if node[0] == "constant":
                texts[k] = _literal(float(node[1]))
                continue
            if node[0] == "input":
                body = f"record[{parameters[str(node[1])]} * LANES + lane]"
            else:
                body = _expression(str(node[0]), [texts[each] for each in operands(node)])
            texts[k] = f"d{k}"
            lines.append(f"        d{k} = {body}")
        lines += [
            f"        constants[{row} * LANES + lane] = {texts[k]}" for k, row in self._rows.items() if k in texts
        ]
        return lines or ["        pass"]

    def _is_reference(self, k: int) -> bool:
        node = self._graph.nodes[k]
        return node[0] == "input" and node[1] in self._references


def _literal(value: float) -> str:
    return f"({value!r})" if math.isfinite(value) else "math.nan"


def _expression(operation: str, parts: list[str]) -> str:
    if operation == "neg":
        return f"(-{parts[0]})"
    if operation in _SYMBOLS:
        return f"({parts[0]} {_SYMBOLS[operation]} {parts[1]})"
    return f"{_CALLS[operation]}({', '.join(parts)})"


def _is_of_angle(graph: Graph, k: int) -> bool:
    return graph.levels[k] == ANGLE


def _is_computed(graph: Graph, k: int) -> bool:
    """Whether a number is neither written out nor a parameter."""
    return graph.nodes[k][0] != "constant" and (graph.nodes[k][0] != "input" or graph.levels[k] == ANGLE)


def _body(
    rows: _Rows, outputs: Sequence[Number], place: str, computes: Callable[[Graph, int], bool] = _is_of_angle,
    factor: str = "",
) -> list[str]:  # fmt: skip
    """Statements that fill rows of one lane at one angle; what is used once is written where it is used.

    `computes` tells numbers that are computed from those that are read, and `factor`, if there is one, what disturbs
    the operation of a number.
    """
    graph = outputs[0].graph
    order = [k for k in graph.needed(outputs) if computes(graph, k)]
    uses: dict[int, int] = {}
    for k in order:
        for each in operands(graph.nodes[k]):
            uses[each] = uses.get(each, 0) + 1
    wanted, lines = {output.index for output in outputs}, []
    texts: dict[int, str] = {}
    for k in order:
        node = graph.nodes[k]
        if node[0] == "input":
            text = _INPUTS[str(node[1])]
        else:
            text = _expression(str(node[0]), [texts.get(each) or rows.operand(each) for each in operands(node)])
        if factor and node[0] not in _EXACT:
            text = f"({text} * {factor.format(k % PERIOD)})"
        elif node[0] == "input":
            texts[k] = text
            continue
        if uses.get(k, 0) > 1 or k in wanted or len(text) > _LONGEST:
            lines.append(f"t{k} = {text}")
            text = f"t{k}"
        texts[k] = text
    for row, output in enumerate(outputs):
        text = texts.get(output.index) or rows.operand(output.index)
        lines.append(f"{place}[{row} * LANES + lane] = {text}")
    return lines


#: The inputs of the angle, from the half-tangent u: from the anchor itself, or from its opposite.
_ANGLE = """            u = {tangent}
            square = u * u
            inverse = 1.0 / (1.0 + square)
            less, more = 2.0 * square * inverse, 2.0 * inverse
            behind, ahead = (1.0 - u) * (1.0 - u) * inverse, (1.0 + u) * (1.0 + u) * inverse
            cosine, sine = mirror * (1.0 - square) * inverse, mirror * 2.0 * u * inverse
            versine0, versine2 = less if anchor == 0 else more, more if anchor == 0 else less
            versine1, versine3 = behind if anchor == 0 else ahead, ahead if anchor == 0 else behind"""


def _node_function(name: str, rows: _Rows, outputs: Sequence[Number]) -> str:
    """A subroutine that fills rows at one node of each lane."""
    lines = "\n".join(f"        {line}" for line in _body(rows, outputs, "out"))
    angle = "\n".join(line[4:] for line in _ANGLE.format(tangent="tangents[lane]").splitlines())
    return (
        f"\n\n@subroutine(fast=True, no_alias=True)\ndef {name}(constants, tangents, anchor, out):\n"
        f"    mirror = 1.0 if anchor == 0 else -1.0\n    for lane in range(LANES):\n{angle}\n{lines}\n"
    )


def _fill_function(rows: _Rows, outputs: Sequence[Number]) -> str:
    return _all_nodes("fill", "", _body(rows, outputs, "here"), len(outputs))


def _disturbed_function(rows: _Rows, outputs: Sequence[Number]) -> str:
    """Like `fill`, from the parameters on; see `explore.base.lanes.disturbance`."""
    lines = _body(rows, outputs, "here", _is_computed, "factors[{}]")
    return _all_nodes("disturbed_fill", "        factors = FACTORS[first_factor(j) :]\n", lines, len(outputs))


def _all_nodes(name: str, of_node: str, lines: Sequence[str], rows: int) -> str:
    """A function that fills rows at all nodes of each lane."""
    body = "\n".join(f"            {line}" for line in lines)
    return (
        f"\n\n@compiled(FILL_SIGNATURE, fast=True, no_alias=True)\n"
        f"def {name}(constants, tangents, anchor, _law, _variant, count, _needs, out):\n"
        "    mirror = 1.0 if anchor == 0 else -1.0\n    for j in range(count):\n"
        f"        here = out[j * {rows} * LANES :]\n{of_node}        for lane in range(LANES):\n"
        f"{_ANGLE.format(tangent='tangents[j * LANES + lane]')}\n{body}\n"
    )
