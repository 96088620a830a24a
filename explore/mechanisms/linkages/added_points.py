"""Points of a floating link that a user names: the rows of a kernel from the table of the mechanism.

They follow the rows that are written by hand: the functions here call those of the mechanism, and then programs of the
graph. Rows of points are those of `explore.model.points`, as far as a request asks for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from explore.base.identity import Identity
from explore.mechanisms.linkages.declared import add_points
from explore.mechanisms.linkages.table import FRAME, LinkageTable
from explore.model.mechanism import Mechanism
from explore.model.points import POINT_ROWS, SLOT_ROWS, point_signals
from explore.model.quantities import Signal

if TYPE_CHECKING:
    from explore.mechanisms.linkages.equations import Equations
    from explore.mechanisms.linkages.graph import Number
    from explore.mechanisms.linkages.native_code import NativeFunction

#: Number of kernels with points that are kept.
_MOST_KEPT = 64


def with_points(mechanism: Mechanism, points: tuple[str, ...], names: frozenset[str] | None = None) -> Mechanism:
    """The mechanism with points, and kernels for the signals of these names, or for all."""
    return _with_points(Identity(mechanism), points, names)


@lru_cache(_MOST_KEPT)
def _with_points(of: Identity[Mechanism], points: tuple[str, ...], names: frozenset[str] | None) -> Mechanism:
    mechanism = of.of
    link, table, whole = mechanism.floating_link, mechanism.table, mechanism.extended or mechanism
    if link is None or not isinstance(table, LinkageTable):
        raise ValueError(f"the mechanism '{mechanism.name}' has no floating link of a table")
    own = point_signals(link, points)
    wanted = sorted({row for each in own if _asks(names, each) for row in (each.row, each.terms_row)})
    is_motion = all(mechanism.fills(each) for each in whole.signals if _asks(names, each))
    by_hand = mechanism if wanted and is_motion else whole
    first, total = by_hand.signal_rows, by_hand.signal_rows + len(wanted)
    # Rows that the kernel leaves out follow those that it has.
    others = {row: total + row - first for row in range(first, whole.signal_rows)}
    places = {row: total + whole.signal_rows + row for row in range(len(points) * POINT_ROWS)}
    places |= {row: first + k for k, row in enumerate(wanted)}
    signals = (*(_moved(each, others) for each in whole.signals), *(_moved(each, places) for each in own))
    record, quarters = tuple((row.name, int(row)) for row in whole.rows), whole.anchor_angle / (0.5 * math.pi)
    if quarters not in range(4):
        raise ValueError(f"the anchor of '{mechanism.name}' is not at a quarter of a turn")
    kernel = _kernel(
        table, link.name, link.origin, points, tuple(wanted), by_hand.fill, first, whole.close, record, int(quarters)
    )
    kernels = _Kernels(mechanism, points)
    fields = {
        "rows": kernel.rows, "n_constants": int(kernel.rows["STATUS"]), "n_fill_constants": 0,
        "signal_rows": total, "close": kernel.close, "fill": kernel.fill, "specialise": kernels,
    }  # fmt: skip
    extended = whole.declare_points(points, signals, **fields)
    if mechanism.extended is None:
        return extended
    return mechanism.declare_points(points, signals, extended=extended, specialise=kernels)


def _asks(names: frozenset[str] | None, signal: Signal) -> bool:
    return names is None or signal.name in names


def _moved(signal: Signal, places: Mapping[int, int]) -> Signal:
    """The signal in other rows."""
    row, terms_row = places.get(signal.row, signal.row), places.get(signal.terms_row, signal.terms_row)
    return replace(signal, row=row, terms_row=terms_row)


@dataclass(frozen=True)
class _Kernels:
    """The kernels of a mechanism with points, each for some signals."""

    mechanism: Mechanism
    points: tuple[str, ...]

    def __call__(self, names: frozenset[str], **_: bool) -> Mechanism:
        return with_points(self.mechanism, self.points, names)


class _Kernel(NamedTuple):
    """Functions of a mechanism with points, and the rows of its record."""

    close: Any
    fill: Any
    rows: type[IntEnum]


@lru_cache(_MOST_KEPT)
def _kernel(
    table: LinkageTable, link: str, origin: str, points: tuple[str, ...], wanted: tuple[int, ...],
    fill: Callable[..., None], first: int, close: Callable[..., None], record: tuple[tuple[str, int], ...],
    quarters: int,
) -> _Kernel:  # fmt: skip
    """The kernel of the wanted rows of points, behind so many that `fill` fills, and behind what `close` does."""
    from explore.mechanisms.linkages.equations import Equations
    from explore.mechanisms.linkages.programs import Rows
    from explore.mechanisms.linkages.steps import find_steps

    if not wanted:
        return _Kernel(close, fill, _enumerated(dict(record)))
    named = add_points(table, link, points)
    equations = Equations(named, find_steps(named))
    numbers = [number for point in points for number in _numbers(equations, link, origin, point)]
    outputs, status = [numbers[row] for row in wanted], dict(record)["STATUS"]
    constants = Rows(equations.graph, [], status)
    constants.add(outputs)
    own = constants.count - status
    rows = {name: row + own if row >= status else row for name, row in record}
    places = dict(zip((parameter.name for parameter in named.parameters[-2 * len(points) :]), SLOT_ROWS, strict=False))
    inputs = {name: rows[places.get(name, name.upper())] for name in (each.name for each in named.parameters)}
    design, program = constants.of_design("design", inputs), constants.of_angle("fill", outputs, quarters=quarters)
    return _Kernel(_close_function(close, design, status, own), _fill_function(fill, program, first), _enumerated(rows))


def _enumerated(rows: Mapping[str, int]) -> type[IntEnum]:
    return IntEnum("PointRow", rows)  # type: ignore[return-value]  # a type


def _numbers(equations: Equations, link: str, origin: str, point: str) -> Iterator[Number]:
    """The rows of a point, in the order of `explore.model.points`; terms are sizes of what is added up."""
    from explore.mechanisms.linkages.vectors import length

    table = equations.table
    pivot = next(each for each in table.body_of[table.driver].place_of if each in table.body_of[FRAME].place_of)
    crank = length(equations.between(table.driver, pivot, origin)).terms[0]
    along, across = (abs(part.terms[0]) for part in equations.between(link, origin, point))
    reach, (rate, second_rate) = along + across, equations.turning_of(link)
    x, y = equations.points[point]
    (_, vx, ax), (_, vy, ay) = x.terms, y.terms
    square, acceleration_square = vx * vx + vy * vy, ax * ax + ay * ay
    speed = square.sqrt()
    per_cube = 1.0 / (square * speed)
    yield from (x.terms[0], y.terms[0], vx, vy, square, ax, ay, acceleration_square, (vx * ay - vy * ax) * per_cube)
    velocity_terms = crank + abs(rate) * reach
    acceleration_terms = crank + (abs(second_rate) + rate * rate) * reach
    yield from (crank + reach, velocity_terms, acceleration_terms)
    # of the product by both factors, and of the cube by the velocity
    yield (4.0 * velocity_terms * acceleration_square.sqrt() + speed * acceleration_terms) * per_cube


def _close_function(called: Callable[..., None], design: Any, constants: int, own: int) -> NativeFunction:
    from explore.base.compiling import CLOSE_SIGNATURE, address_of, function_type
    from explore.mechanisms.linkages import page_code, vector_code
    from explore.mechanisms.linkages.native_code import NativeFunction

    def javascript(name: str, word_of: Callable[[Any], str]) -> str:
        written = page_code.design_function(design, word_of)
        return page_code.close_function_after(name, word_of(called), written, constants, own)

    return NativeFunction(
        "close",
        CLOSE_SIGNATURE,
        lambda: (
            vector_code.HEAD
            + vector_code.design_function(design)
            + vector_code.close_function_after(_symbol(called), constants, own)
        ),
        lambda _: {_symbol(called): address_of(called, function_type(CLOSE_SIGNATURE).signature)},
        javascript,
    )


def _fill_function(called: Callable[..., None], program: Any, rows: int) -> NativeFunction:
    from explore.base.compiling import FILL_SIGNATURE, address_of, function_type
    from explore.mechanisms.linkages import page_code, vector_code
    from explore.mechanisms.linkages.native_code import NativeFunction

    return NativeFunction(
        "fill",
        FILL_SIGNATURE,
        lambda: vector_code.HEAD + vector_code.fill_function(program, before=_symbol(called), rows_before=rows),
        lambda _: {_symbol(called): address_of(called, function_type(FILL_SIGNATURE).signature)},
        lambda name, word_of: page_code.fill_function(name, program, word_of, word_of(called), rows),
    )


def _symbol(function: Any) -> str:
    """The name of a compiled function of this package in the texts of functions that call it."""
    return f"{function.__module__}.{function.__name__}".replace(".", "_")
