"""The loads of a table, as data: masses, forces, what acts between places, and curves that these follow."""

from dataclasses import dataclass
from typing import Literal

from explore.mechanisms.linkages.coordinate import Coordinate, Place

#: Stands for the crank angle, which a curve can be over.
CRANK_ANGLE = "crank_angle"
#: Stands for how far the output is from its least place.
FROM_LEAST = "from_least"
#: Stands for how far the output is from its greatest place.
TO_GREATEST = "to_greatest"


@dataclass(frozen=True)
class Mass:
    """The mass of a link, or at a point.

    Attributes
    ----------
    owner
        The link or the point.
    mass
        In kg.
    centroid
        A point of the link, or a place in its coordinates; that of a mass at a point is the point.
    inertia
        Moment of inertia about the centroid, kg m^2.
    """

    owner: str
    mass: Coordinate
    centroid: str | Place
    inertia: Coordinate


@dataclass(frozen=True)
class PivotedMass(Mass):
    """The mass of a link whose moment of inertia is `about` a point of the link; the centroid is a place."""

    centroid: Place
    about: str


@dataclass(frozen=True)
class PointForce:
    """A force at a point, N along the axes of the frame."""

    point: str
    force: Place


@dataclass(frozen=True)
class Element:
    """A spring, a damper, a torque, what opposes a motion, or friction in a slot or at a pin.

    Attributes
    ----------
    kind
        "spring", "damper", "torque", "opposing", "friction" of a slot or "pin_friction".
    name
        Its name in the table.
    ends
        What it acts between: two points, along the line through them; a slot, along it; a link, about the frame or
        about a second link; or the links that turn on a pin, and last the body that it is fast in.
    size
        The torque counter-clockwise on the first link, N m; the rate, in N/m, N s/m, N m/rad or N m s/rad; the force or
        torque against the motion, N or N m; or the coefficient of friction.
    rest
        Length, position or angle at which a spring is relaxed, mm or deg; or the radius of a pin with friction, mm.
    """

    kind: Literal["spring", "damper", "torque", "opposing", "friction", "pin_friction"]
    name: str
    ends: tuple[str, ...]
    size: Coordinate
    rest: Coordinate | None = None


@dataclass(frozen=True)
class Curve:
    """A value that changes with a place or with the crank angle.

    Attributes
    ----------
    name
        Its name in expressions of loads.
    over
        A slot, for the position of its pin; `CRANK_ANGLE`, `FROM_LEAST` or `TO_GREATEST`; or a point and the direction
        that its place is measured along.
    points
        Places, mm or deg, in ascending order, with the values there.
    is_cubic
        Whether it is a monotone cubic between its points, or else straight.
    """

    name: str
    over: str | tuple[str, Place]
    points: tuple[tuple[float, float], ...]
    is_cubic: bool


@dataclass(frozen=True)
class Motor:
    """A drive that the load slows down.

    Attributes
    ----------
    flywheel
        Moment of inertia that turns with the driver, besides the masses, kg m^2.
    slope
        How much torque it loses per speed of the driver, N m s/rad.
    """

    flywheel: Coordinate
    slope: Coordinate


@dataclass(frozen=True)
class Loads:
    """What acts on a linkage besides its drive; gravity in m/s^2 along the axes of the frame, None for none."""

    gravity: Place | None = None
    masses: tuple[Mass, ...] = ()
    forces: tuple[PointForce, ...] = ()
    elements: tuple[Element, ...] = ()
    curves: tuple[Curve, ...] = ()
    motor: Motor | None = None

    @property
    def is_dynamic(self) -> bool:
        """Whether the speed changes them."""
        return bool(self.masses) or self.has("damper") or self.motor is not None

    @property
    def need_strokes(self) -> bool:
        """Whether they are known only where the output has two strokes."""
        return any(curve.over in (FROM_LEAST, TO_GREATEST) for curve in self.curves)

    @property
    def gain_power(self) -> bool:
        """Whether they may give power over a turn."""
        return self.has("torque") or bool(self.curves)

    @property
    def lose_power(self) -> bool:
        """Whether they take power whichever way the linkage moves."""
        return any(self.has(kind) for kind in ("damper", "opposing", "friction", "pin_friction"))

    @property
    def rough(self) -> tuple[str, ...]:
        """The slots, and links that slide, with friction."""
        return tuple(element.name for element in self.elements if element.kind == "friction")

    def has(self, kind: str) -> bool:
        """Whether there is an element of a kind."""
        return any(element.kind == kind for element in self.elements)
