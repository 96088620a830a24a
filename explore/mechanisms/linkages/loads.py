"""Loads of a linkage as numbers of its graph: forces at points and on bodies, and the torque of the drive by power.

With a prime for derivatives by the input angle, w the speed of the input and g gravity, the drive balances the power of
inertia, weights and all other loads, which is divided by w::

    T = sum m (w^2 c'' - g).c' + sum J w^2 phi'' phi' - sum F.p' - sum M phi' - sum f q'

with c the centroids, phi the angles of links, p the points of forces, and q the length, position or angle that a spring
or a damper acts on with the force f. Forces are in N and lengths in mm, so sums of powers are in N mm.
"""

from __future__ import annotations

import copy
import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from explore.base.units.quantities import unit_factor
from explore.mechanisms.linkages.bearings import Bearing, rigid_parts
from explore.mechanisms.linkages.coordinate import ZERO, Coordinate
from explore.mechanisms.linkages.curves import place_of_curve, value_of_curve
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.expressions import read_expression
from explore.mechanisms.linkages.graph import SENSES, Number, Series
from explore.mechanisms.linkages.group_steps import groups_of
from explore.mechanisms.linkages.load_table import Element, Loads, Mass, PivotedMass
from explore.mechanisms.linkages.steps import slots_of
from explore.mechanisms.linkages.table import Slide, Slot
from explore.mechanisms.linkages.vectors import Local, Vector, dot, length, minus

#: Units of amounts that are not negative, and that 0 leaves out.
AMOUNTS = ("kg", "kg m^2", "N s/m", "N m s/rad")
#: The parameter that the speed of the driver is, rad/s.
SPEED = "speed"
#: A slot, a link that slides, or a pin and the link that turns on it.
Joint = str | tuple[str, str]
#: Meters in a millimeter.
_METERS = Fraction(1, 1000)
#: Half a turn, rad, with 32 digits.
_PI = Fraction(math.pi) + Fraction(1.2246467991473532e-16)
#: Half a turn less what no angle equals, rad.
_HALF_TURN = 3.14159265358979
#: Radians in a degree.
_RADIANS = unit_factor("deg", "rad")


