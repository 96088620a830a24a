"""Programs as LLVM's language: functions that Numba's compiled functions call, of LANES designs at once or of one.

A function has Numba's calling convention of C: arrays are passed as their structures, and the result is a null pointer.
"""

import struct
from collections.abc import Iterable, Iterator

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import FACTORS, OF_TANGENTS, PERIOD, STEP
from explore.base.lanes.elementary import exact_sum
from explore.mechanisms.linkages.following import GROUP_ROWS
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, SENSES
from explore.mechanisms.linkages.operations import CODES
from explore.mechanisms.linkages.programs import EXACT, Operation, Program

#: Numba's structure of an array.
ARRAY = "{ptr, ptr, i64, i64, ptr, [1 x i64], [1 x i64]}"

#: Type of a row of LANES designs.
_VECTOR = f"<{LANES} x double>"

#: Permissions to reorder sums and products; see `explore.base.compiling`.
_FAST = "reassoc nsz arcp contract "

#: Names of the rows that `operate` takes.
_SLOTS = ("first.operand", "second.operand", "of.operands")

#: Symbol of `operations.operate`.
OPERATE = "explore_linkage_operate"

#: Symbol of `following.follow`.
FOLLOW = "explore_linkage_follow"

#: Names of the inputs of the angle in functions; "input" copies its operand.
_GIVEN = {
    "input": "",
    **{name: f"%{name}" for name in ("tangent", "cosine", "sine", "half.more")},
}  # fmt: skip

_SYMBOLS = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_INTRINSICS = {"sqrt": "sqrt", "abs": "fabs", "max": "maximum", "maximum": "maximum", "minimum": "minimum"}


def _type(lanes: int) -> str:
    """The type of a row."""
    return "double" if lanes == 1 else _VECTOR


def _suffix(lanes: int) -> str:
    """The end of the names of LLVM's functions of rows."""
    return "f64" if lanes == 1 else f"v{lanes}f64"


#: Declarations of what functions call.
HEAD = (
    f"declare ptr @{OPERATE}(i64, i64, ptr, ptr, ptr)\ndeclare ptr @{FOLLOW}(ptr, i64, i64, ptr, ptr, ptr)\n"
    + "".join(
        f"declare {_type(lanes)} @llvm.{name}.{_suffix(lanes)}({', '.join([_type(lanes)] * count)})\n"
        for name, count in (("sqrt", 1), ("fabs", 1), ("maximum", 2), ("minimum", 2))
        for lanes in (LANES, 1)
    )
)


def design_function(program: Program) -> str:
    """A function of the rows of parameters and of constants."""
    return _function(program.name, ("read", "written"), _scratch(program) + _body(program, ""))


def node_function(program: Program) -> str:
    """A function of the constants, of half-tangents and of anchors of all lanes, and of the rows to fill."""
    angle = _load("%tangent", "%tangents") + _load("%anchor", "%anchors")
    arguments = ("read", "tangents", "anchors", "written")
    return _function(program.name, arguments, _scratch(program) + angle + _body(program, _FAST))


def curve_function(program: Program) -> str:
    """A function of the constants of one design, of cosine and sine of the angle, and of the numbers to fill."""
    return _function(
        program.name,
        ("read", "cosine.", "sine.", "written"),
        _scratch(program, 1) + _angle_of_ray(1) + _body(program, _FAST, lanes=1),
    )


def rows_of_curve_function(program: Program, size: int) -> str:
    """The same for rows: of constants, of cosines and sines, of how many of these two, and of `size` numbers each."""
    loop = (
        "  br label %begin\nbegin:\n  %empty = icmp sle i64 %count, 0\n  br i1 %empty, label %done, label %next\n"
        "next:\n  %j = phi i64 [0, %begin], [%j.after, %next]\n"
        + _place("%cosine.at", "%cosines", "%j", 1)
        + _load("%cosine", "%cosine.at")
        + _place("%sine.at", "%sines", "%j", 1)
        + _load("%sine", "%sine.at")
        + _place("%written", "%all.written", "%j", size)
        + _angle_of_ray(LANES)
        + _body(program, _FAST)
        + "  %j.after = add i64 %j, 1\n  %again = icmp slt i64 %j.after, %count\n"
        "  br i1 %again, label %next, label %done\ndone:\n"
    )
    arguments = ("read", "cosines", "sines", "count:", "all.written")
    return _function(f"{program.name}_rows", arguments, _scratch(program) + loop)


