"""Why designs are infeasible, in words and hatches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.model.status import Status
from explore.results.store.results import Results

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.patches import Patch

#: Hatches of regions in turn; pale and dense alternate, so that neighbours differ in more than direction.
_HATCHES = ("///", "\\\\\\\\", "...", "xxx", "--", "||", "oo", "++")
#: Background colours of regions in turn.
_TINTS = ("#e3e6ea", "#fbe3d3", "#dcecf7", "#f6e3ee", "#e0f1ea", "#fdf3d9", "#efe6df", "#ffffff")
#: Colour of the hatches, paler than the marks of feasible designs.
HATCH_COLOUR = "#a3abb3"
#: Designs whose constraints were checked.
_CHECKED = (int(Status.OK), int(Status.SCREENED))

#: Masks of designs, each of shape (n,), by the reason why they are infeasible.
ReasonMasks = dict[str, npt.NDArray[np.bool_]]


@dataclass(frozen=True)
class RegionStyle:
    """Colour and hatch of a region without feasible designs."""

    face: str
    hatch: str

    def legend_patch(self, label: str) -> Patch:
        """An entry of a legend."""
        from matplotlib.patches import Patch

        return Patch(facecolor=self.face, edgecolor=HATCH_COLOUR, hatch=self.hatch, lw=0, label=label)


def region_style(number: int) -> RegionStyle:
    """The style of the reason with this number; styles repeat after eight."""
    return RegionStyle(_TINTS[number % len(_TINTS)], _HATCHES[number % len(_HATCHES)])


def reason_columns(results: Results) -> list[str]:
    """Columns that `reason_masks` needs."""
    return ["feasible", "status", *(c.name for c in results.columns if c.role == "margin")]


def reason_masks(results: Results, frame: pd.DataFrame) -> ReasonMasks:
    """The infeasible designs by reason, such as "crank blocked" or "misses swing_angle"; a design may have several."""
    labels = next(c.labels for c in results.columns if c.name == "status")
    status = frame["status"].to_numpy()
    masks = {
        labels.get(int(code), f"status {code}").replace("_", " "): status == code
        for code in np.unique(status)
        if code not in _CHECKED
    }
    checked = np.isin(status, _CHECKED)
    for column in results.columns:
        if column.role == "margin":
            margin = frame[column.name].to_numpy()
            constraint = column.name.removesuffix("_margin")
            masks[f"misses {constraint}"] = checked & (margin < 0.0)
            masks[f"{constraint.replace('_', ' ')} undefined"] = (status == Status.OK) & np.isnan(margin)
    return {reason: mask for reason, mask in masks.items() if mask.any()}
