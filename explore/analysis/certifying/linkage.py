"""Certificates of linkages that tables describe, from their graph."""

from collections.abc import Mapping
from functools import reduce
from typing import cast

from flint import arb

from explore.analysis.certifying.balls import Enclosure, UnprovedError, exact
from explore.analysis.certifying.linkage_graph import BallGraph
from explore.analysis.certifying.linkage_status import Turning, find_reference
from explore.analysis.certifying.means import arc_means, turn_means
from explore.analysis.certifying.positions import Arc, Position
from explore.analysis.certifying.statistics import from_extremes, from_moments, in_its_unit
from explore.analysis.certifying.subdivision import extremes_by_subdivision
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.linkages.trace import REFERENCE
from explore.model.quantities import EXTREME_STATISTICS, DerivedMetric, Metric, SampledMetric
from explore.model.request import Request
from explore.model.status import Status
from explore.model.window import Window

#: Angle at which the cells of a turn begin, rad: signals like to turn at round angles, where no cell ends.
_OFFSET = 0.0951


class LinkageOfTable:
    """A linkage of exact parameters; see `explore.analysis.certifying.contract.Certificate`."""

    def __init__(self, parameters: Mapping[str, float], request: Request) -> None:
        table = cast(LinkageTable, request.mechanism.table)
        self._table, self._parameters, self._request = table, parameters, request
        self._speed = arb(exact(parameters["speed"]))
        self._graph = BallGraph(table, parameters)
        window = request.interval or (request.mechanism.windows[0] if table.limits else None)
        self._turning = Turning(self._graph, _arc(window) if window else None)
        self._extremes: dict[tuple[str, Window], tuple[arb, arb]] = {}
        self._moments: dict[tuple[str, Window, bool], tuple[arb, arb]] = {}

    @property
    def status(self) -> int:
        """The status by signs of the factors; strokes are not proved."""
        status = self._turning.status
        if status == Status.OK and self._request.needs_stroke:
            raise UnprovedError("strokes of a table have no rigorous road")
        return status

    def enclose(self, metric: Metric | SampledMetric | DerivedMetric) -> Enclosure | None:
        """Enclose a metric."""
        if isinstance(metric, Metric):
            raise UnprovedError(f"{metric.name} has no rigorous road")
        if self.status != Status.OK:
            return None
        return self._derived(metric) if isinstance(metric, DerivedMetric) else self._statistic(metric)

    # statistics

    def _statistic(self, metric: SampledMetric) -> Enclosure | None:
        quantity = self._graph.quantities.get(metric.signal.name)
        if quantity is None or metric.window.kind not in ("turn", "interval"):
            what = metric.signal.name if quantity is None else f"the window {metric.window.name}"
            raise UnprovedError(f"{what} has no rigorous road")
        if metric.statistic in EXTREME_STATISTICS:
            key = metric.signal.name, metric.window
            if key not in self._extremes:
                self._extremes[key] = self._find_extremes(quantity, metric.window)
            enclosure: Enclosure | None = from_extremes(metric.statistic, *self._extremes[key])
        else:
            moments = self._find_moments(quantity, metric.window, needs_mean=metric.statistic != "rms")
            enclosure = from_moments(metric.statistic, *moments, self._request.tolerance)
        return in_its_unit(enclosure, metric, self._speed)

    def _references(self, quantity: Quantity) -> dict[str, arb]:
        """The inputs of the middles of links that an angle follows from."""
        inputs: dict[str, arb] = {}
        for link in quantity.links:
            middle = arb(find_reference(self._graph, link, self._turning.nodes()))
            parts = (middle, middle.cos(), middle.sin())
            inputs |= {f"{REFERENCE}{link}:{part}": value for part, value in enumerate(parts)}
        return inputs

    def _find_extremes(self, quantity: Quantity, window: Window) -> tuple[arb, arb]:
        """Smallest and largest value of a signal, for unit speed in rad."""
        function = self._graph.function([quantity.number], self._references(quantity))
        is_turn = window.kind == "turn"
        start, stop = (arb(_OFFSET), _OFFSET + 2 * arb.pi()) if is_turn else _ends(_arc(window))
        low, high = extremes_by_subdivision(function, quantity.signal.name, start, stop, is_turn=is_turn)
        if quantity.signal.is_magnitude:
            return low.nonnegative_part().sqrt(), high.nonnegative_part().sqrt()
        return low, high

    def _find_moments(self, quantity: Quantity, window: Window, *, needs_mean: bool) -> tuple[arb, arb]:
        """Mean of a signal and of its square, for unit speed in rad; only a magnitude's mean can be left out."""
        is_magnitude = quantity.signal.is_magnitude
        key = quantity.signal.name, window, needs_mean or not is_magnitude
        if key not in self._moments:
            if not is_magnitude:
                self._moments[key] = self._means(quantity, window)
            else:
                square = self._means(quantity, window)[0]
                mean = self._means(quantity, window, is_root=True)[0] if needs_mean else arb(0)
                self._moments[key] = mean, square
        return self._moments[key]

    def _means(self, quantity: Quantity, window: Window, *, is_root: bool = False) -> tuple[arb, arb]:
        """Means of the number of a signal, or of its root, and of the square of that."""
        number = quantity.number.sqrt() if is_root else quantity.number
        function = self._graph.function([number], self._references(quantity))
        reason = f"{quantity.signal.name} is too close to a singularity for a proof of its mean"
        if window.kind == "turn":
            return turn_means(lambda angle: function(angle)[0], reason)
        return arc_means(lambda angle: function(angle)[0], *_ends(_arc(window)), reason)

    # derived metrics

    def _derived(self, metric: DerivedMetric) -> Enclosure | None:
        """A metric that follows from extremes."""
        sources = [self._source(source) for source in metric.inputs]
        name = metric.formula.name
        if name in ("swing_angle", "stroke"):
            return Enclosure.of(sources[0])
        if name == "footprint":
            return Enclosure.of(sources[0] * sources[1])
        if name == "transmission_angle_min":
            return Enclosure.of(reduce(arb.min, [*sources[::2], *(180 - each for each in sources[1::2])]))
        if name in ("envelope_width", "envelope_height"):
            return Enclosure.of(self._side(sources, name == "envelope_height"))
        raise UnprovedError(f"{name} has no rigorous road")

    def _side(self, sources: list[arb], axis: int) -> arb:
        """The extent of all points along an axis; the last sources are least and greatest x and y of each."""
        frame = self._table.frame.points
        fixed = [self._graph.place_of_frame(point)[axis] for point, _ in frame]
        moving = sources[len(sources) - 4 * (len(self._table.points) - len(frame)) :]
        greatest = reduce(arb.max, [*moving[2 * axis + 1 :: 4], *fixed])
        return greatest - reduce(arb.min, [*moving[2 * axis :: 4], *fixed])

    def _source(self, source: object) -> arb:
        if isinstance(source, Metric | SampledMetric | DerivedMetric):
            enclosure = self.enclose(source)
            if enclosure is None:
                raise UnprovedError(f"{source.name} is undefined")
            return enclosure.ball
        return arb(exact(self._parameters[source.name]))  # type: ignore[attr-defined]  # a parameter


def _arc(window: Window) -> Arc:
    """The arc of an interval."""
    return Arc(*(Position.at_degrees(angle) for angle in (window.start, window.stop)))


def _ends(arc: Arc) -> tuple[arb, arb]:
    return arc.start.angle, arc.stop.angle


#: Maker that the registry names.
certify = LinkageOfTable
