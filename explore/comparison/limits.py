"""The limit of a parameter, beyond which a design has no motion, to the last double; designs ever nearer to it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.comparison.methods.closed_form import geometric_outcome
from explore.comparison.methods.contract import Outcome, Task
from explore.comparison.methods.loop import Loop
from explore.model.quantities import FloatArray

#: Exponents of the powers of two that a parameter is from its limit, in units of the design's scale, descending.
_EXPONENTS = (*range(6, -41, -3),)
#: Exponents of the powers of two that a parameter is beyond its limit.
_BEYOND = (-32, -20, -8, 2)
#: Number of steps in which a parameter is doubled or brought to 0 in the search for a limit.
_STEPS = 64


class Limit(NamedTuple):
    """A parameter and the first of its values without a motion, from the side of a design with one."""

    name: str
    value: float
    design: FloatArray
    column: int


def find_limit(loop: Loop, design: FloatArray, name: str = "") -> Limit:
    """The limit of a parameter from a design with a motion, or of the one that is relatively nearest to its limit.

    Raises `RequestError` if the design has no motion, or keeps it while any parameter goes to 0 or doubles.
    """
    if not _moves(loop, design[None])[0]:
        raise RequestError("the design has no motion to begin with; give one that turns")
    columns = [loop.parameters.index(name)] if name else [k for k, value in enumerate(design) if value != 0.0]
    steps = np.arange(1, _STEPS) / _STEPS
    for share in np.concatenate([steps, [1.0]]):
        for k in columns:
            for factor in (1.0 - share, 1.0 + share):
                other = design.copy()
                other[k] *= factor
                if factor > 0.0 and not _moves(loop, other[None])[0]:
                    value = _bisect(loop, design, k, other[k])
                    return Limit(loop.parameters[k], value, design, k)
    raise RequestError("no singular position: the design moves while any parameter goes to 0 or doubles")


def _bisect(loop: Loop, design: FloatArray, column: int, blocked: float) -> float:
    """The first double without a motion between the value of a design and one that has none."""
    moving = design[column]
    while (middle := 0.5 * (moving + blocked)) not in (moving, blocked):
        tried = design.copy()
        tried[column] = middle
        moving, blocked = (middle, blocked) if _moves(loop, tried[None])[0] else (moving, middle)
    return float(blocked)


def designs_towards(loop: Loop, limit: Limit, *, is_length: bool = True) -> tuple[FloatArray, FloatArray]:
    """Margins, descending, and designs at them, but for those that do not move as they should.

    A margin of a length is over the longest link, one of another parameter over its limit.
    """
    scale = 2.0 ** np.round(np.log2(abs(limit.design[limit.column] - limit.value)) - _EXPONENTS[0])
    sense = np.sign(limit.design[limit.column] - limit.value)
    wanted = np.array([*(2.0**k for k in _EXPONENTS), 0.0, *(-(2.0**k) for k in _BEYOND)]) * scale * sense
    parameters = np.tile(limit.design, (len(wanted), 1))
    parameters[:, limit.column] = limit.value + wanted
    distance = (parameters[:, limit.column] - limit.value) * sense
    kept = (_moves(loop, parameters) == (distance > 0.0)) & (
        parameters[:, limit.column] * limit.design[limit.column] > 0.0
    )
    kept &= np.append(np.diff(distance) < 0.0, True)
    parameters, distance = parameters[kept], distance[kept]
    return distance / (loop.size(loop.columns(parameters.T)) if is_length else abs(limit.value)), parameters


def _moves(loop: Loop, parameters: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether designs have their whole motion."""
    task = Task(loop, parameters, np.zeros((len(parameters), 1)))
    return np.asarray(geometric_outcome(task) == Outcome.OK)
