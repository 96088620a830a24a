"""What the exact geometry says before any method is asked."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.compiling import compiled
from explore.mechanisms import four_bar
from explore.methods.contract import Outcome
from explore.vocabulary import FloatArray

#: By class of linkage: whether its crank can turn.
_OUTCOMES = np.full(7, Outcome.CRANK_BLOCKED, dtype=np.int8)
_OUTCOMES[[four_bar.CRANK_ROCKER, four_bar.DOUBLE_CRANK]] = Outcome.OK
_OUTCOMES[four_bar.CHANGE_POINT] = Outcome.CHANGE_POINT
_OUTCOMES[four_bar.CANNOT_ASSEMBLE] = Outcome.CANNOT_ASSEMBLE


@compiled("void(float64[:, ::1], int64[::1])")
def _classify(lengths, classes):
    for i in range(lengths.shape[0]):
        classes[i], _ = four_bar.classify(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3])


def geometric_outcome(lengths: FloatArray) -> npt.NDArray[np.int8]:
    """Whether the crank can make a full turn, from exactly rounded sums of lengths.

    Parameters
    ----------
    lengths : (n, 4) array
        Crank, coupler, rocker, ground.

    Returns
    -------
    (n,) array
        An `Outcome` for each: OK, CANNOT_ASSEMBLE, CRANK_BLOCKED, CHANGE_POINT, or NOT_FINITE if a length is no
        positive number.
    """
    usable: npt.NDArray[np.bool_] = np.all(np.isfinite(lengths) & (lengths > 0.0), axis=1)
    classes = np.zeros(len(lengths), dtype=np.int64)
    _classify(np.ascontiguousarray(np.where(usable[:, None], lengths, 1.0)), classes)
    return np.where(usable, _OUTCOMES[classes], np.int8(Outcome.NOT_FINITE))
