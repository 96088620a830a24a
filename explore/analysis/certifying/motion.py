"""The motion of one design in balls: its status, windows, and extremes and means of its signals."""

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cached_property, reduce
from typing import cast

from flint import arb, fmpq

from explore.analysis.certifying.arcs import Arc, angle_of_mark, driven_arc, extremes, full_turn, interval, window_arc
from explore.analysis.certifying.ball_graph import BallGraph, Function
from explore.analysis.certifying.balls import UnprovedError, exact
from explore.analysis.certifying.constants import constant_of
from explore.analysis.certifying.fluctuations import fluctuation
from explore.analysis.certifying.means import arc_means, turn_means
from explore.analysis.certifying.pieces import Piece, cut_pieces
from explore.analysis.certifying.subdivision import sign_changes
from explore.analysis.certifying.turning import Turning
from explore.mechanisms.linkages.declared import table_of
from explore.mechanisms.linkages.graph import GREATEST_PLACE, LEAST_PLACE, Number
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.statuses import CANNOT_ASSEMBLE, NO_STROKES, blocked_at
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.linkages.trace import REFERENCE
from explore.model.exact import ExactDesign
from explore.model.quantities import Signal
from explore.model.request import Request
from explore.model.status import Status
from explore.model.window import Window

#: Ending of the names of the signals of tables that are angles of transmission.
_TRANSMISSION = "transmission_angle"


