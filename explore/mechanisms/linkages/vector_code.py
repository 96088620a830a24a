"""Programs as LLVM's language: functions that Numba's compiled functions call, of LANES designs at once or of one.

A function has Numba's calling convention of C: arrays are passed as their structures, and the result is a null pointer.
"""

from collections.abc import Iterable

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import FACTORS, OF_TANGENTS, PERIOD, STEP
from explore.mechanisms.linkages.programs import Program
from explore.mechanisms.linkages.vector_body import body, scratch
from explore.mechanisms.linkages.vector_text import (
    ARRAY,
    FOLLOW,
    OPERATE,
    VECTOR,
    hexadecimal,
    load,
    place,
    row_type,
    splat,
    spread,
    suffix,
    table,
)

#: Declarations of what functions call.
HEAD = (
    f"declare ptr @{OPERATE}(i64, i64, ptr, ptr, ptr)\ndeclare ptr @{FOLLOW}(ptr, i64, i64, ptr, ptr, ptr)\n"
    + "".join(
        f"declare {row_type(lanes)} @llvm.{name}.{suffix(lanes)}({', '.join([row_type(lanes)] * count)})\n"
        for name, count in (("sqrt", 1), ("fabs", 1), ("maximum", 2), ("minimum", 2))
        for lanes in (LANES, 1)
    )
)

#: Permissions to reorder sums and products; see `explore.base.compiling`.
_FAST = "reassoc nsz arcp contract "


def design_function(program: Program) -> str:
    """A function of the rows of parameters and of constants."""
    return _function(program.name, ("read", "written"), scratch(program) + body(program, ""))


def node_function(program: Program) -> str:
    """A function of the constants, of half-tangents and of anchors of all lanes, and of the rows to fill."""
    angle = load("%tangent", "%tangents") + load("%anchor", "%anchors")
    arguments = ("read", "tangents", "anchors", "written")
    return _function(program.name, arguments, scratch(program) + angle + body(program, _FAST))


def curve_function(program: Program) -> str:
    """A function of the constants of one design, of cosine and sine of the angle, and of the numbers to fill."""
    return _function(
        program.name,
        ("read", "cosine.", "sine.", "written"),
        scratch(program, 1) + _angle_of_ray(1) + body(program, _FAST, lanes=1),
    )


def rows_of_curve_function(program: Program, size: int) -> str:
    """The same for rows: of constants, of cosines and sines, of how many of these two, and of `size` numbers each."""
    loop = (
        "  br label %begin\nbegin:\n  %empty = icmp sle i64 %count, 0\n  br i1 %empty, label %done, label %next\n"
        "next:\n  %j = phi i64 [0, %begin], [%j.after, %next]\n"
        + place("%cosine.at", "%cosines", "%j", 1)
        + load("%cosine", "%cosine.at")
        + place("%sine.at", "%sines", "%j", 1)
        + load("%sine", "%sine.at")
        + place("%written", "%all.written", "%j", size)
        + _angle_of_ray(LANES)
        + body(program, _FAST)
        + "  %j.after = add i64 %j, 1\n  %again = icmp slt i64 %j.after, %count\n"
        "  br i1 %again, label %next, label %done\ndone:\n"
    )
    arguments = ("read", "cosines", "sines", "count:", "all.written")
    return _function(f"{program.name}_rows", arguments, scratch(program) + loop)


def _angle_of_ray(lanes: int) -> str:
    """Statements of the half-tangent and of the anchor of angles by their cosines and sines."""
    row, truth = row_type(lanes), "i1" if lanes == 1 else f"<{lanes} x i1>"
    return (
        f"  %behind = fcmp olt {row} %cosine, {splat(0.0, lanes)}\n  %anchor = uitofp {truth} %behind to {row}\n"
        f"  %size = call {row} @llvm.fabs.{suffix(lanes)}({row} %cosine)\n"
        f"  %more = fadd {row} %size, {splat(1.0, lanes)}\n  %half.more = fmul {row} %more, {splat(0.5, lanes)}\n"
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
        + place("%node.tangents", "%tangents", "%j", 1)
        + place("%node.written", "%all.written", "%j", rows)
        + place("%written", "%node.written", rows_before, 1)
        + load("%tangent.exact" if is_disturbed else "%tangent", "%node.tangents")
        + (factors + _DISTURBED_TANGENT if is_disturbed else "")
        + body(program, _FAST, is_disturbed=is_disturbed)
        + "  %j.after = add i64 %j, 1\n  %more = icmp slt i64 %j.after, %count\n"
        "  br i1 %more, label %next, label %done\ndone:\n"
    )
    anchor = "  %anchor.one = sitofp i64 %anchor.number to double\n" + spread("%anchor", "%anchor.one")
    numbers = ("anchor.number:", "law:", "variant:", "count:", "needs:")
    function = _function(
        program.name, ("read", "tangents", *numbers, "all.written"), scratch(program) + anchor + loop
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
        + place("%tangents.at", "%tangents", "%k", 1)
        + place("%written.at", "%all.written", "%k", rows)
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
        + place("%rest", "%record", own, 1)
        + f"  %rest.array = insertvalue {ARRAY} %record.array, ptr %rest, 4\n"
        f"  %closed = call ptr @{called}({ARRAY} %rest.array)\n"
        f"  call void @llvm.memmove.p0.p0.i64(ptr %record, ptr %rest, i64 {size}, i1 false)\n"
        f"  %filled = call ptr @design({ARRAY} %record.array, {ARRAY} %record.array)\n  ret ptr null\n}}\n"
    )


def _function(name: str, arguments: Iterable[str], text: str) -> str:
    """A function of arrays, of integers (names that end with a colon) and of numbers (with a period)."""
    kinds = {":": "i64", ".": "double"}
    declared = [
        f"{kinds[each[-1]]} %{each[:-1]}" if each[-1] in kinds else f"{ARRAY} %{each}.array" for each in arguments
    ]
    arrays = [each for each in arguments if each[-1] not in kinds]
    pointers = "".join(f"  %{each} = extractvalue {ARRAY} %{each}.array, 4\n" for each in arrays)
    return f"define ptr @{name}({', '.join(declared)}) nounwind {{\nentry:\n{pointers}{text}  ret ptr null\n}}\n\n"


#: Statements of the half-tangents of a disturbed node.
_DISTURBED_TANGENT = (
    "  %tangent.factor.at = getelementptr double, ptr @factors, i64 %factor\n"
    "  %tangent.factor = load double, ptr %tangent.factor.at\n"
    f"  %tangent.more = fmul double %tangent.factor, {hexadecimal(OF_TANGENTS)}\n"
    f"  %tangent.change = fsub double %tangent.more, {hexadecimal(OF_TANGENTS - 1.0)}\n"
    + spread("%tangent.changes", "%tangent.change")
    + f"  %tangent = fmul {VECTOR} %tangent.exact, %tangent.changes\n"
)
