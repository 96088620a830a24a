"""A table as a mechanism: its signals, windows, statuses and drawing follow from the table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache

import numpy as np

from explore.mechanisms.linkages.drawing import draw_linkage, linkage_panels
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.modules import load_module
from explore.mechanisms.linkages.signals import Quantity, find_quantities
from explore.mechanisms.linkages.source import DISTANCE_ROW, Source, write_source
from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import LinkageTable
from explore.model.declaration import own_row
from explore.model.mechanism import Mechanism
from explore.model.quadrature import Located
from explore.model.quantities import FloatArray, Formula, Parameter, Signal
from explore.model.status import OwnStatus
from explore.model.window import Window

#: Code of the status of a crank that the first joint blocks.
FIRST_STATUS = 20
#: Version of the equations and of what follows from them; raised when a number changes.
_VERSION = "2"

_WINDOWS = (
    Window("cycle", "the full turn", "turn", needs_stroke=False),
    Window("interval", "an explicit interval of crank angles, { from = 0, to = 90 }", "interval", needs_stroke=False),
)
SPEED = Parameter("speed", "rad/s", "constant crank velocity", default=1.0, scales_speed=True)


#: Largest number of mechanisms of tables, and of kernels of them, that are kept.
_MOST_KEPT = 256


@lru_cache(_MOST_KEPT)
def linkage_mechanism(table: LinkageTable) -> Mechanism:
    """The mechanism of a table, with a kernel that fills all signals.

    Raises
    ------
    TableError
        If the table cannot be solved; see `steps.find_steps`.
    """
    return _specialise(table, None)


@lru_cache(_MOST_KEPT)
def _specialise(table: LinkageTable, names: frozenset[str] | None) -> Mechanism:
    """The mechanism with a kernel for the signals of these names, or for all; see `Mechanism.specialise`."""
    equations = Equations(table, find_steps(table))
    quantities = find_quantities(equations)
    wanted = [each for each in quantities if names is None or each.signal.name in names]
    others = [each for each in quantities if each not in wanted]
    rows = _Layout.of(equations, wanted, others)
    signals = tuple(rows.signals[each.signal.name] for each in quantities)
    full = _declare(table, equations, quantities, signals, rows.outputs)
    if not others:
        return full
    return _declare(table, equations, wanted, signals, rows.outputs[: rows.first_rows], full)


@dataclass(frozen=True)
class _Kernels:
    """The kernels of a table, each for some signals."""

    table: LinkageTable

    def __call__(self, names: frozenset[str]) -> Mechanism:
        return _specialise(self.table, names)


@dataclass
class _Layout:
    """Rows of the signals: those that are wanted, then the others."""

    outputs: list[Number]
    signals: dict[str, Signal]
    first_rows: int

    @classmethod
    def of(cls, equations: Equations, wanted: Sequence[Quantity], others: Sequence[Quantity]) -> _Layout:
        outputs: list[Number] = []
        signals: dict[str, Signal] = {}
        first_rows = 0
        for group in (wanted, others):
            first = len(outputs)
            outputs += [each.number for each in group]
            for row, each in enumerate(group, first):
                signals[each.signal.name] = replace(each.signal, row=row)
            if not outputs:
                outputs.append(equations.graph.constant(1.0))
            first_rows = first_rows or len(outputs)
        return cls(outputs, signals, first_rows)


def _declare(
    table: LinkageTable,
    equations: Equations,
    filled: Sequence[Quantity],
    signals: tuple[Signal, ...],
    outputs: Sequence[Number],
    extended: Mechanism | None = None,
) -> Mechanism:
    """The mechanism whose kernel fills some of the signals; `extended` fills all."""
    links = [each.link for each in filled if each.link]
    joints = list(dict.fromkeys(factor.joint for factor in equations.factors))
    source = write_source(equations, outputs, links, joints, FIRST_STATUS)
    module = load_module(source.text)
    parameters = tuple(
        Parameter(p.name, p.unit, p.meaning or p.name.replace("_", " "), p.default, p.lower, p.upper)
        for p in table.parameters
    )
    names = [signal.name for signal in signals]
    mover, axis = (table.output, "") if table.output else _last_mover(table)
    output = f"{mover}_velocity{axis}"
    defaults = [f"{output}_rms", f"{output}_peak", f"{mover}_acceleration{axis}_peak"]
    transmission = _transmission_angle(names)
    if transmission:
        defaults.insert(0, transmission.name)
    return Mechanism(
        name=f"linkage-{table.digest[:12]}",
        summary="a planar linkage that a table describes",
        parameters=(*parameters, SPEED),
        signals=signals,
        metrics=(),
        formulas=(transmission,) if transmission else (),
        windows=_WINDOWS,
        default_window="cycle",
        output_signals={"": output},
        zero_mean=frozenset((name, "cycle") for name in names if _returns(name, table)),
        default_metrics={"": tuple(defaults)},
        objectives=tuple(defaults[:1] + defaults[-1:]),
        kernel_version=f"{_VERSION}-{table.digest[:16]}",
        quadrature=Located(DISTANCE_ROW),
        n_constants=source.n_constants,
        keeps_constants=True,
        rows=_record_rows(source, [p.name for p in parameters]),
        signal_rows=len(outputs),
        close=module.close,
        fill=module.fill,
        disturbed_fill=module.disturbed_fill,
        statuses=_statuses(joints, {factor.joint for factor in equations.factors if factor.of_lines}),
        drawing=draw_linkage(table),
        panels=linkage_panels(table, signals),
        extended=extended,
        specialise=_Kernels(table),
        origin=table,
    )


def _last_mover(table: LinkageTable) -> tuple[str, str]:
    """The slot, link or point, with its axis, of the plain statistics where the table names no output."""
    slots = [slot.name for slot in table.slots if slot.name != table.driver]
    moving = [link.name for link in table.links if link.name != table.driver and link.name not in _slides(table)]
    return ([*moving, *slots][-1], "") if moving or slots else (table.points[-1], "_x")


def _slides(table: LinkageTable) -> set[str]:
    return {slide.link for slide in table.slides}


def _record_rows(source: Source, parameters: Sequence[str]) -> type[IntEnum]:
    first = source.n_constants + 1
    rows = {own_row(name): row for row, name in enumerate(parameters, first)}
    return IntEnum("LinkageRow", {"STATUS": source.n_constants, **rows})  # type: ignore[return-value]  # a type


def _statuses(joints: Sequence[str], of_lines: set[str]) -> dict[int, OwnStatus]:
    """Two statuses for each joint, blocked and too close to tell, and that of a turn that was not decided."""
    statuses = {}
    for k, joint in enumerate(joints):
        statuses[FIRST_STATUS + 2 * k] = OwnStatus(
            f"crank_blocked_at_{joint}", f"the crank cannot turn fully: {joint} is out of reach at some crank angles"
        )
        statuses[FIRST_STATUS + 2 * k + 1] = (
            OwnStatus(
                f"parallel_lines_at_{joint}",
                f"the two lines that place {joint} become parallel, or nearly so, at a crank angle: it has no place",
            )
            if joint in of_lines
            else OwnStatus(
                f"change_point_at_{joint}",
                f"two assemblies of {joint} meet at a crank angle, or are nearer to each other than rounding tells",
            )
        )
    statuses[FIRST_STATUS + 2 * len(joints)] = OwnStatus(
        "turn_not_decided", "whether the crank turns fully was not decided: joints are close to their limits too often"
    )
    return statuses


def _returns(name: str, table: LinkageTable) -> bool:
    """Whether a signal is a rate of what is the same after a turn; the angle of a link need not be."""
    rates = ("_velocity_x", "_velocity_y", "_acceleration_x", "_acceleration_y")
    slots = {f"{slot.name}_{rate}" for slot in table.slots for rate in ("velocity", "acceleration")}
    links = {f"{link.name}_acceleration" for link in table.links}
    return name.endswith(rates) or name in slots or name in links


def _transmission_angle(names: Sequence[str]) -> Formula | None:
    """The smallest transmission angle over all joints and the turn, each folded to at most 90 deg."""
    joints = [name for name in names if name.endswith("_transmission_angle")]
    if not joints:
        return None
    return Formula(
        "transmission_angle_min",
        "deg",
        "smallest transmission angle of all joints over the turn, or its supplement if that is smaller",
        "max",
        tuple(f"{joint}_{extreme}_cycle" for joint in joints for extreme in ("min", "max")),
        _fold,
        selects_one=True,
    )


def _fold(*extremes: FloatArray) -> FloatArray:
    """The least of all minima and of 180 deg less each maximum."""
    smallest = np.minimum.reduce(extremes[::2])
    return np.asarray(np.minimum(smallest, 180.0 - np.maximum.reduce(extremes[1::2])))