def _angle_of_ray(lanes: int) -> str:
    """Statements of the half-tangent and of the anchor of angles by their cosines and sines."""
    row, truth = _type(lanes), "i1" if lanes == 1 else f"<{lanes} x i1>"
    return (
        f"  %behind = fcmp olt {row} %cosine, {_splat(0.0, lanes)}\n  %anchor = uitofp {truth} %behind to {row}\n"
        f"  %size = call {row} @llvm.fabs.{_suffix(lanes)}({row} %cosine)\n"
        f"  %more = fadd {row} %size, {_splat(1.0, lanes)}\n  %half.more = fmul {row} %more, {_splat(0.5, lanes)}\n"
        f"  %opposite.sine = fneg {row} %sine\n"
        f"  %over = select {truth} %behind, {row} %opposite.sine, {row} %sine\n  %tangent = fdiv {row} %over, %more\n"
    )


def fill_function(program: Program, *, is_disturbed: bool = False, before: str = "", rows_before: int = 0) -> str:
    """A function as `explore.model.mechanism.Mechanism.fill`, or `disturbed_fill`, whose half-tangents are off as well.

    The function `before` fills so many rows before those of the program, if there are needs.
    """
    rows = rows_before + len(program.writes)
    factors = f"  %factor.step = mul i64 %j, {STEP}\n  %factor = urem i64 %factor.step, {PERIOD}\n"
    loop = (
        (_loop_before(before, rows) if before else "  br label %begin\nbegin:\n")
        + "  %empty = icmp sle i64 %count, 0\n  br i1 %empty, label %done, label %next\n"
        "next:\n  %j = phi i64 [0, %begin], [%j.after, %next]\n"
        + _place("%node.tangents", "%tangents", "%j", 1)
        + _place("%node.written", "%all.written", "%j", rows)
        + _place("%written", "%node.written", rows_before, 1)
        + _load("%tangent.exact" if is_disturbed else "%tangent", "%node.tangents")
        + (factors + _DISTURBED_TANGENT if is_disturbed else "")
        + _body(program, _FAST, is_disturbed=is_disturbed)
        + "  %j.after = add i64 %j, 1\n  %more = icmp slt i64 %j.after, %count\n"
        "  br i1 %more, label %next, label %done\ndone:\n"
    )
    anchor = "  %anchor.one = sitofp i64 %anchor.number to double\n" + _spread("%anchor", "%anchor.one")
    numbers = ("anchor.number:", "law:", "variant:", "count:", "needs:")
    function = _function(
        program.name, ("read", "tangents", *numbers, "all.written"), _scratch(program) + anchor + loop
    )  # fmt: skip
    numbers_before = ", ".join([ARRAY, ARRAY, *["i64"] * len(numbers), ARRAY])
    declared = f"declare ptr @{before}({numbers_before})\n" if before else ""
    return (table("factors", FACTORS) if is_disturbed else "") + declared + function


def _loop_before(called: str, rows: int) -> str:
    """A loop over the nodes that calls a function of one node at a time, if there are needs, as its rows are fewer."""
    passed = f"i64 %anchor.number, i64 %law, i64 %variant, i64 1, i64 %needs, {ARRAY} %written.here"
    return (
        "  %is.needed = icmp ne i64 %needs, 0\n  %is.some = icmp sgt i64 %count, 0\n"
        "  %calls = and i1 %is.needed, %is.some\n  br i1 %calls, label %call, label %begin\n"
        "call:\n  %k = phi i64 [0, %entry], [%k.after, %call]\n"
        + _place("%tangents.at", "%tangents", "%k", 1)
        + _place("%written.at", "%all.written", "%k", rows)
        + f"  %tangents.here = insertvalue {ARRAY} %tangents.array, ptr %tangents.at, 4\n"
        f"  %written.here = insertvalue {ARRAY} %all.written.array, ptr %written.at, 4\n"
        f"  %null = call ptr @{called}({ARRAY} %read.array, {ARRAY} %tangents.here, {passed})\n"
        "  %k.after = add i64 %k, 1\n  %calls.more = icmp slt i64 %k.after, %count\n"
        "  br i1 %calls.more, label %call, label %begin\nbegin:\n"
    )


