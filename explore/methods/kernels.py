"""The four-bar's compiled functions over many linkages at once."""

import numpy as np

from explore.compiling import LANES, compiled
from explore.mechanisms import four_bar


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