class Loading:
    """The loads of a linkage.

    Attributes
    ----------
    loads
        The loads as data.
    on_pins
        Forces on each pin, N: with the weight and the inertia of a mass there.
    on_bodies
        Forces on each body, N, with their places, mm: with its weight and its inertia.
    moments
        Moments on each body, N mm.
    angles
        Links whose angles the loads depend on.
    squares
        Squares of distances that are divided by.
    friction
        For each slot, and link that slides, with friction its coefficient and the sense of the motion.
    bearings
        For each pin with friction and each link that turns on it, how.
    senses
        Signals whose signs forces jump with, in the order of `graph.SENSES`.
    places, values
        The place of each curve, mm or rad, and its value.
    """

    def __init__(self, equations: Equations, loads: Loads) -> None:
        self._equations, self._graph, self.loads = equations, equations.graph, loads
        self._zero = self._graph.constant(0.0)
        self._one, self._meters = self._graph.constant(1.0), self._graph.constant(_METERS)
        self._speed = self._graph.input(SPEED) if loads.is_dynamic else self._zero
        self._power, self._loss = self._zero, self._zero
        self.senses: list[str] = []
        self.friction: dict[str, tuple[Number, Number]] = {}
        self.bearings: dict[tuple[str, str], Bearing] = {}
        self.on_pins: dict[str, list[Local]] = defaultdict(list)
        self.on_bodies: dict[str, list[tuple[Local, Local]]] = defaultdict(list)
        self.moments: dict[str, list[Number]] = defaultdict(list)
        self.places = {curve.name: place_of_curve(equations, curve) for curve in loads.curves}
        self.values = {curve.name: value_of_curve(equations, curve, self.places[curve.name]) for curve in loads.curves}
        table = equations.table
        self.angles = [table.output] if loads.need_strokes and table.output_turns else []
        self.squares: list[Series] = []
        gravity = loads.gravity
        self._gravity = (
            (self._zero, self._zero) if gravity is None else (self._read(gravity[0]), self._read(gravity[1]))
        )
        for mass in loads.masses:
            self._add_mass(mass)
        for force in loads.forces:
            self._push(force.point, (self._read(force.force[0]), self._read(force.force[1])))
        for element in loads.elements:
            self._add_element(element)

    @property
    def torque(self) -> Number:
        """The torque of the drive, N m; where a pin is driven, its power over the speed."""
        return -self._power * self._meters

    @property
    def loss(self) -> Number:
        """The power that dampers, friction and what opposes motions take, over the speed, N m."""
        return self._loss * self._meters

    @property
    def needs_sizes(self) -> bool:
        """Whether friction follows from sizes of forces that are solved for together.

        They are those of pins, of links that slide, of slots of groups, and of two slots that hold one pin or link.
        """
        rough = self.friction.keys()
        if self.bearings or rough & {slide.link for slide in self._equations.table.slides}:
            return True
        ties = [tie for group in groups_of(self._equations.steps) for tie in group.ties]
        both = [slots for step in self._equations.steps if len(slots := slots_of(step)) == 2]
        return any(isinstance(tie, Slot) and tie.name in rough for tie in ties) or any(
            rough >= {slot.name for slot in slots} for slots in both
        )

    def take_friction(self, across: Mapping[str, Number], sizes: Mapping[Joint, Number]) -> None:
        """Take the power of friction from the forces across slots and slides, and the sizes of those of pins, N."""
        pressed = {name: sizes[name] if name in sizes else abs(across[name]) for name in self.friction}
        takes = [
            coefficient * sense * pressed[name] * self._sliding(name)[0]
            for name, (coefficient, sense) in self.friction.items()
        ]
        takes += [each.arm * each.sense * sizes[name] * each.rate for name, each in self.bearings.items()]
        for taken in takes:
            self._power, self._loss = self._power - taken, self._loss + taken

    def unloaded(self) -> Loading:
        """The same joints with friction without any load, as if each turned or slid forwards."""
        result = copy.copy(self)
        result.on_pins, result.on_bodies, result.moments = {}, {}, {}
        result.bearings = {joint: replace(bearing, sense=self._one) for joint, bearing in self.bearings.items()}
        result.friction = {slot: (coefficient, self._one) for slot, (coefficient, _) in self.friction.items()}
        return result

    def _sliding(self, name: str) -> tuple[Number, str]:
        """The rate of a slot, or of a link that slides, and its signal."""
        line, rate = self._equations.table.line_of(name), self._equations.position_of(name).terms[1]
        if isinstance(line, Slide) and name not in self._equations.table.sliders:
            return rate, line.sliding
        return rate, f"{name}_velocity"

    @property
    def lag_rate(self) -> Number | None:
        """The rate, per radian, at which the torque of the motor follows that of the drive; None without a motor."""
        if self.loads.motor is None:
            return None
        return self._amount(self.loads.motor.slope) / (self._amount(self.loads.motor.flywheel) * self._speed)

    def _read(self, coordinate: Coordinate) -> Number:
        return read_expression(self._graph, coordinate, self.values)

    # inertia and forces at places

    def _add_mass(self, mass: Mass) -> None:
        """Weight and inertia, as forces at the centroid and a moment."""
        equations, amount = self._equations, self._amount(mass.mass)
        is_link = mass.owner in equations.table.body_of
        if not is_link or isinstance(mass.centroid, str):
            place = equations.points[mass.centroid if isinstance(mass.centroid, str) else mass.owner]
        else:
            place = equations.place_of(mass.owner, mass.centroid)
        square = self._speed * self._speed
        x, y = (
            amount * (g - part.terms[2] * square * self._meters) for g, part in zip(self._gravity, place, strict=True)
        )
        self._work((x, y), place)
        if not is_link:
            self.on_pins[mass.owner].append((x, y))
            return
        self.on_bodies[mass.owner].append(((place[0].terms[0], place[1].terms[0]), (x, y)))
        first, second = equations.turning_of(mass.owner)
        inertia = self._amount(mass.inertia)
        if isinstance(mass, PivotedMass):  # parallel axes
            pivot = equations.table.body_of[mass.owner].place_of[mass.about]
            arms = [self._read(c) - self._read(p) for c, p in zip(mass.centroid, pivot, strict=True)]
            inertia = inertia - amount * (self._meters * self._meters) * (arms[0] * arms[0] + arms[1] * arms[1])
        self._turn(mass.owner, -(inertia * square * second), first)

    def _push(self, point: str, force: Local) -> None:
        """A force on a pin that does work."""
        self._work(force, self._equations.points[point])
        self.on_pins[point].append(force)

    def _work(self, force: Local, place: Vector) -> None:
        for part, coordinate in zip(force, place, strict=True):
            self._power = self._power + part * coordinate.terms[1]

    def _turn(self, body: str, torque: Number, rate: Number) -> None:
        """A torque on a body, N m, that does work."""
        moment = torque * float(1 / _METERS)
        self._power = self._power + moment * rate
        self.moments[body].append(moment)

    # springs, dampers and torques

    def _add_element(self, element: Element) -> None:
        if element.kind == "friction":
            rate, signal = self._sliding(element.name)
            coefficient = self._not_negative(self._read(element.size))
            self.friction[element.name] = coefficient, self._sense_of(signal, rate)
        elif element.kind == "pin_friction":
            self._add_bearings(element)
        elif len(element.ends) == 2 and element.ends[0] in self._equations.points:
            self._add_between_points(element)
        elif element.ends[0] in self._equations.table.sliders:
            self._add_along_line(element)
        else:
            self._add_between_links(element)

    def _add_bearings(self, element: Element) -> None:
        """A bearing for each link that turns on the pin."""
        *links, holder = element.ends
        parts = rigid_parts(self._equations.table, self._equations.steps).parts
        arm = self._not_negative(self._read(element.size)) * self._not_negative(self._read(element.rest or ZERO))
        for link in (each for each in links if parts[each] != parts[holder]):
            rate = self._equations.turning_of(link)[0] - self._equations.turning_of(holder)[0]
            body = link if element.name in self._equations.table.body_of[link].place_of else holder
            bearing = Bearing(element.name, link, holder, body, arm, rate, self._one)
            bearing = replace(bearing, sense=self._sense_of(bearing.turning, rate))
            self.bearings[element.name, link] = bearing

    def _add_between_points(self, element: Element) -> None:
        """A force that pulls two points towards each other."""
        first, second = element.ends
        difference = minus(self._equations.points[second], self._equations.points[first])
        square = dot(difference, difference)
        if element.rest and self._read(element.rest).value == 0.0:  # no force where the points meet
            pull = [self._read(element.size) * part.terms[0] * self._meters for part in difference]
        else:
            distance = length(difference)
            self.squares.append(square)
            size = self._force(element, distance.terms[0], distance.terms[1])
            pull = [size * (part.terms[0] / distance.terms[0]) for part in difference]
        x, y = pull
        self._push(first, (x, y))
        self._push(second, (-x, -y))

    def _add_along_line(self, element: Element) -> None:
        """A force that pulls the pin of a slot, or a link that slides, back along its line."""
        equations, name = self._equations, element.ends[0]
        position = equations.position_of(name)
        size = -self._force(element, position.terms[0], position.terms[1])
        self._power = self._power + size * position.terms[1]
        line = equations.table.line_of(name)
        if isinstance(line, Slot):
            place, direction = equations.points[line.pin], equations.slot_direction(line)
        else:
            place, direction = equations.place_of(name, (ZERO, ZERO)), equations.slide_direction(line)
        x, y = (size * part.terms[0] for part in direction)
        px, py = (part.terms[0] for part in place)
        if isinstance(line, Slot):
            self.on_pins[line.pin].append((x, y))
        else:
            self.on_bodies[name].append(((px, py), (x, y)))
        self.on_bodies[line.body].append(((px, py), (-x, -y)))

    def _add_between_links(self, element: Element) -> None:
        """A torque on a link, with its reaction on a second one if there is one."""
        rates = [self._equations.turning_of(link)[0] for link in element.ends]
        if element.kind == "torque":
            torque = self._read(element.size)
        else:
            rate = rates[0] - rates[1] if len(rates) == 2 else rates[0]
            angle = self._zero
            if element.kind == "spring":
                self.angles += element.ends
                first, *second = (self._equations.angle_of(link) for link in element.ends)
                angle = first - second[0] if second else first
                angle = angle - self._turns_from_rest(element)
            torque = -self._resist(element, angle, rate, self._one, self._graph.constant(_RADIANS))
        for sign, link, rate in zip((1.0, -1.0), element.ends, rates, strict=False):
            self._turn(link, torque * sign, rate)

    def _turns_from_rest(self, element: Element) -> Number:
        """The whole turns, up to two, by which the middle of an angle is beyond half a turn from the spring's rest."""
        first, *second = (self._equations.middle_of(link) for link in element.ends)
        middle = first - second[0] if second else first
        rest = self._read(element.rest) if element.rest else self._zero
        apart = middle - rest * self._graph.constant(_RADIANS)
        beyond = [apart + k * _HALF_TURN for k in (-3.0, -1.0, 1.0, 3.0)]
        return sum((each / abs(each) for each in beyond), self._zero) * self._graph.constant(_PI)

    def _force(self, element: Element, place: Number, rate: Number) -> Number:
        """The force of an element against its length or position, N."""
        return self._resist(element, place, rate, self._meters, self._one)

    def _resist(self, element: Element, place: Number, rate: Number, unit: Number, rest_unit: Number) -> Number:
        """What an element resists with; its lengths or angles times `unit` are in m or rad."""
        size = self._read(element.size)
        if element.kind == "spring":
            rest = self._read(element.rest) * rest_unit if element.rest else self._zero
            return size * (place - rest) * unit
        if element.kind == "opposing":
            resistance = self._not_negative(size) * self._sense_of(f"{element.ends[0]}_velocity", rate)
        else:
            resistance = self._amount(element.size) * rate * self._speed * unit
        self._loss = self._loss + resistance * rate * (1.0 if unit is self._meters else float(1 / _METERS))
        return resistance

    def _sense_of(self, signal: str, rate: Number) -> Number:
        """1, or -1 where a rate, which is a signal, is negative."""
        if rate.value is not None:
            return -self._one if rate.value < 0.0 else self._one
        if signal not in self.senses:
            self.senses.append(signal)
        return rate.call(SENSES[self.senses.index(signal)])

    def _amount(self, coordinate: Coordinate) -> Number:
        """An amount, undefined where an expression is negative; ranges see to parameters that stand alone."""
        number = self._read(coordinate)
        return number if len(coordinate.steps) == 1 else self._not_negative(number)

    def _not_negative(self, number: Number) -> Number:
        """The number, undefined where it is negative; where nothing is rounded, a curve is not below its points."""
        above = [curve.name for curve in self.loads.curves if min(y for _, y in curve.points) >= 0.0]
        is_known = self._graph.is_exact and number.index in (self.values[name].index for name in above)
        return number if number.value is not None or is_known else number.call("maximum", -number.sqrt())