def close_function_after(called: str, constants: int, own: int) -> str:
    """A function of a record that calls one for fewer constants, and then the function "design" for its own.

    The rows from the status on are where both have them.
    """
    size = 8 * LANES * constants
    return (
        f"declare ptr @{called}({ARRAY})\ndeclare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)\n"
        f"define ptr @close({ARRAY} %record.array) nounwind {{\n"
        f"  %record = extractvalue {ARRAY} %record.array, 4\n"
        + _place("%rest", "%record", own, 1)
        + f"  %rest.array = insertvalue {ARRAY} %record.array, ptr %rest, 4\n"
        f"  %closed = call ptr @{called}({ARRAY} %rest.array)\n"
        f"  call void @llvm.memmove.p0.p0.i64(ptr %record, ptr %rest, i64 {size}, i1 false)\n"
        f"  %filled = call ptr @design({ARRAY} %record.array, {ARRAY} %record.array)\n  ret ptr null\n}}\n"
    )


def table(name: str, values: Iterable[float]) -> str:
    """A constant array."""
    numbers = [f"double {_hex(value)}" for value in values]
    return f"@{name} = private constant [{len(numbers)} x double] [{', '.join(numbers)}]\n"


def _function(name: str, arguments: Iterable[str], text: str) -> str:
    """A function of arrays, of integers (names that end with a colon) and of numbers (with a period)."""
    kinds = {":": "i64", ".": "double"}
    declared = [
        f"{kinds[each[-1]]} %{each[:-1]}" if each[-1] in kinds else f"{ARRAY} %{each}.array" for each in arguments
    ]
    arrays = [each for each in arguments if each[-1] not in kinds]
    pointers = "".join(f"  %{each} = extractvalue {ARRAY} %{each}.array, 4\n" for each in arrays)
    return f"define ptr @{name}({', '.join(declared)}) nounwind {{\nentry:\n{pointers}{text}  ret ptr null\n}}\n\n"


def _scratch(program: Program, lanes: int = LANES) -> str:
    """Rows for the operands and the results of `operate` and `follow`, if they are called."""
    names = {operation.name for operation in program.operations}
    calls = not names.isdisjoint((*CODES, *FOLLOWS))
    slots = [f"  %{name} = alloca {_type(lanes)}\n" for name in _SLOTS] if calls else []
    groups = [f"  %{name}.rows = alloca [{1 + len(PARTS)} x {_type(lanes)}]\n" for name in FOLLOWS if name in names]
    return "".join([*slots, *groups])


def _body(program: Program, flags: str, *, is_disturbed: bool = False, lanes: int = LANES) -> str:
    return "".join(f"{line}\n" for line in _Body(program, flags, lanes, is_disturbed=is_disturbed).lines())


