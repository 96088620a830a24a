"""Forces in the joints of a linkage under load, by the balances of its links, one step after the other in reverse.

What is solved last hangs on what is solved before, so the forces of its joints follow from its own loads. A link that
keeps a joint at the distance r from its centre can take up any force along r; what acts on it about the centre gives
the part of the force in the joint across r. A slot takes up a force across its line. The two forces along r or across
a line that a joint is placed by follow from the balance of its pin; the rest from the sums of forces of each link.

A slot that presses on its pin with N across its line rubs it with mu |N| along it, against its motion of the sense s.
With the determinant D of the balance without friction, in which the line's own direction in place of that across it
gives C, and the force q across without friction::

    N = q/(1 - r sign(q)),    r = mu s C/D

This is unique while |r| < 1; else friction can lock the slot, and there is no number. `friction` solves for the sizes
of forces where others have friction too; here they are given, and N = q + r |N|.
"""

from collections.abc import Mapping
from types import MappingProxyType

from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.group_steps import Bar, PoseGroup
from explore.mechanisms.linkages.joint_forces import JointForces
from explore.mechanisms.linkages.loads import Joint, Loading
from explore.mechanisms.linkages.steps import (
    Circle,
    Drive,
    DriveOnLines,
    JoinPoint,
    Locus,
    PlacePoint,
    PoseBySlot,
    SlideInSlot,
    SlideLine,
    Step,
    TranslateLink,
)
from explore.mechanisms.linkages.table import FRAME, Slide, Slot
from explore.mechanisms.linkages.vectors import Local, cross, dot, left, minus, plus, times


