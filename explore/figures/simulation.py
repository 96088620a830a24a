"""One design of results, simulated over its motion for the figures of a single design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.base.units.shown import ShownUnits
from explore.figures.charts.bounds import SignalBound, drive_of, interval_of, signal_bounds, uses_drive_stroke
from explore.figures.charts.turn import TURN, Span
from explore.mechanisms.linkages.table import LinkageTable
from explore.model.drawing import PLACE, Drawing, Guide, Panel, Pose
from explore.model.mechanism import Mechanism
from explore.model.output_slider import TRAVEL, TRAVEL_PANEL, TRAVEL_SIGNAL, OutputSlider
from explore.model.points import coordinates
from explore.model.quantities import FloatArray, Signal
from explore.model.targets import DwellTarget, PathTarget, Target
from explore.results.labels import results_name
from explore.results.queries import choose_design
from explore.running.motions import mark_angles, motion_span, window_limits
from explore.running.public import simulate
from explore.studies.config.linkage import mechanism_of

if TYPE_CHECKING:
    import pandas as pd

    from explore.results.store.results import Results


@dataclass(frozen=True)
class SimulatedDesign:
    """The motion of one design, and what its study defines on it.

    Attributes
    ----------
    mechanism
        The declaration of its mechanism.
    parameters
        Parameters of the design, in declared units, defaults included.
    motion
        Signals at input angles of the span, from `explore.simulate`.
    title
        Study, number and parameters of the design.
    marks
        Input angles of the marks by name, deg; those of limit positions are absent where the output turns fully.
    drive
        First and last input angle of the drive stroke, deg, the last the larger; None without strokes, or where the
        study does not use it.
    phases
        Number of mechanisms that share the output through one-way clutches; None where there are no clutches, or the
        study does not use the drive stroke.
    bounds
        Bounds of the study on signals, at the input angles where they hold for this design.
    units
        Units that figures show; all values here are in declared units.
    dwell
        First and last input angle of the dwell that the study asks for, deg; None without one.
    slider
        The slider that the columns of its results tie to its point; None without one.
    span
        The input angles of the motion.
    """

    mechanism: Mechanism
    parameters: Mapping[str, float]
    motion: pd.DataFrame
    title: str = ""
    marks: Mapping[str, float] = field(default_factory=dict)
    drive: tuple[float, float] | None = None
    phases: int | None = None
    bounds: Sequence[SignalBound] = ()
    units: ShownUnits = field(default_factory=ShownUnits)
    dwell: tuple[float, float] | None = None
    slider: OutputSlider | None = None
    span: Span = TURN

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The signals of the mechanism, and the travel of the slider."""
        return (*self.mechanism.signals, *([TRAVEL_SIGNAL] if self.slider else []))

    @property
    def panels(self) -> tuple[Panel, ...]:
        """The panels of the mechanism, and that of the slider first."""
        return (*([TRAVEL_PANEL] if self.slider else []), *self.mechanism.declared_panels)

    def signal(self, name: str) -> Signal:
        """A signal by its name."""
        return TRAVEL_SIGNAL if name == TRAVEL and self.slider else self.mechanism.signal(name)

    @property
    def limits(self) -> dict[str, float]:
        """Input angles of the limit positions by name, deg, or the ends of a part of a turn; empty without any."""
        if not self.span.is_turn:
            return dict(zip(("first", "last"), self.span.ends, strict=True))
        names = [end for stroke in self.mechanism.strokes[:1] for end in self.mechanism.window(stroke).ends]
        return {name: angle for name, angle in self.marks.items() if name in names}

    @property
    def path(self) -> PathTarget | None:
        """The places that a point is to pass by the target of the study; None where there are none."""
        return self.mechanism.target.path if self.mechanism.target else None

    @property
    def drawing(self) -> Drawing | None:
        """The declared drawing, at the place of the design in its plane where its parameters say one."""
        drawing, place = self.mechanism.drawing, [self.parameters.get(name, 0.0) for name in PLACE]
        if drawing and self.slider:
            drawing = self.slider.drawn(drawing)
        if drawing and any(guide.follows_path for guide in drawing.guides):
            pose = self.pose()
            drawing = replace(drawing, guides=tuple(_with_angle(guide, drawing, pose) for guide in drawing.guides))
        return drawing.placed(*place) if drawing and any(place) else drawing

    def pose(self, input_angles: Sequence[float] | None = None) -> Pose:
        """The values that a drawing needs, at input angles in deg; by default those of the motion."""
        motion = self.motion
        if input_angles is not None:
            # The place in the plane is the drawing's, and the motion has no target.
            targets = [p.name for p in self.mechanism.parameters if p.affects == "target"]
            parameters = {name: value for name, value in self.parameters.items() if name not in targets}
            points = coordinates(self.mechanism.points, parameters)
            motion = simulate(self.mechanism.name, parameters, points=points, angles=input_angles)
        return self.pose_of({str(name): motion[name].to_numpy() for name in motion}, motion.index.to_numpy())

    def pose_of(self, signals: Mapping[str, FloatArray], input_angle: FloatArray) -> Pose:
        """The values that a drawing needs, of signals of the mechanism at input angles in deg."""
        pose = Pose.of(self.mechanism.signals, self.parameters, signals, input_angle)
        drawing = self.mechanism.drawing
        return self.slider.completed(pose, drawing) if self.slider and drawing else pose


