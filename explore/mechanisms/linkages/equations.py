"""The equations of a linkage as a graph: places of points, directions of links, and what must stay positive.

A dyad RRR joins the points a and b at the distances r and s. With d = b - a, D = d.d and the factors::

    p = D - (r - s)^2,   q = (r + s)^2 - D,   k = (p + 2 r (r - s))/(2 D),   f = +- sqrt(p q)/(2 D)

the joint is at a + k d + f J d, J a quarter of a turn to the left. Where a is of the frame and b on the driver, p, q
and D are sums of positive terms: a versine of the input angle times the lengths, and sums of lengths that are rounded
once. So are r - h and r + h of the next where c is on the driver and the line one of the frame.

RRP: a line through g along n, and a point c at the distance r from the joint: with w = g - c and h = n x w the joint is
at g + (+- sqrt((r - h)(r + h)) - n.w) n. RPR: the direction of a link follows from a known point of it and from the pin
in its slot, v apart, at the distance e across: v (+- sqrt(D - e^2) - i e)/D in complex numbers, D = v.v. Of the rates
of these links see `turning_rates`.

Of groups of links see `group_equations`.
"""

from explore.mechanisms.linkages.graph import Series
from explore.mechanisms.linkages.group_equations import Span, Tie, pose_group, rows_of
from explore.mechanisms.linkages.group_steps import Bar, PoseGroup
from explore.mechanisms.linkages.steps import (
    Circle,
    Drive,
    DriveOnLines,
    JoinPoint,
    PlacePoint,
    PoseBySlot,
    PoseLink,
    SlideInSlot,
    SlideLine,
    Step,
    TranslateLink,
)
from explore.mechanisms.linkages.table import FRAME, LinkageTable, Slot, carrier
from explore.mechanisms.linkages.trace import Factor, Loop, Trace, length_of, local_of
from explore.mechanisms.linkages.turning_rates import turn_in_slot, turn_sides, turned
from explore.mechanisms.linkages.vectors import Vector, cross, dot, larger, length, minus, unit

#: Least product of two factors that conditions are relative to, over the square of their sum.
_LEAST_SQUARE = 1e-30