class _Body:
    """The operations of a program; those of one lane call no functions and are not disturbed."""

    def __init__(self, program: Program, flags: str, lanes: int, *, is_disturbed: bool) -> None:
        self._program, self._flags, self._is_disturbed = program, flags, is_disturbed
        self._lanes, self._type = lanes, _type(lanes)
        self._texts = {k: _splat(value, lanes) for k, value in program.literals.items()}
        self._followed: dict[int, str] = {}

    def lines(self) -> Iterator[str]:
        """Statements, and stores of results as soon as they are known."""
        if any(operation.name in ("mirror", "choose") for operation in self._program.operations):
            yield f"  %opposite = fcmp une {self._type} %anchor, {_splat(0.0, self._lanes)}"
        if self._is_disturbed:
            yield from map(self._disturb, self._program.rests)  # constants that are rounded
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
        placed = _place(place, "%written", row, 1, self._lanes)
        return f"{placed}  store {self._type} {self._texts[k]}, ptr {place}, align 8"

    def _read(self, k: int) -> Iterator[str]:
        if k not in self._texts:
            row = self._program.reads[k]
            self._texts[k] = f"%read{row}"
            placed = _place(f"%read{row}.at", "%read", row, 1, self._lanes)
            yield placed + _load(f"%read{row}", f"%read{row}.at", self._lanes).rstrip()

    def _operate(self, operation: Operation) -> Iterator[str]:
        k, name = operation.result, operation.name
        parts = [self._texts[each] for each in operation.operands]
        result = self._texts[k] = f"%t{k}" if k >= 0 else f"%a{~k}"
        if name in _GIVEN:
            self._texts[k] = parts[0] if parts else _GIVEN[name]
        elif name in _SYMBOLS:
            yield f"  {result} = {_SYMBOLS[name]} {self._flags}{self._type} {parts[0]}, {parts[1]}"
        elif name == "neg":
            yield f"  {result} = fneg {self._type} {parts[0]}"
        elif name in _INTRINSICS:
            given = ", ".join(f"{self._type} {part}" for part in parts)
            yield f"  {result} = call {self._type} @llvm.{_INTRINSICS[name]}.{_suffix(self._lanes)}({given})"
        elif name in ("mirror", "choose"):
            one, other = parts or (_splat(1.0, self._lanes), _splat(-1.0, self._lanes))
            truth = "i1" if self._lanes == 1 else f"<{LANES} x i1>"
            yield f"  {result} = select {truth} %opposite, {self._type} {other}, {self._type} {one}"
        elif name in SENSES:
            yield from self._sense(result, SENSES.index(name), parts[0])
        elif name == "exact_sum":
            lines: list[str] = []
            self._texts[k] = exact_sum.py_func(*(_Plain(part, result, lines) for part in parts)).text
            yield from lines
        elif name in FOLLOWS:
            self._followed[k] = f"%{name}.rows"
            yield from self._follow(result, self._followed[k], FOLLOWS.index(name), parts)
        elif name in PARTS:
            rows, row = self._followed[operation.operands[0]], 1 + PARTS.index(name)
            yield (
                _place(f"{result}.at", rows, row, 1, self._lanes) + _load(result, f"{result}.at", self._lanes).rstrip()
            )
        else:
            yield from self._call(result, CODES[name], parts)
        if self._is_disturbed and k >= 0 and name not in EXACT:
            yield self._disturb(k)

    def _disturb(self, k: int) -> str:
        """A number times its factor."""
        exact, self._texts[k] = self._texts[k], f"%d{k}"
        return (
            f"  %f{k}.number = add i64 %factor, {k % PERIOD}\n"
            f"  %f{k}.at = getelementptr double, ptr @factors, i64 %f{k}.number\n"
            f"  %f{k}.one = load double, ptr %f{k}.at\n{_spread(f'%f{k}', f'%f{k}.one')}"
            f"  %d{k} = fmul {self._flags}{_VECTOR} {exact}, %f{k}"
        )

    def _sense(self, result: str, number: int, rate: str) -> Iterator[str]:
        """The sense that the law says, or that of a rate."""
        one, other = _splat(1.0, LANES), _splat(-1.0, LANES)
        yield f"  {result}.shifted = lshr i64 %law, {2 * number}"
        yield f"  {result}.code = and i64 {result}.shifted, 3"
        yield f"  {result}.free = icmp eq i64 {result}.code, 0"
        yield f"  {result}.back = icmp eq i64 {result}.code, 2"
        yield f"  {result}.said = select i1 {result}.back, {_VECTOR} {other}, {_VECTOR} {one}"
        yield f"  {result}.below = fcmp olt {_VECTOR} {rate}, {_splat(0.0, LANES)}"
        yield f"  {result}.own = select <{LANES} x i1> {result}.below, {_VECTOR} {other}, {_VECTOR} {one}"
        yield f"  {result} = select i1 {result}.free, {_VECTOR} {result}.own, {_VECTOR} {result}.said"

    def _call(self, result: str, code: int, parts: list[str]) -> Iterator[str]:
        """A function of one or two numbers; the second row of one number is that of the first."""
        first, second, third = (f"%{name}" for name in _SLOTS)
        for slot, part in zip((first, second), parts, strict=False):
            yield f"  store {_VECTOR} {part}, ptr {slot}"
        slots = f"ptr {first}, ptr {second if len(parts) == 2 else first}, ptr {third}"
        yield f"  {result}.null = call ptr @{OPERATE}(i64 {code}, i64 {LANES}, {slots})"
        yield f"  {result} = load {_VECTOR}, ptr {third}"

    def _follow(self, result: str, rows: str, group: int, parts: list[str]) -> Iterator[str]:
        """A group of links at the cosine and the sine of an angle."""
        for slot, part in zip(_SLOTS, parts, strict=False):
            yield f"  store {self._type} {part}, ptr %{slot}, align 8"
        first = self._program.first_group + group * GROUP_ROWS
        slots = f"ptr %{_SLOTS[0]}, ptr %{_SLOTS[1]}, ptr {rows}"
        yield f"  {result}.null = call ptr @{FOLLOW}(ptr %read, i64 {first}, i64 {self._lanes}, {slots})"
        yield _load(result, rows, self._lanes).rstrip()


