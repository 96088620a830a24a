"""Single input angles of many designs: the ends of a window and the angles where a signal has extremes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_

import numpy as np
import numpy.typing as npt

from explore.base.lanes.designs import fill_rows
from explore.evaluation.quadrature.windows import INTERVAL, LARGEST_TANGENT, TURN, orient_arcs
from explore.evaluation.windows import interval_place, specify_window
from explore.model.declaration import ANCHORS
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray, Signal
from explore.model.window import Window

#: Angle beyond the end of a window that counts as inside, because a signal is stationary at an extreme, rad.
_SAME = 1e-12


@dataclass(frozen=True)
class Position:
    """One angle of each design: half-tangents from the anchor (0) or its opposite (1), shape (d,)."""

    anchor: int
    tangents: FloatArray

    @property
    def angles(self) -> FloatArray:
        """The angles from the anchor, rad."""
        return np.asarray(np.pi * self.anchor + 2.0 * np.arctan(self.tangents))

    def sample(self, mechanism: Mechanism, constants: FloatArray, signal: Signal) -> FloatArray:
        """A signal at these angles for unit speed; NaN where an angle is too near the anchor's opposite to be told."""
        values = sample_signals(mechanism, constants, [signal], self.tangents[None], self.anchor)[0, 0]
        return np.where(np.abs(self.tangents) <= LARGEST_TANGENT, values, np.nan)


def sample_signals(
    mechanism: Mechanism, constants: FloatArray, signals: Sequence[Signal], tangents: FloatArray, anchor: int
) -> FloatArray:
    """Signals for unit speed, shape (t, m, d), at half-tangents (t, d) from an anchor."""
    values = np.empty((len(tangents), len(signals), tangents.shape[1]))
    fill_rows(
        mechanism.fill, constants, int(mechanism.n_fill_constants or mechanism.n_constants),
        np.ascontiguousarray(tangents), anchor, reduce(or_, (signal.needs for signal in signals)),
        mechanism.signal_rows, np.array([signal.row for signal in signals]), values,
    )  # fmt: skip
    return values


class WindowPositions:
    """The ends of a window of d designs, its length, rad, (d,), and the angles in it where a signal may have extremes.

    Over a full turn both ends are the anchor.
    """

    def __init__(self, mechanism: Mechanism, constants: FloatArray, window: Window, drive: str) -> None:
        self._mechanism, self._constants, self._count = mechanism, constants, constants.shape[1]
        kind, start_row, stop_row, *_ = specify_window(mechanism, window, drive)
        self._is_turn, self._end_rows = kind == TURN, (start_row, stop_row)
        if kind in (TURN, INTERVAL):
            anchor, start, length = interval_place(mechanism, window) if kind == INTERVAL else (0, 0.0, 2.0 * np.pi)
            self.start, self.stop = self._fixed(anchor, start), self._fixed(anchor, start + length)
            self.length = np.full(self._count, length)
        else:
            starts, stops = constants[start_row].copy(), constants[stop_row].copy()
            self.length = np.empty(self._count)
            orient_arcs(kind, starts, stops, self.length)
            self.start, self.stop = Position(0, starts), Position(0, stops)

    def candidates(self, signal: Signal) -> Iterator[tuple[Position, npt.NDArray[np.bool_]]]:
        """Angles among which a signal with declared `extremes_at` has its extremes, and whether each is inside."""
        everywhere = np.ones(self._count, dtype=np.bool_)
        if not self._is_turn:
            yield self.start, everywhere
            yield self.stop, everywhere
        for name in signal.extremes_at:
            row = self._mechanism.marks.get(name, -1)
            if row >= 0 and row in self._end_rows:
                continue
            position = Position(0, self._constants[row]) if row >= 0 else self._fixed(ANCHORS.index(name), 0.0)
            offset = np.remainder(position.angles - self.start.angles, 2.0 * np.pi)
            yield position, everywhere if self._is_turn else offset <= self.length + _SAME

    def _fixed(self, anchor: int, angle: float) -> Position:
        """The same angle of every design, given from an anchor, from the nearer one."""
        number = np.floor(angle / np.pi + 0.5)
        tangents = np.full(self._count, np.tan(0.5 * (angle - number * np.pi)))
        return Position(int((anchor + number) % 2), tangents)
