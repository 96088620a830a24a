"""Compiled functions of mechanisms over many designs at once, and the rows that they fill."""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from explore.base.compiling import FILL_SIGNATURE, LANES, compiled, function_type
from explore.base.lanes.designs import fill_motion_of_design
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar
from explore.mechanisms.variable_crank.blend import blend
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray
from explore.model.status import Status


@compiled("void(float64[:, ::1], int64[::1])")
def classify_all(lengths, classes):
    """Fill the class of each linkage; a row of `lengths` is crank, coupler, rocker, ground."""
    for i in range(lengths.shape[0]):
        linkage_class, _ = four_bar.classify(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3])
        classes[i] = int(linkage_class)


@compiled(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64[:, ::1], int64, int64[::1], float64[:, :, ::1])",
    allocates=True,
)
def solve_all(lengths, branch, sine, cosine, needs, rows, signals):
    """Fill ``signals[k, i]`` with row ``rows[k]`` of linkage i, at half-angle sines and cosines of shape (n, t)."""
    constants, tangents = np.zeros(four_bar.FOUR_BAR_SIZE * LANES), np.empty(2 * LANES)
    out, nodes = np.empty(four_bar.SIGNAL_ROWS * LANES), np.empty(2 * LANES, np.int64)
    for i in range(lengths.shape[0]):
        for lane in range(LANES):
            four_bar.prepare(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3], branch[i], constants, lane)
        for anchor in range(2):
            lanes = 0
            for j in range(sine.shape[1] + 1):
                if j < sine.shape[1] and (abs(sine[i, j]) > abs(cosine[i, j])) == (anchor == 1):
                    tangents[lanes] = sine[i, j] / cosine[i, j] if anchor == 0 else -cosine[i, j] / sine[i, j]
                    nodes[lanes] = j
                    lanes += 1
                if lanes == LANES or (j == sine.shape[1] and lanes > 0):
                    for lane in range(lanes, LANES):
                        tangents[lane] = tangents[0]
                    four_bar.fill_motion(constants, tangents, anchor, 1, needs, four_bar.SIGNAL_ROWS, out)
                    for k in range(signals.shape[0]):
                        for lane in range(lanes):
                            signals[k, i, nodes[lane]] = out[rows[k] * LANES + lane]
                    lanes = 0


@compiled(
    types.void(
        function_type(FILL_SIGNATURE), types.float64[:, ::1], types.int64[:, ::1], types.int64[:, ::1],
        types.float64[:, ::1], types.int64, types.int64, types.float64[:, :, ::1],
    ),
    allocates=True,
)  # fmt: skip
def fill_motions(fill, constants, anchors, laws, tangents, needs, rows, signals):
    """Fill the signals of many designs, shape (n, rows, t), each at its own angles; see `fill_motion_of_design`."""
    for i in range(constants.shape[0]):
        fill_motion_of_design(fill, constants[i], anchors[i], laws[i], tangents[i], 0, needs, rows, signals[i])


@subroutine()
def _given_position(rod, slider_speed, speed, time, blend_order, angle, order):
    """The slider's position, or a derivative by the angle: constant speed between smooth reversals."""
    travel, width = slider_speed / speed, speed * time
    turned = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    folded = abs(turned)
    side = 1.0 if folded < 0.5 * math.pi else -1.0
    z = max(0.5 - min(folded, math.pi - folded) / width, 0.0)
    lag, share, slope = blend(blend_order, z)
    if order == 1:
        rate = travel * (share - 1.0)
        return rate if turned > 0.0 else -rate
    if order == 2:
        return -side * travel / width * slope
    crank = travel * math.sqrt(2.0 * rod / (rod + math.hypot(rod, 2.0 * travel)))
    return math.hypot(rod, crank) - travel * (folded - math.atan2(rod, crank) + side * width * lag)


@compiled("float64(float64, float64, float64, float64, float64, float64, int64)")
def given_position(rod, slider_speed, speed, time, blend_order, angle, order):
    """The position of the variable crank's slider, or its derivative of an order up to 2 by the angle."""
    return _given_position(rod, slider_speed, speed, time, blend_order, angle, order)


@compiled("void(float64[:, ::1], int64, float64[::1])")
def fill_given_positions(inputs, order, positions):
    """Fill what `given_position` returns for columns of inputs: parameters and angle."""
    for k in range(inputs.shape[1]):
        positions[k] = _given_position(
            inputs[0, k], inputs[1, k], inputs[2, k], inputs[3, k], inputs[4, k], inputs[5, k], order
        )


def kernel_rows(
    mechanism: Mechanism, parameters: FloatArray, angle: FloatArray, laws: npt.NDArray[np.int64], needs: int
) -> FloatArray:
    """Signals, (n, rows, t), of a mechanism whose anchor is at 0 or 90 degrees, at angles, rad, under laws, (n, t).

    The parameters are the first ones of the closed form; others have their defaults. Rows are meaningless where the
    bits of `needs` exclude a signal, and not finite for designs without a motion.
    """
    constants = np.ascontiguousarray(mechanism.constants(_complete(mechanism, parameters)).T)
    # tan(x/2) = sin x/(1 + cos x): a difference from half a turn would lose the digits beside it
    sine, cosine = np.sin(angle), np.cos(angle)
    along, across = (cosine, sine) if mechanism.anchor_angle == 0.0 else (sine, -cosine)
    anchors = (along < 0.0).astype(np.int64)
    tangents = np.where(along < 0.0, -across, across) / (1.0 + np.abs(along))
    rows = np.zeros((len(parameters), mechanism.signal_rows, angle.shape[1]))
    fill_motions(mechanism.fill, constants, anchors, np.ascontiguousarray(laws), np.ascontiguousarray(tangents), needs,
                 mechanism.signal_rows, rows)  # fmt: skip
    return rows


def kernel_status(mechanism: Mechanism, parameters: FloatArray) -> npt.NDArray[np.int8]:
    """Status of each design, from the first parameters of the closed form, shape (n, p)."""
    columns = zip(parameters.T, mechanism.kernel_parameters, strict=False)
    usable = np.all([declared.allows(values) for values, declared in columns], axis=0)
    status = mechanism.evaluate_closed_form(_complete(mechanism, np.where(usable[:, None], parameters, 1.0))).status
    return np.where(usable, status, np.int8(Status.NOT_FINITE))


def _complete(mechanism: Mechanism, parameters: FloatArray) -> FloatArray:
    """All parameters of the closed form, shape (p, n)."""
    defaults = [p.default for p in mechanism.kernel_parameters[parameters.shape[1] :]]
    return np.concatenate([parameters.T, np.tile(np.array(defaults, dtype=float)[:, None], (1, len(parameters)))])
