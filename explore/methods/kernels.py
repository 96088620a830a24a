"""The four-bar's compiled functions over many linkages at once."""

import numpy as np

from explore.compiling import compiled
from explore.mechanisms import four_bar


@compiled("void(float64[:, ::1], int64[::1])")
def classify_all(lengths, classes):
    """Fill the class of each linkage; a row of `lengths` is crank, coupler, rocker, ground."""
    for i in range(lengths.shape[0]):
        classes[i], _ = four_bar.classify(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3])


@compiled(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64[:, ::1], int64, int64[::1], float64[:, :, ::1])",
    allocates=True,
)
def solve_all(lengths, branch, sine, cosine, needs, rows, signals):
    """Fill ``signals[k, i]`` with row ``rows[k]`` of linkage i, at half-angle sines and cosines of shape (n, t)."""
    row, out = np.empty(four_bar.FOUR_BAR_SIZE), np.empty((four_bar.SIGNAL_ROWS, sine.shape[1]))
    for i in range(lengths.shape[0]):
        four_bar.prepare(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3], branch[i], row)
        four_bar.fill(row, sine[i], cosine[i], sine.shape[1], needs, out)
        for k in range(signals.shape[0]):
            signals[k, i] = out[rows[k]]
