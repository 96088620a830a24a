"""Points of a body that lie on a line in several poses: where a slider may carry it.

For three poses they lie on a circle (L. Burmester, Lehrbuch der Kinematik, 1888). The circles of poses 1, 2, 3 and of
poses 1, 2, 4 meet in two points. One is the pole P12, about which the body turns from pose 1 to pose 2: two of its
places are the same, so that it is on both circles whatever the guide. The other is the only slider point of four poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.poses import Poses

#: Rotations, shifts over the size of the poses, and curvatures of circles that are smaller than this are none.
_NONE = 1e-9


@dataclass(frozen=True)
class PointCircle:
    """The points of a body that lie on a line in three poses, in its first pose.

    Attributes
    ----------
    centre, radius
        Of the circle.
    """

    centre: complex
    radius: float

    def points(self, angles: FloatArray) -> ComplexArray:
        """Its points in these directions from the centre, rad, shape (n,)."""
        return np.asarray(self.centre + self.radius * np.exp(1j * np.asarray(angles)))


@dataclass(frozen=True)
class SliderDyad:
    """A pin on the body that a slider carries along a guide.

    Attributes
    ----------
    moving
        The pin, in the first pose of the body.
    direction
        Of the guide, 0 … pi, rad.
    """

    moving: complex
    direction: float


def point_circle(poses: Poses) -> PointCircle:
    """The circle of points that lie on a line in three poses.

    Raises
    ------
    RequestError
        If the poses are not three, or two of them have the same angle: then the points lie on a line, or nowhere.
    """
    if len(poses.points) != 3:
        raise RequestError(f"three poses have a circle of slider points, not {len(poses.points)}")
    rotations, shifts = poses.displacements()
    (one, other), (first, second) = (rotations - 1.0).tolist(), shifts.tolist()
    # The places of z after pose 1, less z, are one z + first and other z + second: on a line through 0 if
    # curvature |z|^2 + Re(slope z) + rest = 0.
    curvature = (one.conjugate() * other).imag
    if abs(curvature) <= _NONE:
        raise RequestError("two of the three poses have the same angle: the slider points lie on no circle; turn one")
    slope = 1j * (one * second.conjugate() - first.conjugate() * other)
    rest = (first.conjugate() * second).imag
    centre = -slope.conjugate() / (2.0 * curvature)
    return PointCircle(centre, float(np.sqrt(max(abs(centre) ** 2 - rest / curvature, 0.0))))


def find_slider_dyad(poses: Poses) -> SliderDyad:
    """The only pin that four poses keep on a line, and the direction of that line.

    Raises
    ------
    RequestError
        If the poses are not four, two have the same angle or are alike, or the circles meet in the pole alone.
    """
    if len(poses.points) != 4:
        raise RequestError(f"four poses determine the slider point, not {len(poses.points)}")
    pole = pole_of(poses)
    circles = [point_circle(Poses(poses.points[[0, 1, k]], poses.angles[[0, 1, k]])) for k in (2, 3)]
    axis = circles[1].centre - circles[0].centre
    size = max(circle.radius for circle in circles)
    if abs(axis) <= _NONE * size:
        raise RequestError("the poses single out no slider point: every point of a circle is one; move a pose")
    # The circles meet symmetrically about the line of their centres.
    moving = circles[0].centre + axis * ((pole - circles[0].centre) / axis).conjugate()
    if abs(moving - pole) <= _NONE * size:
        raise RequestError("the poses have no slider point but the pole of the first two, which does not slide")
    return SliderDyad(moving, guide_direction(poses, moving))


def pole_of(poses: Poses) -> complex:
    """The point about which a body turns from its first to its second pose."""
    rotations, shifts = poses.displacements()
    turned = complex(rotations[0]) - 1.0
    if abs(turned) <= _NONE:
        raise RequestError("poses 1 and 2 have the same angle: their pole is infinitely far away; turn one of them")
    return -complex(shifts[0]) / turned


def guide_direction(poses: Poses, moving: complex) -> float:
    """The direction of the line on which the places of a pin lie best, 0 … pi, rad."""
    rotations, shifts = poses.displacements()
    places = np.append(moving, rotations * moving + shifts)
    # The principal axis: the mean of squared vectors has twice its angle.
    return float(np.angle(((places - places.mean()) ** 2).sum()) / 2.0 % np.pi)


def largest_offset(poses: Poses, dyad: SliderDyad) -> float:
    """The largest distance of a place of the pin from the guide through its first place."""
    rotations, shifts = poses.displacements()
    moved = rotations * dyad.moving + shifts - dyad.moving
    return float(np.abs((moved * np.exp(-1j * dyad.direction)).imag).max())
