"""The metrics of a function as a target: a mechanism gives the angle of its output, everything else is here."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from explore.mechanisms.targets.function_errors.measuring import (
    LARGEST,
    LARGEST_ROUNDING,
    N_MEASURES,
    RMS,
    RMS_ROUNDING,
    measure_outputs,
)
from explore.mechanisms.targets.measures import (
    ConstantScale,
    Measures,
    Motion,
    TargetMeasure,
    keep_last,
    shapes_and_rest,
)
from explore.model.quantities import FloatArray, Formula
from explore.model.target_kinds import STARTS, TargetKind
from explore.model.targets import FunctionTarget

_DEGREES = 180.0 / np.pi
_ABOUT = {
    "output_error_rms": ("root mean square error of the {}'s angle over the pairs of the target", RMS, RMS_ROUNDING),
    "output_error_max": ("largest error of the {}'s angle at the pairs of the target", LARGEST, LARGEST_ROUNDING),
}


@keep_last
def _measure_functions(motion: Motion, target: FunctionTarget, table: FloatArray) -> Measures:
    """Measures, shape (n, N_MEASURES), of designs: inputs of the motion, then both angles at the start."""
    shapes, starts = shapes_and_rest(motion, table)
    designs = np.hstack([shapes, np.radians(starts)])
    measures = np.empty((len(designs), N_MEASURES))
    measure_outputs(motion.function(), designs, *_arrays(target), measures)
    return (measures,)


@lru_cache(maxsize=8)
def _arrays(target: FunctionTarget) -> tuple[FloatArray, FloatArray]:
    """What input and output have turned, rad."""
    inputs, outputs = np.radians(np.array(target.table, dtype=np.float64)).T
    return np.ascontiguousarray(inputs), np.ascontiguousarray(outputs)


def declare_functions(motion: Motion, name: str, objectives: tuple[str, ...]) -> TargetKind:
    """Declare that the output of a mechanism, the link `name`, can follow functions of its input.

    The function of the motion is what `mechanisms.targets.function_errors.measuring.measure_outputs` takes;
    `objectives` are the default ones of a study with a function.
    """
    return TargetKind(FunctionFormulas(motion, name), tuple(_ABOUT), objectives, STARTS)


@dataclass(frozen=True)
class FunctionFormulas:
    """The metrics of a function as the target of a mechanism; see `declare_functions`."""

    motion: Motion
    name: str

    def __call__(self, target: FunctionTarget) -> tuple[Formula, ...]:
        """The metrics of the error of a target."""
        inputs = (*self.motion.inputs, *(parameter.name for parameter in STARTS))

        def measure(row: int) -> TargetMeasure:
            return TargetMeasure(_measure_functions, self.motion, target, row, _DEGREES)

        return tuple(
            Formula(name, "deg", about.format(self.name), "min", inputs, measure(row), rounding=measure(rounding),
                    scale=ConstantScale(_DEGREES), needs_turn=self.motion.needs_turn)
            for name, (about, row, rounding) in _ABOUT.items()
        )  # fmt: skip
