"""Certificates of crank-rockers and double cranks."""

from collections.abc import Callable, Mapping
from functools import cached_property

from flint import acb, arb, fmpq_poly

from explore.analysis.certifying import four_bar_extremes, four_bar_integrals
from explore.analysis.certifying.balls import Enclosure, UnprovedError
from explore.analysis.certifying.four_bar_integrals import SquareOfVelocity
from explore.analysis.certifying.four_bar_motion import COUPLER, ROCKER, Linkage, State
from explore.analysis.certifying.four_bar_shape import classify, overall_size
from explore.analysis.certifying.positions import Arc, Position, extremes, full_turn
from explore.analysis.certifying.statistics import from_extremes, from_moments, in_its_unit, stroke_of, time_ratio
from explore.mechanisms import four_bar, rocking
from explore.model.quantities import EXTREME_STATISTICS, DerivedMetric, Metric, SampledMetric
from explore.model.request import Request
from explore.model.status import Status
from explore.model.window import Window

_LENGTHS = ("crank", "coupler", "rocker", "ground")
_STATUSES = {
    four_bar.CRANK_ROCKER: Status.OK,
    four_bar.DOUBLE_CRANK: rocking.NO_STROKE,
    four_bar.CHANGE_POINT: rocking.CHANGE_POINT,
    four_bar.CANNOT_ASSEMBLE: rocking.CANNOT_ASSEMBLE,
}
#: Link and order of the derivative of its angle for signals that are one.
_MOTIONS = {
    "coupler_angle": (COUPLER, 0),
    "rocker_angle": (ROCKER, 0),
    "coupler_velocity": (COUPLER, 1),
    "rocker_velocity": (ROCKER, 1),
    "output_velocity": (ROCKER, 1),
    "velocity_ratio": (ROCKER, 1),
    "coupler_acceleration": (COUPLER, 2),
    "rocker_acceleration": (ROCKER, 2),
}


