"""Compiled closed forms over many designs at once: those of mechanisms, and of tables by their graph."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from numba import types

from explore.base.compiling import FILL_SIGNATURE, compiled, function_type
from explore.base.lanes.designs import fill_motion_of_design
from explore.comparison.methods.chains import ORIGIN
from explore.evaluation.windows import find_laws
from explore.mechanisms.linkages import statuses
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.kernel import Kernel, make_kernel
from explore.mechanisms.linkages.motions import close_table
from explore.mechanisms.linkages.steps import find_steps
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.linkages.vectors import dot, minus
from explore.mechanisms.loops import Columns, LoopDeclaration
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray, Signal
from explore.model.status import Status

#: Code of a crank that a joint blocks; the next one is that of a change point.
_BLOCKED = 3


@dataclass(frozen=True)
class Closed:
    """Designs whose motion is known in closed form.

    Attributes
    ----------
    status
        A code for each design.
    fill
        ``fill(angle, count)``: so many rows of the unknowns, then of their derivatives, at angles (n, t) in rad; not
        finite for designs without a motion.
    """

    status: npt.NDArray[np.int8]
    fill: Callable[[FloatArray, int], FloatArray]


class ClosedMotion(Protocol):
    """The closed form of a loop."""

    def close(self, columns: Columns) -> Closed:
        """Close designs with these parameters, of shape (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class MechanismMotion:
    """The closed form of a mechanism with functions of its own."""

    mechanism: Mechanism
    loop: LoopDeclaration

    def close(self, columns: Columns) -> Closed:
        """Close designs."""
        mechanism, count = self.mechanism, len(next(iter(columns.values())))
        declared = mechanism.kernel_parameters
        inputs = np.stack([columns.get(p.name, np.full(count, p.default)) for p in declared])
        usable = np.all([p.allows(values) for values, p in zip(inputs, declared, strict=True)], axis=0)
        result = mechanism.evaluate_closed_form(np.where(usable, inputs, 1.0), keeps_constants=True)
        result.constants[:, ~usable] = np.nan
        status = np.where(usable, result.status, np.int8(Status.NOT_FINITE))
        moving = [code for code, own in mechanism.statuses.items() if own.lacks_strokes]
        status[np.isin(status, moving)] = Status.OK

        def fill(angle: FloatArray, count: int) -> FloatArray:
            signals = [mechanism.signal(name) for name in self.loop.signals[: None if self.loop.motion else count]]
            values = self._fill(result.constants, angle, signals)
            if self.loop.motion is None:
                return values
            return self.loop.motion({name: c[:, None] for name, c in columns.items()}, angle, values)[:count]

        return Closed(status, fill)

    def _fill(self, constants: FloatArray, angle: FloatArray, signals: Sequence[Signal]) -> FloatArray:
        mechanism, laws = self.mechanism, np.zeros(angle.shape, dtype=np.int64)
        if mechanism.breaks:
            laws = np.stack([find_laws(mechanism, *each) for each in zip(constants.T, angle, strict=True)])
        needs = int(np.bitwise_or.reduce([signal.needs for signal in signals]))
        kept = constants[: mechanism.n_fill_constants or None]
        filled = _fill_all(mechanism.fill, kept, angle, mechanism.anchor_angle, laws, needs, mechanism.signal_rows)
        return np.stack([filled[:, signal.row] for signal in signals])


@dataclass(frozen=True, eq=False)
class TableMotion:
    """The closed form of a table, from its graph."""

    table: LinkageTable
    angles: Sequence[str]
    lengths: Sequence[str]

    def close(self, columns: Columns) -> Closed:
        """Close designs."""
        table, kernel = self.table, self._kernel
        inputs = np.stack([columns[p.name] for p in table.parameters], axis=1)
        start, end = np.deg2rad(table.limits or (0.0, 0.0))
        constants, status = close_table(kernel, inputs, (start, end - start))
        status[~np.isfinite(inputs).all(axis=1)] = Status.NOT_FINITE
        joints = status >= statuses.blocked_at(0)
        status[joints] = _BLOCKED + (status[joints] - statuses.blocked_at(0)) % 2

        def fill(angle: FloatArray, count: int) -> FloatArray:
            laws, turning = np.zeros(angle.shape, dtype=np.int64), len(self.angles)
            rows = 3 * (turning + len(self.lengths)) + turning
            filled = np.moveaxis(_fill_all(kernel.fill, constants, angle, 0.0, laws, 1, rows), 1, 0)
            angles = np.arctan2(filled[:turning], filled[turning : 2 * turning])
            return np.concatenate([angles, filled[2 * turning : turning + count]])

        return Closed(status, fill)

    @cached_property
    def _kernel(self) -> Kernel:
        equations = Equations(self.table, find_steps(self.table))
        directions = [equations.directions[link] for link in self.angles]
        slots = {slot.name: equations.slot_position(slot) for slot in self.table.slots}
        for slide in self.table.slides:
            origins = equations.place_of(slide.link, ORIGIN), equations.place_of(slide.body, ORIGIN)
            slots[slide.link] = dot(minus(*origins), equations.slide_direction(slide))
        places = [slots[name].terms for name in self.lengths]
        outputs = [part[axis].terms[0] for axis in (1, 0) for part in directions] + [place[0] for place in places]
        turning = [equations.turning_of(link) for link in self.angles]
        outputs += [each[order] for order in (0, 1) for each in [*turning, *(place[1:] for place in places)]]
        joints = list(dict.fromkeys(factor.joint for factor in equations.factors))
        return make_kernel(equations, outputs, [], joints, (), (), tells_reach=False)


def table_motion(table: LinkageTable, angles: Sequence[str], lengths: Sequence[str]) -> TableMotion:
    """The closed form of a table for unknown angles of links, and positions in slots and along slides."""
    moving = tuple(p for p in table.parameters if p.name in table.moving_names)
    return TableMotion(replace(table, loads=None, parameters=moving), angles, lengths)


def _fill_all(
    fill: Any, constants: FloatArray, angle: FloatArray, anchor: float, laws: npt.NDArray[np.int64], needs: int,
    rows: int,
) -> FloatArray:  # fmt: skip
    """Rows of signals, (n, rows, t), at angles (n, t) from the anchor, which is 0 or a quarter of a turn."""
    # tan(x/2) = sin x/(1 + cos x): a difference from half a turn would lose the digits beside it
    sine, cosine = np.sin(np.ascontiguousarray(angle)), np.cos(np.ascontiguousarray(angle))
    along, across = (cosine, sine) if anchor == 0.0 else (sine, -cosine)
    anchors = (along < 0.0).astype(np.int64)
    tangents = np.where(along < 0.0, -across, across) / (1.0 + np.abs(along))
    filled = np.zeros((constants.shape[1], rows, angle.shape[1]))
    _fill_motions(fill, np.ascontiguousarray(constants.T), anchors, laws, np.ascontiguousarray(tangents), needs, rows,
                  filled)  # fmt: skip
    return filled


@compiled(
    types.void(
        function_type(FILL_SIGNATURE), types.float64[:, ::1], types.int64[:, ::1], types.int64[:, ::1],
        types.float64[:, ::1], types.int64, types.int64, types.float64[:, :, ::1],
    ),
    allocates=True,
)  # fmt: skip
def _fill_motions(fill, constants, anchors, laws, tangents, needs, rows, signals):
    """Fill the signals of many designs, shape (n, rows, t), each at its own angles; see `fill_motion_of_design`."""
    for i in range(constants.shape[0]):
        fill_motion_of_design(fill, constants[i], anchors[i], laws[i], tangents[i], 0, needs, rows, signals[i])
