"""A mechanism: its declaration and its compiled functions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.model.checks import check_declaration
from explore.model.declaration import Declaration
from explore.model.points import (
    draw_points,
    drawn_name,
    include_points,
    point_panels,
    point_parameters,
    point_signals,
    zero_means,
)
from explore.model.quantities import FloatArray, GivenMetric, Signal
from explore.model.status import Status
from explore.model.targets import Target
from explore.model.window import Window


@dataclass(frozen=True)
class ClosedFormResult:
    """What the compiled closed form of a mechanism fills for n designs.

    Constants (k, n) are the first rows of the records, as many as were asked for. Metrics (m, n) are in declared order
    and units, NaN where undefined; status (n,) has codes of `Declaration.status_labels`.
    """

    constants: FloatArray
    metrics: FloatArray
    status: npt.NDArray[np.int8]


@dataclass(frozen=True, kw_only=True)
class Mechanism(Declaration):
    """A declaration and two or three compiled functions; everything else is generic.

    A declaration that contradicts itself or the kernel raises ValueError when the mechanism is made.

    Attributes
    ----------
    close
        ``close(record)`` fills the rows of a tile of LANES designs, ``record[row * LANES + lane]``, from those of the
        parameters: first the constants, which `fill` and the windows take, then the status and the metrics.
    fill
        ``fill(constants, tangents, anchor, law, variant, count, needs, out)`` fills the signals at `count` nodes of
        each lane: ``out[(node * signal_rows + row) * LANES + lane]`` from ``tangents[node * LANES + lane]``, the
        half-tangent of the node's angle from the anchor (0) or its opposite (1). `law` and `variant` are the same in
        all lanes.
    disturbed_fill
        Like `fill`, with every operation disturbed as `explore.base.lanes.disturbance` says: it tells how each signal
        amplifies rounding errors. None where `noise_row`, the terms and the lengths of signals tell that.
    precise_fill, disturbed_precise_fill
        The same with more digits, for designs that miss their tolerance by the rounding of `fill`; the second one
        disturbs half-tangents and the operations of the first as much as they are rounded. None where there are none.
    precise_close
        Like `close`, with the marks that windows end at to the last digit of doubles. None where there are no marks.
    integrals
        ``integrals(constants, starts, stops, out)`` fills mean, variance and bounds of their absolute errors for unit
        speed, the row ``out[(k * INTEGRALS + j) * LANES + lane]`` for each number k of `integrated_rows`, over the
        window between two half-tangents from the anchor, ``starts[lane]`` and ``stops[lane]``, or over the full turn
        where both are half a turn off. A bound is NaN where there is no closed form. None where there is no function.
    specialise
        ``specialise(names, needs_stroke=...)`` is the same mechanism with a kernel that fills the signals and metrics
        of these names and no others, and strokes only if they are needed. None for a mechanism whose whole kernel is
        written by hand.
    specialised
        With which names, and whether with strokes, `specialise` made it from a table; None for one with all.
    loop
        Its loop as a table, a `LoopDeclaration`, so that other methods solve it too; None for none, or where it was
        made from a table.
    """

    close: Callable[..., None]
    fill: Callable[..., None]
    disturbed_fill: Callable[..., None] | None = None
    precise_close: Callable[..., None] | None = None
    precise_fill: Callable[..., None] | None = None
    disturbed_precise_fill: Callable[..., None] | None = None
    integrals: Callable[..., None] | None = None
    extended: Mechanism | None = None
    specialise: Callable[..., Mechanism] | None = None
    specialised: tuple[frozenset[str], bool] | None = None
    loop: Any = None

    def __post_init__(self) -> None:
        for name in ("close", "fill"):
            function = getattr(self, name)  # told without loading Numba
            if not hasattr(function, "py_func") and not hasattr(function, "__wrapper_address__"):
                raise ValueError(
                    f"mechanism '{self.name}': {name} is not compiled; decorate it with explore.base.compiling.compiled"
                )
        check_declaration(self)
        if (self.integrals is None) != (not self.integrated_rows):
            raise ValueError(f"mechanism '{self.name}': integrals and integrated_rows are given together or not at all")
        if (self.precise_fill is None) != (self.disturbed_precise_fill is None):
            raise ValueError(f"mechanism '{self.name}': precise_fill and disturbed_precise_fill are given together")

    @property
    def knows_rounding(self) -> bool:
        """Whether the rounding errors of every signal follow from a disturbed kernel."""
        return self.disturbed_fill is not None

    @property
    def moving_statuses(self) -> tuple[int, ...]:
        """Codes of the statuses of designs with a motion, with strokes or without."""
        return (int(Status.OK), *(code for code, status in self.statuses.items() if status.lacks_strokes))

    def kernel_of(self, signals: Iterable[Signal]) -> Mechanism:
        """The mechanism itself, or its extended one if it does not fill all of these signals."""
        if self.extended is None or all(self.fills(signal) for signal in signals):
            return self
        return self.extended

    def for_signals(self, names: Iterable[str], *, needs_stroke: bool = False) -> Mechanism:
        """The mechanism with a kernel for signals and metrics of these names; itself where it has one for all."""
        if not self.specialise:
            return self
        return (
            self.specialise(frozenset(names), needs_stroke=needs_stroke).with_given(self.given).with_target(self.target)
        )

    def drawn_point(self, name: str) -> str:
        """What the drawing calls a point that can meet a target."""
        return drawn_name(name) if name in self.points else name

    @cached_property
    def precise(self) -> Mechanism | None:
        """The mechanism by its precise functions, for signals that it fills itself; None where it has none."""
        if self.precise_fill is None:
            return None
        close = self.precise_close or self.close
        return replace(self, close=close, fill=self.precise_fill, disturbed_fill=self.disturbed_precise_fill)

    def with_points(self, points: tuple[str, ...]) -> Mechanism:
        """The mechanism with points of its floating link: their parameters, signals, panels, paths, and overall size.

        The names are unique and are none of the mechanism's; `explore.studies.request.points` checks them.
        """
        link = self.floating_link
        if not points or link is None:
            return self
        if link.kernels:
            with_kernels: Mechanism = link.kernels(self, points)
            return with_kernels
        extended = self.extended.with_points(points) if self.extended else None
        return self.declare_points(points, (*self.signals, *point_signals(link, points)), extended=extended)

    def declare_points(self, points: tuple[str, ...], signals: tuple[Signal, ...], **kernel: Any) -> Mechanism:
        """The mechanism with points and all its signals, theirs too, and with other fields of its kernel."""
        link = self.floating_link
        if link is None:
            raise ValueError(f"mechanism '{self.name}' has no floating link")
        return replace(
            self,
            points=points,
            parameters=(*self.parameters, *point_parameters(link, points)),
            signals=signals,
            zero_mean=self.zero_mean | zero_means(points, self.whole_motion.name),
            formulas=tuple(include_points(formula, points, self.whole_motion.name) for formula in self.formulas),
            drawing=draw_points(self.drawing, link, points) if self.drawing else None,
            panels=(*self.declared_panels, *point_panels(points)),
            **kernel,
        )

    def with_target(self, target: Target | None) -> Mechanism:
        """The mechanism with a target: what places it on the target as parameters, metrics of the error, new defaults.

        It has the point of the target; `studies.request.targets` checks that. The statistics are over the full turn
        unless a study names a window, because a target can be met anywhere in it.
        """
        if target is None:
            return self
        kind = self.targets[target.kind]
        formulas = kind.formulas(target)
        absent = set(kind.alternatives).difference(formula.name for formula in formulas)
        defaults = [name for name in kind.defaults if name not in absent]
        return replace(
            self,
            target=target,
            parameters=(*self.parameters, *kind.parameters),
            formulas=(*self.formulas, *formulas),
            default_metrics={
                window: tuple(dict.fromkeys((*names, *defaults))) for window, names in self.default_metrics.items()
            },
            default_window=self.whole_motion.name,
            objectives=tuple(each for each in kind.objectives if each.partition(":")[0] not in absent),
            extended=self.extended.with_target(target) if self.extended else None,
        )

    def with_given(self, metrics: tuple[GivenMetric, ...]) -> Mechanism:
        """The mechanism with metrics whose values come with the designs."""
        extended = self.extended.with_given(metrics) if self.extended else None
        return replace(self, given=metrics, extended=extended) if metrics else self

    def evaluate_closed_form(
        self, parameters: FloatArray, interval: Window | None = None, *, keeps_constants: bool = False
    ) -> ClosedFormResult:
        """Evaluate the closed form for `kernel_parameters` (p, n), in declared units.

        The result has all constants if they are to be kept; else the first ones, up to the closed error. A mechanism
        that takes an interval is to move over that, in place of its whole motion.
        """
        return self._close(parameters, interval, keeps_constants=keeps_constants or self.keeps_constants)

    def constants(self, parameters: FloatArray, interval: Window | None = None) -> FloatArray:
        """The constants of designs, shape (k, n); see `evaluate_closed_form`."""
        return self._close(parameters, interval, keeps_constants=True).constants

    def _close(self, parameters: FloatArray, interval: Window | None, *, keeps_constants: bool) -> ClosedFormResult:
        from explore.base.compiling import CLOSE_SIGNATURE, as_argument  # imports Numba, needed only here
        from explore.base.lanes.designs import close_all

        interval = interval or self.limits
        if interval is not None:
            ends = [math.radians(interval.start), math.radians(interval.length)]
            parameters = np.vstack([parameters, np.repeat(np.array(ends)[:, None], parameters.shape[1], axis=1)])
        n_constants = self.n_constants if keeps_constants else self.closed_error_row + 1
        n = parameters.shape[1]
        shapes = np.empty((n_constants, n)), np.empty((len(self.metrics), n))
        result = ClosedFormResult(*shapes, np.zeros(n, dtype=np.int8))
        inputs = np.ascontiguousarray(parameters, dtype=np.float64)
        close_all(
            as_argument(self.close, CLOSE_SIGNATURE), inputs, self.record_rows, self.first_parameter,
            self.first_metric, self.status_row, result.constants, result.metrics, result.status,
        )  # fmt: skip
        return result
