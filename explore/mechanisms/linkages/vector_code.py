"""Programs as LLVM's language: functions that Numba's compiled functions call, WIDTH designs at once.

A function has Numba's calling convention of C: arrays are passed as their structures, and the result is a null pointer.
"""

import struct
from collections.abc import Iterable, Iterator, Sequence

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import FACTORS, PERIOD, STEP
from explore.mechanisms.linkages.closing import Sizes
from explore.mechanisms.linkages.operations import CODES, MOST_OPERANDS, WIDTH
from explore.mechanisms.linkages.programs import EXACT, Operation, Program

#: Numba's structure of an array.
_ARRAY = "{ptr, ptr, i64, i64, ptr, [1 x i64], [1 x i64]}"

#: Numba's structure of a function.
_FUNCTION = "{ptr, ptr, ptr}"

#: Type of WIDTH designs.
_VECTOR = f"<{WIDTH} x double>"

#: Number of vectors of a row.
_PARTS = LANES // WIDTH

#: Permissions to reorder sums and products; see `explore.base.compiling`.
_FAST = "reassoc nsz arcp contract "

#: Symbol of `operations.operate`.
OPERATE = "explore_linkage_operate"

#: Symbol of `closing.close_designs`.
CLOSE = "explore_linkage_close"

_SYMBOLS = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_INTRINSICS = {"sqrt": "sqrt", "abs": "fabs", "max": "maximum", "maximum": "maximum", "minimum": "minimum"}

#: Declarations of what functions call.
HEAD = f"declare ptr @{OPERATE}(i64{', ptr' * (MOST_OPERANDS + 1)})\n" + "".join(
    f"declare {_VECTOR} @llvm.{name}.v{WIDTH}f64({', '.join([_VECTOR] * count)})\n"
    for name, count in (("sqrt", 1), ("fabs", 1), ("maximum", 2), ("minimum", 2))
)


def design_function(program: Program) -> str:
    """A function of the rows of parameters and of constants."""
    return _function(program, ("read", "written"), "1", "", "", "")


def node_function(program: Program) -> str:
    """A function of the constants, of half-tangents and of anchors of all lanes, and of the rows to fill."""
    anchor = f"  %anchor.at = getelementptr double, ptr %anchors, i64 %i.lane\n{_load('%anchor', '%anchor.at')}"
    arguments = ("read", "tangents", "anchors", "written")
    return _function(program, arguments, "1", anchor, _FAST, "")


def fill_function(program: Program, *, is_disturbed: bool) -> str:
    """A function as `explore.model.mechanism.Mechanism.fill`, or `disturbed_fill`."""
    first = f"  %first.step = mul i64 %i.node, {STEP}\n  %first = urem i64 %first.step, {PERIOD}\n"
    anchor = "  %anchor.one = sitofp i64 %anchor.number to double\n" + _spread("%anchor", "%anchor.one")
    arguments = ("read", "tangents", "anchor.number:", "law:", "variant:", "count:", "needs:", "written")
    table = _table("factors", FACTORS) if is_disturbed else ""
    return table + _function(program, arguments, "%count", anchor, _FAST, first if is_disturbed else "")


def close_function(sizes: Sizes, blocked: Sequence[float], functions: Sequence[str]) -> str:
    """A function of a record, which calls `closing.close_designs` with these arguments; "" stands for no function."""
    count = len(blocked)
    array = f"ptr null, ptr null, i64 {count}, i64 8, ptr @blocked, [1 x i64] [i64 {count}], [1 x i64] [i64 8]"
    arguments = [
        (_ARRAY, "%record"),
        (f"[{len(sizes)} x i64]", f"[{', '.join(f'i64 {size}' for size in sizes)}]"),
        (_ARRAY, f"{{{array}}}"),
        *((_FUNCTION, f"{{ptr {f'@{name}' if name else 'null'}, ptr null, ptr null}}") for name in functions),
    ]
    return (
        f"{_table('blocked', blocked)}declare ptr @{CLOSE}({', '.join(kind for kind, _ in arguments)})\n"
        f"define ptr @close({_ARRAY} %record) {{\n"
        f"  %null = call ptr @{CLOSE}({', '.join(f'{kind} {value}' for kind, value in arguments)})\n"
        "  ret ptr null\n}\n"
    )


def _table(name: str, values: Iterable[float]) -> str:
    """A constant array."""
    numbers = [f"double {_hex(value)}" for value in values]
    return f"@{name} = private constant [{len(numbers)} x double] [{', '.join(numbers)}]\n"


def _function(
    program: Program, arguments: tuple[str, ...], count: str, anchor: str, flags: str, disturbance: str
) -> str:
    arrays = [name for name in arguments if not name.endswith(":")]
    declared = [f"i64 %{name[:-1]}" if name.endswith(":") else f"{_ARRAY} %{name}.array" for name in arguments]
    pointers = "".join(f"  %{name} = extractvalue {_ARRAY} %{name}.array, 4\n" for name in arrays)
    calls = any(operation.name in CODES for operation in program.operations)
    scratch = "".join(f"  %slot{k} = alloca {_VECTOR}\n" for k in range(MOST_OPERANDS + 1)) if calls else ""
    tangent = (
        f"  %i.tangent = mul i64 %i, {WIDTH}\n  %tangent.at = getelementptr double, ptr %tangents, i64 %i.tangent\n"
        + _load("%tangent", "%tangent.at")
        if "tangents" in arguments
        else ""
    )
    body = "\n".join(_Body(program, flags, is_disturbed=bool(disturbance)).lines())
    return (
        f"define ptr @{program.name}({', '.join(declared)}) nounwind {{\nentry:\n{pointers}{scratch}"
        f"  %end = mul i64 {count}, {_PARTS}\n  %empty = icmp sle i64 %end, 0\n"
        f"  br i1 %empty, label %done, label %next\nnext:\n"
        f"  %i = phi i64 [0, %entry], [%i.after, %next]\n  %i.part = urem i64 %i, {_PARTS}\n"
        f"  %i.node = udiv i64 %i, {_PARTS}\n  %i.lane = mul i64 %i.part, {WIDTH}\n"
        f"  %i.row = mul i64 %i.node, {len(program.writes) * LANES}\n  %i.written = add i64 %i.row, %i.lane\n"
        f"{tangent}{anchor}{disturbance}{body}\n"
        f"  %i.after = add i64 %i, 1\n  %more = icmp slt i64 %i.after, %end\n"
        f"  br i1 %more, label %next, label %done\ndone:\n  ret ptr null\n}}\n\n"
    )


