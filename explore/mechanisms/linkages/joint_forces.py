"""The forces in the joints of a linkage as they become known, and what acts on its pins and bodies besides."""

from collections import defaultdict
from collections.abc import Mapping
from functools import reduce
from types import MappingProxyType

from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.loads import Joint, Loading
from explore.mechanisms.linkages.table import Slide, Slot
from explore.mechanisms.linkages.vectors import Local, cross, dot, left, minus, plus, times


class JointForces:
    """The forces in the joints.

    Attributes
    ----------
    on_bodies
        Forces of pins on bodies, N, by the names of both.
    across
        Forces of slots on their pins, and of what links slide on that only translate on these, by the names of slots
        and links, N: positive along the direction turned to the left.
    along
        The force that drives a pin along its slot, N; 0 where a link turns.
    moment
        The moment that turns the driver, N mm; 0 where a pin is driven.
    lock_ratios
        For each slot with friction whose size is not given, r of `Reactions` but for the sense of the motion.
    """

    def __init__(self, equations: Equations, loading: Loading, sizes: Mapping[Joint, Number] = MappingProxyType({})):
        """Know the loads; with the `sizes` of those that friction follows from, N, or for single slots their own."""
        self._equations, self._table = equations, equations.table
        self._zero = equations.graph.constant(0.0)
        self.on_bodies: dict[tuple[str, str], Local] = {}
        self.across: dict[str, Number] = {}
        self.along = self.moment = self._zero
        self.lock_ratios: dict[str, Number] = {}
        self._friction, self._sizes = loading.friction, sizes
        # What acts on pins and bodies; reactions are added as they are found.
        self._pins = {
            point: reduce(plus, loading.on_pins.get(point, []), (self._zero, self._zero))
            for point in self._table.pinned.points
        }
        self._acting = defaultdict(list, {body: list(forces) for body, forces in loading.on_bodies.items()})
        self._moments = {body.name: sum(loading.moments.get(body.name, []), self._zero) for body in self._table.bodies}
        for joint, bearing in loading.bearings.items():
            moment = bearing.arm * bearing.sense * sizes[joint]
            self._moments[bearing.link] = self._moments[bearing.link] - moment
            self._moments[bearing.holder] = self._moments[bearing.holder] + moment
        for slide in self._table.slides:
            if slide.link in self._friction:
                self._slow_down(slide)

    def _slow_down(self, slide: Slide) -> None:
        """Note the friction on a link that slides; where along the direction it acts makes no difference."""
        coefficient, sense = self._friction[slide.link]
        x, y = self._equations.slide_direction(slide)
        force = times((x.terms[0], y.terms[0]), -(coefficient * sense * self._sizes[slide.link]))
        place = self._place(next(iter(self._table.body_of[slide.link].place_of)))
        self._acting[slide.link].append((place, force))
        self._acting[slide.body].append((place, (-force[0], -force[1])))

    # forces that were found

    def _put(self, point: str, body: str, force: Local) -> None:
        """Note the force of a pin on a body: of a driven one that along its slot, which drives it, and that across."""
        slot = self._table.driven_slot
        if slot is not None and (point, body) == (slot.pin, slot.body):
            self.along, self.across[slot.name] = -dot(force, self._along(slot)), -dot(force, self._normal(slot))
        else:
            before = self.on_bodies.get((point, body))
            self.on_bodies[point, body] = plus(before, force) if before else force
        self._pins[point] = minus(self._pins[point], force)
        self._acting[body].append((self._place(point), force))

    def _pass_on(self, point: str, body: str) -> None:
        """Note that a pin passes on to a body what acts on it."""
        self._put(point, body, self._pins[point])

    def _hold(self, link: str, point: str) -> None:
        """Note the force of the last pin of a link, which balances it."""
        x, y = self._total(link)
        self._put(point, link, (-x, -y))

    def _press(self, slot: Slot, size: Number) -> None:
        """Note the force of a slot on its pin, and the reaction."""
        self.across[slot.name] = size
        force = plus(times(self._normal(slot), size), self._rub(slot, size))
        self._pins[slot.pin] = plus(self._pins[slot.pin], force)
        self._acting[slot.body].append((self._place(slot.pin), (-force[0], -force[1])))

    def _guide(self, slide: Slide, size: Number, point: str) -> None:
        """Note the force on a link that only translates at a point, with the moment that balances it; and reactions."""
        self.across[slide.link] = size
        force, moment = times(self._normal_of_slide(slide), size), -self._moment(slide.link, point)
        place = self._place(point)
        self._acting[slide.link].append((place, force))
        self._acting[slide.body].append((place, (-force[0], -force[1])))
        self._moments[slide.link] = self._moments[slide.link] + moment
        self._moments[slide.body] = self._moments[slide.body] - moment

    def _rub(self, slot: Slot, size: Number) -> Local:
        """The friction of a slot on its pin; none where it is smooth."""
        if slot.name not in self._friction:
            return self._zero, self._zero
        coefficient, sense = self._friction[slot.name]
        return times(self._along(slot), -(coefficient * sense * self._sizes.get(slot.name, abs(size))))

    # sums and directions

    def _total(self, body: str) -> Local:
        return reduce(plus, (force for _, force in self._acting[body]), (self._zero, self._zero))

    def _moment(self, body: str, point: str) -> Number:
        """The moment of what acts on a body about a point, N mm."""
        about = self._place(point)
        arms = (cross(minus(place, about), force) for place, force in self._acting[body] if place != about)
        return sum(arms, self._moments[body])

    def _place(self, point: str) -> Local:
        x, y = self._equations.points[point]
        return x.terms[0], y.terms[0]

    def _along(self, slot: Slot) -> Local:
        x, y = self._equations.slot_direction(slot)
        return x.terms[0], y.terms[0]

    def _normal(self, slot: Slot) -> Local:
        return left(self._along(slot))

    def _normal_of_slide(self, slide: Slide) -> Local:
        x, y = self._equations.slide_direction(slide)
        return left((x.terms[0], y.terms[0]))
