"""Extremes of functions of the input angle by subdivision, from their Taylor series in balls."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

from flint import arb, ctx

from explore.analysis.certifying.balls import UndecidedError, UnprovedError

#: Length of the longest cells of an arc at first, rad.
_LONGEST_CELL = 0.27
#: Number of cells of a short arc at first.
_FEWEST_CELLS = 2
#: Largest number of cells that are looked at.
MOST_CELLS = 2000
#: Largest radius of an extreme that is no peak, over its size, as a power of 2.
_NARROW = -80
#: Largest number of halvings of a radian that tiny cells are long.
_MOST_HALVINGS = 80
#: Half the width of short cells, rad.
_SHORT = 2.0**-30
#: Largest number of steps of Newton's method.
_MOST_STEPS = 12


class Expandable(Protocol):
    """Functions of an angle that have Taylor series."""

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients of each about an angle."""

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """The same about the middle of a cell of half a width; the last one is that about all angles of the cell."""


class Decision(Expandable, Protocol):
    """A function of an angle whose sign is asked for."""

    def value(self, angle: arb) -> Any:
        """The function at an angle."""


@dataclass(frozen=True)
class Cell:
    """The angles from `middle` less `half` to `middle` and `half`; its number is its own in a subdivision."""

    number: int
    middle: arb
    half: arb

    def halves(self) -> list[Cell]:
        """Its two halves."""
        half = self.half / 2
        return [
            Cell(2 * self.number, self.middle - half, half),
            Cell(2 * self.number + 1, self.middle + half, half),
        ]


def cells_of(start: arb, stop: arb) -> list[Cell]:
    """The cells of an arc at first."""
    count = max(_FEWEST_CELLS, math.ceil(float(stop - start) / _LONGEST_CELL))
    half = (stop - start) / (2 * count)
    return [Cell(count + k, start + (2 * k + 1) * half, half) for k in range(count)]


def over_cell(terms: Sequence[arb], half: arb) -> tuple[arb, arb, arb]:
    """A function and its first and second derivatives over a cell, from coefficients of `series_over`."""
    offset, value, slope, bend = arb(0, half.upper()), arb(0), arb(0), arb(0)
    for k in range(len(terms) - 1, -1, -1):
        value = value * offset + terms[k]
        slope = slope * offset + k * terms[k] if k > 0 else slope
        bend = bend * offset + k * (k - 1) * terms[k] if k > 1 else bend
    return value, slope, bend


def sign_changes(
    function: Expandable, name: str, start: arb, stop: arb, left: list[Cell] | None = None
) -> list[tuple[arb, bool]]:  # fmt: skip
    """Where the first function changes its sign in an arc, at whose ends it does not, and whether it rises there.

    Tiny cells in which that is not decided, as where it touches 0, are appended to `left`, if it is given. Else, and
    where many cells do not decide it, `UnprovedError` names the function.
    """
    waiting, count, found = cells_of(start, stop), 0, []
    while waiting:
        cell, count = waiting.pop(), count + 1
        value, slope, _ = over_cell(function.series_over(cell.middle, cell.half)[0], cell.half)
        if value > 0 or value < 0:
            continue
        rises = bool(slope > 0)
        if rises or slope < 0:
            low, high = (function.series(end)[0][0] for end in (cell.middle - cell.half, cell.middle + cell.half))
            if (low < 0 and high > 0) or (low > 0 and high < 0):
                found.append((_zero(partial(_value_series, function), cell, slope), rises))
                continue
            if (low < 0 and high < 0) or (low > 0 and high > 0):
                continue
        if count > MOST_CELLS:
            raise UnprovedError(f"where {name} is 0 is not decided by {MOST_CELLS} cells")
        if left is not None and (cell.half < tiny() or _is_lost(function, cell)):
            left.append(cell)
        else:
            waiting += cell.halves()
    return found


def _is_lost(function: Expandable, cell: Cell) -> bool:
    """Whether the first function is rounding at both ends of a short cell and in its middle: halves tell no more."""
    ends = (cell.middle + cell.half * k for k in (0, -1, 1))
    return bool(cell.half < _SHORT) and all(function.series(end)[0][0].contains(0) for end in ends)


