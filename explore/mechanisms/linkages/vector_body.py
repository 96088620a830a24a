"""The operations of a program as LLVM's statements."""

from collections.abc import Iterator

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import PERIOD
from explore.base.lanes.elementary import exact_sum
from explore.mechanisms.linkages.following import GROUP_ROWS
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, SENSES
from explore.mechanisms.linkages.operations import CODES
from explore.mechanisms.linkages.programs import EXACT, Operation, Program
from explore.mechanisms.linkages.vector_text import (
    FOLLOW,
    OPERATE,
    VECTOR,
    load,
    place,
    row_type,
    splat,
    spread,
    suffix,
)

#: Names of the rows that `operate` takes.
_SLOTS = ("first.operand", "second.operand", "of.operands")

#: Names of the inputs of the angle in functions; "input" copies its operand.
_GIVEN = {
    "input": "",
    **{name: f"%{name}" for name in ("tangent", "cosine", "sine", "half.more")},
}  # fmt: skip

_SYMBOLS = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_INTRINSICS = {"sqrt": "sqrt", "abs": "fabs", "max": "maximum", "maximum": "maximum", "minimum": "minimum"}


def scratch(program: Program, lanes: int = LANES) -> str:
    """Rows for the operands and the results of `operate` and `follow`, if they are called."""
    names = {operation.name for operation in program.operations}
    calls = not names.isdisjoint((*CODES, *FOLLOWS))
    slots = [f"  %{name} = alloca {row_type(lanes)}\n" for name in _SLOTS] if calls else []
    groups = [f"  %{name}.rows = alloca [{1 + len(PARTS)} x {row_type(lanes)}]\n" for name in FOLLOWS if name in names]
    return "".join([*slots, *groups])


def body(program: Program, flags: str, *, is_disturbed: bool = False, lanes: int = LANES) -> str:
    """Statements of the operations of a program, with flags that permit to reorder them."""
    return "".join(f"{line}\n" for line in _Body(program, flags, lanes, is_disturbed=is_disturbed).lines())


class _Body:
    """The operations of a program; those of one lane call no functions and are not disturbed."""

    def __init__(self, program: Program, flags: str, lanes: int, *, is_disturbed: bool) -> None:
        self._program, self._flags, self._is_disturbed = program, flags, is_disturbed
        self._lanes, self._type = lanes, row_type(lanes)
        self._texts = {k: splat(value, lanes) for k, value in program.literals.items()}
        self._followed: dict[int, str] = {}

    def lines(self) -> Iterator[str]:
        """Statements, and stores of results as soon as they are known."""
        if any(operation.name in ("mirror", "choose") for operation in self._program.operations):
            yield f"  %opposite = fcmp une {self._type} %anchor, {splat(0.0, self._lanes)}"
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
        pointer = f"%written{row}"
        placed = place(pointer, "%written", row, 1, self._lanes)
        return f"{placed}  store {self._type} {self._texts[k]}, ptr {pointer}, align 8"

    def _read(self, k: int) -> Iterator[str]:
        if k not in self._texts:
            row = self._program.reads[k]
            self._texts[k] = f"%read{row}"
            placed = place(f"%read{row}.at", "%read", row, 1, self._lanes)
            yield placed + load(f"%read{row}", f"%read{row}.at", self._lanes).rstrip()

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
            yield f"  {result} = call {self._type} @llvm.{_INTRINSICS[name]}.{suffix(self._lanes)}({given})"
        elif name in ("mirror", "choose"):
            one, other = parts or (splat(1.0, self._lanes), splat(-1.0, self._lanes))
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
                place(f"{result}.at", rows, row, 1, self._lanes) + load(result, f"{result}.at", self._lanes).rstrip()
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
            f"  %f{k}.one = load double, ptr %f{k}.at\n{spread(f'%f{k}', f'%f{k}.one')}"
            f"  %d{k} = fmul {self._flags}{VECTOR} {exact}, %f{k}"
        )

    def _sense(self, result: str, number: int, rate: str) -> Iterator[str]:
        """The sense that the law says, or that of a rate."""
        one, other = splat(1.0, LANES), splat(-1.0, LANES)
        yield f"  {result}.shifted = lshr i64 %law, {2 * number}"
        yield f"  {result}.code = and i64 {result}.shifted, 3"
        yield f"  {result}.free = icmp eq i64 {result}.code, 0"
        yield f"  {result}.back = icmp eq i64 {result}.code, 2"
        yield f"  {result}.said = select i1 {result}.back, {VECTOR} {other}, {VECTOR} {one}"
        yield f"  {result}.below = fcmp olt {VECTOR} {rate}, {splat(0.0, LANES)}"
        yield f"  {result}.own = select <{LANES} x i1> {result}.below, {VECTOR} {other}, {VECTOR} {one}"
        yield f"  {result} = select i1 {result}.free, {VECTOR} {result}.own, {VECTOR} {result}.said"

    def _call(self, result: str, code: int, parts: list[str]) -> Iterator[str]:
        """A function of one or two numbers; the second row of one number is that of the first."""
        first, second, third = (f"%{name}" for name in _SLOTS)
        for slot, part in zip((first, second), parts, strict=False):
            yield f"  store {VECTOR} {part}, ptr {slot}"
        slots = f"ptr {first}, ptr {second if len(parts) == 2 else first}, ptr {third}"
        yield f"  {result}.null = call ptr @{OPERATE}(i64 {code}, i64 {LANES}, {slots})"
        yield f"  {result} = load {VECTOR}, ptr {third}"

    def _follow(self, result: str, rows: str, group: int, parts: list[str]) -> Iterator[str]:
        """A group of links at the cosine and the sine of an angle."""
        for slot, part in zip(_SLOTS, parts, strict=False):
            yield f"  store {self._type} {part}, ptr %{slot}, align 8"
        first = self._program.first_group + group * GROUP_ROWS
        slots = f"ptr %{_SLOTS[0]}, ptr %{_SLOTS[1]}, ptr {rows}"
        yield f"  {result}.null = call ptr @{FOLLOW}(ptr %read, i64 {first}, i64 {self._lanes}, {slots})"
        yield load(result, rows, self._lanes).rstrip()


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
        self._lines.append(f"  {text} = {instruction} {VECTOR} {self.text}, {other.text}")
        return _Plain(text, self._name, self._lines)
