"""The drawing of a mechanism: its links keep their lengths."""

from collections.abc import Iterator

import numpy as np

from explore.model.drawing import Pose
from explore.testing.subject import Subject

_INPUT_ANGLES = np.linspace(-180.0, 540.0, 49)
#: Largest difference over the size of the drawing: rounding of a few sums, with angles up to 540 deg.
_TOLERANCE = 1e-12


def broken_links(subject: Subject) -> Iterator[str]:
    """A sentence for each link between two points whose distance is not the parameter that it is named after."""
    drawing = subject.mechanism.drawing
    if drawing is None:
        return
    lengths = subject.complete_designs
    links = [link for link in drawing.links if link.name in lengths and len(link.points) == 2]
    for design in np.flatnonzero(subject.is_computed):
        parameters = {name: float(column[design]) for name, column in lengths.items()}
        rows = subject.motion(int(design), _INPUT_ANGLES)
        signals = dict(zip((signal.name for signal in subject.signals), rows, strict=True))
        points = Pose.of(subject.mechanism.signals, parameters, signals, _INPUT_ANGLES).points(drawing)
        size = max(float(np.abs(place).max()) for place in points.values())
        for link in links:
            first, last = (points[name] for name in link.points)
            difference = np.abs(np.hypot(*(last - first).T) - parameters[link.name]).max()
            if not difference <= _TOLERANCE * size:
                yield (
                    f"the drawing's {link.name} is longer or shorter than its length by {difference:.1e} mm, "
                    f"for {subject.describe(int(design))}"
                )
                return
