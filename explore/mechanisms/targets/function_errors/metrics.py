"""The metrics of a function as a target: a mechanism gives the angle of its output, everything else is here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from explore.mechanisms.targets.function_errors.measuring import LARGEST, N_MEASURES, RMS, STARTS_SIZE, measure_outputs
from explore.model.quantities import FloatArray, Formula
from explore.model.targets import STARTS, FunctionTarget, TargetKind

#: Gives the compiled output of a mechanism.
FindOutput = Callable[[], Any]

_ABOUT = {
    "output_error_rms": ("root mean square error of the {}'s angle over the pairs of the target", RMS),
    "output_error_max": ("largest error of the {}'s angle at the pairs of the target", LARGEST),
}


@dataclass(frozen=True)
class OutputMeasure:
    """A measure of designs against a function, of their parameters.

    Attributes
    ----------
    output
        Gives the compiled output of the mechanism: a function of a module, so that a worker finds it by name.
    target
        The function.
    row
        Number among the measures.
    """

    output: FindOutput
    target: FunctionTarget
    row: int

    def __call__(self, *columns: FloatArray) -> FloatArray:
        """Measure designs, deg: their shape, then the angles of crank and output at the start, deg."""
        return np.degrees(_measures_of(self.output, self.target, columns)[:, self.row])


class _Last:
    """The last measures: both metrics of a block ask for the same."""

    found: tuple[FindOutput, FunctionTarget, FloatArray, FloatArray] | None = None


def _measures_of(output: FindOutput, target: FunctionTarget, columns: tuple[FloatArray, ...]) -> FloatArray:
    """Measures of designs, shape (n, N_MEASURES)."""
    designs = np.ascontiguousarray(np.column_stack(np.broadcast_arrays(*columns)), dtype=np.float64)
    designs[:, -STARTS_SIZE:] = np.radians(designs[:, -STARTS_SIZE:])
    last = _Last.found
    if last and last[:2] == (output, target) and np.array_equal(last[2], designs, equal_nan=True):
        return last[3]
    measures = np.empty((len(designs), N_MEASURES))
    measure_outputs(output(), designs, *_arrays(target), measures)
    _Last.found = output, target, designs, measures
    return measures


@lru_cache(maxsize=8)
def _arrays(target: FunctionTarget) -> tuple[FloatArray, FloatArray]:
    """What input and output have turned, rad."""
    inputs, outputs = np.radians(np.array(target.table, dtype=np.float64)).T
    return np.ascontiguousarray(inputs), np.ascontiguousarray(outputs)


def declare_functions(output: FindOutput, name: str, shape: tuple[str, ...], objectives: tuple[str, ...]) -> TargetKind:
    """Declare that the output of a mechanism can follow functions of its input.

    Parameters
    ----------
    output
        Gives the compiled output, of the signature `mechanisms.targets.function_errors.measuring.OUTPUT_SIGNATURE`.
    name
        Name of the link that is the output.
    shape
        Names of the parameters that it takes.
    objectives
        Default objectives of a study with a function.
    """
    return TargetKind(FunctionFormulas(output, name, shape), tuple(_ABOUT), objectives, STARTS)


@dataclass(frozen=True)
class FunctionFormulas:
    """The metrics of a function as the target of a mechanism; see `declare_functions`."""

    output: FindOutput
    name: str
    shape: tuple[str, ...]

    def __call__(self, target: FunctionTarget) -> tuple[Formula, ...]:
        """The metrics of the error of a target."""
        inputs = (*self.shape, *(parameter.name for parameter in STARTS))
        return tuple(
            Formula(name, "deg", about.format(self.name), "min", inputs, OutputMeasure(self.output, target, row))
            for name, (about, row) in _ABOUT.items()
        )
