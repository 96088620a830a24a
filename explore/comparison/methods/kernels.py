"""Compiled functions of mechanisms over many designs at once."""

import math

import numpy as np
from numba import types

from explore.base.compiling import FILL_SIGNATURE, LANES, compiled, function_type
from explore.base.lanes.designs import fill_motion_of_design
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar
from explore.mechanisms.variable_crank.blend import blend


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
