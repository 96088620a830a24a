"""Metrics of targets: a compiled function measures designs at once, and each metric is a row of its measures."""

import functools
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from explore.model.quantities import FloatArray

#: Measures of designs, shape (n, k), then their input angles from the frame at the places of a target, rad, (n, m).
Measures = tuple[FloatArray, ...]


class Motion(Protocol):
    """What of a mechanism is to meet a target: a compiled function of its motion, and the designs that this takes."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of parameters and metrics that the shapes of designs follow from."""

    @property
    def needs_turn(self) -> bool:
        """Whether designs whose crank does not turn fully have no motion."""

    def function(self) -> Any:
        """The compiled function, of the signature of `mechanisms.targets.path_errors.curve`."""

    def function_of_rows(self) -> Any:
        """The same for many angles at once."""

    def shapes(self, inputs: FloatArray) -> FloatArray:
        """What the function takes of designs, (n, k), from their inputs, (n, p); NaN first where there is no motion."""


@dataclass(frozen=True)
class TargetMeasure:
    """A measure of designs against a target, a function of the inputs of a motion and of the parameters of the target.

    `measures` is a function of a module that `keep_last` decorates. The row is the number among the measures, and the
    unit what it is multiplied by.
    """

    measures: Callable[[Motion, Any, tuple[FloatArray, ...]], Measures]
    motion: Motion
    target: Any
    row: int
    unit: float = 1.0

    def __call__(self, *columns: FloatArray) -> FloatArray:
        """Measure designs, whose inputs are columns of shape (n,)."""
        return self.measures(self.motion, self.target, columns)[0][:, self.row] * self.unit


@dataclass(frozen=True)
class ConstantScale:
    """What errors are relative to, the same of all designs: a radian of angles, a turn of spans."""

    value: float

    def __call__(self, first: FloatArray, *_: FloatArray) -> FloatArray:
        """The scale of designs, whose inputs are columns of shape (n,)."""
        return np.full(np.shape(first), self.value)


def keep_last(
    measure: Callable[[Motion, Any, FloatArray], Measures],
) -> Callable[[Motion, Any, tuple[FloatArray, ...]], Measures]:
    """Measure columns by a function of a table, (n, p), once for all metrics of a block, which ask for the same.

    Each thread keeps what it measured last: threads take turns at blocks of their own.
    """
    kept = threading.local()

    @functools.wraps(measure)
    def measures(motion: Motion, target: Any, columns: tuple[FloatArray, ...]) -> Measures:
        last: tuple[Motion, Any, FloatArray, Measures] | None = getattr(kept, "last", None)
        table = np.column_stack(np.broadcast_arrays(*columns)).astype(np.float64)
        if not last or last[:2] != (motion, target) or not np.array_equal(last[2], table, equal_nan=True):
            last = kept.last = motion, target, table, measure(motion, target, table)
        return last[3]

    return measures


def shapes_and_rest(motion: Motion, table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The shapes of designs, (n, k), and their parameters of the target, (n, q), from a table of their inputs."""
    count = len(motion.inputs)
    return motion.shapes(table[:, :count]), table[:, count:]
