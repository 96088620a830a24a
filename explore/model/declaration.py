"""The declaration of a mechanism: names, units and codes of all that its compiled functions take and fill."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum

from explore.model.quantities import OUTPUT_STATISTICS, Formula, Metric, Parameter, Signal, Window


@dataclass(frozen=True, kw_only=True)
class Declaration:
    """A mechanism without its compiled functions.

    Attributes
    ----------
    name, summary
        Name in study files, and one line for lists.
    parameters
        Inputs of every design.
    signals
        Functions of the crank angle that can be sampled.
    metrics
        Closed-form metrics, in the order of the rows that `closed_form` fills.
    windows
        Parts of the turn that statistics are taken over.
    drives
        Names and kernel codes of the strokes that a study's `drive` can name.
    output_signals
        Name of the output's signal by name of the window; the empty name is for all other windows.
    zero_mean
        Pairs of a signal and a window over which its mean is exactly 0, so that it has no coefficient of variation.
    default_metrics
        Metrics of a study that names none, by name of the window; the empty name is for all other windows.
    objectives
        Default objectives, ``metric`` or ``metric:sense``.
    kernel_version
        Stored with results; a new version marks changed numbers.
    kernel_size
        Number of constants of a design, the columns of a kernel row.
    signal_rows
        Number of rows of the signal array.
    parameter_columns, metric_columns
        Named columns of ``parameters`` and named rows of ``metrics`` in `closed_form`: the names of
        `kernel_parameters` and `metrics` in capitals.
    default_window, default_drive
        Names of the window and the drive of a study that names none.
    formulas
        Declarations of the derived metrics.
    loop_lengths
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
    output_signals: Mapping[str, str]
    zero_mean: frozenset[tuple[str, str]]
    default_metrics: Mapping[str, tuple[str, ...]]
    objectives: tuple[str, ...]
    kernel_version: str
    kernel_size: int
    signal_rows: int
    parameter_columns: type[IntEnum]
    metric_columns: type[IntEnum]
    default_window: str = "drive"
    default_drive: str = "slow"
    formulas: tuple[Formula, ...] = ()
    loop_lengths: tuple[str, ...] = ()

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    def metric_names(self) -> Iterator[str]:
        """All names that a metric can have, in any window."""
        yield from (metric.name for metric in self.metrics)
        yield from (formula.name for formula in self.formulas)
        yield from OUTPUT_STATISTICS
        for signal in self.signals:
            for statistic in signal.statistics:
                yield f"{signal.name}_{statistic}"
                yield from (f"{signal.name}_{statistic}_{window.name}" for window in self.named_windows)

    @property
    def named_windows(self) -> tuple[Window, ...]:
        """The windows that a metric's name can end with: all but the explicit interval."""
        return tuple(window for window in self.windows if window.name != "interval")

    @property
    def geometry(self) -> tuple[Parameter, ...]:
        """All parameters but the speed: designs that differ in one of them need kinematic evaluations of their own."""
        return tuple(p for p in self.parameters if not p.scales_speed)

    @property
    def kernel_parameters(self) -> tuple[Parameter, ...]:
        """The parameters that `closed_form` takes: all but those for sizing; the speed is the last, if one is dynamic.

        The speed is 1 unless a requested metric depends on it other than by scaling.
        """
        dynamic = any(p.is_dynamic for p in self.parameters)
        return (*(p for p in self.geometry if p.affects != "sizing"), *((self.speed,) if dynamic else ()))

    @property
    def speed(self) -> Parameter:
        """The parameter that only scales the motion."""
        return next(p for p in self.parameters if p.scales_speed)
