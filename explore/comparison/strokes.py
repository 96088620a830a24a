"""The slow stroke as crank angles and weights, so that any method's velocities give a coefficient of variation."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore import quadrature
from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.mechanisms.crank_rocker_kernel import DRIVE, DRIVES
from explore.methods.contract import Outcome
from explore.methods.geometry import geometric_outcome
from explore.vocabulary import FloatArray, Status

_LOG_TOLERANCE = float(np.log(1e-13))


def stroke_nodes(lengths: FloatArray, branch: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of the graded rule over the slow stroke, as many for each design as the hardest one needs.

    Parameters
    ----------
    lengths : (n, 4) array
        Crank, coupler, rocker, ground.
    branch : (n,) array

    Returns
    -------
    crank_angle, weights : (n, t) arrays
        Ascending, rad. Designs that have no strokes are given those of the first that has.
    """
    n = len(lengths)
    status, kernel, singular = closed_form_rows(lengths, branch)
    rocks = np.flatnonzero((geometric_outcome(lengths) == Outcome.OK) & (status == Status.OK))
    size_of, row_of, table = quadrature.rules()
    parts, shapes = np.zeros((4, 3)), np.zeros((3, 4))
    pieces = {}
    for i in rocks:
        CRANK_ROCKER.pieces(kernel[i], DRIVE, DRIVES["slow"], 0.0, 0.0, parts)
        quadrature.panel(parts, 0, singular, i, shapes)
        pieces[i] = (int(parts[0, 0]), shapes[0].copy())
    count = max(quadrature.node_count(_LOG_TOLERANCE, shape[1], shape[3], 2, size_of) for _, shape in pieces.values())
    crank_angle, weights = np.empty((n, count)), np.empty((n, count))
    t, sine, cosine = np.empty(count), np.empty(count), np.empty(count)
    for i, (anchor, shape) in pieces.items():
        shapes[0] = shape
        quadrature.place_nodes(shapes, 0, anchor, count, 0, row_of, table, False, t, sine, cosine, weights[i])
        crank_angle[i] = 2.0 * np.arctan2(sine, cosine)
    others = np.setdiff1d(np.arange(n), rocks)
    crank_angle[others], weights[others] = crank_angle[rocks[0]], weights[rocks[0]]
    return crank_angle, weights


def closed_form_rows(lengths: FloatArray, branch: FloatArray) -> tuple[npt.NDArray[np.int8], FloatArray, FloatArray]:
    """What the mechanism's closed form knows of each linkage: status (n,), kernel row (n, k), singularities (n, 3)."""
    n = len(lengths)
    status, kernel, singular = np.zeros(n, np.int8), np.zeros((n, CRANK_ROCKER.kernel_size)), np.ones((n, 3))
    parameters = np.column_stack([lengths, np.ones(n), branch])
    CRANK_ROCKER.closed_form(parameters, np.empty((len(CRANK_ROCKER.metrics), n)), status, kernel, singular, np.ones(n))
    return status, kernel, singular


def coefficient_of_variation(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Standard deviation over the size of the mean, from values and weights at nodes, shapes (n, t) to (n,)."""
    length = weights.sum(axis=-1)
    mean = (weights * values).sum(axis=-1) / length
    variance = (weights * (values - mean[:, None]) ** 2).sum(axis=-1) / length
    return np.asarray(np.sqrt(variance) / np.abs(mean))
