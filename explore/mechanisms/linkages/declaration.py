"""A table as a mechanism: its signals, windows, statuses and drawing follow from the table."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache, partial
from typing import Any

from explore.base.units.quantities import exact_angle
from explore.mechanisms.linkages.drawing import draw_linkage, linkage_panels
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.kernel import Kernel, make_kernel, parameter_names
from explore.mechanisms.linkages.load_signals import balanced_signals, sense_signals
from explore.mechanisms.linkages.loads import AMOUNTS, SPEED
from explore.mechanisms.linkages.metrics import CLOSED_METRICS, REACH_NAMES, declare_formulas
from explore.mechanisms.linkages.motions import declare_targets
from explore.mechanisms.linkages.programs import (
    CLOSED_ERROR_ROW,
    DISTANCE_ROW,
    GREATEST_ROW,
    LEAST_ROW,
    MIDDLE_ROW,
    OTHERS_ROW,
    REACH_ROW,
    SINGULAR_ANGLE_ROW,
)
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.signals import find_quantities
from explore.mechanisms.linkages.statuses import declare_statuses
from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import PREFIX, LinkageTable
from explore.mechanisms.linkages.trace import Loop
from explore.mechanisms.linkages.turning import ROUNDING
from explore.model.declaration import INTERVAL_ROWS, own_row
from explore.model.mechanism import Mechanism
from explore.model.quadrature import Located
from explore.model.quantities import Parameter, Signal
from explore.model.window import INTERVAL, Window

#: Version of the equations and of what follows from them; raised when a number changes.
_VERSION = "41"

_STROKES = ("forward", "backward")
_WINDOWS = (
    Window("cycle", "the full turn", "turn", needs_stroke=False),
    Window("drive", "the stroke that works (setting `drive`)", "drive"),
    Window("return", "the other stroke", "return"),
    Window(_STROKES[0], "from the output's least place or angle to its greatest", "arc", ("least", "greatest")),
    Window(_STROKES[1], "from the output's greatest place or angle to its least", "arc", ("greatest", "least")),
    INTERVAL,
)
#: Largest number of mechanisms of tables, and of kernels of them, that are kept.
_MOST_KEPT = 64


@lru_cache(_MOST_KEPT)
def linkage_mechanism(table: LinkageTable) -> Mechanism:
    """The mechanism of a table, with a kernel that fills all signals.

    Raises
    ------
    TableError
        If the table cannot be solved; see `steps.find_steps`.
    """
    return _specialise(table, None, needs_stroke=table.limits is None)


@lru_cache(_MOST_KEPT)
def _specialise(table: LinkageTable, names: frozenset[str] | None, *, needs_stroke: bool) -> Mechanism:
    """The mechanism with a kernel for the signals and metrics of these names, or for all; see `Mechanism.specialise`.

    Only with `needs_stroke` it looks for strokes, and without names or with one of `REACH_NAMES` for the intervals at
    which designs assemble that do not turn.
    """
    equations = Equations(table, find_steps(table))
    quantities = find_quantities(equations)
    specialised = None if names is None else (names, needs_stroke)
    tells_reach = names is None or not names.isdisjoint(REACH_NAMES)
    if names is not None:
        names = names.union(*(each.signal.corners_at for each in quantities if each.signal.name in names))
    wanted = [each for each in quantities if names is None or each.signal.name in names]
    others = [each for each in quantities if each not in wanted]
    needs_stroke |= any(each.signal.needs_stroke for each in wanted) and table.limits is None
    # The wanted rows are the first ones; a kernel has a row at least.
    outputs, row_of = _lay_rows(wanted)
    outputs = outputs or [equations.graph.constant(1.0)]
    first_rows = len(outputs)
    more, others_row_of = _lay_rows(others, first_rows)
    outputs, row_of = outputs + more, row_of | others_row_of
    signals = tuple(
        replace(each.signal, row=row_of[each.signal.name], lag_row=row_of.get(f"{each.signal.name} lag", -1))
        for each in quantities
    )
    declare = partial(_declare, needs_stroke=needs_stroke, tells_reach=tells_reach, specialised=specialised)
    full = declare(table, equations, quantities, signals, outputs)
    if not others:
        return full
    return declare(table, equations, wanted, signals, outputs[:first_rows], full)


def _lay_rows(quantities: Sequence[Quantity], first: int = 0) -> tuple[list[Number], dict[str, int]]:
    """The numbers of rows from a first one on, and the rows of quantities, with those of lags, by name."""
    numbers = {each.signal.name: each.number for each in quantities}
    numbers |= {f"{each.signal.name} lag": each.lag_rate for each in quantities if each.lag_rate is not None}
    return [*numbers.values()], {name: row for row, name in enumerate(numbers, first)}


@dataclass(frozen=True)
class _Kernels:
    """The kernels of a table, each for some signals."""

    table: LinkageTable

    def __call__(self, names: frozenset[str], *, needs_stroke: bool) -> Mechanism:
        return _specialise(self.table, names, needs_stroke=needs_stroke and self.table.limits is None)


def _declare(
    table: LinkageTable,
    equations: Equations,
    filled: Sequence[Quantity],
    signals: tuple[Signal, ...],
    outputs: Sequence[Number],
    extended: Mechanism | None = None,
    *,
    needs_stroke: bool,
    tells_reach: bool,
    specialised: tuple[frozenset[str], bool] | None,
) -> Mechanism:
    """The mechanism whose kernel fills some of the signals; `extended` fills all."""
    links = list(dict.fromkeys(link for each in filled for link in each.links))
    squares = list(dict.fromkeys(square for each in filled for square in each.squares))
    joints = list(dict.fromkeys(factor.joint for factor in equations.factors))
    mover, axis = (table.output, "") if table.output else _last_mover(table)
    output, change = f"{mover}_velocity{axis}", f"{mover}_acceleration{axis}"
    rate = _rate_of(equations, output, change, links) if needs_stroke else ()
    windows = (_range(*table.limits), INTERVAL) if table.limits else _WINDOWS
    turns = windows is _WINDOWS
    loops, integrated_rows = _integrated(equations, filled, signals) if turns else ({}, ())
    kernel = make_kernel(equations, outputs, links, joints, rate, squares, tells_reach=tells_reach, loops=loops)
    formulas = declare_formulas(table, signals, mover, axis, windows[0].name)
    defaults = [f"{output}_rms", f"{output}_peak", f"{change}_peak"]
    if any(formula.name == "transmission_angle_min" for formula in formulas):
        defaults.insert(0, "transmission_angle_min")
    return Mechanism(
        name=f"{PREFIX}{table.digest[:12]}",
        called="this linkage",
        summary="a planar linkage that a table describes",
        # `crank_angle` may be that of a driven link, and no link is named drive.
        input_angle=f"{'drive' if any(signal.name == 'crank_angle' for signal in signals) else 'crank'} angle",
        parameters=tuple(_parameters(table)),
        signals=signals,
        formulas=formulas,
        windows=windows,
        senses=sense_signals(equations),
        default_window=windows[0].name,
        output_signals={"": output},
        default_metrics={"": tuple(defaults)},
        objectives=tuple(defaults[:1] + defaults[-1:]),
        kernel_version=f"{_VERSION}-{table.digest[:16]}",
        quadrature=Located(
            DISTANCE_ROW, MIDDLE_ROW, REACH_ROW, SINGULAR_ANGLE_ROW, OTHERS_ROW, knows_places=kernel.knows_places
        ),
        n_constants=kernel.n_constants,
        keeps_constants=bool(table.limits) or not kernel.closes_quickly,
        takes_interval=True,
        rows=_record_rows(kernel, parameter_names(table), "" if turns else "_"),
        signal_rows=len(outputs),
        integrals=kernel.turn_moments,
        integrated_rows=integrated_rows,
        integrates_turns_alone=turns,
        close=kernel.close,
        fill=kernel.fill,
        disturbed_fill=kernel.disturbed_fill,
        precise_close=kernel.precise_close,
        precise_fill=kernel.precise_fill,
        disturbed_precise_fill=kernel.disturbed_precise_fill,
        statuses=declare_statuses(
            joints,
            {factor.joint for factor in equations.factors if factor.of_lines},
            turns=turns,
            is_pin=table.driven_slot is not None,
            has_groups=bool(equations.groups),
        ),
        drawing=draw_linkage(table),
        targets=declare_targets(table, [f"{name}:max" for name in defaults if name == "transmission_angle_min"]),
        panels=linkage_panels(table, signals),
        extended=extended,
        specialise=_Kernels(table),
        specialised=specialised,
        table=table,
        **(_of_a_turn(table, signals, change) if turns else {"metrics": (), "zero_mean": frozenset()}),
    )


def _integrated(
    equations: Equations, filled: Sequence[Quantity], signals: Sequence[Signal]
) -> tuple[dict[Loop, list[int]], tuple[int, ...]]:
    """Loops with the places of their links among signals whose moments over the turn are known, and these rows."""
    names, row_of = {each.signal.name for each in filled}, {signal.name: signal.row for signal in signals}
    loops: dict[Loop, list[int]] = {}
    rows: list[int] = []
    for loop in equations.loops:
        velocities = [f"{link}_velocity" for link in loop.links]
        found = [name for name in velocities if name in names]
        if found:
            loops[loop] = [len(rows) + found.index(name) if name in names else -1 for name in velocities]
            rows += [row_of[name] for name in found]
    return loops, tuple(rows)


def _of_a_turn(table: LinkageTable, signals: tuple[Signal, ...], change: str) -> dict[str, Any]:
    """What mechanisms declare whose driver turns fully: strokes, what ends them, and what follows from periods."""
    return {
        "metrics": CLOSED_METRICS,
        "strokes": _STROKES,
        "drives": ("slow", "fast", *_STROKES),
        "marks": {"least": LEAST_ROW, "greatest": GREATEST_ROW},
        "closed_error_row": CLOSED_ERROR_ROW,
        "zero_mean": _zero_means(table, signals, change),
    }


def _range(first: float, last: float) -> Window:
    """The window of all crank angles of a driver that does not turn fully, deg."""
    start, stop = exact_angle(first), exact_angle(last)
    words = f"the crank angles from {first:g} to {last:g} deg"
    return Window("range", words, "interval", needs_stroke=False, start=start, stop=stop)


def _parameters(table: LinkageTable) -> Iterator[Parameter]:
    for p in table.parameters:
        yield Parameter(
            p.name, p.unit, p.meaning or p.name.replace("_", " "), p.default,
            max(p.lower, 0.0) if p.unit in AMOUNTS else p.lower, p.upper,
            zero_meaning="none" if p.unit in AMOUNTS else "",
            affects="motion" if p.name in table.moving_names else "load",
        )  # fmt: skip
    is_dynamic = SPEED in parameter_names(table)
    words = "constant crank velocity"
    yield Parameter(SPEED, "rad/s", words, default=1.0, scales_speed=True, is_dynamic=is_dynamic)


def _zero_means(table: LinkageTable, signals: Sequence[Signal], change: str) -> frozenset[tuple[str, str]]:
    """Signals and windows of a mean of exactly 0: rates over the turn, and the change of the output over a stroke."""
    rates = [(signal.name, "cycle") for signal in signals if _returns(signal.name, table)]
    balanced = [(name, "cycle") for name in balanced_signals(table)]
    return frozenset([*rates, *balanced, *((change, window) for window in ("drive", "return", *_STROKES))])


def _last_mover(table: LinkageTable) -> tuple[str, str]:
    """The slot, link or point, with its axis, of the plain statistics where the table names no output."""
    slots = [slot.name for slot in table.slots if slot.name != table.driver]
    moving = [link.name for link in table.links if link.name != table.driver and link.name not in _slides(table)]
    return ([*moving, *slots][-1], "") if moving or slots else (table.points[-1], "_x")


def _slides(table: LinkageTable) -> set[str]:
    return {slide.link for slide in table.slides}


def _record_rows(kernel: Kernel, parameters: Sequence[str], mark: str) -> type[IntEnum]:
    """The rows of a record; those of the closed-form metrics are marked."""
    first = kernel.n_constants + 1
    names = [*map(own_row, parameters), *INTERVAL_ROWS, *(f"{mark}{metric.name.upper()}" for metric in CLOSED_METRICS)]
    rows = {name: row for row, name in enumerate(names, first)}
    return IntEnum("LinkageRow", {"STATUS": kernel.n_constants, **rows})  # type: ignore[return-value]  # a type


def _rate_of(equations: Equations, rate: str, change: str, links: Sequence[str]) -> tuple[Number, ...]:
    """The rate of the output, its slope by the angle, the rounding error of both, and its place, for `reversals`.

    The angle of a link is 0 unless it is one of the `links` whose references are filled.
    """
    by_name, table = {each.signal.name: each for each in find_quantities(equations)}, equations.table
    is_placed = table.output in (*links, *table.sliders)
    place = equations.output_place() if is_placed else equations.graph.constant(0.0)
    size = equations.size if by_name[rate].signal.unit.startswith("mm") else equations.graph.constant(1.0)
    return by_name[rate].number, by_name[change].number, size * equations.condition.sqrt() * ROUNDING, place


def _returns(name: str, table: LinkageTable) -> bool:
    """Whether a signal is a rate of what is the same after a turn; the angle of a link need not be."""
    rates = ("_velocity_x", "_velocity_y", "_acceleration_x", "_acceleration_y")
    sliders = {f"{name}_{rate}" for name in table.sliders for rate in ("velocity", "acceleration")}
    links = {f"{link.name}_acceleration" for link in table.links}
    return name.endswith(rates) or name in sliders or name in links
