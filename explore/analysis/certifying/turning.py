"""Whether a linkage of a table assembles at all angles of a turn or an interval, and the middles of its angles."""

from functools import cached_property

from flint import arb

from explore.analysis.certifying.arcs import Arc
from explore.analysis.certifying.ball_graph import BallGraph
from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.reaches import find_reaches
from explore.analysis.certifying.subdivision import MOST_CELLS, Cell, cells_of, over_cell
from explore.mechanisms.linkages.cells import NODES
from explore.mechanisms.linkages.directions import DIRECTION_NODES
from explore.mechanisms.linkages.statuses import CANNOT_ASSEMBLE, blocked_at
from explore.model.status import Status

#: Least factor that is told from 0, over the size of its terms: ten times the rounding that the program allows for.
_ROOM = 1e-13
#: Largest rounding of an angle at which a linkage is to assemble, rad.
_NEAR = 1e-13
#: Largest swing of a link whose angle is followed, rad; the program follows 6.
_LARGEST_SWING = 5.9
#: Least distance of the first angle of a link from half a turn, rad: nearer ones may be on either side.
_LEAST_DISTANCE = 1e-9


class Turning:
    """Signs of the factors of a linkage over a turn, or over an arc."""

    def __init__(self, graph: BallGraph, arc: Arc | None) -> None:
        factors = graph.equations.factors
        self._graph, self._is_turn, self._factors = graph, arc is None, factors
        # The program looks at the nodes of a turn from a quarter before 0 on.
        self._start, self._length = (arc.start, arc.length) if arc else (-arb.pi() / 2, 2 * arb.pi())
        self._joints = list(dict.fromkeys(factor.joint for factor in factors))
        self._values = graph.function([factor.value.terms[0] for factor in factors])
        self._sizes = graph.function([factor.size or factor.value.terms[0] for factor in factors])

    @cached_property
    def status(self) -> int:
        """The status; `UnprovedError` where a factor is too close to 0 to tell, or none was decided."""
        count = 2 * (NODES - 1)
        blocked = [self._blocked(self._start + self._length * k / count) for k in range(count + 1)]
        first = [k for k in blocked if k >= 0]
        if not first:
            return self._between_nodes()
        if self._is_turn and len(first) == len(blocked):
            if self._is_blocked_throughout():
                return CANNOT_ASSEMBLE
            raise UnprovedError("whether it assembles at some angle is not decided")
        return blocked_at(self._joints.index(self._factors[min(first)].joint))

    def misses(self, angle: arb) -> bool:
        """Whether a factor is certainly negative at all angles near one, beyond what rounding tells."""
        return any(value < -room for value, room in self._with_room(angle + arb(0, _NEAR)))

    def _with_room(self, angle: arb) -> list[tuple[arb, arb]]:
        """The factors at an angle, and what rounding may hide of each."""
        pairs = zip(self._factors, self._values.at(angle), self._sizes.at(angle), strict=True)
        return [(value, abs(size) * arb(_ROOM) if factor.size else arb(0)) for factor, value, size in pairs]

    def _blocked(self, angle: arb) -> int:
        """The first factor that is negative at an angle; -1 for none."""
        for k, (value, room) in enumerate(self._with_room(angle)):
            if value < -room:
                return k
            if not value > room:
                raise UnprovedError(f"whether {self._factors[k].joint} assembles is not decided")
        return -1

    def _between_nodes(self) -> int:
        """The status of a linkage that assembles at all nodes."""
        waiting, count = cells_of(self._start, self._start + self._length), 0
        while waiting:
            cell, count = waiting.pop(), count + 1
            if self._is_positive(cell):
                continue
            if self._blocked(cell.middle) >= 0:
                if len(self._joints) > 1:
                    raise UnprovedError("which joint blocks the driver first is not decided")
                return blocked_at(0)
            if count > MOST_CELLS:
                raise UnprovedError("whether the driver turns is not decided")
            waiting += cell.halves()
        return int(Status.OK)

    def _is_positive(self, cell: Cell) -> bool:
        """Whether all factors are certainly positive in a cell, beyond what rounding tells."""
        series, room = self._values.series_over(cell.middle, cell.half), self._sizes.at(cell.middle)
        for k, factor in enumerate(self._factors):
            least, _, _ = over_cell(series[k], cell.half)
            if not least > (abs(room[k]) * arb(_ROOM) if factor.size else 0):
                return False
        return True

    def _is_blocked_throughout(self) -> bool:
        """Whether at each angle some factor is certainly negative whose joint hangs on others that assemble."""
        waiting, count = cells_of(self._start, self._start + self._length), 0
        while waiting:
            cell, count = waiting.pop(), count + 1
            if count > MOST_CELLS:
                return False
            if not any(value < 0 for value in self._values.at(cell.middle + arb(0, cell.half.upper()))):
                waiting += cell.halves()
        return True

    @cached_property
    def reaches(self) -> list[tuple[arb, arb]]:
        """Start and end of each interval of a turn at which all joints assemble, rad; see `find_reaches`."""
        return find_reaches(self._assembles)

    def _assembles(self, cell: Cell) -> int:
        """1 where all factors are positive in a cell, -1 where one is negative, which those before it do not spoil."""
        series = self._values.series_over(cell.middle, cell.half)
        values = [over_cell(terms, cell.half)[0] for terms in series]
        return 1 if all(value > 0 for value in values) else -1 if any(value < 0 for value in values) else 0

    def middle_of(self, link: str) -> float:
        """The middle of the angles of a link, rad, which tells them from those a turn away."""
        directions = self._graph.equations.directions[link]
        function = self._graph.function([part.terms[0] for part in directions])
        begin = arb(0) if self._is_turn else self._start
        cosine, sine = function.at(begin)
        first = float(arb.atan2(sine, cosine).mid())
        turn = least = greatest = 0.0
        for k in range(1, DIRECTION_NODES + 1):
            c, s = function.at(begin + self._length * k / DIRECTION_NODES)
            turn += float(arb.atan2(cosine * s - sine * c, cosine * c + sine * s).mid())
            least, greatest, cosine, sine = min(least, turn), max(greatest, turn), c, s
        if not (greatest - least < _LARGEST_SWING and abs(first) < 3.141592653589793 - _LEAST_DISTANCE):
            raise UnprovedError(f"the angle of {link} cannot be certified: it turns fully, or nearly so")
        return first + 0.5 * (least + greatest)