class _Body:
    """The operations of a program."""

    def __init__(self, program: Program, flags: str, *, is_disturbed: bool) -> None:
        self._program, self._flags, self._is_disturbed = program, flags, is_disturbed
        self._texts = {k: _splat(value) for k, value in program.literals.items()}

    def lines(self) -> Iterator[str]:
        """Statements, and stores of results as soon as they are known."""
        if any(operation.name in ("mirror", "choose") for operation in self._program.operations):
            yield f"  %opposite = fcmp une {_VECTOR} %anchor, {_splat(0.0)}"
        rows: dict[int, list[int]] = {}
        for row, k in self._program.writes:
            rows.setdefault(k, []).append(row)
        for operation in self._program.operations:
            for each in operation.operands:
                yield from self._read(each)
            yield from self._operate(operation)
            for row in rows.pop(operation.result, ()):
                yield self._store(row, operation.result)
        for k, others in rows.items():
            yield from self._read(k)
            for row in others:
                yield self._store(row, k)

    def _store(self, row: int, k: int) -> str:
        place = f"%written{row}"
        return f"{_place(place, 'written', row)}  store {_VECTOR} {self._texts[k]}, ptr {place}, align 8"

    def _read(self, k: int) -> Iterator[str]:
        if k not in self._texts:
            row = self._program.reads[k]
            self._texts[k] = f"%read{row}"
            yield _place(f"%read{row}.at", "read", row) + _load(f"%read{row}", f"%read{row}.at")

    def _operate(self, operation: Operation) -> Iterator[str]:
        k, name = operation.result, operation.name
        parts = [self._texts[each] for each in operation.operands]
        result = self._texts[k] = f"%t{k}" if k >= 0 else f"%a{~k}"
        if name in ("input", "tangent"):
            self._texts[k] = parts[0] if parts else "%tangent"
        elif name in _SYMBOLS:
            yield f"  {result} = {_SYMBOLS[name]} {self._flags}{_VECTOR} {parts[0]}, {parts[1]}"
        elif name == "neg":
            yield f"  {result} = fneg {_VECTOR} {parts[0]}"
        elif name in _INTRINSICS:
            given = ", ".join(f"{_VECTOR} {part}" for part in parts)
            yield f"  {result} = call {_VECTOR} @llvm.{_INTRINSICS[name]}.v{WIDTH}f64({given})"
        elif name in ("mirror", "choose"):
            one, other = parts or (_splat(1.0), _splat(-1.0))
            yield f"  {result} = select <{WIDTH} x i1> %opposite, {_VECTOR} {other}, {_VECTOR} {one}"
        else:
            yield from self._call(result, CODES[name], parts)
        if self._is_disturbed and k >= 0 and name not in EXACT:
            self._texts[k] = f"%d{k}"
            yield (
                f"  %f{k}.number = add i64 %first, {k % PERIOD}\n"
                f"  %f{k}.at = getelementptr double, ptr @factors, i64 %f{k}.number\n"
                f"  %f{k}.one = load double, ptr %f{k}.at\n{_spread(f'%f{k}', f'%f{k}.one')}"
                f"  %d{k} = fmul {self._flags}{_VECTOR} {parts[0] if name == 'input' else result}, %f{k}"
            )

    def _call(self, result: str, code: int, parts: list[str]) -> Iterator[str]:
        for slot, part in enumerate(parts):
            yield f"  store {_VECTOR} {part}, ptr %slot{slot}"
        slots = "".join(f", ptr %slot{slot}" for slot in range(MOST_OPERANDS + 1))
        yield f"  {result}.null = call ptr @{OPERATE}(i64 {code}{slots})"
        yield f"  {result} = load {_VECTOR}, ptr %slot{MOST_OPERANDS}"


def _place(name: str, array: str, row: int) -> str:
    """A pointer to a row: of the node of `%i` where it is written."""
    first = "%i.written" if array == "written" else "%i.lane"
    return (
        f"  {name}.part = getelementptr double, ptr %{array}, i64 {first}\n"
        f"  {name} = getelementptr double, ptr {name}.part, i64 {row * LANES}\n"
    )


def _load(name: str, place: str) -> str:
    return f"  {name} = load {_VECTOR}, ptr {place}, align 8\n"


def _spread(name: str, number: str) -> str:
    """All lanes of a vector of one number."""
    return (
        f"  {name}.first = insertelement {_VECTOR} undef, double {number}, i64 0\n"
        f"  {name} = shufflevector {_VECTOR} {name}.first, {_VECTOR} undef, <{WIDTH} x i32> zeroinitializer\n"
    )


def _splat(value: float) -> str:
    return f"<{', '.join([f'double {_hex(value)}'] * WIDTH)}>"


def _hex(value: float) -> str:
    return f"0x{struct.pack('>d', value).hex()}"
