"""One design of results, simulated for a figure."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.columns import choose_design, study_name
from explore.cli.output import compiled_kernels, number

if TYPE_CHECKING:
    import pandas as pd

    from explore.store.results import Results


@dataclass(frozen=True)
class Simulated:
    """A design, its motion over a turn, and the crank angles (deg) of its drive stroke and its limit positions."""

    title: str
    parameters: dict[str, float]
    motion: pd.DataFrame
    drive: tuple[float, float] | None
    limits: dict[str, float]

    @property
    def phases(self) -> int:
        """Number of linkages that share the output."""
        return int(self.parameters.get("phases", 1))


def simulated_design(results: Results, design: int | None) -> Simulated:
    """The design asked for or the best one, with the drive stroke of its study.

    Raises
    ------
    MotionError
        If it cannot make a full turn.
    """
    with compiled_kernels():
        from explore.api import simulate
        from explore.charts.motion import crank_angles
        from explore.motions import window_limits
        from explore.request.requests import find_mechanism
    chosen = choose_design(results, design)
    row = results.design(chosen)
    mechanism = find_mechanism(str(results.attributes["mechanism"]))
    parameters = {p.name: float(row[p.name]) if p.name in row else p.default for p in mechanism.parameters}
    known = {name: value for name, value in parameters.items() if value is not None}
    motion = simulate(mechanism.name, angles=crank_angles(), method="auto", tolerance=1e-9, **known)
    columns = {name: np.array([value]) for name, value in known.items()}
    wanted = json.loads(str(results.attributes["determines"]))["evaluate"]["drive"]
    clutched = any(window.name == "drive" for window in mechanism.windows)
    drive = window_limits(mechanism, columns, "drive", wanted) if clutched else None
    ends = window_limits(mechanism, columns, "overlapped_to_extended", wanted)
    limits = dict(zip(("overlapped", "extended"), ends, strict=True)) if ends else {}
    values = ", ".join(f"{p.name} {number(known[p.name])} {p.unit}" for p in mechanism.parameters if p.name in row)
    title = f"{study_name(results)}, design {chosen:,}: {values}"
    return Simulated(title, known, motion, drive, limits)
