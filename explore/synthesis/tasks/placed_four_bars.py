"""Candidates that are four-bars at their place in the plane, with a point of the coupler, and how they pass places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.columns import Arrays, Column
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.defects import PASSES, SENTENCES
from explore.synthesis.linkages import FourBar
from explore.synthesis.slider_cranks import SliderCrank
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
#: Name of the point.
POINT = "M"
#: Parameters of the candidates.
PARAMETERS = (
    *LENGTHS, "branch", f"{POINT}_along", f"{POINT}_across", "crank_pivot_x", "crank_pivot_y", "ground_angle",
)  # fmt: skip
#: Column with the number of a cognate.
_COGNATE = Column("cognate", "", "0: as found; 1, 2: its cognates, which draw the same path", "bookkeeping", "|i1")
#: Column with the fate of a linkage.
PASSAGE = Column(
    "passage", "", "whether the crank takes the point through all points in their order", "bookkeeping", "|i1",
    dict(enumerate(SENTENCES)),
)  # fmt: skip
#: Column that tells proved linkages.
_PROVED = Column("proved", "", "whether it is proved to exist", "bookkeeping", "|i1", {0: "not_proved", 1: "proved"})
#: Columns of the distances at crank angles that a task gives.
TIMED = (
    Column("timed_error_rms", "mm", "rms distance of the points to the path at their crank angles", "metric"),
    Column("timed_error_max", "mm", "largest distance of a point to the path at its crank angle", "metric"),
)


@dataclass(frozen=True)
class FourBarBounds:
    """Bounds: least transmission angle or its supplement over the turn, deg, and the longest link over the shortest."""

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


@dataclass(frozen=True)
class PlacedFourBar:
    """A four-bar, in mm, with a point that passes places of a task.

    The number of its solution, from 1, and of its cognate, 0 for the linkage as found; how it passes the places, a fate
    of `explore.synthesis.defects`; whether it is proved to exist, None where nothing is said of it. `timed_errors` are
    the rms and the largest distance of places with crank angles to the point at these, mm; None for none.
    """

    linkage: FourBar
    solution: int
    cognate: int
    fate: str
    is_proved: bool | None = None
    timed_errors: tuple[float, float] | None = None


def read_passage(bounds: SectionReader) -> Mapping[str, Mapping[str, float]]:
    """The constraint that the places are passed in one motion and in order, unless that is only to be reported."""
    word = bounds.word("passage", ("required", "reported"), "required")
    return {PASSAGE.name: {"max": float(list(SENTENCES).index(PASSES))}} if word == "required" else {}


def parameters_of(linkages: Sequence[FourBar]) -> Arrays:
    """The values of `PARAMETERS` by name, each of shape (n,)."""
    grounds = np.array([each.rocker_pivot - each.crank_pivot for each in linkages])
    return placed(linkages, (*LENGTHS, "branch"), [each.coupler for each in linkages], np.degrees(np.angle(grounds)))


def placed(
    linkages: Sequence[FourBar | SliderCrank], names: Sequence[str], links: Sequence[float], angles: npt.ArrayLike
) -> Arrays:
    """Columns of these names, of the point on links of these lengths, of the crank's pivot and the ground's angles."""
    arms = [linkage.point * link for linkage, link in zip(linkages, links, strict=True)]
    columns: dict[str, npt.ArrayLike] = {
        **{name: [getattr(linkage, name) for linkage in linkages] for name in names},
        f"{POINT}_along": [arm.real for arm in arms],
        f"{POINT}_across": [arm.imag for arm in arms],
        "crank_pivot_x": [linkage.crank_pivot.real for linkage in linkages],
        "crank_pivot_y": [linkage.crank_pivot.imag for linkage in linkages],
        "ground_angle": angles,
    }
    return {name: np.array(column, dtype=np.float64) for name, column in columns.items()}


def passage_codes(fates: Sequence[str]) -> npt.NDArray[np.int8]:
    """The values of `PASSAGE` for fates of `explore.synthesis.defects`, shape (n,)."""
    return np.array([list(SENTENCES).index(fate) for fate in fates], dtype=np.int8)


def candidates_of(found: Sequence[PlacedFourBar], tried: Sequence[str]) -> Candidates:
    """Four-bars as candidates, in their order; `tried` says what was searched."""
    values = {
        "solution": np.array([each.solution for each in found]),
        "cognate": np.array([each.cognate for each in found]),
        "passage": passage_codes([each.fate for each in found]),
    }
    added = [SOLUTION, _COGNATE, PASSAGE]
    if any(each.is_proved is not None for each in found):
        added.append(_PROVED)
        values["proved"] = np.array([bool(each.is_proved) for each in found])
    if any(each.timed_errors is not None for each in found):
        added += TIMED
        errors = np.array([each.timed_errors or (np.nan, np.nan) for each in found])
        values |= {column.name: errors[:, k] for k, column in enumerate(TIMED)}
    return Candidates(
        parameters=parameters_of([each.linkage for each in found]),
        added=tuple(added),
        values=values,
        tried=tuple(tried),
        sentences=SENTENCES,
    )
