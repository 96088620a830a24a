"""Metrics of every linkage: strokes of its output, transmission angles, size, and where it assembles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.expressions import evaluate_coordinate
from explore.mechanisms.linkages.load_signals import load_formulas
from explore.mechanisms.linkages.reaches import MOST_REACHES
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.overall_size import declare_size
from explore.model.quantities import FloatArray, Formula, Metric, Signal

_JOINTS = "all joints assemble"
#: Names of the metrics of the intervals of crank angles at which a linkage assembles.
REACH_NAMES = (
    "assembly_intervals",
    *(f"assembles_{end}_{k}" for k in range(1, MOST_REACHES + 1) for end in ("from", "to")),
)
#: Closed-form metrics, in the order of their rows.
CLOSED_METRICS = (
    Metric("time_ratio", "1", "time ratio: longer crank interval over shorter", lower=1.0, needs_stroke=True),
    Metric(REACH_NAMES[0], "1", f"number of intervals of crank angles at which {_JOINTS}", lower=0.0),
    *(
        Metric(
            name,
            "deg",
            f"{'end' if '_to_' in name else 'start'} of interval {name[-1]} at which {_JOINTS}",
            is_partial=name[-1] != "1",
        )
        for name in REACH_NAMES[1:]
    ),
)


def declare_formulas(
    table: LinkageTable, signals: Sequence[Signal], output: str, axis: str, window: str
) -> tuple[Formula, ...]:
    """The derived metrics over the window of the whole motion.

    `output` is a link or a slot, or a point whose place along an axis counts.
    """
    names = [signal.name for signal in signals]
    motion = (*_transmission_angle(names, window), *_stroke(names, output, axis, window), *_size(table, window))
    return (*motion, *load_formulas(table, window))


def _transmission_angle(names: Sequence[str], window: str) -> tuple[Formula, ...]:
    """The smallest transmission angle over all joints and the motion, each folded to at most 90 deg."""
    joints = [name for name in names if name.endswith("_transmission_angle")]
    if not joints:
        return ()
    words = "turn" if window == "cycle" else window
    return (
        Formula(
            "transmission_angle_min",
            "deg",
            f"smallest transmission angle of all joints over the {words}, or its supplement if that is smaller",
            "max",
            tuple(f"{joint}_{extreme}_{window}" for joint in joints for extreme in ("min", "max")),
            _fold,
            selects_one=True,
            is_folded=True,
        ),
    )


def _fold(*extremes: FloatArray) -> FloatArray:
    """The least of all minima and of 180 deg less each maximum."""
    smallest = np.minimum.reduce(extremes[::2])
    return np.asarray(np.minimum(smallest, 180.0 - np.maximum.reduce(extremes[1::2])))


def _stroke(names: Sequence[str], output: str, axis: str, window: str) -> tuple[Formula, ...]:
    """How far the output moves: the swing of a link, or the stroke of a slot or a point."""
    swings = f"{output}_angle" in names
    place = f"{output}_angle" if swings else f"{output}{axis or '_position'}"
    name, unit, words = ("swing_angle", "deg", "swing") if swings else ("stroke", "mm", "stroke")
    inputs = (f"{place}_peak_to_peak_{window}",)
    return (Formula(name, unit, f"{words} of the output", "max", inputs, np.positive, selects_one=True),)


def _size(table: LinkageTable, window: str) -> tuple[Formula, ...]:
    """The box around all positions of all points, along the axes of the frame."""
    fixed = dict(table.frame.points)
    moving = [point for point in table.points if point not in fixed]
    names = tuple(parameter.name for parameter in table.parameters if parameter.name in table.moving_names)
    inputs = (
        *names,
        *(f"{point}_{axis}_{end}_{window}" for point in moving for axis in ("x", "y") for end in ("min", "max")),
    )  # fmt: skip

    width, height = (_Side(tuple(place[axis] for place in fixed.values()), names, axis) for axis in (0, 1))
    return declare_size("the frame's x axis", inputs, width, height)


@dataclass(frozen=True)
class _Side:
    """The extent of all points along an axis.

    Its arguments are the parameters of these names, on which the places of the points of the frame depend, then least
    and greatest x and y of the moving points.
    """

    places: tuple[Coordinate, ...]
    parameters: tuple[str, ...]
    axis: int

    def __call__(self, *columns: FloatArray) -> FloatArray:
        given, extremes = dict(zip(self.parameters, columns, strict=False)), columns[len(self.parameters) :]
        fixed = [evaluate_coordinate(place, given) for place in self.places]
        least = np.broadcast_arrays(*extremes[2 * self.axis :: 4], *fixed)
        greatest = np.broadcast_arrays(*extremes[2 * self.axis + 1 :: 4], *fixed)
        return np.asarray(np.maximum.reduce(greatest) - np.minimum.reduce(least))