class CrankRocker:
    """A crank-rocker or double crank of exact lengths; see `explore.analysis.certifying.contract.Certificate`."""

    def __init__(self, parameters: Mapping[str, float], request: Request) -> None:
        lengths = tuple(parameters[name] for name in _LENGTHS)
        self._class, self._margin = classify(*lengths)
        self._branch, self._phases = int(parameters["branch"]), int(parameters["phases"])
        self._speed, self._request = arb(parameters["speed"]), request
        self._rocks = self._class == four_bar.CRANK_ROCKER
        self._turns = self._rocks or self._class == four_bar.DOUBLE_CRANK
        self._linkage = Linkage(*lengths)
        self._squares: dict[int, SquareOfVelocity] = {}
        self._moments: dict[tuple[str, Window], tuple[arb, arb]] = {}
        self._extremes: dict[tuple[str, Window], tuple[arb, arb]] = {}

    @property
    def status(self) -> int:
        """The status by exact signs; a double crank is computed where no metric needs a stroke."""
        status = int(_STATUSES.get(self._class, rocking.CRANK_BLOCKED))
        return status if status != rocking.NO_STROKE or self._request.needs_stroke else int(Status.OK)

    def enclose(self, metric: Metric | SampledMetric | DerivedMetric) -> Enclosure | None:
        """Enclose a metric."""
        if isinstance(metric, DerivedMetric):
            limits = self._limit_angles if self._rocks else None
            return overall_size(self._linkage, limits, metric.name) if self._turns else None
        if isinstance(metric, Metric):
            return self._closed_form(metric.name)
        if self.status != Status.OK:
            return None
        return self._statistic(metric)

    # closed form

    def _closed_form(self, name: str) -> Enclosure | None:
        if name == "linkage_class":
            return Enclosure.of(arb(self._class))
        if name == "grashof_margin":
            return Enclosure.of(arb(self._margin))
        degrees = 180 / arb.pi()
        if name in ("transmission_angle_min", "transmission_angle_max"):
            if not self._turns:
                return None
            cosine = arb(1 if name == "transmission_angle_min" else -1)
            at_end = self._linkage.state(cosine, arb(0))
            return Enclosure.of(self._linkage.transmission_angle(at_end) * degrees)
        if not self._rocks:
            return None
        overlapped, extended = self._limit_angles
        match name:
            case "swing_angle":
                return Enclosure.of((overlapped - extended) * degrees)
            case "mid_angle":
                return Enclosure((overlapped + extended) * degrees * self._branch / 2, arb(180))
            case "time_ratio":
                return time_ratio(self._linkage.stroke(through_zero=True).length)
            case "mean_output_ratio":
                return Enclosure.of((overlapped - extended) / (2 * arb.pi()))
        raise UnprovedError(f"{name} has no rigorous road")

    @cached_property
    def _limit_angles(self) -> tuple[arb, arb]:
        """Rocker angles at both limit positions, of branch 1."""
        linkage = self._linkage
        return linkage.angle(ROCKER, linkage.overlapped), linkage.angle(ROCKER, linkage.extended)

    # statistics

    def _statistic(self, metric: SampledMetric) -> Enclosure | None:
        signal = metric.signal
        if signal.name not in _MOTIONS and signal.name != "transmission_angle":
            raise UnprovedError(f"{signal.name} has no rigorous road")
        if metric.statistic in EXTREME_STATISTICS:
            enclosure: Enclosure | None = from_extremes(metric.statistic, *self._low_and_high(metric))
        else:
            enclosure = from_moments(metric.statistic, *self._mean_and_square(metric), self._request.tolerance)
        return in_its_unit(enclosure, metric, self._speed)

    def _mean_and_square(self, metric: SampledMetric) -> tuple[arb, arb]:
        """Mean of a signal and of its square, for unit speed in rad."""
        key = metric.signal.name, metric.window
        if key not in self._moments:
            self._moments[key] = self._find_moments(metric)
        return self._moments[key]

    def _find_moments(self, metric: SampledMetric) -> tuple[arb, arb]:
        name, arc = metric.signal.name, self._arc(metric.window)
        turn = 2 * arb.pi()
        if metric.window.kind == "clutch":
            driven, period = self._driven_arc, turn / self._phases
            change = self._linkage.angle(ROCKER, driven.stop) - self._linkage.angle(ROCKER, driven.start)
            return abs(change) / period, self._square_of_velocity(ROCKER).over(driven) / period
        if name == "transmission_angle":
            return self._integrated(arc, four_bar_integrals.transmission_angle(self._linkage))
        link, order = _MOTIONS[name]
        if order == 0:
            mean, square = self._integrated(arc, four_bar_integrals.angle(self._linkage, link))
            return mean * self._branch, square
        if order == 1:
            change = self._linkage.angle(link, arc.stop) - self._linkage.angle(link, arc.start)
            return change / arc.length, self._square_of_velocity(link).over(arc) / arc.length
        change = self._velocity(link, arc.stop) - self._velocity(link, arc.start)
        square = four_bar_integrals.integrate(
            self._linkage, arc, lambda state, _: self._linkage.acceleration(link, state) ** 2
        )
        return self._branch * change / arc.length, square / arc.length

    def _integrated(self, arc: Arc, signal: four_bar_integrals.Integrand) -> tuple[arb, arb]:
        def square(state: State, analytic: bool) -> acb:
            return signal(state, analytic) ** 2

        integrals = (four_bar_integrals.integrate(self._linkage, arc, function) for function in (signal, square))
        mean, mean_square = (integral / arc.length for integral in integrals)
        return mean, mean_square

    def _velocity(self, link: int, position: Position) -> arb:
        return self._linkage.velocity(link, self._linkage.at(position))

    def _square_of_velocity(self, link: int) -> SquareOfVelocity:
        if link not in self._squares:
            self._squares[link] = SquareOfVelocity(self._linkage, link)
        return self._squares[link]

    def _low_and_high(self, metric: SampledMetric) -> tuple[arb, arb]:
        """Smallest and largest value of a signal, for unit speed in rad."""
        key = metric.signal.name, metric.window
        if key not in self._extremes:
            self._extremes[key] = self._find_extremes(metric)
        return self._extremes[key]

    def _find_extremes(self, metric: SampledMetric) -> tuple[arb, arb]:
        name, arc, linkage = metric.signal.name, self._arc(metric.window), self._linkage
        signal: Callable[[Position, State], arb]
        if name == "transmission_angle":
            return self._extremes_of(arc, lambda _, state: linkage.transmission_angle(state), fmpq_poly([1, 0, -1]))
        link, order = _MOTIONS[name]
        if order == 0:
            signal, find = lambda position, _: linkage.angle(link, position), four_bar_extremes.turning_points_of_angle
        elif order == 1:
            signal, find = lambda _, state: linkage.velocity(link, state), four_bar_extremes.turning_points_of_velocity
        else:
            signal = lambda _, state: linkage.acceleration(link, state)  # noqa: E731
            find = four_bar_extremes.turning_points_of_acceleration
        low, high = self._extremes_of(arc, signal, find(linkage, link))
        if metric.window.kind == "clutch":
            rests = self._driven_arc.length < 2 * arb.pi() / self._phases
            least = arb(0) if rests else abs(self._velocity(ROCKER, self._driven_arc.start))
            return least, abs(low).max(abs(high))
        if self._branch < 0 and order != 1:
            low, high = -high, -low
        if order == 0 and not (low > -arb.pi() and high < arb.pi()):
            raise UnprovedError(f"{name} passes 180 deg")
        return low, high

    def _extremes_of(self, arc: Arc, signal: Callable[[Position, State], arb], turning: fmpq_poly) -> tuple[arb, arb]:
        ends = [signal(end, self._linkage.at(end)) for end in (arc.start, arc.stop)]
        return extremes(ends, arc, four_bar_extremes.turning_values(self._linkage, signal, turning))

    @cached_property
    def _driven_arc(self) -> Arc:
        """The part of the drive stroke in which one rocker drives the output."""
        clutch = next(window for window in self._request.mechanism.windows if window.kind == "clutch")
        return four_bar_extremes.driven_arc(self._linkage, self._arc(clutch), 2 * arb.pi() / self._phases)

    # windows

    def _arc(self, window: Window) -> Arc:
        """A window as an arc of the motion of branch 1; the drive stroke for the window of the clutch."""
        linkage = self._linkage
        if window.kind == "turn":
            return full_turn()
        if window.kind == "interval":
            ends = (Position.at_degrees(angle) for angle in (window.start, window.stop))
            arc = Arc(*ends)
            return arc.mirrored() if self._branch < 0 else arc
        product = -linkage.overlapped.tangent * linkage.extended.tangent
        stroke = stroke_of(self._request, window.name, product if self._branch > 0 else 1 / product)
        is_first = stroke == self._request.mechanism.strokes[0]
        return linkage.stroke(through_zero=is_first == (self._branch > 0))


#: Maker that the registry names.
certify = CrankRocker
