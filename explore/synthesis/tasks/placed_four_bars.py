"""Candidates that are four-bars at their place in the plane, with a point of the coupler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explore.model.columns import Column
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.defects import SENTENCES
from explore.synthesis.linkages import FourBar
from explore.synthesis.tasks.four_bars import LENGTHS

#: Name of the point, and of the parameters of the candidates.
POINT = "M"
PARAMETERS = (
    *LENGTHS, "branch", f"{POINT}_along", f"{POINT}_across", "crank_pivot_x", "crank_pivot_y", "ground_angle",
)  # fmt: skip
_COGNATE = Column("cognate", "", "0: as found; 1, 2: its cognates, which draw the same path", "bookkeeping", "|i1")
_PASSAGE = Column(
    "passage", "", "whether the crank takes the point through all points in their order", "bookkeeping", "|i1",
    dict(enumerate(SENTENCES)),
)  # fmt: skip
_PROVED = Column("proved", "", "whether it is proved to exist", "bookkeeping", "|i1", {0: "not_proved", 1: "proved"})
_TIMED = (
    Column("timed_error_rms", "mm", "rms distance of the points to the path at their crank angles", "metric"),
    Column("timed_error_max", "mm", "largest distance of a point to the path at its crank angle", "metric"),
)


@dataclass(frozen=True)
class PlacedFourBar:
    """A four-bar with a point that passes places of a task.

    Attributes
    ----------
    linkage
        The four-bar, in mm.
    solution, cognate
        Number of the solution, from 1, and of its cognate: 0 for the linkage as found.
    fate
        How it passes the places: a fate of `explore.synthesis.defects`.
    is_proved
        Whether it is proved to exist; None where nothing is said of it.
    timed_errors
        The rms and the largest distance of places with crank angles to the point at these, mm; None for none.
    """

    linkage: FourBar
    solution: int
    cognate: int
    fate: str
    is_proved: bool | None = None
    timed_errors: tuple[float, float] | None = None


def candidates_of(found: Sequence[PlacedFourBar], tried: Sequence[str]) -> Candidates:
    """Four-bars as candidates, in their order; `tried` says what was searched."""
    linkages = [each.linkage for each in found]
    arms = [linkage.point * linkage.coupler for linkage in linkages]
    columns = {
        **{name: [getattr(linkage, name) for linkage in linkages] for name in (*LENGTHS, "branch")},
        f"{POINT}_along": [arm.real for arm in arms],
        f"{POINT}_across": [arm.imag for arm in arms],
        "crank_pivot_x": [linkage.crank_pivot.real for linkage in linkages],
        "crank_pivot_y": [linkage.crank_pivot.imag for linkage in linkages],
        "ground_angle": [float(np.degrees(np.angle(each.rocker_pivot - each.crank_pivot))) for each in linkages],
    }
    values = {
        "solution": np.array([each.solution for each in found]),
        "cognate": np.array([each.cognate for each in found]),
        "passage": np.array([list(SENTENCES).index(each.fate) for each in found]),
    }
    added = [SOLUTION, _COGNATE, _PASSAGE]
    if any(each.is_proved is not None for each in found):
        added.append(_PROVED)
        values["proved"] = np.array([bool(each.is_proved) for each in found])
    if any(each.timed_errors is not None for each in found):
        added += _TIMED
        errors = np.array([each.timed_errors or (np.nan, np.nan) for each in found])
        values |= {column.name: errors[:, k] for k, column in enumerate(_TIMED)}
    return Candidates(
        parameters={name: np.array(column, dtype=np.float64) for name, column in columns.items()},
        added=tuple(added),
        values=values,
        tried=tuple(tried),
        sentences=SENTENCES,
    )