def tiny() -> arb:
    """The length below which parts of an arc need no sign, rad: constants of a graph have 105 bits."""
    return arb(2) ** -min(ctx.prec // 2, _MOST_HALVINGS)


def _zero(expand: Callable[[arb], Sequence[arb]], cell: Cell, slope: arb) -> arb:
    """The zero in a cell of a function that has a slope, by Newton's method on intervals, else by bisection.

    `expand` gives its Taylor coefficients about an angle.
    """
    place, rises = cell.middle + arb(0, cell.half.upper()), bool(slope > 0)
    for _ in range(ctx.prec):
        middle = place.mid()
        value = expand(middle)[0]
        better = place.intersection(middle - value / slope)
        if not better.rad() < place.rad() / 2:
            if value.contains(0):
                return better
            better = middle.union(place.lower() if bool(value > 0) == rises else place.upper())
        place, slope_here = better, expand(better)[1]
        slope = slope.intersection(slope_here) if slope_here.is_finite() else slope
    return place


def _value_series(function: Expandable, angle: arb) -> list[arb]:
    """Taylor coefficients of the first function."""
    return function.series(angle)[0]


def _slope_series(function: Expandable, angle: arb) -> list[arb]:
    """Taylor coefficients of its derivative."""
    return [k * term for k, term in enumerate(function.series(angle)[0])][1:]


@dataclass
class ExtremeSearch:
    """The search for extremes of the first function over an arc; over a turn, it is the same at both ends.

    `UnprovedError` names the function where they are not decided; what is known of cells is kept. What is far below the
    `size` of the function elsewhere needs no digits of its own.
    """

    function: Expandable
    name: str
    start: arb
    stop: arb
    is_turn: bool = False
    size: arb = field(default_factory=arb)
    known: dict[int, tuple[arb, arb, arb, arb]] = field(default_factory=dict)

    def extremes(self) -> tuple[arb, arb]:
        """The smallest and the largest value."""
        return -self.largest(-1), self.largest()

    def largest(self, sign: int = 1) -> arb:
        """The largest value of the function times a sign.

        A cell in which the function is monotonic has its largest value at an end, which is one of another cell too or
        one of the arc.
        """
        waiting, count = cells_of(self.start, self.stop), 0
        found = [] if self.is_turn else [sign * self._series(end)[0] for end in (self.start, self.stop)]
        least = arb.neg_inf()
        for value in [*found, *(sign * self._over(cell)[3] for cell in waiting)]:
            least = least.max(value.lower()) if value.is_finite() else least
        while waiting:
            cell, count = waiting.pop(), count + 1
            if count > MOST_CELLS:
                raise UnprovedError(f"extremes of {self.name} are not decided by {MOST_CELLS} cells")
            value, slope, bend, _ = (sign * each for each in self._over(cell))
            if value.is_finite() and (value < least or slope > 0 or slope < 0):
                continue
            peaks = None
            if value.is_finite() and value.rad() <= value.abs_upper().max(self.size) * arb(2) ** _NARROW:
                peaks = [value]
            elif value.is_finite() and bend < 0:
                peaks = self._peaks(cell, sign)
            if peaks is None:
                waiting += cell.halves()
                continue
            found += peaks
            for peak in peaks:
                least = least.max(peak.lower())
        if not found:
            raise UndecidedError
        result = found[0]
        for value in found[1:]:
            result = result.max(value)
        return result

    def _series(self, angle: arb) -> list[arb]:
        return self.function.series(angle)[0]

    def _over(self, cell: Cell) -> tuple[arb, arb, arb, arb]:
        """The function, its first and second derivatives over a cell, and its value in the middle."""
        if cell.number not in self.known:
            terms = self.function.series_over(cell.middle, cell.half)[0]
            self.known[cell.number] = *over_cell(terms, cell.half), terms[0]
        return self.known[cell.number]

    def _peaks(self, cell: Cell, sign: int) -> list[arb] | None:
        """The peak in a cell in which the function is concave: none if it is monotonic, None if that is not decided."""
        low, high = cell.middle - cell.half, cell.middle + cell.half
        for end, inwards in ((low, sign), (high, -sign)):
            value, slope, *_ = self._series(end)
            if inwards * slope < 0:
                return []
            if slope.contains(0):  # a concave function stays below its tangent
                return [sign * value + arb(0, (2 * slope * cell.half).abs_upper())]
        place, near = cell.middle.mid(), arb(2) ** (-ctx.prec // 2)
        for _ in range(_MOST_STEPS):
            _, slope, bend, *_ = self._series(place)
            step = (slope / (2 * bend)).mid()
            place = (place - step).mid()
            if not (place - near > low and place + near < high):
                return None
            if abs(step) < near / 4:
                break
        if not (sign * self._series(place - near)[1] > 0 and sign * self._series(place + near)[1] < 0):
            return None
        offset = arb(0, near)
        return [sign * (self._series(place)[0] + offset * self._series(place + offset)[1])]


def places_of_least(function: Expandable, start: arb, stop: arb, least: arb) -> list[tuple[arb, arb]]:
    """Intervals that hold all angles of an arc at which the first function is its least value of a larger arc."""
    waiting, count, found = cells_of(start, stop), 0, []
    while waiting:
        cell, count = waiting.pop(), count + 1
        value, slope, bend = over_cell(function.series_over(cell.middle, cell.half)[0], cell.half)
        if value > least:
            continue
        low, high = cell.middle - cell.half, cell.middle + cell.half
        first, last = (function.series(end)[0] for end in (low, high))
        if slope > 0 or (bend > 0 and first[1] > 0):
            found += [] if first[0] > least else [(low, low)]
        elif slope < 0 or (bend > 0 and last[1] < 0):
            found += [] if last[0] > least else [(high, high)]
        elif cell.half < tiny() or count > MOST_CELLS:
            found.append((low, high))
        elif bend > 0 and first[1] < 0 and last[1] > 0:
            place = _zero(partial(_slope_series, function), cell, bend)
            found.append((place, place))
        else:
            waiting += cell.halves()
    return found