class Reactions(JointForces):
    """The forces in the joints, found step after step in reverse."""

    def __init__(self, equations: Equations, loading: Loading, sizes: Mapping[Joint, Number] = MappingProxyType({})):
        super().__init__(equations, loading, sizes)
        self._last: tuple[str, ...] = ()
        for step in equations.steps:
            if isinstance(step, DriveOnLines):
                self._last = (step.first[0], step.second[0])
        lines = [step.second for step in equations.steps if isinstance(step, JoinPoint)]
        self._placed_first = {line.body for line in lines if isinstance(line, SlideLine) and line.is_of_body}
        for step in reversed(equations.steps):
            self._take(step)
        for point, _ in self._table.frame.points:
            self._pass_on(point, FRAME)

    def _take(self, step: Step) -> None:
        match step:
            case PlacePoint():
                if step.point not in self._last:  # those of `DriveOnLines` follow from its lines
                    self._pass_on(step.point, step.body)
            case JoinPoint():
                self._join(step)
            case PoseBySlot():
                self._hold_by_slot(step)
            case SlideInSlot():
                self._slide_in_slot(step)
            case TranslateLink() if step.link in self._placed_first:
                self._hold_slider(step)
            case Drive():
                self.moment = -self._moment(step.link, step.pivot)
                self._hold(step.link, step.pivot)
            case DriveOnLines():
                self._drive_on_lines(step)
            case PoseGroup():
                self._pose_group(step)

    # balances of steps

    def _join(self, step: JoinPoint) -> None:
        loci = step.first, step.second
        (first, along), (second, beside) = (self._force_of(step.point, locus) for locus in loci)
        rest = plus(self._pins[step.point], plus(first, second))
        rest = self._rubbed(rest, loci, (along, beside), step.point)
        a, b = self._shares(rest, along, beside, step.point)
        if isinstance(step.second, SlideLine) and step.second.is_of_body:
            self._press_slider(step.second.slide, -b)
            first = self._force_of(step.point, step.first)[0]
            self._apply(step.point, step.first, plus(first, times(along, a)), a)
            return
        self._apply(step.point, step.first, plus(first, times(along, a)), a)
        other = plus(second, times(beside, b))
        if self._equations.graph.is_exact and isinstance(step.second, Circle):  # what the first one leaves, as it is
            other = times(self._pins[step.point], -1.0)
        self._apply(step.point, step.second, other, b)

    def _press_slider(self, slide: Slide, size: Number) -> None:
        """Note the force on a link that slides in one that is placed after it, at the link's pin."""
        pin = next(s.point for s in self._equations.steps if isinstance(s, TranslateLink) and s.link == slide.link)
        self.across[slide.link] = size
        force, place = times(self._normal_of_slide(slide), size), self._place(pin)
        self._acting[slide.link].append((place, force))
        self._acting[slide.body].append((place, (-force[0], -force[1])))

    def _hold_slider(self, step: TranslateLink) -> None:
        """Note the moment on a link of `_press_slider`, which passes through what it slides in, and its pin's force."""
        moment = self._moment(step.link, step.point)
        body = next(slide.body for slide in self._table.slides if slide.link == step.slide.body)
        self._moments[step.link] = self._moments[step.link] - moment
        self._moments[body] = self._moments[body] + moment
        self._hold(step.link, step.point)

    def _drive_on_lines(self, step: DriveOnLines) -> None:
        (p, line), (q, other) = step.first, step.second
        (first, along), (second, beside) = self._force_of(p, line), self._force_of(q, other)
        rest = plus(plus(self._pins[p], self._pins[q]), plus(first, second))
        rest = self._rubbed(plus(rest, self._total(step.link)), (line, other), (along, beside), step.link)
        a, b = self._shares(rest, along, beside, step.link)
        self._apply(p, line, plus(first, times(along, a)), a)
        self._apply(q, other, plus(second, times(beside, b)), b)
        self._pass_on(p, step.link)
        self._pass_on(q, step.link)
        self.moment = -self._moment(step.link, p)

    def _hold_by_slot(self, step: PoseBySlot) -> None:
        determinant = self._equations.determinants[step.slot.name]
        normal = self._moment(step.link, step.point) / determinant
        if step.slot.name in self._friction:
            arm = minus(self._place(step.slot.pin), self._place(step.point))
            normal = self._pressed(step.slot, normal, cross(arm, self._along(step.slot)) / determinant)
        self._press(step.slot, normal)
        self._hold(step.link, step.point)

    def _slide_in_slot(self, step: SlideInSlot) -> None:
        normal, other = self._normal_of_slide(step.slide), self._normal(step.slot)
        total = self._total(step.link)
        if step.slot.name in self._friction:
            smooth, _ = self._shares(total, normal, other, step.slot.name)[::-1]
            ratio = cross(normal, self._along(step.slot)) / self._equations.determinants[step.slot.name]
            total = minus(total, self._rub(step.slot, self._pressed(step.slot, -smooth, ratio)))
        a, b = self._shares(total, normal, other, step.slot.name)
        self._press(step.slot, -b)
        self._guide(step.slide, a, step.slot.pin)

    def _pose_group(self, step: PoseGroup) -> None:
        """The forces of two ties along them follow from the moments of both links about their pins."""
        first, second = self._moment(step.first, step.first_pin), self._moment(step.second, step.second_pin)
        arm, is_carried = self._arm(step.first_pin, step.second_pin), step.carries(step.second_pin)
        first = first + (cross(arm, self._total(step.second)) if is_carried else self._zero)
        known, slopes = [], []
        for tie in step.ties:
            force, along, point = self._push(step, tie)
            lever = self._arm(step.second_pin, point)
            second = second + cross(lever, force)
            on_first, start = self._zero, tie.start if isinstance(tie, Bar) else tie.pin
            # what pushes the second link pushes the first one, or the pin of the second link on the first one
            if step.carries(start) or (isinstance(tie, Slot) and tie.body == step.first):
                own = self._total(tie.link) if isinstance(tie, Bar) else (self._zero, self._zero)
                across = self._arm(step.first_pin, start)
                first, on_first = first + cross(across, minus(own, force)), -cross(across, along)
            if is_carried:
                first, on_first = first + cross(arm, force), on_first + cross(arm, along)
            known.append((force, along))
            slopes.append((on_first, cross(lever, along)))
        (p, q), (r, s) = slopes
        inverse = 1.0 / (p * s - q * r)
        shares = (r * second - s * first) * inverse, (q * first - p * second) * inverse
        for tie, (force, along), share in zip(step.ties, known, shares, strict=True):
            if isinstance(tie, Slot):
                self._press(tie, share)
                if body := step.body_of(tie.pin):
                    self._pass_on(tie.pin, body)
                continue
            x, y = plus(force, times(along, share))
            self._put(tie.end, tie.link, (-x, -y))
            self._pass_on(tie.end, step.second)
            self._hold(tie.link, tie.start)
            if step.carries(tie.start):
                self._pass_on(tie.start, step.first)
        self._hold(step.second, step.second_pin)
        if is_carried:
            self._pass_on(step.second_pin, step.first)
        self._hold(step.first, step.first_pin)

    def _push(self, step: PoseGroup, tie: Bar | Slot) -> tuple[Local, Local, str]:
        """The force of a tie on the second link of a group: what is known, the direction of the rest, and where."""
        if isinstance(tie, Bar):
            return *self._force_of(tie.end, Circle(tie.link, tie.start)), tie.end
        # what acts on the pin; its friction is known
        force, along = self._rub(tie, self._zero), self._normal(tie)
        if tie.body == step.second:
            force, along = times(force, -1.0), times(along, -1.0)
        return force, along, tie.pin

    def _arm(self, start: str, end: str) -> Local:
        return minus(self._place(end), self._place(start))

    def _force_of(self, point: str, locus: Locus) -> tuple[Local, Local]:
        """The force of a locus on a pin: what is known of it, and the direction of the rest."""
        if isinstance(locus, Slot):
            return (self._zero, self._zero), self._normal(locus)
        if isinstance(locus, SlideLine):
            total = (self._zero, self._zero) if locus.is_of_body else self._total(locus.slide.link)
            return total, self._normal_of_slide(locus.slide)
        arm = minus(self._place(point), self._place(locus.centre))
        across = self._moment(locus.link, locus.centre) / dot(arm, arm)
        return times(left(arm), across), arm

    def _shares(self, rest: Local, first: Local, second: Local, joint: str) -> tuple[Number, Number]:
        """The multiples of two directions that balance a force; the cross product of the two is known of the joint."""
        determinant = self._equations.determinants[joint]
        return -(cross(rest, second) / determinant), -(cross(first, rest) / determinant)

    def _rubbed(
        self, rest: Local, loci: tuple[Locus, Locus], directions: tuple[Local, Local], joint: str
    ) -> Local:  # fmt: skip
        """What two loci balance, with the friction of those that are slots with some."""
        rough = [locus for locus in loci if isinstance(locus, Slot) and locus.name in self._friction]
        if len(rough) == 2:  # their sizes are known
            return plus(rest, plus(*(self._rub(slot, self._zero) for slot in rough)))
        for number, locus in enumerate(loci):
            if isinstance(locus, Slot) and locus in rough:
                smooth, along = self._shares(rest, *directions, joint)[number], self._along(locus)
                turned = cross(along, directions[1]) if number == 0 else cross(directions[0], along)
                size = self._pressed(locus, smooth, turned / self._equations.determinants[joint])
                return plus(rest, self._rub(locus, size))
        return rest

    def _pressed(self, slot: Slot, smooth: Number, ratio: Number) -> Number:
        """The force across a slot with friction, from that without, and from C/D."""
        coefficient, sense = self._friction[slot.name]
        if slot.name in self._sizes:
            return smooth + ratio * coefficient * sense * self._sizes[slot.name]
        self.lock_ratios[slot.name] = ratio * coefficient
        if coefficient.value == 0.0:
            return smooth
        ratio = ratio * coefficient * sense
        root, one = (1.0 - ratio * ratio).sqrt(), ratio.graph.constant(1.0)
        left, right = smooth.call("maximum", self._zero), smooth.call("minimum", self._zero)
        return (left * (one + ratio) + right * (one - ratio)) / (root * root)

    def _apply(self, point: str, locus: Locus, force: Local, share: Number) -> None:
        """Note the force of a locus on a pin, and what follows on its link."""
        if isinstance(locus, Slot):
            self._press(locus, share)
            return
        link = locus.link if isinstance(locus, Circle) else locus.slide.link
        self._put(point, link, (-force[0], -force[1]))
        if isinstance(locus, Circle):
            self._hold(link, locus.centre)
        else:
            self._guide(locus.slide, share, point)
