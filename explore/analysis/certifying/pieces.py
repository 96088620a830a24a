"""Arcs cut where numbers take another form: where a motion turns back, at corners of sizes and of the larger of two."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import pairwise, product

from flint import arb

from explore.analysis.certifying.arcs import Arc
from explore.analysis.certifying.ball_graph import BallGraph, Function
from explore.analysis.certifying.balls import UndecidedError, UnprovedError
from explore.analysis.certifying.constants import same_value
from explore.analysis.certifying.subdivision import Cell, Decision, ExtremeSearch, sign_changes, tiny
from explore.mechanisms.linkages.graph import Number, operands

#: Largest number of branches: zeros of the decision of each are looked for.
_MOST_BRANCHES = 20
#: Largest number of signs that are not known of which each choice is looked at.
_MOST_UNKNOWN = 5
#: A sign that is not known.
_EITHER = arb(0, 1)


@dataclass(frozen=True)
class Part:
    """Both ends of a part of an arc, rad, and the signs of decisions there; all are, unless it `is_tiny`, known."""

    start: arb
    stop: arb
    signs: Mapping[int, int | arb] = field(default_factory=dict)
    is_tiny: bool = False


@dataclass(frozen=True)
class Piece:
    """The input angles from one to another, rad, and a number there: analytic, or of a tiny piece only enclosed.

    The number of a tiny piece may be that of `others` too, with other signs of decisions.
    """

    start: arb
    stop: arb
    function: Function
    is_tiny: bool
    others: tuple[Function, ...] = ()

    @property
    def value(self) -> arb:
        """The number over all of the piece."""
        angles = self.start.union(self.stop)
        return reduce(arb.union, (function.value(angles) for function in (self.function, *self.others)))

    def extremes(self, name: str, size: arb, reason: str, *, is_turn: bool) -> tuple[arb, arb]:
        """Smallest and largest value of the number, which has a size elsewhere; the reason is that of `arc_means`."""
        if self.is_tiny:
            return self.value, self.value
        same = same_value(self.function, self.start, self.stop, reason)
        return same or ExtremeSearch(self.function, name, self.start, self.stop, is_turn, size).extremes()


def cut_pieces(
    graph: BallGraph, number: Number, name: str, arc: Arc, references: Mapping[str, arb], at_ends: Number | None
) -> list[Piece]:
    """The pieces of an arc in which a number, called by a name, has one form.

    `at_ends` is 0 at both ends of the arc and nowhere between.
    """

    def function(of: Number, part: Part) -> Function:
        return graph.function([of], references, name, part.signs)

    program, parts = graph.cut_program(number, name), [Part(arc.start, arc.stop)]
    if len(program.branches) > _MOST_BRANCHES:
        reason = f"{name} has {len(program.branches)} terms with jumps or corners; proofs take at most {_MOST_BRANCHES}"
        raise UnprovedError(reason)
    for k in program.branches:
        first, *others = (Number(program.graph, j) for j in operands(program.graph.nodes[k]))
        decision = first - others[0] if others else first
        is_known = at_ends is not None and at_ends.index == decision.index
        parts = [
            replace(part, signs={**part.signs, k: sign})
            for whole in parts
            for part, sign in divide(function(decision, whole), f"a term of {name}", whole, is_known=is_known)
        ]
    pieces = []
    for part in parts:
        first_function, *rest = (function(number, each) for each in _with_signs(part))
        pieces.append(Piece(part.start, part.stop, first_function, part.is_tiny, tuple(rest)))
    return pieces


def _with_signs(part: Part) -> Iterator[Part]:
    """The part with each choice of signs that are not known there, unless these are many."""
    unknown = [k for k, sign in part.signs.items() if sign is _EITHER]
    choices = product((1, -1), repeat=len(unknown)) if len(unknown) <= _MOST_UNKNOWN else [[_EITHER] * len(unknown)]
    for signs in choices:
        yield replace(part, signs={**part.signs, **dict(zip(unknown, signs, strict=True))})


def divide(
    decision: Decision, name: str, part: Part, *, is_known: bool = False
) -> Iterator[tuple[Part, int | arb]]:  # fmt: skip
    """The parts of a part in which a decision has one sign, and tiny ones at ends where it may be 0; with the sign.

    `is_known`: it is 0 at both ends and nowhere between.
    """
    if part.is_tiny:
        yield part, _sign(decision, part.start.union(part.stop)) or _EITHER
        return
    near, ends = tiny(), [part.start, part.stop]
    inner = [
        end if is_known or _sign(decision, end) else end + step for end, step in zip(ends, (near, -near), strict=True)
    ]
    left: list[Cell] = []
    places = [] if is_known else [(place, place) for place, _ in sign_changes(decision, name, inner[0], inner[1], left)]
    cuts = sorted([*places, *_joined(left)], key=lambda cut: arb.mid(cut[0]))
    for (_, first), (last, end) in pairwise([(inner[0], inner[0]), *cuts, (inner[1], inner[1])]):
        if not last > first:  # a cell beside an end
            yield replace(part, start=first, stop=last, is_tiny=True), _EITHER
        elif sign := _sign(decision, ((first + last) / 2).mid()):
            yield replace(part, start=first, stop=last), sign
        else:
            raise UndecidedError
        if end is not last:
            yield replace(part, start=last, stop=end, is_tiny=True), _EITHER
    for end, other in zip(ends, inner, strict=True):
        if other is not end:
            first, last = (end, other) if end is part.start else (other, end)
            yield replace(part, start=first, stop=last, is_tiny=True), _EITHER


def _joined(cells: list[Cell]) -> list[tuple[arb, arb]]:
    """The ends of cells, of those side by side once."""
    joined: list[tuple[arb, arb]] = []
    for cell in sorted(cells, key=lambda cell: cell.middle.mid()):
        low, high = cell.middle - cell.half, cell.middle + cell.half
        if joined and not joined[-1][1] < low:
            low, _ = joined.pop()
        joined.append((low, high))
    return joined


def _sign(decision: Decision, angle: arb) -> int:
    """The sign of a decision at an angle; 0 where it is not decided."""
    value = decision.value(angle)
    return (1 if value > 0 else -1 if value < 0 else 0) if value.is_finite() else 0
