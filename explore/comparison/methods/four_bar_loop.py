"""The loop of the four-bar linkage: crank + coupler = ground + rocker."""

from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.kernels import classify_all, solve_all
from explore.comparison.methods.vector_loop import UnknownAngle, Vector, VectorLoop
from explore.mechanisms import four_bar
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.model.quantities import FloatArray
from explore.model.status import Status

#: Status by linkage class; 3 (the crank is blocked) where nothing else is set.
_STATUSES = np.full(7, 3, dtype=np.int8)

_STATUSES[[four_bar.CRANK_ROCKER, four_bar.DOUBLE_CRANK]] = Status.OK
_STATUSES[four_bar.CHANGE_POINT] = 4
_STATUSES[four_bar.CANNOT_ASSEMBLE] = 2
#: Needs of each number of rows of a motion.
_NEEDS = {
    2: four_bar.ANGLES,
    4: four_bar.ANGLES | four_bar.VELOCITIES,
    6: four_bar.ANGLES | four_bar.ACCELERATIONS,
}
#: Rows of the kernel's scratch array, in the order of a motion.
_KERNEL_ROWS = np.array([
    four_bar.COUPLER_ANGLE, four_bar.ROCKER_ANGLE, four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY,
    four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION,
])  # fmt: skip


def _known(lengths: Any, _angle: Any, direction: Vector, order: int) -> Vector:
    """Crank less ground, or a derivative."""
    x, y = lengths[0] * direction[0], lengths[0] * direction[1]
    return (x - lengths[3], y) if order == 0 else (-y, x) if order == 1 else (-x, -y)


def _orientation(_lengths: Any, _angle: Any) -> float:
    return -1.0


def _status(lengths: FloatArray) -> npt.NDArray[np.int8]:
    """Whether the crank can make a full turn, from exactly rounded sums of lengths."""
    usable: npt.NDArray[np.bool_] = np.all(np.isfinite(lengths) & (lengths > 0.0), axis=1)
    classes = np.zeros(len(lengths), dtype=np.int64)
    classify_all(np.ascontiguousarray(np.where(usable[:, None], lengths, 1.0)), classes)
    return np.where(usable, _STATUSES[classes], np.int8(Status.NOT_FINITE))


def _fill_closed_form(lengths: FloatArray, branch: FloatArray, angle: FloatArray, signals: FloatArray) -> None:
    """The kernel of a sweep: exactly rounded sums of lengths, no cancelling sums."""
    # the compiled signature needs contiguous, writable arrays
    half = 0.5 * np.ascontiguousarray(angle)
    lengths, branch = np.array(lengths, order="C"), np.array(branch)
    solve_all(lengths, branch, np.sin(half), np.cos(half), _NEEDS[len(signals)], _KERNEL_ROWS, signals)


def _derive(motion: FloatArray, _lengths: FloatArray) -> dict[int, FloatArray]:
    difference = np.remainder(motion[0] - motion[1] + np.pi, 2.0 * np.pi) - np.pi
    return dict(zip(_KERNEL_ROWS.tolist(), motion, strict=True)) | {four_bar.TRANSMISSION_ANGLE: np.abs(difference)}


FOUR_BAR = VectorLoop(
    mechanism=CRANK_ROCKER,
    parameters=("crank", "coupler", "rocker", "ground"),
    links=slice(0, 4),
    names=("coupler angle", "rocker angle"),
    first=UnknownAngle(1),
    second=UnknownAngle(2, -1.0),
    known=_known,
    orientation=_orientation,
    status=_status,
    fill_closed_form=_fill_closed_form,
    derive=_derive,
    fallback=(0.0, 0.5 * np.pi),  # the rocker at a right angle
)