def _with_angle(guide: Guide, drawing: Drawing, pose: Pose) -> Guide:
    """A guide with the direction of the path of its point, if it follows that."""
    if not guide.follows_path:
        return guide
    path = pose.sum(drawing.points[guide.point])
    ways = path - path[0]
    x, y = ways[int(np.argmax(np.hypot(*ways.T)))]
    return replace(guide, angle=float(np.rad2deg(np.arctan2(y, x))))


def drawing_of(simulated: SimulatedDesign) -> Drawing:
    """The drawing of a design; `RequestError` if its mechanism declares none."""
    if simulated.drawing is None:
        mechanism = simulated.mechanism
        reason = f"the mechanism '{mechanism.name}' declares no drawing"
        if isinstance(mechanism.table, LinkageTable):
            reason = f"{mechanism.in_words} has no drawing: a point of its frame is no sum of parameters times numbers"
        raise RequestError(f"{reason}; draw or export its motion instead")
    return simulated.drawing


def simulate_design(results: Results, design: int | None = None) -> SimulatedDesign:
    """Simulate one design of results, with the drive stroke of its study; arguments and errors as of `motion_chart`."""
    units, results = results.shown_units, results.declared
    mechanism = mechanism_of(results)
    chosen = choose_design(results, design)
    row = results.design(chosen)
    values = {p.name: float(row[p.name]) if p.name in row else p.default for p in mechanism.parameters}
    parameters = {name: value for name, value in values.items() if value is not None}
    columns = {name: np.array([value]) for name, value in parameters.items()}
    span = Span(*motion_span(mechanism, columns, interval_of(results, mechanism)))
    points, angles = coordinates(mechanism.points, parameters), span.densely(np.rad2deg(mechanism.anchor_angle))
    motion = simulate(mechanism.name, parameters, points=points, target=mechanism.target, angles=angles)
    limits = partial(window_limits, mechanism, columns, drive=drive_of(results, mechanism))
    bounds = [
        replace(bound, span=own)
        for bound in signal_bounds(results, mechanism)
        if (own := limits(bound.stroke) if bound.stroke else bound.span)
    ]
    uses_stroke = uses_drive_stroke(results, mechanism)
    swept = ", ".join(
        f"{name} {scale.show(parameters[name]):.6g} {'' if scale.shown == '1' else scale.shown}".rstrip()
        for name, scale in units.scales({p.name: p.unit for p in mechanism.parameters if p.name in row}).items()
    )
    simulated = SimulatedDesign(
        mechanism,
        parameters,
        motion,
        title=f"{results_name(results)}, design {chosen:,}: {swept}",
        marks=mark_angles(mechanism, columns) if span.is_turn else {},
        drive=limits("drive") if uses_stroke else None,
        phases=_count_phases(mechanism, parameters) if uses_stroke else None,
        bounds=bounds,
        units=units,
        dwell=_dwell_of(row, mechanism.target),
        span=span,
    )
    slider = OutputSlider.of(row, mechanism.points)
    return _with_slider(simulated, slider) if slider and mechanism.drawing else simulated


def _dwell_of(row: Mapping[str, object], target: Target | None) -> tuple[float, float] | None:
    if not isinstance(target, DwellTarget):
        return None
    start, angle = (float(str(row.get(name, np.nan))) for name in ("dwell_start", "dwell_angle"))
    stop = start + (target.angle or angle)
    return (start, stop) if np.isfinite(stop) else None


def _with_slider(simulated: SimulatedDesign, slider: OutputSlider) -> SimulatedDesign:
    """The design with a slider on the side on which it rests, its travel as a signal, and no strokes for clutches."""
    points = simulated.pose([slider.dwell[0]]).points(drawing_of(simulated))
    tied = replace(simulated, slider=slider.beside(points[slider.point][0]), drive=None, phases=None)
    return replace(tied, motion=tied.motion.assign(**{TRAVEL: tied.pose().lengths[TRAVEL]}))


def _count_phases(mechanism: Mechanism, parameters: Mapping[str, float]) -> int | None:
    """The number of mechanisms behind clutches; None where there are no clutches."""
    if mechanism.phases_row < 0:
        return None
    column = np.array([[parameters[parameter.name]] for parameter in mechanism.kernel_parameters])
    return int(mechanism.constants(column)[mechanism.phases_row, 0])
