"""Certificates of linkages: enclosures of the metrics of one design, from the graph of their table."""

from collections.abc import Mapping
from functools import reduce

import numpy as np
from flint import arb, fmpq

from explore.analysis.certifying.balls import Enclosure, UnprovedError, exact
from explore.analysis.certifying.motion import Motion
from explore.analysis.certifying.statistics import from_extremes, from_moments, in_its_unit, time_ratio
from explore.analysis.certifying.targets import TargetErrors
from explore.base.errors import RequestError
from explore.mechanisms.linkages.declared import table_of
from explore.mechanisms.linkages.metrics import REACH_NAMES
from explore.mechanisms.load_metrics import WORK_FORMULAS, largest, largest_magnitude
from explore.mechanisms.targets.measures import TargetMeasure
from explore.model.mechanism import Mechanism
from explore.model.quantities import (
    EXTREME_STATISTICS,
    FLUCTUATION,
    LAGGED_STATISTICS,
    DerivedMetric,
    Metric,
    SampledMetric,
    Signal,
)
from explore.model.request import Request, needs_stroke
from explore.model.status import Status

#: Works of the drive in a turn, which follow from its mean power.
_WORKS = tuple(formula.name for formula in WORK_FORMULAS)
#: Functions of formulas that take the largest of metrics, of their magnitudes, or a single one.
_LARGEST = (largest, largest_magnitude, np.positive)


def require_table(mechanism: Mechanism) -> None:
    """Refuse a mechanism that no table says, or a table with links that no dyad solves."""
    table = table_of(mechanism)
    if table is None or table.starts:
        reason = "no table says how it moves" if table is None else "it has a group of links that no dyad solves"
        raise RequestError(f"designs of {mechanism.called if table else mechanism.name} cannot be certified: {reason}")


