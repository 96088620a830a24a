"""The output of designs over its strokes: windows, and a rule that averages the velocities of any method."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.contract import Level, Task
from explore.comparison.methods.loop import Loop
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, COUNT, HALF, PANEL_CAPACITY, SCALE, TARGET, count_nodes
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.windows import map_window, window_ends
from explore.model.columns import Arrays
from explore.model.mechanism import Mechanism
from explore.model.quadrature import Adaptive, Graded
from explore.model.quantities import FloatArray
from explore.model.status import Status

_LOG_TOLERANCE = float(np.log(1e-13))
#: The windows in which outputs are averaged: the slower stroke and the full turn.
WINDOWS = ("drive", "cycle")


@dataclass(frozen=True, eq=False)
class Designs:
    """Designs of a mechanism with a loop; columns of all parameters, of shape (n,)."""

    mechanism: Mechanism
    loop: Loop
    columns: Arrays

    def __len__(self) -> int:
        """Number of designs."""
        return len(next(iter(self.columns.values())))

    @property
    def parameters(self) -> FloatArray:
        """Those of the loop, shape (n, p)."""
        return np.column_stack([self.columns[name] for name in self.loop.parameters])

    def task(self, angles: FloatArray, level: Level = Level.ACCELERATIONS) -> Task:
        """The motion of all designs at crank angles (n, t)."""
        return Task(self.loop, self.parameters, angles, level)

    def part(self, which: npt.NDArray[Any]) -> Designs:
        """Some of the designs."""
        return replace(self, columns={name: column[which] for name, column in self.columns.items()})

    @cached_property
    def output(self) -> tuple[str, str, str] | None:
        """Position, velocity and acceleration that are averaged; None where no unknown of the loop is the output."""
        velocity, declared = self.mechanism.output_signals[""], self.mechanism.loop
        is_graded = not isinstance(self.mechanism.quadrature, Adaptive)
        if not is_graded or not {window.name for window in self.mechanism.windows}.issuperset(WINDOWS):
            return None
        if declared is not None:
            first, m = declared.signals.index(velocity) - self.loop.count, self.loop.count
            position, velocity, acceleration = declared.signals[first::m][:3]
            return position, velocity, acceleration
        name = velocity.removesuffix("_velocity")
        kind = "angle" if name in self.loop.angles else "position"
        return (f"{name}_{kind}", velocity, f"{name}_acceleration") if name in self._unknowns else None

    @property
    def _unknowns(self) -> tuple[str, ...]:
        slots = {slot.name for slot in self.loop.table.slots}
        return (*self.loop.angles, *(name if name in slots else "" for name in self.loop.lengths))

    @property
    def row(self) -> int:
        """Number of the unknown that is the output."""
        position, velocity, _ = self.output or ("", "", "")
        if self.mechanism.loop is not None:
            return int(self.mechanism.loop.signals.index(position))
        return self._unknowns.index(velocity.removesuffix("_velocity"))

    @cached_property
    def has_strokes(self) -> npt.NDArray[np.bool_]:
        """Whether each design has the whole motion and two strokes."""
        return np.asarray(self.mechanism.evaluate_closed_form(self._inputs).status == Status.OK)

    @property
    def _inputs(self) -> FloatArray:
        count = len(self)
        return np.stack([
            self.columns.get(p.name, np.full(count, p.default)) for p in self.mechanism.kernel_parameters
        ])  # fmt: skip

    @property
    def constants(self) -> FloatArray:
        """The constants of all designs, which have strokes."""
        return self.mechanism.constants(self._inputs)

    def ends(self, window: str) -> FloatArray:
        """First and last crank angle of a window (rad), shape (n, 2); NaN for a design without strokes."""
        ends = np.full((len(self), 2), np.nan)
        if window == "cycle":
            ends[self.has_strokes] = [0.0, 2.0 * np.pi]
        elif self.has_strokes.any():
            constants = self.part(self.has_strokes).constants
            ends[self.has_strokes] = window_ends(self.mechanism, constants, self.mechanism.window(window), "slow")
        return ends


def stroke_nodes(designs: Designs) -> tuple[FloatArray, FloatArray] | None:
    """Nodes, rad, and weights of the graded rule over the slow stroke, as many as the hardest design needs, (n, t).

    Designs without strokes have the nodes of the first design with strokes. None where there is none, or where the
    singularities are not known one by one.
    """
    n, rocks, mechanism = len(designs), np.flatnonzero(designs.has_strokes), designs.mechanism
    if not isinstance(mechanism.quadrature, Graded) or not len(rocks):
        return None
    mapped = map_window(mechanism, designs.part(rocks).constants, mechanism.window("drive"), "slow")
    panels = np.concatenate(mapped, axis=1)
    if len({panels_of_one.shape for panels_of_one in mapped}) > 1 or panels.shape[1] > PANEL_CAPACITY:
        return None
    buffer = np.zeros((panels.shape[0], PANEL_CAPACITY))
    buffer[:, : panels.shape[1]] = panels
    buffer[TARGET // PANEL_CAPACITY] = _LOG_TOLERANCE
    count_nodes(buffer.reshape(-1), panels.shape[1], 2)
    size_of, row_of, table = gauss_legendre_rules()
    count = int(size_of[int(buffer[COUNT // PANEL_CAPACITY, : panels.shape[1]].max())])
    stored = table[row_of[count] : row_of[count] + (count + 1) // 2]  # half of the abscissas, descending, and weights
    mirrored = stored[count // 2 - 1 :: -1]
    abscissas = np.concatenate([-stored[:, 0], mirrored[:, 0]])
    rule = np.concatenate([stored[:, 1], mirrored[:, 1]])
    anchor, centre, half, scale = (panels[row // PANEL_CAPACITY][:, None] for row in (ANCHOR, CENTRE, HALF, SCALE))
    t = centre + half * abscissas
    tangent = scale * np.sinh(t)
    nodes = mechanism.anchor_angle + np.pi * anchor + 2.0 * np.arctan(tangent)
    weights = 2.0 * half * rule * scale * np.cosh(t) / (1.0 + tangent * tangent)
    which = np.searchsorted(rocks, np.arange(n)) % len(rocks)
    which[~designs.has_strokes] = 0
    return nodes.reshape(len(rocks), -1)[which], weights.reshape(len(rocks), -1)[which]


def coefficient_of_variation(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Standard deviation over absolute mean, shape (n,), from values and weights at nodes, both (n, t)."""
    length = weights.sum(axis=-1)
    mean = (weights * values).sum(axis=-1) / length
    variance = (weights * (values - mean[:, None]) ** 2).sum(axis=-1) / length
    return np.asarray(np.sqrt(variance) / np.abs(mean))
