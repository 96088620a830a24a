"""The declaration of a mechanism: names, units and codes of all that its compiled functions take and fill."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import Any

from explore.model.drawing import Drawing, Panel
from explore.model.exact import ExactDesign
from explore.model.points import FloatingLink
from explore.model.quadrature import Adaptive, Graded, Located, Quadrature
from explore.model.quantities import OUTPUT_STATISTICS, TURN_STATISTICS, Formula, GivenMetric, Metric, Parameter, Signal
from explore.model.status import OwnStatus, Status
from explore.model.target_kinds import TargetKind
from explore.model.targets import Target
from explore.model.window import Window

#: Names of the anchor and of its opposite, half a turn on, in `Signal.extremes_at`.
ANCHORS = ("anchor", "opposite")


#: Rows of a record for the interval that a mechanism is to move over in place of the turn: start and length, rad.
INTERVAL_ROWS = ("INTERVAL_START", "INTERVAL_LENGTH")


def own_row(name: str) -> str:
    """The name of a row of a parameter whose name a user chose."""
    return f"parameter {name}"


@dataclass(frozen=True, kw_only=True)
class Declaration:
    """A mechanism without its compiled functions.

    Attributes
    ----------
    name, summary
        Name in study files, and one line for lists.
    called
        What sentences call it; empty for its name.
    parameters
        Inputs of every design.
    signals
        Functions of the input angle that can be sampled.
    metrics
        Closed-form metrics, in the order of their rows.
    windows
        Parts of the turn that statistics are taken over.
    drives
        Names that a study's `drive` can have, first that of a study that names none: "slow" and "fast", which choose
        among the strokes by length, and strokes; empty where no window depends on the drive.
    strokes
        Names of the two windows between limit positions that together are the turn; empty where there are none.
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
    n_constants
        Number of constants of a design, the first rows of a record, which `fill` and the windows take.
    rows
        Rows of a record after those constants that the declaration does not name: further constants, then "STATUS", the
        names of `kernel_parameters` and those of `metrics`, in capitals or, where case tells names apart, as `own_row`,
        then those that begin with "_", which are the kernel's own.
    signal_rows
        Number of rows of the signal array.
    marks
        Rows of the constants that hold the angles where windows end or laws change, by name: half-tangents of the angle
        from the anchor.
    anchor_angle
        The input angle of the anchor, rad: where singularities of a graded quadrature stand above it and its opposite.
    input_angle
        Name of the angle of the input link, in degrees the index of a simulated motion.
    integrated_rows
        Rows of signals whose mean and variance over any window `Mechanism.integrals` gives in closed form.
    integrates_turns_alone
        Whether it gives them over the full turn alone, from the parameters of a record that is not closed.
    breaks
        Marks where the law of a signal changes, each forwards from the one before; that of signals under load only, and
        only by parameters that are declared to add jumps, if there are any of these.
    senses
        Signals whose signs others jump with: number k is said to `fill` by bits 2k and 2k + 1 of the law, 1 for 1, 2
        for -1, and 0 for what the signal is at the node.
    quadrature
        `Adaptive`, which needs to know nothing of the signals, or `Graded` or `Located`, with their singularities.
    n_fill_constants
        Number of constants, the first ones, that `fill` reads; 0 for all.
    keeps_constants
        Whether the constants of all designs are kept for sampling, because it takes longer to compute them twice.
    takes_interval
        Whether `close` can also fill status and constants of a motion over an interval in place of the turn, for
        statuses that lack a turn: it reads the rows `INTERVAL_ROWS`, a length of 0 for the turn.
    noise_row
        Row of the constant by which rounding errors in velocities are amplified; -1 for none.
    closed_error_row
        Row of the constant with a bound of the errors of closed-form metrics and of the lengths of strokes, relative,
        of angles at least to 1 rad, where they follow from what is solved for; -1 for none.
    phases_row
        Row of the constant that holds the number of mechanisms behind clutches; -1 for none.
    variant_row
        Row of the constant that tells kinds of designs apart which `fill` treats differently; -1 for none.
    default_window
        Name of the window of a study that names none.
    formulas
        Declarations of the derived metrics.
    loop_lengths
        Names of the lengths that close the loop: where one equals a signed sum of the others the loop is
        flattened, and between two such lengths the closed-form metrics change smoothly.
    starter
        Text of a commented study of the mechanism, ready to run; empty for one in the folder `data` of this package.
    statuses
        The statuses that `close` gives to designs without a motion or without strokes, by code.
    drawing
        How figures show the mechanism in its plane; None for a mechanism without a picture.
    panels
        Which signals share an axis in charts of a motion; without them each has its own.
    extended
        The same mechanism with a kernel of more rows, which also fills the signals whose rows this one does not have,
        such as forces, and takes the parameters that affect these alone. It is compiled and called only for requests
        that name such a signal. None where one kernel fills all signals.
    floating_link
        The link whose points a user can name; None where there is none. The kernel without an extended one has rows for
        `MOST_POINTS` of them: parameters of the names of `SLOT_ROWS` behind the others, and signals.
    points
        Names of the points, whose parameters, signals and drawing `Mechanism.with_points` adds.
    targets
        How it meets targets, by their kind; empty where it meets none.
    target
        The target, whose parameters and metrics `Mechanism.with_target` adds; None for none.
    given
        Metrics that come with the designs, which `Mechanism.with_given` adds.
    table
        The table of the planar linkage that it is, for `explore.mechanisms.linkages`, by its parameters and the names
        of its drawing; None for a mechanism that no table says.
    table_signals
        Function of the equations of the table and of its signals that returns those that have other names here, or are
        none of it. None where there are none.
    exact
        Function of parameters that are fractions that returns what is known of a design without rounding; angles of
        links are then between -180 and 180 deg. None where status and marks follow from the table.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    signals: tuple[Signal, ...]
    metrics: tuple[Metric, ...]
    windows: tuple[Window, ...]
    output_signals: Mapping[str, str]
    zero_mean: frozenset[tuple[str, str]]
    default_metrics: Mapping[str, tuple[str, ...]]
    objectives: tuple[str, ...]
    kernel_version: str
    n_constants: int
    rows: type[IntEnum]
    signal_rows: int
    marks: Mapping[str, int] = field(default_factory=dict)
    anchor_angle: float = 0.0
    input_angle: str = "crank angle"
    integrated_rows: tuple[int, ...] = ()
    integrates_turns_alone: bool = False
    breaks: tuple[str, ...] = ()
    senses: tuple[str, ...] = ()
    quadrature: Quadrature = field(default_factory=Adaptive)
    n_fill_constants: int = 0
    keeps_constants: bool = False
    takes_interval: bool = False
    noise_row: int = -1
    closed_error_row: int = -1
    phases_row: int = -1
    variant_row: int = -1
    strokes: tuple[str, ...] = ()
    drives: tuple[str, ...] = ()
    default_window: str = "drive"
    formulas: tuple[Formula, ...] = ()
    loop_lengths: tuple[str, ...] = ()
    starter: str = ""
    statuses: Mapping[int, OwnStatus] = field(default_factory=dict)
    drawing: Drawing | None = None
    panels: tuple[Panel, ...] = ()
    extended: Declaration | None = None
    floating_link: FloatingLink | None = None
    points: tuple[str, ...] = ()
    targets: Mapping[str, TargetKind] = field(default_factory=dict)
    target: Target | None = None
    given: tuple[GivenMetric, ...] = ()
    table: Hashable = None
    table_signals: Callable[[Any, Mapping[str, Any]], dict[str, Any]] | None = None
    called: str = ""
    exact: Callable[[Mapping[str, Any]], ExactDesign] | None = None

    @property
    def in_words(self) -> str:
        """What sentences call it."""
        return self.called or self.name

    @property
    def default_drive(self) -> str:
        """Name of the drive of a study that names none; empty where there are no drives."""
        return self.drives[0] if self.drives else ""

    @property
    def knows_rounding(self) -> bool:
        """Whether rounding errors of signals are known beside what is declared of them."""
        return False

    @property
    def singularities(self) -> tuple[tuple[int, int], ...]:
        """The singularities of the quadrature; none if it is adaptive."""
        return self.quadrature.singularities if isinstance(self.quadrature, Graded | Located) else ()

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    def signal(self, name: str) -> Signal:
        """The signal of that name."""
        return next(signal for signal in self.signals if signal.name == name)

    def metric_names(self) -> Iterator[str]:
        """All names that a metric can have, in any window."""
        yield from (metric.name for metric in self.metrics)
        yield from (formula.name for formula in self.formulas)
        yield from (metric.name for metric in self.given)
        yield from OUTPUT_STATISTICS
        for signal in self.signals:
            for statistic in signal.statistics:
                yield f"{signal.name}_{statistic}"
                is_of_turn = statistic in TURN_STATISTICS
                windows = (window for window in self.named_windows if window.kind == "turn" or not is_of_turn)
                yield from (f"{signal.name}_{statistic}_{window.name}" for window in windows)

    @cached_property
    def taken_names(self) -> frozenset[str]:
        """All names of signals, and those that a metric can have."""
        return frozenset((*self.metric_names(), *(signal.name for signal in self.signals)))

    @property
    def declared_panels(self) -> tuple[Panel, ...]:
        """The panels, or one for each signal."""
        signals = (signal for signal in self.signals if not signal.only_in)
        return self.panels or tuple(Panel(signal.long_name, (signal.name,)) for signal in signals)

    @property
    def kernel(self) -> str:
        """Name and version of the formulas, by which results that differ are told apart."""
        return f"{self.name} {self.kernel_version}"

    @property
    def named_windows(self) -> tuple[Window, ...]:
        """The windows that a metric's name can end with: all but the explicit interval."""
        return tuple(window for window in self.windows if window.name != "interval")

    @cached_property
    def record_rows(self) -> int:
        """Number of rows of a record."""
        return max(self.rows) + 1

    @cached_property
    def status_row(self) -> int:
        """Row of a record that holds the status."""
        return int(self.rows["STATUS"])

    @cached_property
    def first_parameter(self) -> int:
        """Row of a record that holds the first parameter."""
        return self.row_of(self.kernel_parameters[0].name)

    @cached_property
    def first_metric(self) -> int:
        """Row of a record that holds the first metric; the number of rows where there are none."""
        return self.row_of(self.metrics[0].name) if self.metrics else self.record_rows

    @property
    def interval_row(self) -> int:
        """Row of a record that holds the start of the interval to move over; -1 where none is taken."""
        return int(self.rows[INTERVAL_ROWS[0]]) if self.takes_interval else -1

    def row_of(self, name: str) -> int:
        """Row of a record that holds a parameter or a metric."""
        return int(self.rows.__members__.get(own_row(name)) or self.rows[name.upper()])

    @property
    def any_metric(self) -> str:
        """Name of a metric that needs no strokes, one that needs no samples if there is one."""
        closed = [metric.name for metric in self.metrics if not metric.needs_stroke]
        return closed[0] if closed else f"{self.signals[0].name}_mean"

    def derivative(self, signal: Signal) -> Signal | None:
        """The signal that is declared as the derivative of this one, or of the one whose row it shares."""
        names = {signal.name, signal.shares_row_with}
        return next((other for other in self.signals if other.derivative_of and other.derivative_of in names), None)

    def reference(self, signal: Signal) -> Parameter | None:
        """The length that a signal is relative to; None for angles and numbers."""
        while signal.derivative_of and not signal.relative_to:
            signal = self.signal(signal.derivative_of)
        return self.parameter(signal.relative_to) if signal.relative_to else None

    @property
    def whole_motion(self) -> Window:
        """The full turn, or the range of input angles to which a mechanism is limited."""
        return next(window for window in self.windows if window.is_whole)

    @property
    def limits(self) -> Window | None:
        """The range of input angles to which a mechanism is limited; None where it turns fully."""
        return None if self.whole_motion.kind == "turn" else self.whole_motion

    def window(self, name: str) -> Window:
        """The window of that name."""
        return next(window for window in self.windows if window.name == name)

    @property
    def status_labels(self) -> dict[int, str]:
        """The words for all statuses, by ascending code."""
        all_statuses = {int(status): status.label for status in Status}
        all_statuses |= {code: status.label for code, status in self.statuses.items()}
        return dict(sorted(all_statuses.items()))

    @property
    def status_sentences(self) -> dict[str, str]:
        """The meanings of all statuses, by their words."""
        sentences = {status.label: status.sentence for status in (*Status, *self.statuses.values())}
        return {label: sentences[label] for label in self.status_labels.values()}

    @cached_property
    def geometry(self) -> tuple[Parameter, ...]:
        """All parameters but the speed: designs that differ in one of them need kinematic evaluations of their own."""
        return tuple(p for p in self.parameters if not p.scales_speed)

    @cached_property
    def axis_order(self) -> tuple[Parameter, ...]:
        """All parameters in the order of axes, with the speed last.

        The last axis of a grid varies fastest, so that designs that differ only in speed are neighbours and share
        one motion.
        """
        return (*self.geometry, *((self.speed,) if self.speed else ()))

    @cached_property
    def kernel_parameters(self) -> tuple[Parameter, ...]:
        """The parameters that `closed_form` takes: all but those for sizing; the speed is the last, if one is dynamic.

        The speed is 1 unless a requested metric depends on it other than by scaling. Those of points follow. A
        mechanism with an extended kernel takes only those parameters of motion and load that its rows name.
        """
        is_dynamic = any(p.is_dynamic for p in self.parameters)
        of_all = (p for p in self.axis_order if p.affects in ("motion", "load") and (is_dynamic or not p.scales_speed))
        if self.extended:
            members = self.rows.__members__
            return tuple(p for p in of_all if p.name.upper() in members or own_row(p.name) in members)
        return (*of_all, *(p for p in self.parameters if p.affects == "point"))

    def fills(self, signal: Signal) -> bool:
        """Whether the kernel of the mechanism, not only its extended one, fills a signal."""
        return max(signal.row, signal.terms_row) < self.signal_rows

    @cached_property
    def speed(self) -> Parameter | None:
        """The parameter that only scales the motion; None where there is none, and the speed is 1."""
        return next((p for p in self.parameters if p.scales_speed), None)