class _Plain:
    """A vector whose sums and differences become statements, none of which is reordered."""

    def __init__(self, text: str, name: str, lines: list[str]) -> None:
        self.text, self._name, self._lines = text, name, lines

    def __add__(self, other: "_Plain") -> "_Plain":
        return self._put("fadd", other)

    def __sub__(self, other: "_Plain") -> "_Plain":
        return self._put("fsub", other)

    def _put(self, instruction: str, other: "_Plain") -> "_Plain":
        text = f"{self._name}.{len(self._lines)}"
        self._lines.append(f"  {text} = {instruction} {_VECTOR} {self.text}, {other.text}")
        return _Plain(text, self._name, self._lines)


def _place(name: str, pointer: str, number: str | int, rows: int, lanes: int = LANES) -> str:
    """A pointer to so many rows behind another, times a number."""
    return f"  {name} = getelementptr [{rows * lanes} x double], ptr {pointer}, i64 {number}\n"


def _load(name: str, place: str, lanes: int = LANES) -> str:
    return f"  {name} = load {_type(lanes)}, ptr {place}, align 8\n"


def _spread(name: str, number: str) -> str:
    """All lanes of a vector of one number."""
    return (
        f"  {name}.first = insertelement {_VECTOR} undef, double {number}, i64 0\n"
        f"  {name} = shufflevector {_VECTOR} {name}.first, {_VECTOR} undef, <{LANES} x i32> zeroinitializer\n"
    )


def _splat(value: float, lanes: int) -> str:
    return _hex(value) if lanes == 1 else f"<{', '.join([f'double {_hex(value)}'] * lanes)}>"


def _hex(value: float) -> str:
    return f"0x{struct.pack('>d', value).hex()}"


#: Statements of the half-tangents of a disturbed node.
_DISTURBED_TANGENT = (
    "  %tangent.factor.at = getelementptr double, ptr @factors, i64 %factor\n"
    "  %tangent.factor = load double, ptr %tangent.factor.at\n"
    f"  %tangent.more = fmul double %tangent.factor, {_hex(OF_TANGENTS)}\n"
    f"  %tangent.change = fsub double %tangent.more, {_hex(OF_TANGENTS - 1.0)}\n"
    + _spread("%tangent.changes", "%tangent.change")
    + f"  %tangent = fmul {_VECTOR} %tangent.exact, %tangent.changes\n"
)
