"""What is known of a linkage while its steps are taken: places, directions, factors, and what amplifies errors."""

from dataclasses import dataclass, field, replace
from functools import reduce

from explore.mechanisms.linkages.coordinate import Place
from explore.mechanisms.linkages.driver_distance import DriverDistance, Input, find_distance, find_margins
from explore.mechanisms.linkages.expressions import read_expression
from explore.mechanisms.linkages.graph import Graph, Number, Series, operands
from explore.mechanisms.linkages.steps import SlideLine
from explore.mechanisms.linkages.table import FRAME, LinkageTable, Slide, Slot
from explore.mechanisms.linkages.vectors import Local, Vector, cross, dot, larger, minus, unit

#: Beginning of the names of inputs for the middle of a link's range (rad, ":0"), its cosine (":1") and sine (":2").
REFERENCE = "@reference:"


@dataclass(frozen=True)
class Factor:
    """What must stay positive over the turn for a joint to assemble.

    Attributes
    ----------
    joint
        The point or slot.
    value
        The factor.
    size
        Size of the terms that it is the difference of; None where it has no terms of both signs.
    of_lines
        Whether it vanishes where two lines become parallel.
    """

    joint: str
    value: Series
    size: Number | None
    of_lines: bool = False


@dataclass(frozen=True)
class Loop:
    """Four bars that close a loop, of which the driver and the frame are two, and its other links.

    Attributes
    ----------
    lengths
        Crank, both links and ground, each the name of a parameter, or "" and a value.
    links
        The coupler and the rocker, in any order: the other two sides of their parallelogram turn as they do.
    """

    lengths: tuple[tuple[str, float], ...]
    links: tuple[str, str]


