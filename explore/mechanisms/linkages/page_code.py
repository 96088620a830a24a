"""Programs in JavaScript, for a page: functions of one design in place of LANES."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.disturbance import FACTORS, OF_TANGENTS, PERIOD, STEP
from explore.base.lanes.elementary import exact_sum
from explore.mechanisms.linkages.closing import Sizes, close_designs
from explore.mechanisms.linkages.degrees import cosine_of_degrees, degrees_of, sine_of_degrees, tangent_of_degrees
from explore.mechanisms.linkages.following import GROUP_ROWS, follow
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, SENSES
from explore.mechanisms.linkages.mark_errors import bound_marks
from explore.mechanisms.linkages.programs import EXACT, Operation, Program

#: Function that gives the word of JavaScript for a function of Python.
WordOf = Callable[[Any], str]

_SYMBOLS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "power": "**"}
_CALLS = {
    "sqrt": math.sqrt, "abs": abs, "max": max, "maximum": max, "minimum": min, "exact_sum": exact_sum,
    "arctangent": arctangent, "sin": sine_of_degrees, "cos": cosine_of_degrees, "tan": tangent_of_degrees,
    "atan2": degrees_of, "log": math.log, "exp": math.exp, "hypot": math.hypot,
}  # fmt: skip


def design_function(program: Program, word_of: WordOf) -> str:
    """A function of the rows of parameters and of constants."""
    return "\n".join(["(read, written) => {", *_lines(program, word_of), "}"])


def node_function(program: Program, word_of: WordOf) -> str:
    """A function of the constants, of the half-tangent and the anchor, and of the rows to fill."""
    head = "(read, tangents, anchors, written) => {\nconst tangent = tangents[0], anchor = anchors[0];"
    return "\n".join([head, *_lines(program, word_of), "}"])


def fill_function(name: str, program: Program, word_of: WordOf, before: str = "", rows_before: int = 0) -> str:
    """A function as `explore.model.mechanism.Mechanism.fill`; for `before` see `vector_code`."""
    head = f"function {name}(read, tangents, anchor, law, variant, count, needs, out) {{"
    node = f"const tangent = tangents[j], row = j * {rows_before + len(program.writes)};"
    passed = "read, tangents.subarray(j), anchor, law, variant, 1, needs, out.subarray(row)"
    called = [f"if (needs) {before}({passed});"] if before else []
    written = f"const written = out.subarray(row + {rows_before});"
    return "\n".join(
        [head, "for (let j = 0; j < count; j++) {", node, *called, written, *_lines(program, word_of), "}", "}"]
    )


def disturbed_function(program: Program, word_of: WordOf) -> str:
    """A function as `fill_function` gives, of disturbed operations."""
    head = f"(read, tangents, anchor, law, variant, count, needs, out) => {{\nconst factors = {FACTORS.tolist()};"
    factor = f"const factor = {STEP} * j % {PERIOD}, written = out.subarray(j * {len(program.writes)});"
    node = f"const tangent = tangents[j] * ({OF_TANGENTS} * factors[factor] - {OF_TANGENTS - 1.0});"
    lines = _lines(program, word_of, is_disturbed=True)
    return "\n".join([head, "for (let j = 0; j < count; j++) {", factor, node, *lines, "}", "}"])


def close_function_after(name: str, called: str, design: str, constants: int, own: int) -> str:
    """A function as `vector_code.close_function_after`."""
    lines = [f"{called}(record.subarray({own}));", f"record.copyWithin(0, {own}, {own + constants});"]
    return "\n".join([f"function {name}(record) {{", *lines, f"({design})(record, record);", "}"])


def close_function(
    name: str, word_of: WordOf, sizes: Sizes, tables: Sequence[Sequence[float]], functions: Sequence[str],
    disturbed_rate: str,
) -> str:  # fmt: skip
    """A function of a record, as `calling_code.close_function`."""
    members = ", ".join(f"{key}: {value}" for key, value in sizes._asdict().items())
    passed = ", ".join([*(f"new Float64Array({list(each)})" for each in tables), *functions])
    lines = [f"{word_of(close_designs)}(record, {{{members}}}, {passed});"]
    if sizes.has_strokes:
        lines.append(f"{word_of(bound_marks)}(record, {sizes.interval + 2}, {disturbed_rate});")
    return "\n".join([f"function {name}(record) {{", *lines, "}"])


def _lines(program: Program, word_of: WordOf, *, is_disturbed: bool = False) -> Iterator[str]:
    texts = {k: f"read[{row}]" for k, row in program.reads.items()}
    texts |= {k: _literal(value) for k, value in program.literals.items()}
    for k in program.rests if is_disturbed else ():
        texts[k] = f"({texts[k]} * factors[factor + {k % PERIOD}])"
    for operation in program.operations:
        k = operation.result
        texts[k], parts = f"t{k}" if k >= 0 else f"a{~k}", [texts[each] for each in operation.operands]
        if operation.name in FOLLOWS:
            first = program.first_group + FOLLOWS.index(operation.name) * GROUP_ROWS
            passed = f"read, {first}, 1, [{parts[0]}], [{parts[1]}], {texts[k]}rows"
            yield f"const {texts[k]}rows = new Float64Array({1 + len(PARTS)});\n{word_of(follow)}({passed});"
        value = _expression(operation, parts, word_of, texts[k])
        if is_disturbed and k >= 0 and operation.name not in EXACT:
            value = f"({value}) * factors[factor + {k % PERIOD}]"
        yield f"const {texts[k]} = {value};"
    for row, k in program.writes:
        yield f"written[{row}] = {texts[k]};"


def _literal(value: float) -> str:
    if math.isinf(value):
        return "Infinity" if value > 0.0 else "(-Infinity)"
    return f"({value!r})" if math.isfinite(value) else "NaN"


def _expression(operation: Operation, parts: list[str], word_of: WordOf, result: str) -> str:
    match operation.name:
        case name if name in FOLLOWS:
            return f"{result}rows[0]"
        case name if name in PARTS:
            return f"{parts[0]}rows[{1 + PARTS.index(name)}]"
        case "input":
            return parts[0]
        case "tangent":
            return "tangent"
        case name if name in SENSES:
            code = f"(law >> {2 * SENSES.index(name)} & 3)"
            return f"({code} == 0 ? ({parts[0]} < 0 ? -1 : 1) : 3 - 2 * {code})"
        case "mirror":
            return "(anchor == 0 ? 1 : -1)"
        case "choose":
            return f"(anchor == 0 ? {parts[0]} : {parts[1]})"
        case "neg":
            return f"-{parts[0]}"
        case name if name in _SYMBOLS:
            return f"{parts[0]} {_SYMBOLS[name]} {parts[1]}"
        case name:
            return f"{word_of(_CALLS[name])}({', '.join(parts)})"
