"""Dwells in balls: the least travel of an output while the input turns by an angle, and the longest rest.

While the input turns by A from a start s, an output with the place q moves by the largest less the least of q(s),
q(s + A), and its places where it turns back in between. Between the starts at which one of these enters or leaves the
dwell, the travel is cut where another of the numbers becomes the largest or the least; in each part it is analytic.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

from flint import arb

from explore.analysis.certifying.arcs import full_turn
from explore.analysis.certifying.balls import UndecidedError
from explore.analysis.certifying.pieces import Part, divide
from explore.analysis.certifying.subdivision import Decision, ExtremeSearch, places_of_least

#: Largest number of steps to the angle of the longest rest.
_MOST_STEPS = 12
#: First step to that angle, rad.
_FIRST_STEP = 2.0**-30
#: Half the width of its enclosure, rad.
_NEAR = 2.0**-80
#: Words for what is cut and searched.
_TRAVEL = "the travel in a dwell"

#: Start and end of an interval, rad.
_Interval = tuple[arb, arb]


@dataclass(frozen=True)
class _Sum:
    """Places of a function ahead of an angle, each with a sign, and a number, added."""

    function: Decision
    terms: tuple[tuple[int, arb], ...]
    number: arb

    def __sub__(self, other: "_Sum") -> "_Sum":
        terms = *self.terms, *((-sign, ahead) for sign, ahead in other.terms)
        return _Sum(self.function, terms, self.number - other.number)

    def value(self, angle: arb) -> arb:
        """The sum at an angle."""
        return sum((sign * self.function.value(angle + ahead) for sign, ahead in self.terms), self.number)

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients about an angle."""
        return [self._added([self.function.series(angle + ahead)[0] for _, ahead in self.terms])]

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """The same about the middle of a cell; the last one is that about all angles of the cell."""
        return [self._added([self.function.series_over(middle + ahead, half)[0] for _, ahead in self.terms])]

    def _added(self, series: Sequence[Sequence[arb]]) -> list[arb]:
        signs = [sign for sign, _ in self.terms]
        rows = zip(*series, strict=True)
        first, *others = [sum((s * each for s, each in zip(signs, row, strict=True)), arb(0)) for row in rows]
        return [first + self.number, *others]


@dataclass(frozen=True)
class _Least:
    """The least travel of a part, and what it is there: a sum, or a number."""

    part: Part
    value: arb
    travel: _Sum | None

    def places(self, least: arb) -> list[_Interval]:
        """Where the travel may be the least of all."""
        if self.travel is None or not self.travel.terms:
            return [(self.part.start, self.part.stop)]
        return places_of_least(self.travel, self.part.start, self.part.stop, least)


