"""Fluctuations: ranges over a turn of the integral of a number less its mean, with extremes where it is its mean."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

from flint import arb

from explore.analysis.certifying.ball_graph import Function
from explore.analysis.certifying.means import arc_means
from explore.analysis.certifying.pieces import Piece
from explore.analysis.certifying.subdivision import sign_changes


def fluctuation(pieces: Sequence[Piece], mean: arb, name: str, reason: str) -> arb:
    """The fluctuation of a number, called by a name, whose pieces are a turn; `reason` is why it has none."""
    total, found = arb(0), [arb(0)]
    for piece in sorted(pieces, key=lambda piece: piece.start.mid()):
        if piece.is_tiny:
            before, total = total, total + (piece.value - mean) * (piece.stop - piece.start)
            found.append(before.union(total))
            continue
        zeros = sign_changes(_Less(piece.function, mean), name, piece.start, piece.stop)
        places = sorted((place for place, _ in zeros), key=arb.mid)
        for first, last in pairwise([piece.start, *places, piece.stop]):
            total += (arc_means(piece.function.value, first, last, reason)[0] - mean) * (last - first)
            found.append(total)
    return reduce(arb.max, found) - reduce(arb.min, found)


@dataclass(frozen=True)
class _Less:
    """A function less a number."""

    function: Function
    number: arb

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients about an angle."""
        return self._less(self.function.series(angle))

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """The same about the middle of a cell."""
        return self._less(self.function.series_over(middle, half))

    def _less(self, all_terms: list[list[arb]]) -> list[list[arb]]:
        return [[first - self.number, *others] for first, *others in all_terms]
