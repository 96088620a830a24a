"""Requests: the metrics and constraints to evaluate for each design, and the objectives of rankings."""

from dataclasses import dataclass, replace
from functools import cached_property

from explore.model.expressions import Expression
from explore.model.mechanism import Mechanism
from explore.model.quantities import AnyMetric, DerivedMetric, GivenMetric, Metric, Parameter, SampledMetric, Sense
from explore.model.window import Window


@dataclass(frozen=True)
class Constraint:
    """Bounds on one metric, in its unit, allowed values included; None for no bound."""

    metric: AnyMetric
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True)
class Objective:
    """An objective of a ranking: the name of a column, and the sense in which it is better."""

    metric: str
    sense: Sense


@dataclass(frozen=True)
class Request:
    """Metrics and constraints to evaluate for each design, with all names resolved.

    Attributes
    ----------
    mechanism
        The mechanism of all designs.
    metrics
        Metrics of the columns of results, in order.
    constraints
        Bounds that feasible designs satisfy.
    window
        Window of the metrics whose names have none.
    drive
        Name of the stroke that the window "drive" is.
    tolerance
        Largest allowed error bound of a design, relative; `explore.evaluation.evaluate` has the norms.
    is_finest
        Whether the statistics that derived metrics depend on are to be as exact as they can be.
    has_jumps
        Whether parameters that add jumps may differ from 0.
    """

    mechanism: Mechanism
    metrics: tuple[AnyMetric, ...]
    constraints: tuple[Constraint, ...]
    window: Window
    drive: str
    tolerance: float
    is_finest: bool = False
    has_jumps: bool = True

    @cached_property
    def all_metrics(self) -> tuple[AnyMetric, ...]:
        """The metrics of the columns and those that only constraints use, each once."""
        return tuple(dict.fromkeys((*self.metrics, *(c.metric for c in self.constraints))))

    @cached_property
    def parts(self) -> tuple[Metric | SampledMetric | Parameter, ...]:
        """All closed-form and sampled metrics and the parameters that derived metrics depend on, each once."""
        parts: list[Metric | SampledMetric | Parameter] = []
        for metric in self.all_metrics:
            if not isinstance(metric, GivenMetric):
                parts += metric.parts if isinstance(metric, DerivedMetric) else (metric,)
        return tuple(dict.fromkeys(parts))

    @cached_property
    def sampled(self) -> tuple[SampledMetric, ...]:
        """The metrics that need samples of the motion, including those that derived metrics depend on."""
        return tuple(part for part in self.parts if isinstance(part, SampledMetric))

    @cached_property
    def kernel(self) -> Mechanism:
        """The mechanism, or its extended one if a metric depends on signals that only this one fills."""
        return self.mechanism.kernel_of(metric.signal for metric in self.sampled)

    @cached_property
    def breaks(self) -> tuple[str, ...]:
        """Marks where the laws of the signals change: those of an extended kernel are of signals under load only."""
        depends_on_load = any(metric.signal.depends_on_load for metric in self.sampled)
        if any(parameter.adds_jumps for parameter in self.kernel.parameters):
            return self.kernel.breaks if depends_on_load and self.has_jumps else ()
        return self.kernel.breaks if depends_on_load else self.mechanism.breaks

    @cached_property
    def without_jumps(self) -> "Request":
        """The request for designs whose parameters that add jumps are all 0; itself where it has the same breaks."""
        smooth = replace(self, has_jumps=False) if self.breaks else self
        return smooth if smooth.breaks != self.breaks else self

    @cached_property
    def derived(self) -> tuple[DerivedMetric, ...]:
        """The metrics that are functions of others."""
        return tuple(m for m in self.all_metrics if isinstance(m, DerivedMetric))

    @cached_property
    def formulas(self) -> tuple[DerivedMetric, ...]:
        """The metrics that the user wrote."""
        return tuple(metric for metric in self.derived if isinstance(metric.formula.function, Expression))

    @cached_property
    def interval(self) -> Window | None:
        """The explicit interval that is asked about; None where a statistic or a formula is over another window."""
        windows = {metric.window for metric in self.sampled}
        if self.window.name != "interval" or not windows <= {self.window}:
            return None
        return None if any(metric.needs_turn for metric in self.derived) else self.window

    @cached_property
    def needs_stroke(self) -> bool:
        """Whether a metric exists only where the output rocks."""
        windows = (self.window, *(metric.window for metric in self.sampled))
        return (
            any(window.needs_stroke for window in windows)
            or any(metric.signal.needs_stroke for metric in self.sampled)
            or any(map(needs_stroke, self.all_metrics))
        )


def needs_stroke(metric: AnyMetric | Parameter) -> bool:
    """Whether a closed-form metric, or an input that a formula does not do without, needs strokes."""
    if isinstance(metric, DerivedMetric):
        return any(needs_stroke(source) for source in metric.inputs if source.name not in metric.formula.optional)
    return isinstance(metric, Metric) and metric.needs_stroke
