"""Functions in LLVM's language that call compiled ones of the package with tables of their own."""

from collections.abc import Sequence

from explore.mechanisms.linkages.closing import Sizes
from explore.mechanisms.linkages.pair_programs import PairPlan
from explore.mechanisms.linkages.vector_text import ARRAY, table

#: Numba's structure of a function.
_FUNCTION = "{ptr, ptr, ptr}"

#: End of a function that only calls others.
_RETURN = "  ret ptr null\n}\n"

#: Symbol of `closing.close_designs`.
CLOSE = "explore_linkage_close"

#: Symbol of `pair_operations.fill_pairs`.
FILL_PAIRS = "explore_linkage_fill_pairs"

#: Symbol of `mark_errors.bound_marks`.
BOUND_MARKS = "explore_linkage_bound_marks"

#: Symbol of `pair_marks.sharpen_marks`.
SHARPEN = "explore_linkage_sharpen_marks"

#: Symbol of `turn_moments.fill_turn_moments`.
TURN_MOMENTS = "explore_linkage_turn_moments"


def close_function(sizes: Sizes, blocked: Sequence[float], starts: Sequence[float], functions: Sequence[str]) -> str:
    """A function of a record, which calls `closing.close_designs` with these arguments; "" stands for no function.

    With strokes it calls `mark_errors.bound_marks` then, with the function `disturbed_rate`.
    """
    arguments = [
        (ARRAY, "%record"),
        _whole_numbers(sizes),
        _array_of("blocked", len(blocked)),
        _array_of("starts", len(starts)),
        *map(_function, functions),
    ]
    calls = [(CLOSE, arguments)]
    if sizes.has_strokes:
        calls.append((BOUND_MARKS, [(ARRAY, "%record"), ("i64", str(sizes.interval + 2)), _function("disturbed_rate")]))
    declarations = "".join(_declaration(*call) for call in calls)
    body = "".join(_call(*call) for call in calls)
    tables = table("blocked", blocked) + table("starts", starts)
    return f"{tables}{declarations}define ptr @close({ARRAY} %record) {{\n{body}{_RETURN}"


def pairs_function(name: str, plan: PairPlan, *, is_disturbed: bool) -> str:
    """A function as `fill_function`, which calls `pair_operations.fill_pairs` with the tables of a program."""
    arguments = [
        *((ARRAY, f"%{array}") for array in ("read", "tangents")),
        ("i64", "%anchor"),
        ("i64", "%count"),
        (ARRAY, "%written"),
        *_arguments_of(plan),
        ("i64", str(int(is_disturbed))),
    ]
    given = f"{ARRAY} %read, {ARRAY} %tangents, i64 %anchor, i64, i64, i64 %count, i64, {ARRAY} %written"
    text = f"define ptr @{name}({given}) {{\n{_call(FILL_PAIRS, arguments)}{_RETURN}"
    return f"{_tables(plan)}{_declaration(FILL_PAIRS, arguments)}{text}"


def precise_close_function(plan: PairPlan, ratio_row: int) -> str:
    """A function of a record, which calls the one of `close_function` and then `pair_marks.sharpen_marks`."""
    arguments = [(ARRAY, "%record"), ("i64", str(ratio_row)), *_arguments_of(plan)]
    text = f"define ptr @precise_close({ARRAY} %record) {{\n  %closed = call ptr @close({ARRAY} %record)\n"
    return f"{_tables(plan)}{_declaration(SHARPEN, arguments)}{text}{_call(SHARPEN, arguments)}{_RETURN}"


def moments_function(rows: Sequence[float], lengths: Sequence[float], places: Sequence[float]) -> str:
    """A function as `Mechanism.integrals`, which calls `turn_moments.fill_turn_moments` with these arguments."""
    tables = {"rows": rows, "lengths": lengths, "places": places}
    arrays = [_array_of(name, len(values)) for name, values in tables.items()]
    of_window = [(ARRAY, f"%{name}") for name in ("record", "starts", "stops")]
    arguments = [*of_window, *arrays, (ARRAY, "%out")]
    given = ", ".join(" ".join(each) for each in (*of_window, (ARRAY, "%out")))
    text = f"define ptr @turn_moments({given}) {{\n{_call(TURN_MOMENTS, arguments)}{_RETURN}"
    return "".join(table(*each) for each in tables.items()) + _declaration(TURN_MOMENTS, arguments) + text


def _arguments_of(plan: PairPlan) -> list[tuple[str, str]]:
    """Types and values of the arguments that are the tables of a program."""
    return [
        _whole_numbers(plan.sizes),
        _array_of("literals", len(plan.literals)),
        _array_of("integers", len(plan.integers)),
    ]


def _tables(plan: PairPlan) -> str:
    """The constant arrays of a program."""
    numbers = ", ".join(f"i64 {number}" for number in plan.integers)
    return f"{table('literals', plan.literals)}@integers = private constant [{len(plan.integers)} x i64] [{numbers}]\n"


def _whole_numbers(numbers: Sequence[int]) -> tuple[str, str]:
    """Type and value of an argument with so many integers."""
    return f"[{len(numbers)} x i64]", f"[{', '.join(f'i64 {number}' for number in numbers)}]"


def _array_of(name: str, count: int) -> tuple[str, str]:
    """Type and value of an argument that is a constant array."""
    shape = f"i64 {count}, i64 8, ptr @{name}, [1 x i64] [i64 {count}], [1 x i64] [i64 8]"
    return ARRAY, f"{{ptr null, ptr null, {shape}}}"


def _function(name: str) -> tuple[str, str]:
    """Type and value of an argument that is a function of the text, or none."""
    return _FUNCTION, f"{{ptr {f'@{name}' if name else 'null'}, ptr null, ptr null}}"


def _declaration(symbol: str, arguments: Sequence[tuple[str, str]]) -> str:
    return f"declare ptr @{symbol}({', '.join(kind for kind, _ in arguments)})\n"


def _call(symbol: str, arguments: Sequence[tuple[str, str]]) -> str:
    given = ", ".join(f"{kind} {value}" for kind, value in arguments)
    return f"  %of.{symbol} = call ptr @{symbol}({given})\n"