class Equations(Trace):
    """The trace of a linkage after all of its steps."""

    def __init__(self, table: LinkageTable, steps: tuple[Step, ...]) -> None:
        super().__init__(table)
        self.steps = steps
        self._drive_pin()
        for step in steps:
            self._take(step)

    def _take(self, step: Step) -> None:
        match step:
            case Drive():
                self.directions[step.link] = (self._angle.cosine, self._angle.sine)
                self._origins[step.link] = (self.points[step.pivot], self._local[step.link][step.pivot])
                self._pivot = step.pivot
            case DriveOnLines():
                self._drive_on_lines(step)
            case PlacePoint():
                place = self._in_plane(step.body, self._local[step.body][step.point])
                self._know(step.point, place, self._condition_of(step.body), step.body)
            case PoseLink():
                self._pose(step)
            case TranslateLink():
                direction = self.directions[carrier(step.slide.body, self.table.slides)]
                self.directions[step.link] = self.directions[step.slide.body] = direction
                self._origins[step.link] = (self.points[step.point], self._local[step.link][step.point])
            case SlideInSlot():
                self._slide_in_slot(step)
            case PoseBySlot():
                self._pose_by_slot(step)
            case JoinPoint(first=Circle() as first, second=Circle() as second):
                self._join_circles(step.point, first, second)
            case JoinPoint(first=Circle() as circle, second=(Slot() | SlideLine()) as line):
                self._join_circle_and_line(step.point, circle, line)
            case JoinPoint(first=(Slot() | SlideLine()) as first, second=(Slot() | SlideLine()) as second):
                self._join_lines(step.point, first, second)
            case PoseGroup():
                self._pose_group(step)

    def _drive_pin(self) -> None:
        """Make the driven pin a point of the body with its slot: at `travel` on the way there and back, as a sine."""
        slot, travel = self.table.driven_slot, self.table.travel
        if slot is None or travel is None:
            return
        (x, y), second = self._ends(slot)
        nx, ny = unit(minus(second, (x, y)))
        start, end = self._read(travel)
        self.size = self.size + abs(start.terms[0]) + abs(end.terms[0])
        position = start + (end - start) * (self._angle.versine(0) * 0.5)
        self._local[slot.body][slot.pin] = (x + nx * position, y + ny * position)

    def _drive_on_lines(self, step: DriveOnLines) -> None:
        """The origin of the driver is on each line, moved by the vector from the point on it to the origin."""
        self.directions[step.link] = (self._angle.cosine, self._angle.sine)
        self._origins[step.link] = (self._zero, self._zero)
        (g, n), (h, m) = (
            (minus(place, self._in_plane(step.link, self._local[step.link][point])), direction)
            for point, (place, direction) in ((point, self._line(line)) for point, line in (step.first, step.second))
        )
        sine = cross(n, m)
        t = cross(minus(h, g), m) / sine
        self._origins[step.link] = ((g[0] + t * n[0], g[1] + t * n[1]), self._zero)
        self._conditions_of_links[step.link] = self._add_line_factor(step.link, sine, self.graph.constant(1.0))

    def _pose(self, step: PoseLink) -> None:
        lx, ly = self.between(step.link, step.first, step.second)
        dx, dy = minus(self.points[step.second], self.points[step.first])
        inverse = (lx * lx + ly * ly).inverse()
        nx, ny = lx * inverse, ly * inverse
        direction = dx * nx + dy * ny, dy * nx - dx * ny
        turning = self._turnings.get(step.link)
        self.directions[step.link] = turned(local_of(direction), turning) if turning else direction
        self._origins[step.link] = (self.points[step.first], self._local[step.link][step.first])

    def _slide_in_slot(self, step: SlideInSlot) -> None:
        """The link's origin is t along the slide's direction n; the pin is on the slot's line through g along m."""
        self.directions[step.link] = self.directions[step.slide.body]
        self._origins[step.link] = self._origins[step.slide.body]
        (g, m), n = self._line(step.slot), self.slide_direction(step.slide)
        sine = cross(n, m)
        t = cross(minus(self.points[step.slot.pin], g), m) / sine
        (x, y), local = self._origins[step.slide.body]
        self._origins[step.link] = ((x + t * n[0], y + t * n[1]), local)
        inherited = larger(self._condition_of(step.slide.body), self._conditions[step.slot.pin])
        own = self._add_line_factor(step.slot.name, sine, inherited)
        for point in self._local[step.link]:
            place = self._in_plane(step.link, self._local[step.link][point])
            self._know(point, place, own, step.link)

    def _pose_by_slot(self, step: PoseBySlot) -> None:
        slot, link = step.slot, step.link
        first, second = self._ends(slot)
        nx, ny = unit(minus(second, first))
        ax, ay = self._local[link][step.point]
        # distance of the line from the known point, to the left of its direction
        across = nx * (first[1] - ay) - ny * (first[0] - ax)
        vx, vy = minus(self.points[slot.pin], self.points[step.point])
        known = self._distance(step.point, slot.pin)
        if known:
            square = known[0].square
            vx, vy = (each * known[1] for each in known[0].vector)
        else:
            square = dot((vx, vy), (vx, vy))
        inherited = larger(self._conditions[step.point], self._conditions[slot.pin])
        if across.is_zero:
            # Where the pin is near the known point, the errors of both are large beside their distance.
            own = inherited if known else inherited * (1.0 + self.size * self.size / square.terms[0])
            self._add_factor(Factor(slot.name, square, None), inherited)
            root = square.sqrt()
        else:
            self.squares.append(square)
            factor = square - across * across
            size = square.terms[0] + across.terms[0] * across.terms[0]
            own = inherited * (size / factor.terms[0])
            self._add_factor(Factor(slot.name, factor, size), inherited)
            root = factor.sqrt()
        self._conditions_of_links[link] = own
        root = self._signed(slot.name, root)
        self.determinants[slot.name] = root.terms[0]
        inverse_square = square.inverse()
        # the slot's direction in the plane: v (root - i across)/D, then turned back by that in the link
        cosine, sine = (vx * root + vy * across) * inverse_square, (vy * root - vx * across) * inverse_square
        direction = cosine * nx + sine * ny, sine * nx - cosine * ny
        if across.is_still and nx.is_still and ny.is_still:
            turning = turn_in_slot((vx, vy), square, root.terms[0], across.terms[0])
            self._turnings[link], direction = turning, turned(local_of(direction), turning)
        self.directions[link] = direction
        self._origins[link] = (self.points[step.point], self._local[link][step.point])

    def _join_circles(self, point: str, first: Circle, second: Circle) -> None:
        a, b = first.centre, second.centre
        r = length(self.between(first.link, a, point))
        s = length(self.between(second.link, b, point))
        d = minus(self.points[b], self.points[a])
        inherited = larger(self._conditions[a], self._conditions[b])
        known = self._distance(a, b)
        if known:
            own_distance, total = known[0], self._exact_sum
            square, (dx, dy) = own_distance.square, own_distance.vector
            d = dx * known[1], dy * known[1]
            g, c = Series.still(own_distance.ground), Series.still(own_distance.crank)
            p = own_distance.versine * own_distance.product + total(g, -c, r, -s) * total(g, -c, -r, s)
            q = own_distance.coversine * own_distance.product + total(r, s, g, c) * total(r, s, -g, -c)
            # What the sums cancel by where a parameter is negative; else 0.
            cancelled = abs(own_distance.product) - own_distance.product
            size, both = 2.0 * cancelled, p.terms[0] + q.terms[0]
            # Above 0, so that a design at its change point has a condition.
            product = self.graph.put("max", (p.terms[0] * q.terms[0]).index, (_LEAST_SQUARE * (both * both)).index)
            own = inherited * (1.0 + 0.25 * cancelled * both / product)
            numbers = (own_distance.crank, r.terms[0], s.terms[0], own_distance.ground)
            lengths = tuple(filter(None, map(length_of, numbers)))
            if len(lengths) == len(numbers):
                self.loops.append(Loop(lengths, (first.link, second.link)))
        else:
            square = dot(d, d)
            p, q = square - (r - s) * (r - s), (r + s) * (r + s) - square
            size = square.terms[0] + ((r + s) * (r + s)).terms[0]
            both = p.terms[0] + q.terms[0]
            own = inherited * (0.25 * (both * both) / (p.terms[0] * q.terms[0]))
        self._add_factor(Factor(point, p, size), inherited)
        self._add_factor(Factor(point, q, size), inherited)
        self.squares.append(square)
        (ax, ay), (dx, dy), half_inverse = self.points[a], d, square.inverse() * 0.5
        root = (p * q).sqrt()
        k, f = (p + r * (r - s) * 2.0) * half_inverse, root * half_inverse * self._sign(point)
        ux, uy = k * dx - f * dy, k * dy + f * dx
        determinant, difference = root.terms[0] * (0.5 * self._sign(point)), q.terms[0] - p.terms[0]
        if r.is_still and s.is_still:
            turnings = turn_sides(d, square, k.terms[0], difference, determinant)
            self._turnings[first.link], self._turnings[second.link] = turnings
            ux, uy = turned(local_of((ux, uy)), turnings[0])
        self._know(point, (ax + ux, ay + uy), own, point)
        self.determinants[point] = determinant
        self.transmission[point] = (root.terms[0], 0.5 * difference)

    def _join_circle_and_line(self, point: str, circle: Circle, line: Slot | SlideLine) -> None:
        r = length(self.between(circle.link, circle.centre, point))
        g, n = self._line(line)
        w = minus(g, self.points[circle.centre])
        inherited = larger(self._conditions[circle.centre], self._condition_of(line.body))
        known = self._margins(circle.centre, line, r.terms[0])
        if known:
            low, high, size, sense = known
            h, least = 0.5 * sense * (high.terms[0] - low.terms[0]), _LEAST_SQUARE * (r * r).terms[0]
            product = self.graph.put("max", (low.terms[0] * high.terms[0]).index, least.index)
            own = inherited * (1.0 + size * r.terms[0] / product)
        else:
            distance = cross(n, w)
            low, high, h = r - distance, distance + r, distance.terms[0]
            size = r.terms[0] + abs(h)
            own = inherited * ((r * r).terms[0] / (low.terms[0] * high.terms[0]))
        self._add_factor(Factor(point, low, size), inherited)
        self._add_factor(Factor(point, high, size), inherited)
        root = (low * high).sqrt()
        signed = self._signed(point, root)
        t = signed - dot(w, n)
        self.determinants[point] = signed.terms[0]
        self._know(point, (g[0] + t * n[0], g[1] + t * n[1]), own, point)
        self.transmission[point] = (root.terms[0], -h)

    def _join_lines(self, point: str, first: Slot | SlideLine, second: Slot | SlideLine) -> None:
        (g, n), (h, m) = self._line(first), self._line(second)
        sine = cross(n, m)
        t = cross(minus(h, g), m) / sine
        inherited = self.graph.constant(1.0)
        for line in (first, second):
            inherited = larger(inherited, self._condition_of(line.body))
        own = self._add_line_factor(point, sine, inherited)
        self._know(point, (g[0] + t * n[0], g[1] + t * n[1]), own, point)

    def _pose_group(self, step: PoseGroup) -> None:
        first, second = (self._tie(step, tie) for tie in step.ties)
        cosine, sine = self._angle.cosine.terms[0], self._angle.sine.terms[0]
        pose = pose_group(self.graph, cosine, sine, len(self.groups), (first, second))
        self.directions[step.first], self.directions[step.second] = pose.first, pose.second
        self._origins[step.first] = (self.points[step.first_pin], self._local[step.first][step.first_pin])
        pin = step.second_pin
        carried = step.carries(pin)
        place = self._in_plane(step.first, self._local[step.first][pin]) if carried else self.points[pin]
        self._origins[step.second] = (place, self._local[step.second][pin])
        for link in (step.first, step.second):
            self._conditions_of_links[link] = 1.0 + pose.gain
        self.factors.append(Factor(step.joint, pose.reach, pose.reach_size))
        self.squares.append(pose.square)
        self.groups.append((*rows_of(first), *rows_of(second)))

    def _tie(self, step: PoseGroup, tie: Bar | Slot) -> Tie:
        if isinstance(tie, Bar):
            bar_length = length(self.between(tie.link, tie.start, tie.end)).terms[0]
            return Tie(self._way_to(step, tie.end) - self._way_to(step, tie.start), None, bar_length)
        start, end = self._ends(tie)
        direction, zero = local_of(unit(minus(end, start))), local_of(self._zero)
        is_known = tie.body not in (step.first, step.second)
        bodies = (FRAME, self.table.driver, step.first, step.second)
        along = Span(
            self.slot_direction(tie) if is_known else self._zero,
            *(direction if body == tie.body else zero for body in bodies),
        )
        return Tie(self._way_to(step, tie.pin) - self._way(step, tie.body, start), along, self.graph.constant(1.0))

    def _way_to(self, step: PoseGroup, point: str) -> Span:
        """A point of a group, as what moves with each body."""
        body = step.body_of(point) or self._made_by[point]
        way = self._way(step, body, self._local[body][point])
        return way._replace(known=self.points[point]) if point in self.points else way

    def _way(self, step: PoseGroup, body: str, local: Vector) -> Span:
        """A place of a body as what moves with the frame, with the driver, and with the links of a group."""
        zero = local_of(self._zero)
        if body == FRAME:
            return Span(local, local_of(local), zero, zero, zero)
        if body == step.first:
            on_first = local_of(minus(local, self._local[body][step.first_pin]))
            return self._way_to(step, step.first_pin)._replace(on_first=on_first)
        if body == step.second:
            on_second = local_of(minus(local, self._local[body][step.second_pin]))
            return self._way_to(step, step.second_pin)._replace(on_second=on_second)
        arm = minus(local, self._local[body][self._pivot])
        return Span(self._in_plane(body, local), local_of(self._local[FRAME][self._pivot]), local_of(arm), zero, zero)
