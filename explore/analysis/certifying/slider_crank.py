"""Certificates of slider-cranks.

With s and c sine and cosine of the crank angle, h = r s - e, Y = y^2 = l^2 - h^2, N = r (r c^2 - s h) Y + r^2 c^2 h^2:

    x = r c + y,    x' = -r s - r h c/y,    x'' = -r c - N/y^3,    the rod's angle is -arcsin(h/l),

its rates -r c/y and r B/y^3, B = s Y - r c^2 h. Y, N and B are polynomials in s, and so are the squares of what is 0
where a signal turns.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import acb, arb, fmpq, fmpq_poly

from explore.analysis.certifying.balls import Enclosure, UnprovedError, exact, positive
from explore.analysis.certifying.integration import arctangent, integrate_over
from explore.analysis.certifying.positions import Arc, Position, extremes, full_turn, other_coordinate, real_roots
from explore.analysis.certifying.statistics import from_extremes, from_moments, in_its_unit, stroke_of, time_ratio
from explore.mechanisms.slider_crank import kernel
from explore.model.quantities import EXTREME_STATISTICS, DerivedMetric, Metric, SampledMetric
from explore.model.request import Request
from explore.model.status import Status
from explore.model.window import Window

_SINE = fmpq_poly([0, 1])
#: Signal whose rate each signal is; empty for a position and an angle.
_RATE_OF = {
    "slider_position": "",
    "slider_velocity": "slider_position",
    "slider_acceleration": "slider_velocity",
    "rod_angle": "",
    "rod_velocity": "rod_angle",
    "rod_acceleration": "rod_velocity",
}


@dataclass(frozen=True)
class State:
    """Sine and cosine of a crank angle and y, as balls, real or complex."""

    sine: Any
    cosine: Any
    along: Any


class SliderCrank:
    """A slider-crank of exact lengths; see `explore.analysis.certifying.contract.Certificate`."""

    def __init__(self, parameters: Mapping[str, float], request: Request) -> None:
        self._crank, self._rod, self._offset = (exact(parameters[name]) for name in ("crank", "rod", "offset"))
        self._speed, self._request = arb(parameters["speed"]), request
        self._margin = self._rod - self._crank - abs(self._offset)
        self._rounding = 4 * exact(math.ulp(float(parameters["rod"])))
        self._across = self._crank * _SINE - self._offset
        self._square = self._rod * self._rod - self._across * self._across
        self._moments: dict[tuple[str, Window], tuple[arb, arb]] = {}
        self._extremes: dict[tuple[str, Window], tuple[arb, arb]] = {}

    @property
    def status(self) -> int:
        """The status by exact signs; a margin of up to 4 units in the last place is a change point."""
        if abs(self._offset) - self._crank > self._rod:
            return kernel.CANNOT_ASSEMBLE
        if abs(self._margin) <= self._rounding:
            return kernel.CHANGE_POINT
        return kernel.CRANK_BLOCKED if self._margin < 0 else int(Status.OK)

    def enclose(self, metric: Metric | SampledMetric | DerivedMetric) -> Enclosure | None:
        """Enclose a metric."""
        if metric.name == "turning_margin":
            return Enclosure.of(arb(self._margin))
        if isinstance(metric, SampledMetric) and metric.signal.name not in _RATE_OF:
            raise UnprovedError(f"{metric.signal.name} has no rigorous road")
        if self.status != Status.OK:
            return None
        if isinstance(metric, SampledMetric):
            return self._statistic(metric)
        return self._closed_form(metric.name)

    def _closed_form(self, name: str) -> Enclosure:
        crank, rod, offset, degrees = self._crank, self._rod, self._offset, 180 / arb.pi()
        outer, inner = (arb(reach * reach - offset * offset).sqrt() for reach in (rod + crank, rod - crank))
        pressure = arb((crank + abs(offset)) / rod).asin() * degrees
        width = crank + outer
        height = crank + max(crank, abs(offset))
        match name:
            case "stroke":
                return Enclosure.of(outer - inner)
            case "time_ratio":
                return time_ratio(self._stroke(0).length)
            case "outer_angle":
                return Enclosure.of(arb(offset / (rod + crank)).asin() * degrees)
            case "inner_angle":
                return Enclosure.of(180 + arb(offset / (rod - crank)).asin() * degrees)
            case "pressure_angle_max":
                return Enclosure.of(pressure)
            case "transmission_angle_min":
                return Enclosure.of(90 - pressure)
            case "envelope_width":
                return Enclosure.of(width)
            case "envelope_height":
                return Enclosure.of(arb(height))
            case "footprint":
                return Enclosure.of(width * height)
        raise UnprovedError(f"{name} has no rigorous road")

    # statistics

    def _statistic(self, metric: SampledMetric) -> Enclosure | None:
        key = metric.signal.name, metric.window
        if metric.statistic in EXTREME_STATISTICS:
            if key not in self._extremes:
                self._extremes[key] = self._find_extremes(metric.signal.name, self._arc(metric.window))
            enclosure: Enclosure | None = from_extremes(metric.statistic, *self._extremes[key])
        else:
            if key not in self._moments:
                self._moments[key] = self._find_moments(metric.signal.name, self._arc(metric.window))
            enclosure = from_moments(metric.statistic, *self._moments[key], self._request.tolerance)
        return in_its_unit(enclosure, metric, self._speed)

    def _find_moments(self, name: str, arc: Arc) -> tuple[arb, arb]:
        """Mean of a signal and of its square, for unit speed in rad."""
        signal, antiderivative = self._signal(name), _RATE_OF[name]
        square = self._integral(arc, lambda state, analytic: signal(state, analytic) ** 2) / arc.length
        if not antiderivative:
            return self._integral(arc, signal) / arc.length, square
        at_end = self._signal(antiderivative)
        change = at_end(self._at(arc.stop), False) - at_end(self._at(arc.start), False)
        return change / arc.length, square

    def _integral(self, arc: Arc, signal: Callable[[State, bool], Any]) -> arb:
        def function(tangent: acb, half_turns: int, analytic: bool) -> acb:
            square, sign = tangent * tangent, -1 if half_turns % 2 else 1
            sine, cosine = sign * 2 * tangent / (1 + square), sign * (1 - square) / (1 + square)
            across = self._crank * sine - self._offset
            below, above = ((self._rod + side * across).sqrt(analytic=analytic) for side in (-1, 1))
            return signal(State(sine, cosine, below * above), analytic)

        return integrate_over(arc, function)

    def _find_extremes(self, name: str, arc: Arc) -> tuple[arb, arb]:
        """Smallest and largest value of a signal over an arc, for unit speed in rad."""
        signal = self._signal(name)
        ends = [signal(self._at(end), False) for end in (arc.start, arc.stop)]
        turning = ((position.angle, signal(state, False)) for position, state in self._candidates(name))
        return extremes(ends, arc, turning)

    def _candidates(self, name: str) -> Iterator[tuple[Position, State]]:
        """Positions, all those among them where a signal turns."""
        for sine in real_roots(self._turning(name)):
            cosine = other_coordinate(sine)
            tangent = sine / (1 + cosine)
            yield Position(0, tangent), self._state(sine, cosine)
            yield Position(1, -tangent), self._state(sine, -cosine)

    def _turning(self, name: str) -> fmpq_poly:
        """Polynomial whose roots include the sines where a signal turns."""
        crank, across, square = self._crank, self._across, self._square
        cosine_squared, slope = 1 - _SINE * _SINE, square.derivative()
        numerator, rest = self._numerator, self._rest
        match name:
            case "slider_position":
                return (self._rod * _SINE) ** 2 - across * across
            case "slider_velocity":
                return crank * crank * cosine_squared * square**3 - numerator**2
            case "slider_acceleration":
                rate = numerator.derivative() * square - fmpq(3, 2) * numerator * slope
                return (crank * _SINE) ** 2 * square**5 - cosine_squared * rate**2
            case "rod_angle":
                return cosine_squared
            case "rod_velocity":
                return rest
        return cosine_squared * (rest.derivative() * square - fmpq(3, 2) * rest * slope)

    @cached_property
    def _numerator(self) -> fmpq_poly:
        """N."""
        crank, across, cosine_squared = self._crank, self._across, 1 - _SINE * _SINE
        first = crank * (crank * cosine_squared - _SINE * across) * self._square
        return first + crank * crank * cosine_squared * across * across

    @cached_property
    def _rest(self) -> fmpq_poly:
        """B."""
        return _SINE * self._square - self._crank * (1 - _SINE * _SINE) * self._across

    # motion

    def _signal(self, name: str) -> Callable[[State, bool], Any]:
        """A signal for unit speed in rad; it takes a state, and whether it must be analytic there."""
        crank, offset = self._crank, self._offset

        def slider_acceleration(state: State, _: bool) -> Any:
            across = crank * state.sine - offset
            square, cosine_squared = state.along * state.along, state.cosine * state.cosine
            first = crank * (crank * cosine_squared - state.sine * across) / state.along
            return -crank * state.cosine - first - cosine_squared * (crank * across) ** 2 / (square * state.along)

        def rod_angle(state: State, analytic: bool) -> Any:
            slope = (crank * state.sine - offset) / state.along
            return -arctangent(slope, analytic) if isinstance(slope, acb) else -slope.atan()

        def rod_acceleration(state: State, _: bool) -> Any:
            across = crank * state.sine - offset
            bend = crank * state.cosine**2 * across / (state.along * state.along)
            return crank * (state.sine - bend) / state.along

        signals: dict[str, Callable[[State, bool], Any]] = {
            "slider_position": lambda state, _: crank * state.cosine + state.along,
            "slider_velocity": lambda state, _: (
                -crank * (state.sine + (crank * state.sine - offset) * state.cosine / state.along)
            ),
            "slider_acceleration": slider_acceleration,
            "rod_angle": rod_angle,
            "rod_velocity": lambda state, _: -crank * state.cosine / state.along,
            "rod_acceleration": rod_acceleration,
        }
        return signals[name]

    def _state(self, sine: arb, cosine: arb) -> State:
        across = self._crank * sine - self._offset
        return State(sine, cosine, positive((self._rod - across) * (self._rod + across)).sqrt())

    def _at(self, position: Position) -> State:
        return self._state(position.sine, position.cosine)

    # windows

    def _arc(self, window: Window) -> Arc:
        if window.kind == "turn":
            return full_turn()
        if window.kind == "interval":
            return Arc(*(Position.at_degrees(angle) for angle in (window.start, window.stop)))
        crank, rod, offset = self._crank, self._rod, self._offset
        # by the half-tangents of the dead centres from 90 deg
        first, second = (rod + crank - offset) / (rod + crank + offset), (rod - crank + offset) / (rod - crank - offset)
        stroke = stroke_of(self._request, window.name, arb(first * second).sqrt())
        return self._stroke(self._request.mechanism.strokes.index(stroke))

    def _stroke(self, number: int) -> Arc:
        """The stroke from the outer to the inner dead centre, or back."""
        outer, inner = (
            Position(half_turns, self._offset / (reach + arb(reach * reach - self._offset**2).sqrt()))
            for half_turns, reach in ((0, self._rod + self._crank), (1, self._rod - self._crank))
        )
        return Arc(inner, outer.later(1)) if number else Arc(outer, inner)


#: Maker that the registry names.
certify = SliderCrank
