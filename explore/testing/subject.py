"""The mechanism under test with its designs, evaluated and moved by the generic routes alone."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.evaluation.derived import unavailable_metrics
from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays
from explore.model.declaration import ANCHORS
from explore.model.mechanism import Mechanism
from explore.model.quantities import LAGGED_STATISTICS, AnyMetric, FloatArray, SampledMetric, Signal
from explore.model.status import Status
from explore.model.window import Window
from explore.running.motions import mark_angles, motion_signals, window_limits
from explore.studies.request.names import find_metric, make_window
from explore.studies.request.requests import make_request

#: Explicit intervals that are tried, deg: short, across input angle 0, almost a turn.
_INTERVALS = ((31.0, 47.0), (-40.0, 75.0), (10.0, 365.0))
#: Statuses of designs whose metrics are computed.
COMPUTED = (Status.OK, Status.TOLERANCE_NOT_MET)

WindowArgument = str | Mapping[str, float]


def _parts_of(limits: Window) -> tuple[tuple[float, float], ...]:
    """Intervals that are tried, deg, of a range of input angles."""
    start, length = float(limits.start), float(limits.length)
    return (start, start + 0.3 * length), (start + 0.25 * length, start + 0.75 * length)


@dataclass(frozen=True)
class Subject:
    """A mechanism and designs of it: parameters by name, each (n,)."""

    mechanism: Mechanism
    designs: Arrays

    def __len__(self) -> int:
        return len(next(iter(self.designs.values())))

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The signals that a simulation gives: all but those behind clutches, and those whose loads no design has."""
        return tuple(signal for signal in self._available_signals if not signal.only_in)

    @cached_property
    def _available_signals(self) -> tuple[Signal, ...]:
        given = {name for name, column in self.complete_designs.items() if column.any()}
        signals = self.mechanism.signals
        return tuple(s for s in signals if not s.required_loads or not given.isdisjoint(s.required_loads))

    def windows(self) -> Iterator[tuple[WindowArgument, str]]:
        """Each window with the name of a drive: the default drive, and for the default window every drive.

        The name is empty where there are no drives.
        """
        mechanism = self.mechanism
        for window in mechanism.named_windows:
            is_default = window.name == mechanism.default_window
            for drive in (is_default and mechanism.drives) or (mechanism.default_drive,):
                yield window.name, drive
        if mechanism.named_windows != mechanism.windows:
            limits = self.mechanism.limits
            for start, stop in _parts_of(limits) if limits else _INTERVALS:
                yield {"from": start, "to": stop}, mechanism.default_drive

    @cached_property
    def is_computed(self) -> npt.NDArray[np.bool_]:
        """Whether each design is computed in some window, shape (n,)."""
        first = [self.mechanism.any_metric]
        statuses = [self.evaluate(first, window, drive)["status"] for window, drive in self.windows()]
        return np.asarray(np.isin(statuses, COMPUTED).any(axis=0))

    @property
    def complete_designs(self) -> Arrays:
        """All parameters of the designs, also those at their defaults."""
        return {p.name: self.designs.get(p.name, np.full(len(self), p.default)) for p in self.mechanism.parameters}

    def all_metrics(self, window: WindowArgument) -> tuple[AnyMetric, ...]:
        """All metrics of a window for which the designs give what they need."""
        declared = make_window(self.mechanism, window)
        metrics: list[AnyMetric] = list(self.mechanism.metrics)
        metrics += self._sampled(declared, self._available_signals)
        for formula in self.mechanism.formulas:
            try:
                request = make_request(self.mechanism, metrics=[formula.name], window=window)
            except RequestError:  # of a signal that does not exist in the window
                continue
            if not unavailable_metrics(request, lambda name: bool(self.complete_designs[name].any())):
                metrics += request.metrics
        return tuple(metrics)

    def sampled_metrics(self, window: WindowArgument) -> tuple[SampledMetric, ...]:
        """The statistics of the simulated signals that are defined over a window."""
        return tuple(self._sampled(make_window(self.mechanism, window), self.signals))

    def closed_forms(self, window: WindowArgument) -> Iterator[tuple[str, SampledMetric]]:
        """The names of the metrics that are statistics over a window in closed form, each with the statistic.

        That of a `worst_of` is called "worst".
        """
        declared, signals = make_window(self.mechanism, window), self.signals
        for metric in self.mechanism.metrics:
            name = metric.closed_form_of
            if metric.worst_of:
                name = f"{metric.worst_of}_min_{self.mechanism.whole_motion.name}"
            statistic = find_metric(self.mechanism, name, declared) if name else None
            if isinstance(statistic, SampledMetric) and statistic.window == declared and statistic.signal in signals:
                yield metric.name, replace(statistic, statistic="worst") if metric.worst_of else statistic

    def _sampled(self, window: Window, signals: tuple[Signal, ...]) -> Iterator[SampledMetric]:
        for signal in signals:
            for statistic in signal.statistics:
                if statistic in LAGGED_STATISTICS:  # they follow from more than the signal
                    continue
                try:
                    # with the name of the window, because a closed-form metric may have the name without it
                    metric = find_metric(self.mechanism, f"{signal.name}_{statistic}_{window.name}", window)
                except RequestError:  # undefined for every design, as the cv of a signal without a mean
                    continue
                if isinstance(metric, SampledMetric):
                    yield metric

    def evaluate(
        self,
        metrics: Sequence[str] | None,
        window: WindowArgument,
        drive: str,
        tolerance: float = 1e-9,
        designs: Arrays | None = None,
    ) -> Arrays:
        """The columns of results of all designs, or of others."""
        request = make_request(self.mechanism, metrics=metrics, window=window, drive=drive, tolerance=tolerance)
        return evaluate_columns(request, self.designs if designs is None else designs).columns

    def limits(self, design: int, window: WindowArgument, drive: str) -> tuple[float, float] | None:
        """First and last input angle of a window of one design, deg; None where it has no such window."""
        if not isinstance(window, str):
            return window["from"], window["to"]
        if window == self.mechanism.whole_motion.name:
            limits = self.mechanism.limits
            return (float(limits.start), float(limits.stop)) if limits else (0.0, 360.0)
        return window_limits(self.mechanism, self._one(design), window, drive)

    def motion(self, design: int, input_angle: FloatArray) -> FloatArray:
        """The signals of one design at input angles in degrees, shape (s, t); NaN for signals it does not have."""
        signals, *_ = motion_signals(self.mechanism, self._one(design), input_angle, "closed-form", 1e-9)
        missing = np.full(len(input_angle), np.nan)
        return np.array([signals.get(signal.name, missing) for signal in self.signals])

    def marks(self, design: int) -> dict[str, float]:
        """Input angles of the marks of one design and of the anchors by name, deg."""
        anchor = float(np.rad2deg(self.mechanism.anchor_angle))
        return dict(zip(ANCHORS, (anchor, anchor + 180.0), strict=True)) | mark_angles(
            self.mechanism, self._one(design)
        )

    def speed(self, design: int) -> float:
        """The speed of one design."""
        parameter = self.mechanism.speed
        return float(self.complete_designs[parameter.name][design]) if parameter else 1.0

    def describe(self, design: int) -> str:
        """The parameters of one design that are not at their defaults."""
        defaults = {p.name: p.default for p in self.mechanism.parameters}
        values = {name: float(column[design]) for name, column in self.designs.items()}
        return ", ".join(f"{name} = {value!r}" for name, value in values.items() if value != defaults[name])

    def _one(self, design: int) -> Arrays:
        return {name: column[design : design + 1] for name, column in self.designs.items()}


def name_of(window: WindowArgument) -> str:
    """The window in a sentence."""
    return f"'{window}'" if isinstance(window, str) else f"{window['from']:g} to {window['to']:g} deg"
