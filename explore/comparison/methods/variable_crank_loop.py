"""The loop of the crank of variable length: crank + rod = position of the slider, which is given.

Its derivative is the equation that publications integrate for the crank's length. Where crank and rod are perpendicular
its matrix is singular, and the branch of a continuous motion changes its sign.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.kernels import fill_given_positions, given_position, kernel_rows, kernel_status
from explore.comparison.methods.vector_loop import UnknownAngle, UnknownLength, Vector, VectorLoop
from explore.mechanisms.variable_crank import columns
from explore.mechanisms.variable_crank.declaration import VARIABLE_CRANK as MECHANISM
from explore.model.quantities import FloatArray


def regular_position(parameters: Any) -> tuple[Any, Any, Any]:
    """Crank angle between 0 and pi where crank and rod are perpendicular; length of the crank and slider there."""
    rod, travel = parameters[0], parameters[1] / parameters[2]
    crank = travel * np.sqrt(2.0 * rod / (rod + np.hypot(rod, 2.0 * travel)))
    return np.arctan2(rod, crank), crank, np.hypot(rod, crank)


def _known(parameters: Any, angle: Any, _direction: Vector, order: int) -> Vector:
    """The slider's position with reversed sign, or a derivative."""
    if np.ndim(angle) == 0:
        return -given_position(*map(float, parameters), float(angle), order), 0.0
    inputs = np.stack(np.broadcast_arrays(*parameters, angle))
    positions = np.empty(inputs[0].size)
    fill_given_positions(inputs.reshape(len(inputs), -1), order, positions)
    return -positions.reshape(inputs.shape[1:]), 0.0


def _orientation(parameters: Any, angle: Any) -> Any:
    """Sign of the cosine of the angle between crank and rod."""
    regular, _, _ = regular_position(parameters)
    return np.sign(np.cos(angle) - np.cos(regular))


def _status(parameters: FloatArray) -> npt.NDArray[np.int8]:
    return kernel_status(MECHANISM, parameters)


def _laws(parameters: FloatArray, angle: FloatArray) -> npt.NDArray[np.int64]:
    """Number of the law at each angle: reversals and ways at steady speed in turn, from the outer dead centre on."""
    half = 0.5 * (parameters[:, 2] * parameters[:, 3])[:, None]
    breaks = np.concatenate([half, np.pi - half, np.pi + 0.0 * half, np.pi + half, 2.0 * np.pi - half], axis=1)
    return np.asarray((np.remainder(angle, 2.0 * np.pi)[:, :, None] >= breaks[:, None]).sum(axis=2), dtype=np.int64)


def _fill_closed_form(parameters: FloatArray, _branch: FloatArray, angle: FloatArray, signals: FloatArray) -> None:
    """Length and angle of the kernel, derivatives from its rate and curvature; the rod's from L sin + l sin(b) = 0."""
    rows = kernel_rows(MECHANISM, parameters, angle, _laws(parameters, angle), columns.CRANK)
    crank, rod_angle = rows[:, columns.CRANK_LENGTH], rows[:, columns.ROD_ANGLE]
    signals[0], signals[1] = crank, rod_angle
    rod, sine, cosine = parameters[:, :1], np.sin(angle), np.cos(angle)
    across = rod * np.cos(rod_angle)
    rate = rows[:, columns.CRANK_RATE] / parameters[:, 2:3]
    rod_rate = -(rate * sine + crank * cosine) / across
    if len(signals) > 2:
        signals[2], signals[3] = rate, rod_rate
    if len(signals) > 4:
        square = crank * crank + rate * rate
        second = (square + rate * rate - rows[:, columns.CURVATURE] * square * np.sqrt(square)) / crank
        turning = second * sine + 2.0 * rate * cosine - crank * sine
        signals[4], signals[5] = second, (rod * np.sin(rod_angle) * rod_rate * rod_rate - turning) / across


def _derive(motion: FloatArray, parameters: FloatArray) -> dict[int, FloatArray]:
    """The crank, its rate, the rod's angle, and the groove; slider and forces are given, or follow from all of them."""
    crank, rod_angle, rate, _, second, _ = motion
    square = crank * crank + rate * rate
    return {
        columns.CRANK_LENGTH: crank,
        columns.CRANK_RATE: parameters[2] * rate,
        columns.ROD_ANGLE: rod_angle,
        columns.PRESSURE_ANGLE: np.arctan2(rate, crank),
        columns.CURVATURE: (square + rate * rate - crank * second) / (square * np.sqrt(square)),
    }


VARIABLE_CRANK = VectorLoop(
    mechanism=MECHANISM,
    parameters=("rod", "slider_speed", "speed", "reversal_time", "blend_order"),
    links=slice(0, 1),
    names=("crank length", "rod angle"),
    first=UnknownLength(1.0, turns=True),
    second=UnknownAngle(0),
    known=_known,
    orientation=_orientation,
    status=_status,
    fill_closed_form=_fill_closed_form,
    derive=_derive,
)
