"""Numbers of a graph as the text of functions: what a design has, and what one of its angles has, in all lanes."""

import math
from collections.abc import Callable, Mapping, Sequence

from explore.base.lanes.disturbance import PERIOD
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
#: Row of the constant with the half-tangent of the reversal of the output at its least place.
LEAST_ROW = 1
#: Row of the constant with that at its greatest place.
GREATEST_ROW = 2
#: Row of the first reference.
_FIRST_REFERENCE = 3
#: Longest expression that is written into the one that uses it, characters.
_LONGEST = 160


class Rows:
    """Constants of a design: the numbers that do not depend on the angle, and that functions of the angle use."""

    def __init__(self, graph: Graph, links: Sequence[str]) -> None:
        self._graph = graph
        self._rows: dict[int, int] = {}
        self._references = {f"{REFERENCE}{link}:{part}": None for link in links for part in range(3)}
        # The rows before are written at the end; references follow one after the other, whether used or not.
        for row, name in enumerate(self._references, _FIRST_REFERENCE):
            self._rows[graph.input(name).index] = row

    @property
    def count(self) -> int:
        """Number of constants."""
        return _FIRST_REFERENCE + len(self._rows)

    @property
    def first_reference(self) -> int:
        """The first of the three rows of the first link's reference."""
        return _FIRST_REFERENCE

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
        """Statements that compute the constants of one lane from the rows of parameters."""
        graph, texts, lines = self._graph, {}, []
        wanted = [Number(graph, k) for k in self._rows if not self.is_reference(k)]
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

    def is_reference(self, k: int) -> bool:
        """Whether a number is one of a link's reference, which `close` fills last."""
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
    rows: Rows, outputs: Sequence[Number], place: str, computes: Callable[[Graph, int], bool] = _is_of_angle,
    factor: str = "",
) -> list[str]:  # fmt: skip
    """Statements that fill rows of one lane at one angle; what is used once is written where it is used.

    `computes` tells numbers that are computed from those that are read, and `factor`, if there is one, what disturbs
    the operation of a number.
    """
    graph = outputs[0].graph
    order = [k for k in graph.needed(outputs) if computes(graph, k) and not rows.is_reference(k)]
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


def node_function(name: str, rows: Rows, outputs: Sequence[Number]) -> str:
    """A subroutine that fills rows at one node of each lane, which has an anchor of its own."""
    lines = "\n".join(f"        {line}" for line in _body(rows, outputs, "out"))
    angle = "\n".join(line[4:] for line in _ANGLE.format(tangent="tangents[lane]").splitlines())
    return (
        f"\n\n@subroutine(fast=True, no_alias=True)\ndef {name}(constants, tangents, anchors, out):\n"
        "    for lane in range(LANES):\n        anchor = anchors[lane]\n        mirror = 1.0 - 2.0 * anchor\n"
        f"{angle}\n{lines}\n"
    )


def fill_function(rows: Rows, outputs: Sequence[Number]) -> str:
    """The function that fills the rows of the signals."""
    return _all_nodes("fill", "", _body(rows, outputs, "here"), len(outputs))


def disturbed_function(rows: Rows, outputs: Sequence[Number]) -> str:
    """Like `fill`, from the parameters on; see `explore.base.lanes.disturbance`."""
    lines = _body(rows, outputs, "here", _is_computed, "factors[{}]")
    return _all_nodes("disturbed_fill", "        factors = DISTURBANCES[first_factor(j) :]\n", lines, len(outputs))


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
