"""What moves in a drawing, at input angles of its motion: links, joints, sliders and bodies."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explore.figures.exporting import symbols
from explore.figures.exporting.shapes import Shape, Spline, bounds
from explore.figures.exporting.sheet import body_angle, body_curve, static_shapes, text_height
from explore.figures.simulation import SimulatedDesign, drawing_of
from explore.model.quantities import FloatArray

#: Duration of a turn, or of a way to and fro, s.
DURATION = 4.0


@dataclass(frozen=True)
class Body:
    """A body that turns: its curve about its centre, how far it has turned (deg, shape (t,)), and its centre (t, 2)."""

    curve: Spline
    angle: FloatArray
    centre: FloatArray


@dataclass(frozen=True)
class Movement:
    """A mechanism in its motion; all symbols are scaled by the height of text, mm.

    `still` does not move. Of each link the points, (t, n, 2), of each slider the corners of its block, (t, 4, 2), of
    each joint that moves its place, (t, 2), and bodies with a curve.
    """

    title: str
    height: float
    still: Sequence[Shape]
    chains: Sequence[FloatArray]
    sliders: Sequence[FloatArray]
    joints: Sequence[FloatArray]
    bodies: Sequence[Body]

    @property
    def bounds(self) -> FloatArray:
        """Smallest and largest coordinates, with a margin, shape (2, 2)."""
        points = [part.reshape(-1, 2) for part in (*self.chains, *self.sliders)]
        for body in self.bodies:
            reach = np.hypot(*body.curve.points().T).max()
            points += [body.centre - reach, body.centre + reach]
        everything = np.vstack([bounds(self.still, self.height), *points])
        return np.array([everything.min(axis=0) - self.height, everything.max(axis=0) + self.height])


def move(simulated: SimulatedDesign, angles: FloatArray) -> Movement:
    """The parts of a design at input angles, deg, shape (t,)."""
    drawing, pose = drawing_of(simulated), simulated.pose(angles.tolist())
    height, points = text_height(simulated, drawing), pose.points(drawing)
    names = dict.fromkeys(name for link in drawing.links for name in link.points if name not in drawing.pivots)
    return Movement(
        simulated.title,
        height,
        list(static_shapes(simulated, height)),
        [np.stack([points[name] for name in link.points], axis=1) for link in drawing.links],
        [symbols.slider(points[guide.point], guide.angle, height) for guide in drawing.guides],
        [points[name] for name in names],
        [
            Body(
                body_curve(simulated, profile),
                np.unwrap(body_angle(profile, pose), period=360.0),
                points[profile.centre],
            )
            for profile in drawing.profiles
        ],
    )
