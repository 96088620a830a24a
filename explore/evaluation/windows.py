"""Windows of a request as numbers for the compiled loop, and the positions of their ends."""

import math
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from explore.evaluation.quadrature.integrals import HALF_TURN
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    FIRST,
    LAST,
    PANEL_CAPACITY,
    PANELS_SIZE,
    SINGULAR,
    map_panels,
)
from explore.evaluation.quadrature.windows import ARC, INTERVAL, LONGER, SHORTER, TURN, add_interval, add_window
from explore.model.mechanism import Mechanism
from explore.model.quadrature import MOST_SINGULARITIES
from explore.model.quantities import FloatArray
from explore.model.window import Window


def specify_window(mechanism: Mechanism, window: Window, drive: str) -> tuple[int, ...]:
    """Columns KIND … of `explore.evaluation.quadrature.loop`; `drive` is the stroke that the window "drive" is."""
    clutch = (0, -1, -1, -1, 0)
    if window.kind == "turn":
        return (TURN, -1, -1, *clutch)
    if window.kind == "interval":
        return (INTERVAL, -1, -1, *clutch)
    if window.kind == "arc":
        return (ARC, *_rows(mechanism, window), *clutch)
    first, second = (mechanism.window(name) for name in mechanism.strokes)
    if window.kind == "clutch":
        rate = next(signal for signal in mechanism.signals if signal.name == mechanism.output_signals[window.name])
        rate_of_change = mechanism.derivative(rate) or rate  # every declaration with clutches has one
        needs = rate.needs | rate_of_change.needs
        clutch = (1, mechanism.phases_row, rate.row, rate_of_change.row, needs)
    is_return = window.kind == "return"
    if drive in ("slow", "fast"):
        kind = LONGER if (drive == "slow") != is_return else SHORTER
        return (kind, *_rows(mechanism, first), *clutch)
    stroke = first if (drive == first.name) != is_return else second
    return (ARC, *_rows(mechanism, stroke), *clutch)


def _rows(mechanism: Mechanism, window: Window) -> tuple[int, int]:
    """Rows of the constants that hold the ends of an arc."""
    start, stop = window.ends
    return mechanism.marks[start], mechanism.marks[stop]


def interval_place(mechanism: Mechanism, window: Window) -> tuple[int, float, float]:
    """The anchor (0) or its opposite (1) beside the start of an explicit interval, the start from there, the length.

    Both are in rad and rounded once, from the exact ends; of no use for other windows.
    """
    from_anchor = window.start - Fraction(math.degrees(mechanism.anchor_angle))
    half_turns = round(from_anchor / 180)
    return half_turns % 2, math.radians(from_anchor - 180 * half_turns), math.radians(window.length)


def interval_half_tangents(mechanism: Mechanism, window: Window) -> tuple[float, float]:
    """The half-tangents of the ends of an explicit interval, each as exact beside half a turn as beside the anchor."""
    tangents = []
    for end in (window.start, window.stop):
        from_anchor = end - Fraction(math.degrees(mechanism.anchor_angle))
        half_turns = round(from_anchor / 180)
        tangent = math.tan(0.5 * math.radians(from_anchor - 180 * half_turns))
        if half_turns % 2:
            tangent = -1.0 / tangent if tangent else -HALF_TURN if end == window.start else HALF_TURN
        tangents.append(tangent)
    return tangents[0], tangents[1]


def map_window(mechanism: Mechanism, constants: FloatArray, window: Window, drive: str) -> list[FloatArray]:
    """Panels (r, p) of a window of each of n designs with constants (k, n), in the direction of the motion.

    See `explore.evaluation.quadrature.panels` for the rows.
    """
    kind, start_row, stop_row, *_ = specify_window(mechanism, window, drive)
    breaks = np.array([mechanism.marks[name] for name in mechanism.breaks], dtype=np.int64)
    anchors = np.full(MOST_SINGULARITIES, -1, dtype=np.int64)
    anchors[: len(mechanism.singularities)] = [anchor for _, anchor in mechanism.singularities]
    panels = np.zeros(PANELS_SIZE)
    result = []
    for design in constants.T:
        if kind == INTERVAL:
            count = add_interval(panels, 0, *interval_place(mechanism, window), design[breaks], len(breaks))
        else:
            start, stop = (0.0, 0.0) if start_row < 0 else design[[start_row, stop_row]]
            count = add_window(panels, 0, kind, start, stop, design[breaks], len(breaks))
        for k, (row, _) in enumerate(mechanism.singularities):
            panels[SINGULAR + k * PANEL_CAPACITY : SINGULAR + k * PANEL_CAPACITY + count] = design[row]
        map_panels(panels, count, anchors)
        result.append(panels.reshape(-1, PANEL_CAPACITY)[:, :count].copy())
    return result


def window_ends(mechanism: Mechanism, constants: FloatArray, window: Window, drive: str) -> npt.NDArray[np.float64]:
    """First and last input angle of a window, rad, ascending, shape (n, 2); see `map_window`."""
    ends = []
    for panels in map_window(mechanism, constants, window, drive):
        anchor, first, last = (panels[row // PANEL_CAPACITY] for row in (ANCHOR, FIRST, LAST))
        start = mechanism.anchor_angle + np.pi * anchor[0] + 2.0 * np.arctan(first[0])
        length = 2.0 * np.sum(np.arctan(last) - np.arctan(first))
        ends.append((start, start + length))
    return np.array(ends).reshape(-1, 2)


def find_laws(mechanism: Mechanism, constants: FloatArray, angles: FloatArray) -> npt.NDArray[np.int64]:
    """Number of the law that holds at each input angle (rad) of one design: that of the break before it."""
    if not mechanism.breaks:
        return np.zeros(len(angles), dtype=np.int64)
    marks = constants[[mechanism.marks[name] for name in mechanism.breaks]]
    positions = mechanism.anchor_angle + 2.0 * np.arctan(marks)
    offsets = np.remainder(positions - positions[0], 2.0 * np.pi)
    laws = np.searchsorted(offsets, np.remainder(angles - positions[0], 2.0 * np.pi), side="right") - 1
    return np.asarray(np.clip(laws, 0, None), dtype=np.int64)
