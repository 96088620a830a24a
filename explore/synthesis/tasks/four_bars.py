"""What tasks of four-bars have in common: the names of the lengths, two formulas, and the bounds on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from explore.synthesis.tasks.sections import SectionReader

LENGTHS = ("crank", "coupler", "rocker", "ground")
#: Metrics of the studies of four-bars; a transmission angle far from 90 deg is equally bad on either side.
FORMULAS = {
    "transmission_angle_worst": {
        "formula": "min(transmission_angle_min, 180 - transmission_angle_max)",
        "unit": "deg",
    },
    "link_ratio": {"formula": f"max({', '.join(LENGTHS)}) / min({', '.join(LENGTHS)})", "unit": "1"},
}


@dataclass(frozen=True)
class FourBarBounds:
    """Bounds on four-bars.

    Attributes
    ----------
    transmission_angle_min
        Of the least transmission angle or its supplement over the turn, deg.
    link_ratio_max
        Of the longest link over the shortest.
    """

    transmission_angle_min: float
    link_ratio_max: float

    @staticmethod
    def read(bounds: SectionReader) -> FourBarBounds:
        """Read both; a mistake is noted."""
        return FourBarBounds(
            bounds.number("transmission_angle_min", "deg", default=20.0, least=0.0, below=90.0),
            bounds.number("link_ratio_max", "1", default=10.0, above=1.0),
        )

    @property
    def angle(self) -> float:
        """The bound on the transmission angle, rad."""
        return float(np.radians(self.transmission_angle_min))

    @property
    def constraints(self) -> Mapping[str, Mapping[str, float]]:
        """The bounds as constraints of a study."""
        return {
            "transmission_angle_worst": {"min": self.transmission_angle_min},
            "link_ratio": {"max": self.link_ratio_max},
        }
