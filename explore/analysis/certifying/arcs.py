"""Arcs of the input angle: windows between marks, and the part of a stroke in which one of several linkages drives."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from flint import arb, ctx, fmpq

from explore.analysis.certifying.ball_graph import Function
from explore.analysis.certifying.balls import UndecidedError, UnprovedError
from explore.analysis.certifying.subdivision import sign_changes
from explore.evaluation.quadrature.windows import TIE
from explore.model.request import Request
from explore.model.window import Window

#: Relative rounding of the product of half-tangents by which the program tells the slow stroke.
_ROUNDING = 4e-15
#: Angle at which a turn begins, rad: signals like to turn at round angles, where no cell ends.
_OFFSET = 0.0951


@dataclass(frozen=True)
class Arc:
    """The input angles from one to another, rad."""

    start: arb
    stop: arb
    is_turn: bool = False

    @property
    def length(self) -> arb:
        """Its length, rad."""
        return self.stop - self.start

    def holds(self, angle: arb) -> bool:
        """Whether an angle, or one that differs by turns, is inside; UndecidedError is raised at the ends."""
        turn, undecided = 2 * arb.pi(), False
        first = int((float(self.start) - float(angle)) // float(turn))
        for k in range(first, first + 4):
            here = angle + k * turn
            if here > self.start and here < self.stop:
                return True
            undecided |= not (here < self.start or here > self.stop)
        if undecided:
            raise UndecidedError
        return False


def full_turn() -> Arc:
    """The full turn."""
    return Arc(arb(_OFFSET), arb(_OFFSET) + 2 * arb.pi(), is_turn=True)


def interval(window: Window) -> Arc:
    """The arc of an explicit interval."""
    return Arc(*(arb(fmpq(end.numerator, end.denominator)) * arb.pi() / 180 for end in (window.start, window.stop)))


def angle_of_mark(mark: tuple[fmpq, fmpq]) -> arb:
    """The angle of a mark from the squares of its cosine and its sine, rad; see `ExactDesign`."""
    x, y = ((-1 if each < 0 else 1) * arb(abs(each)).sqrt() for each in mark)
    return arb.atan2(y, x)


def window_arc(request: Request, window: Window, marks: Mapping[str, arb]) -> Arc:
    """A window between marks as an arc; the drive stroke for the window of the clutch."""
    strokes = request.mechanism.strokes
    first = next(each for each in request.mechanism.windows if each.name == strokes[0])
    begin, end = (marks[name] for name in first.ends)
    if window.name not in strokes and request.drive in ("slow", "fast"):
        anchor = request.mechanism.anchor_angle
        first_is_longer = _is_longer(*(((mark - anchor) / 2).tan() for mark in (begin, end)))
        takes_first = first_is_longer == ((request.drive == "slow") != (window.kind == "return"))
    elif window.name not in strokes:
        takes_first = (request.drive == strokes[0]) != (window.kind == "return")
    else:
        takes_first = window.name == strokes[0]
    start, stop = (begin, end) if takes_first else (end, begin)
    return Arc(start, _after(start, stop))


def _after(start: arb, stop: arb) -> arb:
    """An angle that is after another by less than a turn; both are within a turn and a half of 0."""
    while not stop > start:
        if not stop < start:
            raise UndecidedError
        stop += 2 * arb.pi()
    while stop - start > 2 * arb.pi():
        stop -= 2 * arb.pi()
    return stop


def _is_longer(start: arb, stop: arb) -> bool:
    """Whether the arc between two half-tangents exceeds half a turn, as in `quadrature.windows.orient`."""
    product = start * stop
    if not product < 0:  # on the same side of the anchor, or nearly so
        return bool(start > stop)
    excess = (-product if start < stop else -1 / product) - 1 - arb(TIE)
    if not abs(excess) > _ROUNDING:
        raise UnprovedError("both strokes take the same time but for rounding, so which of them is slow")
    return bool(excess > 0)


def extremes(ends: Iterable[arb], arc: Arc, turning: Iterator[tuple[arb, arb]]) -> tuple[arb, arb]:
    """Smallest and largest value of a signal over an arc, from its values at the ends and where it may turn."""
    first, last = ends
    low, high = first.min(last), first.max(last)
    for angle, value in turning:
        try:
            if arc.holds(angle):
                low, high = low.min(value), high.max(value)
        except UndecidedError:  # perhaps inside
            low, high = low.union(low.min(value)), high.union(high.max(value))
    return low, high


def driven_arc(rate: Function, change: Function, stroke: Arc, period: arb) -> Arc:
    """The part of a stroke in which one linkage drives the output of several, a period apart, through one-way clutches.

    The rate rises to one peak and falls. It and that a period later are equal at one angle before the peak, and from
    there the output follows one linkage for a period; all of a stroke that is shorter.
    """
    if stroke.length < period:
        return stroke
    if not stroke.length > period:
        raise UndecidedError
    peaks = sign_changes(change, "the peak of the rate", stroke.start, stroke.stop)
    if len(peaks) != 1:
        raise UnprovedError("the rate of the stroke has several peaks")
    peak = peaks[0][0]
    low, high = stroke.start.max(peak - period), (stroke.stop - period).min(peak)
    for _ in range(ctx.prec):
        middle = ((low + high) / 2).mid()
        gain = abs(rate.value(middle + period)) - abs(rate.value(middle))
        if gain > 0:
            low = middle
        elif gain < 0:
            high = middle
        else:
            break
    crossing = low.union(high)
    return Arc(crossing, crossing + period)