class Certificate:
    """Enclosures of the metrics of one design, at the precision that is set when it is made and used."""

    def __init__(self, parameters: Mapping[str, float | fmpq], request: Request) -> None:
        self._motion, self._mechanism, self._tolerance = (
            Motion(parameters, request),
            request.mechanism,
            request.tolerance,
        )
        self._targets = TargetErrors(self._motion, parameters)
        self._speed = arb(exact(parameters["speed"]))

    @property
    def status(self) -> int:
        """The status of the design by exact signs, before constraints and tolerances."""
        return self._motion.status

    def enclose(self, metric: Metric | SampledMetric | DerivedMetric) -> Enclosure | None:
        """Enclose a metric in its unit; None where the design has none, NaN in results.

        Derived metrics are those that the mechanism declares; formulas of a study are computed from their inputs.
        Raises `UnprovedError` if it cannot be certified: no enclosure is implemented; and `UndecidedError` if the
        precision is too low.
        """
        known = self._motion.exact
        if known and metric.name in known.metrics:
            return Enclosure.of(arb(known.metrics[metric.name]))
        if isinstance(metric, Metric):
            return self._closed_form(metric)
        if self.status != Status.OK and not (isinstance(metric, DerivedMetric) and self._needs_no_motion(metric)):
            return None
        return self._statistic(metric) if isinstance(metric, SampledMetric) else self._derived(metric)

    def _needs_no_motion(self, metric: DerivedMetric) -> bool:
        """Whether the metric exists though the status is not ok: it needs no full turn, or only strokes are lacking."""
        if isinstance(metric.formula.function, TargetMeasure) and not metric.formula.needs_turn:
            return True
        own = self._mechanism.statuses.get(self.status)
        return own is not None and own.lacks_strokes and not metric.sampled and not needs_stroke(metric)

    def _statistic(self, metric: SampledMetric) -> Enclosure | None:
        if metric.statistic in EXTREME_STATISTICS:
            pair = self._motion.low_and_high(metric.signal, metric.window)
            enclosure: Enclosure | None = from_extremes(metric.statistic, *pair)
        elif metric.statistic == "power_mean":
            enclosure = Enclosure.of(self._motion.power_mean(metric.signal, metric.window))
        elif metric.statistic in LAGGED_STATISTICS:
            raise UnprovedError(f"{metric.name} cannot be certified: no enclosure is implemented")
        elif metric.statistic == FLUCTUATION:
            square = self._motion.mean_and_square(metric.signal, metric.window, needs_mean=True)[1]
            enclosure = Enclosure(self._motion.fluctuation(metric.signal), square.sqrt() * 2 * arb.pi())
        else:
            needs_mean = metric.statistic != "rms"
            pair = self._motion.mean_and_square(metric.signal, metric.window, needs_mean=needs_mean)
            enclosure = from_moments(metric.statistic, *pair, self._tolerance)
        return in_its_unit(enclosure, metric, self._speed)

    # closed forms

    def _closed_form(self, metric: Metric) -> Enclosure | None:
        status = self._motion.exact.status if self._motion.exact else self.status
        own = self._mechanism.statuses.get(status)
        if metric.name in REACH_NAMES and not self._motion.exact:
            return self._reach(metric.name)
        if own and (metric.needs_stroke or not own.lacks_strokes):
            return None
        whole, output = self._mechanism.whole_motion.name, self._motion.table.output
        match metric.name:
            case "time_ratio":
                first, second = self._motion.marks.values()
                ratio = time_ratio(abs(second - first))
                return ratio if self._motion.exact else Enclosure.of(ratio.ball)
            case "mid_angle":
                low, high = self._extremes_of(f"{output}_angle")
                return Enclosure((low + high) / 2, arb(180))
            case "mean_output_ratio":
                low, high = self._extremes_of(f"{output}_angle")
                return Enclosure.of((high - low) / 360)
        if metric.closed_form_of:
            ends = [each for each in EXTREME_STATISTICS if metric.closed_form_of.endswith(f"_{each}_{whole}")]
            statistic = max(ends, key=len)
            name = metric.closed_form_of.removesuffix(f"_{statistic}_{whole}")
            return Enclosure.of(from_extremes(statistic, *self._extremes_of(name)).ball)
        mark = metric.name.removesuffix("_angle")
        if mark in self._motion.marks:
            angle = self._motion.marks[mark] * 180 / arb.pi()
            return Enclosure.of(angle + 360 if angle < metric.lower else angle)
        return self._follow(metric.name)

    def _reach(self, name: str) -> Enclosure | None:
        """The number of intervals at which a linkage assembles, or an end of one, deg."""
        reaches = self._motion.reaches
        ends = [end * 180 / arb.pi() for interval in reaches for end in interval]
        told = dict(zip(REACH_NAMES, [arb(len(reaches)), *ends], strict=False))
        return Enclosure(told[name], told[name].max(180 / arb.pi())) if name in told else None

    def _extremes_of(self, name: str) -> tuple[arb, arb]:
        """Least and greatest value over the whole motion of a signal that does not depend on the speed, in its unit."""
        signal = self._mechanism.signal(name)
        unit = 180 / arb.pi() if signal.unit == "deg" else arb(1)
        low, high = self._motion.low_and_high(signal, self._mechanism.whole_motion)
        return low * unit, high * unit

    # what follows from extremes

    def _derived(self, metric: DerivedMetric) -> Enclosure | None:
        name = metric.formula.name
        sampled = [source for source in metric.inputs if isinstance(source, SampledMetric | DerivedMetric)]
        if name in _WORKS:
            (power,) = (self.enclose(source) for source in metric.inputs if isinstance(source, SampledMetric))
            work = power and power.times(2 * arb.pi() / self._speed)
            return work and (work if metric.formula.is_proportional else Enclosure.of(work.ball))
        if isinstance(metric.formula.function, TargetMeasure):
            return self._targets.enclose(metric.formula)
        if metric.formula.is_proportional and len(metric.inputs) == 1:
            (source,) = metric.inputs
            return self.enclose(source) if isinstance(source, SampledMetric) else None
        # The largest of some is not that of all.
        if metric.formula.function in _LARGEST and len(sampled) == len(metric.inputs):
            sources = [self.enclose(source) for source in sampled]
            balls = [source.ball for source in sources if source]
            balls = [abs(ball) for ball in balls] if metric.formula.function is largest_magnitude else balls
            return Enclosure.of(reduce(arb.max, balls)) if len(balls) == len(sources) else None
        return self._follow(name)

    def _follow(self, name: str) -> Enclosure:
        """A metric that follows from transmission angles or from places of points."""
        match name:
            case "transmission_angle_min" | "transmission_angle_worst":
                return Enclosure.of(self._least_transmission())
            case "envelope_width" | "envelope_height":
                return Enclosure.of(self._side(int(name == "envelope_height")))
            case "footprint":
                return Enclosure.of(self._side(0) * self._side(1))
        raise UnprovedError(f"{name} cannot be certified: no enclosure is implemented")

    def _least_transmission(self) -> arb:
        """The least transmission angle of all joints over the whole motion, each folded to at most 90 deg."""
        declared = {signal.name: signal for signal in self._mechanism.signals}
        found = []
        for quantity in self._motion.transmissions:
            signal: Signal = declared.get("transmission_angle", quantity.signal)
            low, high = self._motion.low_and_high(signal, self._mechanism.whole_motion)
            found += [low, arb.pi() - high]
        return reduce(arb.min, found) * 180 / arb.pi()

    def _side(self, axis: int) -> arb:
        """The extent of all points along an axis over the whole motion."""
        frame, graph = self._motion.table.frame.place_of, self._motion.graph
        low = high = [graph.place_of_frame(point)[axis] for point in frame]
        for point in self._motion.table.points:
            if point not in frame:
                place = graph.quantities[f"{point}_{'xy'[axis]}"].signal
                least, greatest = self._motion.low_and_high(place, self._mechanism.whole_motion)
                low, high = [*low, least], [*high, greatest]
        return reduce(arb.max, high) - reduce(arb.min, low)
