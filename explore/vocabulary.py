"""The words of the field, as frozen data: what a mechanism declares and what the rest passes around.

Those of `explore.quantities` are among them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy.typing as npt

from explore.quantities import (
    MAGNITUDE_STATISTICS,
    OMITTED,
    STATISTICS,
    AnyMetric,
    DerivedMetric,
    FloatArray,
    Formula,
    Metric,
    Parameter,
    SampledMetric,
    Sense,
    Signal,
    Window,
)  # fmt: skip
from explore.statuses import Status

__all__ = [
    "MAGNITUDE_STATISTICS",
    "OMITTED",
    "STATISTICS",
    "AnyMetric",
    "Block",
    "Column",
    "Columns",
    "Constraint",
    "DerivedMetric",
    "FloatArray",
    "Formula",
    "Mechanism",
    "Metric",
    "Objective",
    "Parameter",
    "Request",
    "SampledMetric",
    "Sense",
    "Signal",
    "Status",
    "Window",
]

Columns = dict[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Constraint:
    """Bounds on one metric; None leaves a side open."""

    metric: AnyMetric
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True)
class Objective:
    """One aim of a ranking: a column and the sense in which it is better."""

    metric: str
    sense: Sense


@dataclass(frozen=True)
class Column:
    """One column of results. `role` is index, parameter, metric, margin or bookkeeping; `labels` name integer codes."""

    name: str
    unit: str
    long_name: str
    role: str
    dtype: str = "<f8"
    labels: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Block:
    """The unit of work, of commit and of loss: consecutive designs, their parameters by name, each of shape (n,)."""

    number: int
    start: int
    columns: Columns


@dataclass(frozen=True)
class Mechanism:
    """A mechanism: a declaration and three compiled functions, all else is generic.

    Attributes
    ----------
    closed_form
        ``closed_form(parameters[n, p], metrics[m, n], status[n], kernel[n, k], singular[n, 3], noise[n])`` fills the
        closed-form metrics, the status, the constants of the other two functions, the half-tangents of the
        distances of the motion's complex singularities (see `explore.quadrature`), and the amplification of
        rounding errors. ``parameters`` has the columns of `kernel_parameters`.
    pieces
        ``pieces(kernel_row, window_code, drive_code, start, stop, out[4, 3]) -> count`` gives a window as at most
        three pieces (anchor, half-tangent of start, half-tangent of end); ``out[3]`` is the averaging length and how
        much of it the signal rests at 0, rad.
    fill
        ``fill(kernel_row, sin_half, cos_half, count, needs, out[s, t])`` fills the signals at the nodes.
    loop
        Names of the lengths that close the loop: where one equals a signed sum of the others all links fall into one
        line, and between two such lengths the closed-form metrics change smoothly.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    signals: tuple[Signal, ...]
    metrics: tuple[Metric, ...]
    windows: tuple[Window, ...]
    drives: Mapping[str, int]
    output: Mapping[str, str]
    zero_mean: frozenset[tuple[str, str]]
    default_metrics: Mapping[str, tuple[str, ...]]
    objectives: tuple[str, ...]
    kernel_version: str
    kernel_size: int
    signal_rows: int
    closed_form: Callable[..., None]
    pieces: Callable[..., int]
    fill: Callable[..., None]
    default_window: str = "drive"
    default_drive: str = "slow"
    formulas: tuple[Formula, ...] = ()
    loop: tuple[str, ...] = ()

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    @property
    def geometry(self) -> tuple[Parameter, ...]:
        """The parameters that ask for a kinematic evaluation of their own: all but the speed."""
        return tuple(p for p in self.parameters if not p.scales_speed)

    @property
    def kernel_parameters(self) -> tuple[Parameter, ...]:
        """What the closed form is given: all that is more than sizing, with the speed last if a load may depend on it.

        The speed is 1 where nothing that is asked for depends on it.
        """
        dynamic = any(p.dynamic for p in self.parameters)
        return (*(p for p in self.geometry if p.enters != "sizing"), *((self.speed,) if dynamic else ()))

    @property
    def speed(self) -> Parameter:
        """The parameter that only scales the motion."""
        return next(p for p in self.parameters if p.scales_speed)


@dataclass(frozen=True)
class Request:
    """What is to be known of each design, all names resolved: the work order of `explore.evaluate`."""

    mechanism: Mechanism
    metrics: tuple[AnyMetric, ...]
    constraints: tuple[Constraint, ...]
    window: Window
    drive: str
    tolerance: float

    @property
    def all_metrics(self) -> tuple[AnyMetric, ...]:
        """The metrics of the columns and those that only constraints use, each once."""
        return tuple(dict.fromkeys((*self.metrics, *(c.metric for c in self.constraints))))

    @property
    def parts(self) -> tuple[Metric | SampledMetric | Parameter, ...]:
        """All metrics, derived ones taken apart into what they are made of, each once."""
        found: list[Metric | SampledMetric | Parameter] = []
        for metric in self.all_metrics:
            found += metric.parts if isinstance(metric, DerivedMetric) else (metric,)
        return tuple(dict.fromkeys(found))

    @property
    def sampled(self) -> tuple[SampledMetric, ...]:
        """The metrics that need samples of the motion, those that derived metrics are made of included."""
        return tuple(part for part in self.parts if isinstance(part, SampledMetric))

    @property
    def derived(self) -> tuple[DerivedMetric, ...]:
        """The metrics that are functions of others."""
        return tuple(m for m in self.all_metrics if isinstance(m, DerivedMetric))
