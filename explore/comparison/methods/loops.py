"""The loops of mechanisms: of a table, or of the table that a mechanism declares."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from explore.base.errors import RequestError
from explore.comparison.methods.chains import find_chains
from explore.comparison.methods.kernels import MechanismMotion, table_motion
from explore.comparison.methods.loop import Loop
from explore.mechanisms.linkages.table import PREFIX, LinkageTable
from explore.mechanisms.loops import Columns, LoopDeclaration
from explore.mechanisms.registry import MECHANISMS
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray

#: Number of loops of tables that are kept.
_MOST_KEPT = 16


def find_loop(mechanism: Mechanism) -> Loop:
    """The loop of a mechanism; `RequestError` if the methods know none."""
    if mechanism.loop is not None:
        return _declared_loop(mechanism)
    if isinstance(mechanism.table, LinkageTable) and mechanism.name.startswith(PREFIX):
        return _loop_of_table(mechanism.table, mechanism.name)
    others = ", ".join(each.name for each in MECHANISMS.load_all()[0].values() if each.loop is not None)
    raise RequestError(f"{mechanism.name} has only the closed form; other methods solve {others}, and linkages")


@lru_cache(_MOST_KEPT)
def _loop_of_table(table: LinkageTable, name: str) -> Loop:
    chains = find_chains(table)
    closed = table_motion(table, chains.angles, chains.lengths)
    names = tuple(parameter.name for parameter in closed.table.parameters)
    return Loop(name, table, names, **vars(chains), closed=closed)


def _declared_loop(mechanism: Mechanism) -> Loop:
    declared: LoopDeclaration = mechanism.loop
    chains = find_chains(declared.table, declared.table.slots[-1].name if declared.law else "")
    names = tuple(p.name for p in mechanism.kernel_parameters if p.name in declared.design or p.name == "branch")
    side = None
    if (singular_angle := declared.singular_angle) is not None:

        def side(columns: Columns, angle: Any, functions: Any) -> Any:
            return functions.sign(functions.cos(angle) - functions.cos(singular_angle(columns, functions)))

    closed = MechanismMotion(mechanism, declared)
    return Loop(mechanism.name, declared.table, names, **vars(chains), closed=closed, law=declared.law, side=side)


def follow_unknowns(mechanism: Mechanism, loop: Loop, inputs: Columns, values: FloatArray) -> Mapping[str, FloatArray]:
    """The signals of a mechanism, in its kernel's units, that follow from unknowns and both derivatives, (3 m, t)."""
    declared: LoopDeclaration | None = mechanism.loop
    if declared is not None:
        own = {} if declared.motion else dict(zip(declared.signals, values, strict=True))
        return {**own, **(declared.derived(inputs, values) if declared.derived else {})}
    kinds = {**dict.fromkeys(loop.angles, "angle"), **dict.fromkeys(loop.lengths, "position")}
    orders = [(name, (kind, "velocity", "acceleration")[order]) for order in range(3) for name, kind in kinds.items()]
    rows = {f"{name}_{word}": row for (name, word), row in zip(orders, values, strict=True)}
    known = {signal.name for signal in mechanism.signals}
    return {name: row for name, row in rows.items() if name in known}