class Motion:
    """The motion of a design, at the precision that is set when it is made and used; signals are for unit speed in rad.

    Attributes
    ----------
    table
        The linkage.
    graph
        Its graph.
    exact
        What its mechanism knows of it without rounding; None for nothing.
    """

    def __init__(self, parameters: Mapping[str, float | fmpq], request: Request) -> None:
        self._parameters, self._request, self._mechanism = parameters, request, request.mechanism
        self.table = cast(LinkageTable, table_of(self._mechanism))  # `certificate.require_table`
        self.graph = BallGraph(self.table, parameters, self._mechanism.table_signals)
        self.exact: ExactDesign | None = None
        if self._mechanism.exact is not None:
            names = self.table.moving_names | {parameter.name for parameter in request.kernel.kernel_parameters}
            self.exact = self._mechanism.exact({name: exact(parameters[name]) for name in names})
        self._extremes: dict[tuple[str, Window], tuple[arb, arb]] = {}
        self._cut: dict[tuple[int, Window], list[Piece]] = {}
        self._moments: dict[tuple[str, Window, bool], tuple[arb, arb]] = {}

    @cached_property
    def _turning(self) -> Turning:
        """The signs over the whole motion."""
        window = self._mechanism.whole_motion
        return Turning(self.graph, None if window.kind == "turn" else interval(window))

    @cached_property
    def _part_that_moves(self) -> Turning | None:
        """The signs over the interval of the request, if all joints assemble at all of its angles."""
        window = self._request.interval
        part = Turning(self.graph, interval(window)) if window else None
        return part if part and part.status == Status.OK else None

    @cached_property
    def _followed(self) -> Turning:
        """Over the whole motion, or over the interval of a linkage that moves there alone."""
        part = self._part_that_moves
        return part if part and self._turning.status != Status.OK else self._turning

    @cached_property
    def status(self) -> int:
        """The status by signs of what is exact, or of balls."""
        if self.exact is None:
            status = int(Status.OK) if self._part_that_moves else self._turning.status
            lacks_strokes = status == Status.OK and self._request.needs_stroke and len(self.reversals) != 2
            return NO_STROKES if lacks_strokes else status
        own = self._mechanism.statuses.get(self.exact.status)
        computes = own is not None and own.lacks_strokes and not self._request.needs_stroke
        return int(Status.OK) if computes else self.exact.status

    @cached_property
    def reaches(self) -> list[tuple[arb, arb]]:
        """Start and end of each interval of a turn at which all joints assemble, rad; `UnprovedError` if not known."""
        joints = {factor.joint for factor in self.graph.equations.factors}
        status = self.status if self.exact else self._turning.status  # not that over an interval
        if status in (CANNOT_ASSEMBLE, *map(blocked_at, range(len(joints)))):
            return self._turning.reaches
        own = self._mechanism.statuses.get(status)
        if status == Status.OK or (own and own.lacks_strokes):
            return [(arb(0), 2 * arb.pi())]
        raise UnprovedError("where designs beside a change point assemble cannot be certified")

    def misses(self, angle: arb) -> bool:
        """Whether some joint certainly does not assemble at an input angle, rad."""
        return self._turning.misses(angle)

    # marks and windows

    @cached_property
    def reversals(self) -> list[tuple[arb, bool]]:
        """Where the output turns back, and whether forwards then."""
        rate, turn = self._mechanism.signal(self._mechanism.output_signals[""]), full_turn()
        return sign_changes(self.function(self.quantity(rate)), rate.name, turn.start, turn.stop)

    @cached_property
    def marks(self) -> dict[str, arb]:
        """Input angles of the marks, rad."""
        if self.exact is not None:
            return {name: angle_of_mark(mark) for name, mark in self.exact.marks.items()}
        return {"least" if rises else "greatest": angle for angle, rises in self.reversals}

    def _arc(self, window: Window) -> Arc:
        if window.kind == "turn":
            return full_turn()
        return interval(window) if window.kind == "interval" else window_arc(self._request, window, self.marks)

    # signals

    def quantity(self, signal: Signal) -> Quantity:
        """The number of the graph that a signal is."""
        for name in (signal.name, signal.shares_row_with):
            if name in self.graph.quantities:
                return self.graph.quantities[name]
        if signal.name == _TRANSMISSION and len(self.transmissions) == 1:
            return self.transmissions[0]
        raise UnprovedError(f"{signal.name} cannot be certified: no enclosure is implemented")

    @property
    def transmissions(self) -> list[Quantity]:
        """The angles of transmission of all joints."""
        return [each for name, each in self.graph.quantities.items() if name.endswith(_TRANSMISSION)]

    def function(self, quantity: Quantity, number: Number | None = None) -> Function:
        """A signal, or a number of its, as a function of the input angle."""
        number = quantity.number if number is None else number
        return self.graph.function([number], self._references(quantity), quantity.signal.name)

    @property
    def output_place(self) -> Quantity:
        """The angle of the output, or its position along a line."""
        is_slider = self.table.output in self.table.sliders
        return self.graph.quantities[f"{self.table.output}_{'position' if is_slider else 'angle'}"]

    def place(self, point: str, link: str = "") -> Function:
        """The coordinates of a point that moves, mm, and those of the direction of a link, if one is named."""
        direction = [series.terms[0] for series in self.graph.equations.directions[link]] if link else []
        place = [self.graph.quantities[f"{point}_{axis}"].number for axis in "xy"]
        return self.graph.function([*place, *direction], None, point)

    def _references(self, quantity: Quantity) -> dict[str, arb]:
        """Inputs that tell the turns of links apart, and the ends of the stroke where loads follow from them."""
        ends = self._ends_of_output if quantity.signal.needs_stroke else ()
        inputs = dict(zip((LEAST_PLACE, GREATEST_PLACE), ends, strict=False))
        for link in quantity.links:
            middle = arb(0 if self.exact else self._followed.middle_of(link))
            parts = (middle, middle.cos(), middle.sin())
            inputs |= {f"{REFERENCE}{link}:{part}": value for part, value in enumerate(parts)}
        return inputs

    def _pieces(self, quantity: Quantity, window: Window, number: Number | None = None) -> list[Piece]:
        """The pieces of a window in which a signal, or a number of its, is an analytic function."""
        number = quantity.number if number is None else number
        key = number.index, window
        if key not in self._cut:
            rate = self._mechanism.signal(self._mechanism.output_signals[""])
            is_stroke = window.kind not in ("turn", "interval") and rate.name in self.graph.quantities
            at_ends = self.quantity(rate).number if is_stroke else None
            arc, references = self._part(window), self._references(quantity)
            self._cut[key] = cut_pieces(self.graph, number, quantity.signal.name, arc, references, at_ends)
        return self._cut[key]

    def _part(self, window: Window) -> Arc:
        """The input angles of a window at which this linkage moves the output."""
        return self._driven if window.kind == "clutch" else self._arc(window)

    # extremes and means

    def low_and_high(self, signal: Signal, window: Window) -> tuple[arb, arb]:
        """Smallest and largest value of a signal over a window."""
        key = signal.name, window
        if key not in self._extremes:
            self._extremes[key] = self._find_extremes(signal, window)
        return self._extremes[key]

    def _find_extremes(self, signal: Signal, window: Window) -> tuple[arb, arb]:
        quantity, arc = self.quantity(signal), self._part(window)
        if signal.extremes_at and window.kind != "clutch":
            return self._extremes_between(signal, arc, self.function(quantity))
        pieces = self._pieces(quantity, window)
        is_turn = arc.is_turn and len(pieces) == 1
        constant = constant_of(quantity.number, pieces[0].function)
        size, reason = _size(pieces), _too_close(quantity)
        found = [constant] if constant else [
            piece.extremes(signal.name, size, reason, is_turn=is_turn) for piece in pieces
        ]  # fmt: skip
        low, high = reduce(arb.min, (low for low, _ in found)), reduce(arb.max, (high for _, high in found))
        if window.kind == "clutch":
            least = arb(0) if arc.length < self._period else abs(pieces[0].function.value(arc.start))
            return least, abs(low).max(abs(high))
        if quantity.signal.is_magnitude:
            return low.nonnegative_part().sqrt(), high.nonnegative_part().sqrt()
        return low, high

    def _extremes_between(self, signal: Signal, arc: Arc, function: Function) -> tuple[arb, arb]:
        """Extremes of a signal that is monotonic between places which its declaration names."""
        places = [self._place(name) for name in signal.extremes_at]
        values = [function.value(place) for place in places]
        if arc.is_turn:
            return values[0].min(values[1]), values[0].max(values[1])
        return extremes([function.value(end) for end in (arc.start, arc.stop)], arc, zip(places, values, strict=True))

    def _place(self, name: str) -> arb:
        """The input angle of a mark, of the anchor, or of its opposite, rad."""
        if name not in ("anchor", "opposite"):
            return self.marks[name]
        quarters = round(self._mechanism.anchor_angle / (0.5 * math.pi)) + 2 * (name == "opposite")
        return quarters * arb.pi() / 2

    def mean_and_square(self, signal: Signal, window: Window, *, needs_mean: bool) -> tuple[arb, arb]:
        """Mean of a signal and of its square over a window; only a magnitude's mean can be left out."""
        quantity = self.quantity(signal)
        is_magnitude = quantity.signal.is_magnitude
        key = signal.name, window, needs_mean or not is_magnitude
        if key not in self._moments:
            antiderivative = self.exact.squares.get(quantity.signal.name) if self.exact else None
            if antiderivative and window.kind not in ("turn", "clutch"):
                moments = self._closed_means(quantity, self._arc(window), antiderivative)
            else:
                moments = self._means(quantity, window)
            if is_magnitude:
                root = self._means(quantity, window, quantity.number.sqrt())[0] if needs_mean else arb(0)
                moments = root, moments[0]
            self._moments[key] = moments
        return self._moments[key]

    def power_mean(self, signal: Signal, window: Window) -> arb:
        """The mean of power 10/3 of a magnitude over a window, to the power 3/10; of its square, the power is 5/3."""
        quantity = self.quantity(signal)
        square, graph = quantity.number, quantity.number.graph
        mean, _ = self._means(quantity, window, square.call("power", graph.constant(Fraction(5, 3))))
        return mean ** (arb(3) / 10)

    def fluctuation(self, signal: Signal) -> arb:
        """The range over the turn of the integral of a signal less its mean."""
        quantity, whole = self.quantity(signal), self._mechanism.whole_motion
        mean, _ = self.mean_and_square(signal, whole, needs_mean=True)
        return fluctuation(self._pieces(quantity, whole), mean, signal.name, _too_close(quantity))

    def _closed_means(self, quantity: Quantity, arc: Arc, antiderivative: Callable[..., arb]) -> tuple[arb, arb]:
        """Mean of a signal by the change of the one that it is the derivative of, and of its square."""
        below = self._mechanism.signal(self._mechanism.signal(quantity.signal.name).derivative_of)
        first, last = map(self.function(self.quantity(below)).value, (arc.start, arc.stop))
        first_square, last_square = (antiderivative(end, end.cos(), end.sin()) for end in (arc.start, arc.stop))
        return (last - first) / arc.length, (last_square - first_square) / arc.length

    def _means(self, quantity: Quantity, window: Window, number: Number | None = None) -> tuple[arb, arb]:
        """Means of a number and of its square; behind clutches it is the size of the output."""
        arc, pieces, reason = self._part(window), self._pieces(quantity, window, number), _too_close(quantity)
        if arc.is_turn and len(pieces) == 1:
            return turn_means(pieces[0].function.value, reason)
        mean = square = arb(0)
        for piece in pieces:
            share = (piece.stop - piece.start) / arc.length
            own, own_square = (
                (piece.value, piece.value * piece.value) if piece.is_tiny else
                arc_means(piece.function.value, piece.start, piece.stop, reason)
            )  # fmt: skip
            mean, square = mean + share * own, square + share * own_square
        if window.kind == "clutch":
            share = arc.length / self._period
            return abs(mean) * share, square * share
        return mean, square

    @cached_property
    def _ends_of_output(self) -> tuple[arb, arb]:
        """Least and greatest place of the output over the whole motion, mm or rad."""
        return self.low_and_high(self.output_place.signal, self._mechanism.whole_motion)

    # several linkages behind clutches

    @cached_property
    def _period(self) -> arb:
        """The angle between the linkages that share an output, rad."""
        shared = next(p for p in self._mechanism.parameters if "clutch" in p.only_in)
        return 2 * arb.pi() / arb(exact(self._parameters[shared.name]))

    @cached_property
    def _driven(self) -> Arc:
        """The part of the drive stroke in which one linkage drives the output."""
        clutch = next(window for window in self._mechanism.windows if window.kind == "clutch")
        rate = self._mechanism.signal(self._mechanism.output_signals[""])
        change = cast(Signal, self._mechanism.derivative(rate))  # every declaration with clutches has one
        rates = [self.function(self.quantity(signal)) for signal in (rate, change)]
        return driven_arc(rates[0], rates[1], self._arc(clutch), self._period)


def _size(pieces: list[Piece]) -> arb:
    """The largest magnitude that a signal has for certain in the middle of a piece."""
    middles = (piece.function.value((piece.start + piece.stop) / 2) for piece in pieces if not piece.is_tiny)
    return reduce(arb.max, (abs(value).lower() for value in middles if value.is_finite()), arb(0))


def _too_close(quantity: Quantity) -> str:
    return f"{quantity.signal.name} is too close to a singularity for a proof of its mean"
