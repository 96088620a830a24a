"""The loop of the slider-crank: crank + rod = position of the slider + offset."""

from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.kernels import kernel_rows, kernel_status
from explore.comparison.methods.vector_loop import UnknownAngle, UnknownLength, Vector, VectorLoop
from explore.mechanisms.slider_crank import columns
from explore.mechanisms.slider_crank.declaration import SLIDER_CRANK as MECHANISM
from explore.model.quantities import FloatArray

#: Rows of the kernel in the order of a motion.
_ROWS = [columns.POSITION, columns.ROD_ANGLE, columns.VELOCITY, columns.ROD_VELOCITY, columns.ACCELERATION,
         columns.ROD_ACCELERATION]  # fmt: skip
#: Needs of a motion of positions.
_POSITIONS = columns.SLIDER | columns.ANGLE
#: Needs of each number of rows of a motion.
_NEEDS = {
    2: _POSITIONS,
    4: _POSITIONS | columns.ROD_RATES,
    6: _POSITIONS | columns.ROD_RATES | columns.SLIDER_ACCELERATION,
}


def _known(parameters: Any, _angle: Any, direction: Vector, order: int) -> Vector:
    """Crank less offset, or a derivative."""
    crank, _, offset = parameters
    x, y = crank * direction[0], crank * direction[1]
    return (x, y - offset) if order == 0 else (-y, x) if order == 1 else (-x, -y)


def _orientation(_parameters: Any, _angle: Any) -> float:
    return -1.0


def _status(parameters: FloatArray) -> npt.NDArray[np.int8]:
    return kernel_status(MECHANISM, parameters)


def _fill_closed_form(parameters: FloatArray, _branch: FloatArray, angle: FloatArray, signals: FloatArray) -> None:
    rows = kernel_rows(MECHANISM, parameters, angle, np.zeros(angle.shape, dtype=np.int64), _NEEDS[len(signals)])
    signals[:] = np.moveaxis(rows[:, _ROWS[: len(signals)]], 1, 0)


def _derive(motion: FloatArray, _parameters: FloatArray) -> dict[int, FloatArray]:
    return dict(zip(_ROWS, motion, strict=True))


SLIDER_CRANK = VectorLoop(
    mechanism=MECHANISM,
    parameters=("crank", "rod", "offset"),
    links=slice(0, 3),
    names=("slider position", "rod angle"),
    first=UnknownLength(-1.0, turns=False),
    second=UnknownAngle(1),
    known=_known,
    orientation=_orientation,
    status=_status,
    fill_closed_form=_fill_closed_form,
    derive=_derive,
)