@dataclass(frozen=True)
class Dwell:
    """The dwells of an output.

    Attributes
    ----------
    place
        Its place, mm or rad, as a function of the input angle.
    reversals
        Input angles at which it turns back, rad.
    """

    place: Decision
    reversals: Sequence[arb]

    def least_travel(self, angle: arb) -> arb:
        """The least travel while the input turns by an angle."""
        return reduce(arb.min, (each.value for each in self._parts(angle)))

    def longest_rest(self, travel: arb, guess: float) -> arb:
        """The longest angle in which the output moves by no more than a travel, which is near a guess."""
        ends = [self.place.value(angle) for angle in self.reversals]
        whole = reduce(arb.max, ends) - reduce(arb.min, ends)
        if whole < travel:
            return 2 * arb.pi()
        last, angle = arb(guess), arb(guess) + _FIRST_STEP
        before = self.least_travel(last) - travel
        for _ in range(_MOST_STEPS):
            excess = self.least_travel(angle) - travel
            step = (excess * (angle - last) / (excess - before)).mid()
            if not step.is_finite():
                raise UndecidedError
            last, angle, before = angle, (angle - step).mid(), excess
            if abs(step) < _NEAR / 4:
                break
        if self.least_travel(angle - _NEAR) < travel and self.least_travel(angle + _NEAR) > travel:
            return angle + arb(0, _NEAR)
        raise UndecidedError

    def start(self, angle: arb) -> arb:
        """The start of the least travel while the input turns by an angle: the middle of those that serve as well."""
        parts, turn = list(self._parts(angle)), 2 * arb.pi()
        least = reduce(arb.min, (each.value for each in parts))
        serving = [not each.value > least for each in parts]
        if all(serving):
            raise UndecidedError
        begin, places = serving.index(False), list[_Interval]()
        for k in range(begin, begin + len(parts)):
            moved = turn * (k // len(parts))
            found = parts[k % len(parts)].places(least) if serving[k % len(parts)] else []
            places += [(low + moved, high + moved) for low, high in found]
        places.sort(key=lambda place: place[0].mid())
        if any(first[1] < second[0] for first, second in pairwise(places)):
            raise UndecidedError
        middle = (places[0][0] + reduce(arb.max, (high for _, high in places))) / 2
        return middle - turn * _whole(middle / turn)

    def _parts(self, angle: arb) -> Iterator[_Least]:
        """The parts of all starts in a turn."""
        begin, turn = full_turn().start, 2 * arb.pi()
        events = [event for reversal in self.reversals for event in (reversal, reversal - angle)]
        events = sorted((event - turn * _whole((event - begin) / turn) for event in events), key=arb.mid)
        between = []
        for first, second in pairwise([*events, events[0] + turn]):
            if not first < second:
                raise UndecidedError
            middle = ((first + second) / 2).mid()
            inner = self._inner(middle, angle)
            between.append((first, second, inner, self._range(inner, middle, middle + angle)))
        most = reduce(arb.min, (moved for *_, moved in between))
        for first, second, inner, _ in between:
            # All of these dwells pass what is from the last start to the first end, which may be more than another.
            least = self._range(inner, *([second, first + angle] if second < first + angle else []))
            if least > most:
                yield _Least(Part(first, second), least, None)
            else:
                yield from self._between(Part(first, second), angle, inner)

    def _range(self, inner: list[arb], *angles: arb) -> arb:
        """The largest less the least of places where the output turns back, and of those at angles."""
        places = [*inner, *(self.place.value(angle) for angle in angles)]
        return reduce(arb.max, places) - reduce(arb.min, places) if places else arb(0)

    def _inner(self, start: arb, angle: arb) -> list[arb]:
        """The places of the output where it turns back in a dwell from a start on."""
        turn, found = 2 * arb.pi(), []
        for reversal in self.reversals:
            ahead = reversal - start - turn * _whole((reversal - start) / turn)
            if ahead < angle:
                found.append(self.place.value(reversal))
            elif not ahead > angle:
                raise UndecidedError
        return found

    def _between(self, whole: Part, angle: arb, inner: list[arb]) -> Iterator[_Least]:
        """The parts of starts between which no reversal enters the dwell or leaves it."""
        zero = arb(0)
        ends = [_Sum(self.place, ((1, ahead),), zero) for ahead in (zero, angle)]
        highs, lows = list(ends), list(ends)
        if inner:
            highs.append(_Sum(self.place, (), reduce(arb.max, inner)))
            lows.append(_Sum(self.place, (), reduce(arb.min, inner)))
        decisions = [ends[1] - ends[0]]
        decisions += [number - end for numbers in (highs, lows) for number in numbers[2:] for end in ends]
        parts = [whole]
        for decision in decisions:
            parts = [part for each in parts for part, _ in divide(decision, _TRAVEL, each)]
        for part in parts:
            middle = part.start.union(part.stop) if part.is_tiny else ((part.start + part.stop) / 2).mid()
            tops, bottoms = ([each.value(middle) for each in numbers] for numbers in (highs, lows))
            if part.is_tiny:
                yield _Least(part, reduce(arb.max, tops) - reduce(arb.min, bottoms), None)
                continue
            high, low = highs[_only_largest(tops)], lows[_only_largest([-each for each in bottoms])]
            travel = high - low
            search = ExtremeSearch(travel, _TRAVEL, part.start, part.stop)
            yield _Least(part, -search.largest(-1) if travel.terms else travel.number, travel)


def _only_largest(numbers: list[arb]) -> int:
    """The place of the number that is larger than all others."""
    place = max(range(len(numbers)), key=lambda k: float(numbers[k].mid()))
    if not all(numbers[place] > number for k, number in enumerate(numbers) if k != place):
        raise UndecidedError
    return place


def _whole(turns: arb) -> int:
    """The whole turns of an angle; UndecidedError where they are not decided."""
    count = turns.floor().unique_fmpz()
    if count is None:
        raise UndecidedError
    return int(count)
