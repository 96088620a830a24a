"""One design of results, simulated over a turn for the figures of a single design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from explore.api import simulate
from explore.charts.bounds import SignalBound, signal_bounds, uses_clutch
from explore.charts.labels import results_name
from explore.charts.queries import choose_design
from explore.charts.turn import crank_angles
from explore.errors import RequestError, ResultsError
from explore.model.mechanism import Mechanism
from explore.motions import window_limits
from explore.request.names import find_mechanism
from explore.suggest import format_value

if TYPE_CHECKING:
    import pandas as pd

    from explore.store.results import Results


@dataclass(frozen=True)
class SimulatedDesign:
    """The motion of one design over a turn, and what its study defines on it.

    Attributes
    ----------
    motion
        Signals at crank angles of one turn, from `explore.simulate`.
    parameters
        Parameters of the design, in declared units, defaults included.
    title
        Study, number and parameters of the design.
    limits
        Crank angles of the limit positions by name, deg; empty where the output turns fully.
    drive
        First and last crank angle of the drive stroke, deg, the last the larger; None without strokes, or where the
        study uses no clutches.
    phases
        Number of linkages that share the output through one-way clutches; None where the study uses no clutches.
    bounds
        Bounds of the study on signals, at the crank angles where they hold for this design.
    """

    motion: pd.DataFrame
    parameters: Mapping[str, float]
    title: str = ""
    limits: Mapping[str, float] = field(default_factory=dict)
    drive: tuple[float, float] | None = None
    phases: int | None = None
    bounds: Sequence[SignalBound] = ()


def simulate_design(results: Results, design: int | None = None) -> SimulatedDesign:
    """Simulate one design of results, with the drive stroke of its study.

    Parameters
    ----------
    results
        The results of a sweep, finished or not.
    design
        Number of the design; the best of the Pareto set unless given.

    Raises
    ------
    MotionError
        If the crank cannot make a full turn.
    RequestError
        If no number is given and no design is feasible, or the mechanism has no rocker.
    ResultsError
        If the design is not in the file, or the window of the study cannot be read.
    """
    mechanism = find_mechanism(results.mechanism)
    if "rocker_angle" not in {signal.name for signal in mechanism.signals}:
        raise RequestError(
            f"a {mechanism.name} has no rocker, which this figure shows; `explore simulate` gives its motion"
        )
    chosen = choose_design(results, design)
    row = results.design(chosen)
    values = {p.name: float(row[p.name]) if p.name in row else p.default for p in mechanism.parameters}
    parameters = {name: value for name, value in values.items() if value is not None}
    motion = simulate(mechanism.name, parameters, angles=crank_angles())
    strokes = _Strokes(mechanism, parameters, _drive_name(results, mechanism))
    clutched = uses_clutch(results) and any(window.name == "drive" for window in mechanism.windows)
    ends = strokes.limits("overlapped_to_extended")
    swept = ", ".join(f"{p.name} {parameters[p.name]:.6g} {p.unit}" for p in mechanism.parameters if p.name in row)
    return SimulatedDesign(
        motion,
        parameters,
        title=f"{results_name(results)}, design {chosen:,}: {swept}",
        limits=dict(zip(("overlapped", "extended"), ends, strict=True)) if ends else {},
        drive=strokes.limits("drive") if clutched else None,
        phases=int(parameters.get("phases", 1)) if clutched else None,
        bounds=strokes.located(signal_bounds(results, mechanism)),
    )


def _drive_name(results: Results, mechanism: Mechanism) -> str:
    name = results.drive
    if mechanism.drives and name not in mechanism.drives:
        raise ResultsError(f"{results.path} is damaged: a {mechanism.name} has no drive stroke {format_value(name)}")
    return name


@dataclass(frozen=True)
class _Strokes:
    """The strokes of one design."""

    mechanism: Mechanism
    parameters: Mapping[str, float]
    drive: str

    def limits(self, window: str) -> tuple[float, float] | None:
        """First and last crank angle of a stroke, deg; None when the output has no strokes."""
        columns = {name: np.array([value]) for name, value in self.parameters.items()}
        return window_limits(self.mechanism, columns, window, self.drive)

    def located(self, bounds: Sequence[SignalBound]) -> list[SignalBound]:
        """The bounds with the crank angles of this design; those on strokes that it does not have are left out."""
        spans = [self.limits(bound.stroke) if bound.stroke else bound.span for bound in bounds]
        return [replace(bound, span=span) for bound, span in zip(bounds, spans, strict=True) if span]
