"""How a mechanism is drawn, as data: points, links, guides, curves, and the signals that share an axis.

A point is a sum of vectors, as in the loop equations of textbooks: the joint of coupler and rocker of a four-bar is the
ground's vector plus the rocker's. Figures, the page of a report and exports read the same declaration.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from explore.model.quantities import FloatArray, Signal

#: Name of the input angle as the angle of a vector.
INPUT = "input"
#: Parameters that say where the linkage lies in its plane: its origin, mm, and its x axis, deg.
PLACE = ("crank_pivot_x", "crank_pivot_y", "ground_angle")
#: Role of a path: that of a joint, of the output to and fro, or of a point of interest.
PathRole = Literal["joint", "output", "point"]


@dataclass(frozen=True)
class Vector:
    """A vector in the plane of the mechanism.

    Attributes
    ----------
    length
        A parameter or a signal in mm, or a number, mm.
    angle
        A signal in deg, `INPUT`, or a number, deg; counter-clockwise from the x axis.
    factor
        Factor of the length.
    sense
        -1 for an angle that is measured clockwise.
    turn
        Angle of the vector from that direction, deg: 90 for a vector across it.
    """

    length: str | float
    angle: str | float = 0.0
    factor: float = 1.0
    sense: int = 1
    turn: float = 0.0

    @property
    def direction(self) -> float:
        """Direction of a vector whose angle is a number, deg."""
        return self.sense * float(self.angle) + self.turn


@dataclass(frozen=True)
class Link:
    """A body through some points. One of two points that is named after a length parameter has that length."""

    name: str
    points: tuple[str, ...]


@dataclass(frozen=True)
class Guide:
    """A straight guide of a sliding point, at an angle, deg, or along the path of the point in each design."""

    point: str
    angle: float = 0.0
    follows_path: bool = False


@dataclass(frozen=True)
class Path:
    """The path of a point over a turn."""

    point: str
    long_name: str
    role: PathRole = "joint"


@dataclass(frozen=True)
class Profile:
    """A closed curve of a body that turns about a point.

    Attributes
    ----------
    name
        Name of the body.
    vectors
        From the centre to the point of the curve that belongs to an input angle, in the body's position at input
        angle 0.
    centre
        The point that the body turns about.
    angle, sense
        How far the body has turned: `INPUT` or a signal in deg, and -1 if it turns clockwise.
    """

    name: str
    vectors: tuple[Vector, ...]
    centre: str
    angle: str
    sense: int = 1


@dataclass(frozen=True)
class Drawing:
    """A mechanism in its plane, mm.

    Attributes
    ----------
    points
        Each point by its name, as a sum of vectors.
    links
        Bodies, from the input to the output.
    pivots
        Points that are pivots on the ground.
    guides, paths, profiles
        Guides of sliders, paths of points, curves of bodies.
    stroke_point
        The point on whose path the drive stroke is shown; empty for none.
    """

    points: Mapping[str, tuple[Vector, ...]]
    links: tuple[Link, ...] = ()
    pivots: tuple[str, ...] = ()
    guides: tuple[Guide, ...] = ()
    paths: tuple[Path, ...] = ()
    profiles: tuple[Profile, ...] = ()
    stroke_point: str = ""

    def placed(self, x: float, y: float, degrees: float) -> Drawing:
        """The drawing turned about its origin, deg, which is then shifted to a place, mm."""
        origin = (Vector(x), Vector(y, 90.0))

        def turned(vectors: tuple[Vector, ...]) -> tuple[Vector, ...]:
            return tuple(replace(vector, turn=vector.turn + degrees) for vector in vectors)

        return replace(
            self,
            points={name: (*origin, *turned(vectors)) for name, vectors in self.points.items()},
            guides=tuple(replace(guide, angle=guide.angle + degrees) for guide in self.guides),
            profiles=tuple(replace(profile, vectors=turned(profile.vectors)) for profile in self.profiles),
        )


@dataclass(frozen=True)
class Panel:
    """Signals that share an axis in charts of a motion.

    Attributes
    ----------
    label
        Name of the axis, without its unit.
    signals
        Names of the signals, all of one unit.
    unit, factor
        Unit of the axis and the factor to it; empty for that of the signals.
    limits
        First and last value of the axis; empty where they follow from the curves.
    shows_mean
        Whether the mean over the turn is drawn.
    with_clutch
        Whether the panel is drawn only for studies that use the strokes which clutches transmit.
    """

    label: str
    signals: tuple[str, ...]
    unit: str = ""
    factor: float = 1.0
    limits: tuple[float, ...] = ()
    shows_mean: bool = False
    with_clutch: bool = False


@dataclass(frozen=True)
class Pose:
    """Values that the vectors of a drawing name: parameters, and signals at input angles.

    Attributes
    ----------
    lengths, angles
        Parameters and signals in mm, and signals in deg, each a number or of shape (t,).
    input_angle : (t,) array
        deg.
    """

    lengths: Mapping[str, FloatArray | float]
    angles: Mapping[str, FloatArray | float]
    input_angle: FloatArray

    @classmethod
    def of(
        cls,
        signals: Iterable[Signal],
        parameters: Mapping[str, float],
        motion: Mapping[str, FloatArray],
        input_angle: FloatArray,
    ) -> Pose:
        """The values of one design: its parameters, and those signals that its motion has, at input angles in deg."""
        units = {signal.name: signal.unit for signal in signals if signal.name in motion}
        return cls(
            lengths={**parameters, **{name: motion[name] for name, unit in units.items() if unit == "mm"}},
            angles={name: motion[name] for name, unit in units.items() if unit == "deg"},
            input_angle=input_angle,
        )

    def sum(self, vectors: tuple[Vector, ...]) -> FloatArray:
        """The sum of vectors, mm, shape (t, 2)."""
        total = np.zeros((len(self.input_angle), 2))
        for vector in vectors:
            length = self.lengths[vector.length] if isinstance(vector.length, str) else vector.length
            angle = np.deg2rad(vector.sense * self.angle(vector.angle) + vector.turn)
            total += (vector.factor * length * np.array([np.cos(angle), np.sin(angle)])).T
        return total

    def angle(self, name: str | float) -> FloatArray:
        """An angle by its name, deg, shape (t,)."""
        value = self.input_angle if name == INPUT else self.angles[name] if isinstance(name, str) else name
        return np.broadcast_to(np.asarray(value, dtype=np.float64), self.input_angle.shape)

    def points(self, drawing: Drawing) -> dict[str, FloatArray]:
        """All points of a drawing, mm, each of shape (t, 2)."""
        return {name: self.sum(vectors) for name, vectors in drawing.points.items()}
