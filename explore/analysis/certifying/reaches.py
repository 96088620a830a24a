"""The intervals of input angles at which all joints of a linkage assemble, by subdivision of the turn."""

from collections.abc import Callable, Iterator
from itertools import groupby, pairwise

from flint import arb, ctx

from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.subdivision import Cell, cells_of

#: Largest number of cells that are looked at, for each bit of the precision.
_MOST_CELLS = 40
#: Reason why intervals are not proved.
_UNDECIDED = "at which crank angles it assembles is not decided"


def find_reaches(assembles: Callable[[Cell], int]) -> list[tuple[arb, arb]]:
    """Start and end of each interval of a turn in which all joints assemble, rad, ascending from 0 on.

    `assembles` is 1 or -1 for a cell at all of whose angles they do or do not, and 0 where that is not decided. Tiny
    intervals, of fewer digits than half of the precision, count as none.
    """
    borders = list(_borders(assembles))
    if not borders:
        return [(arb(0), 2 * arb.pi())] if assembles(Cell(1, arb(0), arb(0))) > 0 else []
    intervals, turn = [], 2 * arb.pi()
    for (start, rises), (end, _) in pairwise([*borders, borders[0]]):
        if rises:
            if start.contains(0):
                raise UnprovedError(_UNDECIDED)
            first = start if start > 0 else start + turn
            intervals.append((first, first + (end - start if end > start else end - start + turn)))
    return sorted(intervals, key=lambda interval: float(interval[0].mid()))


def _borders(assembles: Callable[[Cell], int]) -> Iterator[tuple[arb, bool]]:
    """The angles from -pi/2 to 3 pi/2 at which the joints begin or cease to assemble, and which of both."""
    runs = [(state, list(cells)) for state, cells in groupby(_decided(assembles), key=lambda each: each[0])]
    if runs[0][0] == 0 or runs[-1][0] == 0 or runs[0][0] != runs[-1][0]:
        raise UnprovedError(_UNDECIDED)
    for k, (state, cells) in enumerate(runs):
        if state:
            continue
        before, behind = runs[k - 1][0], runs[k + 1][0]
        if before > 0 and behind > 0:
            raise UnprovedError(_UNDECIDED)
        if before != behind:
            (_, first), (_, last) = cells[0], cells[-1]
            yield (first.middle - first.half).union(last.middle + last.half), behind > 0


def _decided(assembles: Callable[[Cell], int]) -> Iterator[tuple[int, Cell]]:
    """Cells that follow each other, with what is decided of each; only tiny ones are not."""
    waiting, count, tiny = cells_of(-arb.pi() / 2, 3 * arb.pi() / 2)[::-1], 0, arb(2) ** (-ctx.prec // 2)
    while waiting:
        cell, count = waiting.pop(), count + 1
        state = assembles(cell)
        if state or cell.half < tiny:
            yield state, cell
        elif count > _MOST_CELLS * ctx.prec:
            raise UnprovedError(_UNDECIDED)
        else:
            waiting += cell.halves()[::-1]
