"""The metrics of a dwell as a target: a mechanism gives the place or angle of its output, everything else is here."""

from dataclasses import dataclass

import numpy as np

from explore.mechanisms.targets.dwell_errors.measuring import (
    BEGIN,
    BEGIN_ERROR,
    ERROR,
    N_MEASURES,
    SCALE,
    VALUE,
    measure_dwells,
)
from explore.mechanisms.targets.measures import ConstantScale, Measures, Motion, TargetMeasure, keep_last
from explore.model.quantities import FloatArray, Formula
from explore.model.target_kinds import TargetKind
from explore.model.targets import DwellTarget

_DEGREES = 180.0 / np.pi


@keep_last
def measure_dwell(motion: Motion, dwell: tuple[DwellTarget, bool], table: FloatArray) -> Measures:
    """Measures, shape (n, N_MEASURES), of designs, the inputs of the motion; a dwell with whether its output turns."""
    target, turns = dwell
    measures = np.empty((len(table), N_MEASURES))
    travel = target.travel / _DEGREES if turns else target.travel
    measure_dwells(motion.function_of_rows(), motion.shapes(table), turns, target.angle / _DEGREES, travel, measures)
    return (measures,)


def declare_dwells(motion: Motion, name: str, travel: str, objectives: tuple[str, ...], *, turns: bool) -> TargetKind:
    """Declare that the output of a mechanism, a link or slider with a name, can rest.

    The function of the motion is what `mechanisms.targets.dwell_errors.measuring.measure_dwells` takes; `travel` is the
    metric of what the output moves in a turn, and `objectives` are the default ones beside that of the dwell and this.
    The output of a link `turns`.
    """
    own = ("dwell_error", "dwell_angle")
    return TargetKind(
        DwellFormulas(motion, name, turns),
        (*own, "dwell_start", travel),
        (own[0], f"{own[1]}:max", f"{travel}:max", *objectives),
        parameters=(),
        alternatives=own,
    )


@dataclass(frozen=True)
class DwellFormulas:
    """The metrics of a dwell as the target of a mechanism; see `declare_dwells`."""

    motion: Motion
    name: str
    turns: bool

    def __call__(self, target: DwellTarget) -> tuple[Formula, ...]:
        """The travel in a dwell of an angle, or the angle of a dwell with a travel; and where the dwell starts."""
        inputs, unit, factor = self.motion.inputs, *(("deg", _DEGREES) if self.turns else ("mm", 1.0))

        def measure(row: int, per_unit: float) -> TargetMeasure:
            return TargetMeasure(measure_dwell, self.motion, (target, self.turns), row, per_unit)

        if target.angle:
            about = f"least travel of the {self.name} while the crank turns by the angle of the dwell"
            first = Formula("dwell_error", unit, about, "min", inputs, measure(VALUE, factor),
                            rounding=measure(ERROR, factor), scale=measure(SCALE, factor), needs_turn=True)  # fmt: skip
        else:
            about = f"longest turn of the crank in which the {self.name} moves by no more than the travel of the dwell"
            first = Formula("dwell_angle", "deg", about, "max", inputs, measure(VALUE, _DEGREES),
                            rounding=measure(ERROR, _DEGREES), scale=measure(SCALE, _DEGREES),
                            needs_turn=True)  # fmt: skip
        about = "crank angle at which the dwell starts, the middle of those that serve as well"
        return first, Formula("dwell_start", "deg", about, None, inputs, measure(BEGIN, _DEGREES),
                              rounding=measure(BEGIN_ERROR, _DEGREES), scale=ConstantScale(360.0),
                              needs_turn=True)  # fmt: skip