@dataclass
class Trace:
    """What is known of a linkage while its steps are taken.

    Attributes
    ----------
    points
        Places in the plane, mm.
    directions
        Unit vectors of the x axes of bodies.
    transmission
        For each joint, sine and cosine of its transmission angle times a positive number.
    determinants
        For each joint, and a driver on lines, the cross product of the two directions in which its forces are not
        known, each that of a link from its centre or a unit vector across a line.
    factors
        In the order in which joints are solved.
    squares
        Squares of distances that are divided by, and so must not vanish, at complex angles either.
    groups
        For each group of links what `following` takes of it.
    loops
        Loops of four bars whose lengths are parameters or exact constants.
    size
        Sum of the distances of all points of bodies from the first of each, mm.
    """

    table: LinkageTable
    graph: Graph = field(default_factory=Graph)
    points: dict[str, Vector] = field(default_factory=dict)
    directions: dict[str, Vector] = field(default_factory=dict)
    transmission: dict[str, tuple[Number, Number]] = field(default_factory=dict)
    determinants: dict[str, Number] = field(default_factory=dict)
    factors: list[Factor] = field(default_factory=list)
    squares: list[Series] = field(default_factory=list)
    groups: list[tuple[Number, ...]] = field(default_factory=list)
    loops: list[Loop] = field(default_factory=list)
    size: Number = field(init=False)

    def __post_init__(self) -> None:
        graph = self.graph
        self._angle = Input(graph)
        zero, one = graph.constant(0.0), graph.constant(1.0)
        self._signs: dict[str, int | Number] = dict(self.table.signs)
        self._signs |= {joint: graph.input(name) for joint, name in self.table.branches}
        self._local = {
            body.name: {point: self._read(place) for point, place in body.points} for body in self.table.bodies
        }
        self.size = zero  # all distances of points of bodies from the first of these
        for body, (first, *others) in ((name, [*points]) for name, points in self._local.items() if points):
            for point in others:
                x, y = (part.terms[0] for part in self.between(body, first, point))
                self.size = self.size + abs(x) + abs(y)
        self._conditions: dict[str, Number] = {}
        self._conditions_of_links: dict[str, Number] = {}
        self._made_by: dict[str, str] = {}
        self._turnings: dict[str, tuple[Number, Number]] = {}
        self._origins: dict[str, tuple[Vector, Vector]] = {}
        self._pivot = ""
        self._zero = Series.still(zero), Series.still(zero)
        self.directions[FRAME] = (Series.still(one), self._zero[1])
        self._origins[FRAME] = (self._zero, self._zero)
        for point, place in self._local[FRAME].items():
            self._know(point, place, one, FRAME)

    @property
    def condition(self) -> Number:
        """Square of what errors of lengths are amplified by, over those of places and directions: the largest."""
        return reduce(larger, [*self._conditions.values(), *self._conditions_of_links.values()])

    def slot_position(self, slot: Slot) -> Series:
        """The place of the pin from the first end of a slot towards the second, mm."""
        start, direction = self._line(slot)
        return dot(minus(self.points[slot.pin], start), direction)

    def slot_direction(self, slot: Slot) -> Vector:
        """The unit vector along a slot."""
        return self._line(slot)[1]

    def place_of(self, body: str, local: Place) -> Vector:
        """A place in the coordinates of a body as one in the plane, mm."""
        return self._in_plane(body, self._read(local))

    def angle_of(self, link: str) -> Number:
        """The angle of a link, rad, within half a turn of the middle of its range."""
        cosine, sine = (part.terms[0] for part in self.directions[link])
        to_cosine, to_sine = (self.graph.input(f"{REFERENCE}{link}:{part}") for part in (1, 2))
        x, y = cosine * to_cosine + sine * to_sine, sine * to_cosine - cosine * to_sine
        return self.middle_of(link) + y.call("arctangent", x)

    def middle_of(self, link: str) -> Number:
        """The middle of the range of the angle of a link, rad."""
        return self.graph.input(f"{REFERENCE}{link}:0")

    def position_of(self, name: str) -> Series:
        """The position of a slot, or of a link that slides, along its line, mm."""
        line = self.table.line_of(name)
        return self.slot_position(line) if isinstance(line, Slot) else self.slide_position(line)

    def output_place(self) -> Number:
        """The position of the output along its line, mm, or its angle, rad."""
        output = self.table.output
        return self.position_of(output).terms[0] if output in self.table.sliders else self.angle_of(output)

    def turning_of(self, body: str) -> tuple[Number, Number]:
        """First and second derivative of the angle of a body by the input angle."""
        cosine, sine = self.directions[body]
        if cosine is self._angle.cosine:
            return self.graph.constant(1.0), self.graph.constant(0.0)
        if body in self._turnings:
            return self._turnings[body]
        first, second = (cosine.terms[0] * sine.terms[k] - sine.terms[0] * cosine.terms[k] for k in (1, 2))
        return first, second

    def curvature(self, point: str) -> tuple[Number, str]:
        """The curvature of the path of a point, 1/mm, and the link with whose rate it changes its sign; "" for none.

        It is 1/r of a link that turns about a point of the frame. The table lists no driven pin with the link that has
        its slot, along which it moves.
        """
        x, y = self.points[point]
        for body in self.table.links:
            pivot = next((each for each in body.place_of if each in self.table.frame.place_of), None)
            if point in body.place_of and pivot:
                rate, arm = self.turning_of(body.name)[0], minus((x, y), self.points[pivot])
                sense = rate / (rate * rate).sqrt()
                return sense / dot(arm, arm).terms[0].sqrt(), body.name if rate.value is None else ""
        square = x.terms[1] * x.terms[1] + y.terms[1] * y.terms[1]
        return cross((x.terms[1], y.terms[1]), (x.terms[2], y.terms[2])) / (square * square.sqrt()), ""

    # coordinates of the design

    def _read(self, place: Place) -> Vector:
        x, y = (Series.still(read_expression(self.graph, coordinate)) for coordinate in place)
        return x, y

    def between(self, body: str, start: str, end: str) -> Vector:
        """From one point of a body to another, in its coordinates, mm."""
        return minus(self._local[body][end], self._local[body][start])

    # places in the plane

    def _know(self, point: str, place: Vector, condition: Number, maker: str) -> None:
        self.points[point], self._conditions[point], self._made_by[point] = place, condition, maker

    def _in_plane(self, body: str, local: Vector) -> Vector:
        """The place of a point of a posed body."""
        (x, y), origin = self._origins[body]
        dx, dy = minus(local, origin)
        cosine, sine = self.directions[body]
        return x + (cosine * dx - sine * dy), y + (cosine * dy + sine * dx)

    def _condition_of(self, body: str) -> Number:
        """The largest condition of the points that a body hangs at, and of its direction."""
        known = [self._conditions[point] for point in self._local[body] if point in self._conditions]
        result = self._conditions_of_links.get(body, self.graph.constant(1.0))
        for condition in known:
            result = larger(result, condition)
        return result

    def _direction(self, body: str, along: Vector) -> Vector:
        """A unit vector along a direction of a body."""
        nx, ny = unit(along)
        cosine, sine = self.directions[body]
        return cosine * nx - sine * ny, cosine * ny + sine * nx

    def _ends(self, slot: Slot) -> tuple[Vector, Vector]:
        """The ends of a slot in the coordinates of its body."""
        first, second = (self._local[slot.body][end] if isinstance(end, str) else self._read(end) for end in slot.along)
        return first, second

    def _line(self, locus: Slot | SlideLine) -> tuple[Vector, Vector]:
        """A point of a line and its unit direction."""
        if isinstance(locus, Slot):
            first, second = self._ends(locus)
            return self._in_plane(locus.body, first), self._direction(locus.body, minus(second, first))
        slide = locus.slide
        return self._in_plane(locus.body, self._local[locus.moving][locus.point]), self.slide_direction(slide)

    def slide_direction(self, slide: Slide) -> Vector:
        """The unit vector along which a link slides."""
        return self._direction(slide.body, self._read(slide.direction))

    def slide_position(self, slide: Slide) -> Series:
        """The place of a link's origin from that of what it slides on, along its direction, mm."""
        origin, start = (self._in_plane(body, self._zero) for body in (slide.link, slide.body))
        return dot(minus(origin, start), self.slide_direction(slide))

    # factors

    def _add_line_factor(self, joint: str, sine: Series, inherited: Number) -> Number:
        """Two lines meet unless they are parallel; return the condition of what they place."""
        square = sine * sine
        own = inherited / square.terms[0]
        self.determinants[joint] = sine.terms[0]
        self._add_factor(Factor(joint, square, self.graph.constant(1.0), of_lines=True), inherited)
        return own

    def _add_factor(self, factor: Factor, inherited: Number) -> None:
        """Note a factor; its terms have the errors of the places that it follows from."""
        size = None if factor.size is None else factor.size * inherited.sqrt()
        self.factors.append(replace(factor, size=size))

    def _sign(self, joint: str) -> int | Number:
        return self._signs.get(joint, 1)

    def _signed(self, joint: str, root: Series) -> Series:
        """A root on the side of a joint."""
        sign = self._sign(joint)
        return -root if sign == -1 else root * sign

    def _distance(self, a: str, b: str) -> tuple[DriverDistance, float] | None:
        """The distance of two points if one is of the frame and one of the driver, and the sense of it from a to b."""
        for still, moving, sense in ((a, b, -1.0), (b, a, 1.0)):
            if self._pivot and self._made_by.get(still) == FRAME and self._made_by.get(moving) == self.table.driver:
                ground = local_of(self.between(FRAME, self._pivot, still))
                crank = local_of(self.between(self.table.driver, self._pivot, moving))
                distance = find_distance(self._angle, ground, crank)
                return (distance, sense) if distance else None
        return None

    def _margins(
        self, point: str, line: Slot | SlideLine, radius: Number
    ) -> tuple[Series, Series, Number, Number] | None:
        """See `find_margins`; None but for a point of the driver and a slot of the frame."""
        is_driven = self._pivot and self._made_by.get(point) == self.table.driver
        if not (is_driven and isinstance(line, Slot) and line.body == FRAME):
            return None
        start, end = self._ends(line)
        crank, pivot = self.between(self.table.driver, self._pivot, point), self._local[FRAME][self._pivot]
        return find_margins(
            self._angle, radius, local_of(start), local_of(minus(end, start)), local_of(pivot), local_of(crank)
        )

    def _exact_sum(self, *terms: Series) -> Number:
        """A sum of the design, rounded once."""
        return self.graph.exact_sum(*(term.terms[0] for term in terms))


def local_of(vector: Vector) -> Local:
    """A vector of a body that does not depend on the input angle."""
    return vector[0].terms[0], vector[1].terms[0]


def length_of(number: Number) -> tuple[str, float] | None:
    """Name of the parameter that is a length but for its sign, or "" and an exact constant; None of others."""
    while number.node[0] in ("abs", "neg"):
        number = Number(number.graph, operands(number.node)[0])
    if number.value is not None:
        return ("", abs(number.value)) if number.node[2] == 0.0 else None
    return (str(number.node[1]), 0.0) if number.node[0] == "input" else None
