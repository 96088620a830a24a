"""Read the section [linkage.loads]: masses, gravity, forces, torques, springs, dampers, and what opposes motions.

`explore.studies.linkages.curves` reads the curves that forces, torques and what opposes can follow.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from explore.base.entries import is_known, note_unknown, read_table
from explore.base.errors import KeyPath
from explore.base.suggest import format_value
from explore.mechanisms.linkages.coordinate import ZERO, Coordinate
from explore.mechanisms.linkages.load_table import Element, Loads, Mass, Motor, PointForce
from explore.mechanisms.linkages.loads import AMOUNTS
from explore.mechanisms.linkages.table import FRAME, carrier
from explore.studies.linkages.coordinates import read_amount, read_pair
from explore.studies.linkages.curves import CURVE, CurveReader
from explore.studies.linkages.friction import bodies_on, note_many_senses
from explore.studies.linkages.parameters import Located
from explore.studies.linkages.structure import SECTION, Structure

_EXAMPLES = {
    "masses": "rod = { mass = 0.4, centroid = [50, 0], inertia = 0.0004 }",
    "forces": "P = [0, -20]",
    "torques": "rocker = 2.5",
    "springs": 'return = { between = ["P", "Q"], rate = 400, rest = 60 }',
    "opposing": "ram = 40",
    "friction": "ram = 0.1",
    "dampers": 'brake = { between = "ram", rate = 20 }',
}
#: Example of friction at a pin.
_AT_PIN = "A = { coefficient = 0.1, radius = 8 }"
#: Example of a torque between two links.
_BETWEEN = 'rocker = { torque = 2.5, against = "coupler" }'

#: Example of a motor.
_MOTOR = "motor = { flywheel = 0.8, slope = 2.5 }"

_KEYS = ("gravity", *_EXAMPLES, "curves", "motor")
#: Parts whose numbers can have curves.
_CURVED = ("forces", "torques", "opposing")

#: Operations of an expression with a curve: others would give it corners and poles that nothing looks for.
_LINEAR = {"input", "number", "negate", "+", "-", "*"}

_MASS_KEYS = ("mass", "centroid", "inertia")
_TORQUE_KEYS = ("torque", "against")
_PIN_KEYS = ("coefficient", "radius")
_MOTOR_KEYS = ("flywheel", "slope")
#: Units of rates of springs and dampers, along a line and of an angle.
_RATES = {"springs": ("N/m", "N m/rad"), "dampers": ("N s/m", "N m s/rad")}

#: Largest number of entries of all parts together.
_MOST_ENTRIES = 100


class LoadReader:
    """The loads of a structure, with their coordinates; problems are appended to those of the structure."""

    def __init__(self, structure: Structure, driver: str, output: str, folder: Path | None, *, turns: bool) -> None:
        self._structure, self._driver, self._problems = structure, driver, structure.problems
        self._links = [link.name for link in structure.links]
        self._sliders = structure.sliders
        fixed = structure.bodies[FRAME].place_of
        self._moving = [point for point in structure.points if point not in fixed]
        self._turns = turns
        self.coordinates: list[Located] = []
        self.curves = CurveReader(structure, output, self._moving, folder, turns=turns)

    def read(self, entries: Mapping[str, Any]) -> Loads | None:
        """The loads that a section describes; None where it is empty."""
        key: KeyPath = (SECTION, "loads")
        note_unknown(entries, _KEYS, self._problems, key)
        gravity = None
        if "gravity" in entries:
            gravity = self._pair(entries["gravity"], (*key, "gravity"), "m/s^2")
        curves = self.curves.read(self._part(entries, "curves", CURVE))
        self.coordinates += self.curves.coordinates
        parts = {name: self._part(entries, name, example) for name, example in _EXAMPLES.items()}
        if (count := sum(map(len, parts.values()))) > _MOST_ENTRIES:
            self._problems.append((key, f"has {count:,} entries; at most {_MOST_ENTRIES} are possible"))
            return None
        masses = tuple(self._mass(name, entry) for name, entry in parts["masses"].items())
        forces = tuple(self._point_force(name, entry) for name, entry in parts["forces"].items())
        elements = [self._torque(name, entry) for name, entry in parts["torques"].items()]
        elements += [self._opposing(name, entry) for name, entry in parts["opposing"].items()]
        elements += [self._friction(name, entry) for name, entry in parts["friction"].items()]
        elements += [self._spring(kind, name, entry) for kind in _RATES for name, entry in parts[kind].items()]
        note_many_senses(elements, key, self._problems)
        motor = self._motor(entries["motor"], (*key, "motor")) if "motor" in entries else None
        if gravity is not None and not masses and not self._problems:
            self._problems.append(((*key, "gravity"), "acts on masses, and there is none; write them in masses"))
        used = {name for coordinate, _, _ in self.coordinates for name in coordinate.names}
        for curve in curves:
            if curve.name not in used and not self._problems:
                reason = f'no load uses it; write its name in one, such as torques: rocker = "{curve.name}"'
                self._problems.append(((*key, "curves", curve.name), reason))
        if masses or forces or elements:
            return Loads(gravity, masses, forces, tuple(elements), curves, motor)
        if motor and not self._problems:
            self._problems.append(((*key, "motor"), "drives loads, and there is none; write masses, for one"))
        return None

    def _part(self, entries: Mapping[str, Any], name: str, example: str) -> Mapping[str, Any]:
        return read_table(entries.get(name, {}), (SECTION, "loads", name), (), example, self._problems)

    def _motor(self, entry: object, key: KeyPath) -> Motor:
        """A motor of a link that turns fully."""
        if self._driver in self._sliders or not self._turns:
            self._problems.append((key, f"drives a link that turns fully, and {self._driver} does not"))
        given = read_table(entry, key, _MOTOR_KEYS, _MOTOR, self._problems, _MOTOR_KEYS)
        flywheel = self._amount(given.get("flywheel", 1), (*key, "flywheel"), "kg m^2")
        if not flywheel.names and flywheel.steps[0][1] == 0.0:
            self._problems.append(((*key, "flywheel"), "must not be 0: the motor's torque would be that of the drive"))
        return Motor(flywheel, self._amount(given.get("slope", 0), (*key, "slope"), "N m s/rad"))

    # kinds of loads

    def _mass(self, name: str, entry: object) -> Mass:
        key = (SECTION, "loads", "masses", name)
        if not is_known(name, key, [*self._links, *self._moving], "link or moving point", self._problems):
            return Mass(name, ZERO, name, ZERO)
        if name not in self._links:
            return Mass(name, self._amount(entry, key, "kg"), name, ZERO)
        given = read_table(entry, key, _MASS_KEYS, _EXAMPLES["masses"], self._problems, ("mass", "centroid"))
        mass = self._amount(given.get("mass", 0), (*key, "mass"), "kg")
        inertia = self._amount(given.get("inertia", 0), (*key, "inertia"), "kg m^2")
        centroid, place = given.get("centroid", ""), (ZERO, ZERO)
        points = self._structure.bodies[name].place_of
        if isinstance(centroid, str):
            if "centroid" in given:
                is_known(centroid, (*key, "centroid"), points, f"point of {name}", self._problems)
            return Mass(name, mass, centroid, inertia)
        place = read_pair(centroid, (*key, "centroid"), self._problems)
        self.coordinates += [(coordinate, (*key, "centroid"), "mm") for coordinate in place]
        return Mass(name, mass, place, inertia)

    def _point_force(self, name: str, entry: object) -> PointForce:
        key = (SECTION, "loads", "forces", name)
        is_known(name, key, self._moving, "moving point", self._problems)
        return PointForce(name, self._pair(entry, key, "N"))

    def _torque(self, name: str, entry: object) -> Element:
        key = (SECTION, "loads", "torques", name)
        is_known(name, key, self._links, "link", self._problems)
        ends: tuple[str, ...] = (name,)
        if isinstance(entry, Mapping):
            given = read_table(entry, key, _TORQUE_KEYS, _BETWEEN, self._problems, _TORQUE_KEYS)
            size = self._amount(given.get("torque", 0), (*key, "torque"), "N m")
            if "against" in given:
                ends = self._two_links(name, given["against"], (*key, "against"))
        else:
            size = self._amount(entry, key, "N m")
        self._check_turns(ends, key)
        return Element("torque", name, ends, size)

    def _opposing(self, name: str, entry: object) -> Element:
        key = (SECTION, "loads", "opposing", name)
        known = [*self._sliders, *self._links]
        is_known(name, key, known, "slot or link", self._problems)
        if name in self._sliders:
            return Element("opposing", name, (name,), self._amount(entry, key, "N"))
        self._check_turns((name,), key)
        return Element("opposing", name, (name,), self._amount(entry, key, "N m"))

    def _friction(self, name: str, entry: object) -> Element:
        key = (SECTION, "loads", "friction", name)
        if name in self._structure.points:
            return self._pin_friction(name, entry, key)
        pins = [point for point in self._structure.points if len(bodies_on(self._structure, point)) > 1]
        known = dict.fromkeys([*self._sliders, *(slide.link for slide in self._structure.slides), *pins])
        if not is_known(name, key, known, "slot, slide or pin", self._problems):
            return Element("friction", name, (name,), ZERO)
        if name == self._driver:
            self._problems.append((key, f"{name} is driven; friction there adds to the force of the drive"))
        turning = [slide.sliding for slide in self._structure.slides if slide.link == name not in self._sliders]
        signal = next(iter(turning), "")
        other = signal.removesuffix("_velocity")
        if other in {*self._structure.points, *self._links, *self._sliders}:
            self._problems.append((key, f"its velocity is {signal}, which {other} has too; choose another name"))
        return Element("friction", name, (name,), self._amount(entry, key, "1"))

    def _pin_friction(self, name: str, entry: object, key: KeyPath) -> Element:
        """Friction of links on a pin that is fast in the last of its bodies."""
        given = read_table(entry, key, _PIN_KEYS, _AT_PIN, self._problems, _PIN_KEYS)
        ends = bodies_on(self._structure, name)
        slots = sum(slot.pin == name for slot in self._structure.slots)
        if slots > 1 or (slots and ends[-1] == FRAME and len(ends) > 2):
            self._problems.append((key, f"{name} joins blocks and other bodies; only its slots can have friction"))
        elif len(ends) == 1:
            self._problems.append((key, f"only {ends[0]} has {name}; name a pin on which a link turns"))
        for link in ends[:-1]:
            self._check_turns((link,) if ends[-1] == FRAME else (link, ends[-1]), key)
        coefficient = self._amount(given.get("coefficient", 0), (*key, "coefficient"), "1")
        radius = self._amount(given.get("radius", 0), (*key, "radius"), "mm")
        return Element("pin_friction", name, tuple(ends), coefficient, radius)

    def _spring(self, kind: str, name: str, entry: object) -> Element:
        key = (SECTION, "loads", kind, name)
        keys = ("between", "rate", *(("rest",) if kind == "springs" else ()))
        given = read_table(entry, key, keys, _EXAMPLES[kind], self._problems, keys)
        ends = self._ends(given.get("between", ""), (*key, "between"), kind) if "between" in given else ()
        turns = bool(ends) and ends[0] in self._links and (len(ends) == 2 or ends[0] not in self._sliders)
        if turns and kind == "springs" and ends[0] == self._driver:
            reason = f"{ends[0]} turns with the crank angle, on which no spring acts; name another link"
            self._problems.append(((*key, "between"), reason))
        elif turns:
            self._check_turns(ends, (*key, "between"))
        size = self._amount(given.get("rate", 0), (*key, "rate"), _RATES[kind][turns])
        rest = self._amount(given["rest"], (*key, "rest"), "deg" if turns else "mm") if "rest" in given else None
        return Element("spring" if kind == "springs" else "damper", name, ends, size, rest)

    # what they act on

    def _ends(self, entry: object, key: KeyPath, kind: str) -> tuple[str, ...]:
        """Two points; a slot; or one or two links."""
        names = entry if isinstance(entry, list | tuple) else [entry]
        if len(names) == 1 and isinstance(names[0], str):
            is_known(names[0], key, [*self._sliders, *self._links], "slot or link", self._problems)
            return (names[0],)
        if len(names) != 2 or not all(isinstance(name, str) for name in names):
            reason = f'must be a slot, a link or two points, such as ["P", "Q"], got {format_value(entry)}'
            self._problems.append((key, reason))
            return ()
        first, second = map(str, names)
        if first in self._links:
            if kind == "springs" and second == self._driver:
                self._problems.append((key, f"{second} turns with the crank angle, on which no spring acts"))
            return self._two_links(first, second, key)
        for name in (first, second):
            if name in self._links:
                self._problems.append((key, f"what joins points joins no link; name a point of {name}"))
            else:
                is_known(name, key, self._structure.points, "point", self._problems)
        shared = [body for body in self._structure.bodies.values() if {first, second} <= set(body.place_of)]
        if shared:
            self._problems.append((key, f"both are points of {shared[0].name}, so their distance does not change"))
        return first, second

    def _two_links(self, first: str, second: object, key: KeyPath) -> tuple[str, ...]:
        others = [link for link in self._links if link != first]
        is_known(second, key, others, "other link", self._problems)
        return first, str(second)

    def _check_turns(self, ends: Sequence[str], key: KeyPath) -> None:
        """Note links that do not turn against each other or against the frame; nothing of unknown ones."""
        if not {*ends} <= {*self._links} or len({*ends}) < len(ends):
            return
        bodies = [*ends, FRAME][:2]
        first, second = (carrier(body, self._structure.slides) for body in bodies)
        if first == second:
            self._problems.append((key, f"{bodies[0]} does not turn against {bodies[1]}; name another link"))

    # entries

    def _amount(self, entry: object, key: KeyPath, unit: str) -> Coordinate:
        before = len(self._problems)
        coordinate = read_amount(entry, key, self._problems, unit)
        value = coordinate.steps[0][1]
        if (unit in AMOUNTS or key[2] in ("opposing", "friction")) and not coordinate.names and value < 0.0:
            self._problems.append((key, f"must not be negative, got {value:g}"))
        elif unit in AMOUNTS and [operation for operation, _ in coordinate.steps] == ["input", "negate"]:
            self._problems.append((key, f"{coordinate.names[0]} is never negative, so this never is an amount"))
        self._check_curves(coordinate, key)
        if len(self._problems) == before:
            self.coordinates.append((coordinate, key, unit))
        return coordinate

    def _check_curves(self, coordinate: Coordinate, key: KeyPath) -> None:
        """Note a curve where none can be, in an operation that none can have, or with negative values that oppose."""
        curves = [name for name in coordinate.names if name in self.curves.names]
        if not curves:
            return
        operations = {operation for operation, _ in coordinate.steps}
        if key[2] not in _CURVED:
            self._problems.append((key, f"{curves[0]} is a curve, which only {', '.join(_CURVED)} can have"))
        elif not operations <= _LINEAR:
            self._problems.append((key, f"with the curve {curves[0]} only numbers, parameters and + - * are possible"))
        elif key[2] == "opposing" and (lowest := min(self.curves.lowest.get(name, 0.0) for name in curves)) < 0.0:
            self._problems.append((key, f"must not be negative, and a curve is {lowest:g} at its lowest"))

    def _pair(self, entry: object, key: KeyPath, unit: str) -> tuple[Coordinate, Coordinate]:
        if not isinstance(entry, list | tuple) or len(entry) != 2:
            self._problems.append((key, f"must be a pair [x, y], got {format_value(entry)}"))
            return ZERO, ZERO
        x, y = (self._amount(each, (*key, number), unit) for number, each in enumerate(entry))
        return x, y
