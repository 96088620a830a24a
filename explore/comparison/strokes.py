"""Quadrature over the slow stroke, which turns the velocities of any method into a coefficient of variation."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.mechanisms.crank_rocker.columns import DRIVE, DRIVES
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.methods.contract import Outcome
from explore.methods.geometry import geometric_outcome
from explore.model.quantities import FloatArray
from explore.model.status import Status
from explore.quadrature.node_placement import map_panel, node_count, place_nodes
from explore.quadrature.rules import gauss_legendre_rules

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
        Ascending, rad. Designs without strokes have the nodes of the first design with strokes.
    """
    n = len(lengths)
    status, kernel, singular = evaluate_closed_form(lengths, branch)
    rocks = np.flatnonzero((geometric_outcome(lengths) == Outcome.OK) & (status == Status.OK))
    size_of, row_of, table = gauss_legendre_rules()
    parts, shapes = np.zeros((4, 3)), np.zeros((3, 4))
    pieces = {}
    for i in rocks:
        CRANK_ROCKER.pieces(kernel[i], DRIVE, DRIVES["slow"], 0.0, 0.0, parts)
        map_panel(parts, 0, singular, i, shapes)
        pieces[i] = (int(parts[0, 0]), shapes[0].copy())
    count = max(node_count(_LOG_TOLERANCE, shape[1], shape[3], 2, size_of) for _, shape in pieces.values())
    crank_angle, weights = np.empty((n, count)), np.empty((n, count))
    t, sine, cosine = np.empty(count), np.empty(count), np.empty(count)
    for i, (anchor, shape) in pieces.items():
        shapes[0] = shape
        place_nodes(shapes, 0, anchor, count, 0, row_of, table, False, t, sine, cosine, weights[i])
        crank_angle[i] = 2.0 * np.arctan2(sine, cosine)
    others = np.setdiff1d(np.arange(n), rocks)
    crank_angle[others], weights[others] = crank_angle[rocks[0]], weights[rocks[0]]
    return crank_angle, weights


def evaluate_closed_form(
    lengths: FloatArray, branch: FloatArray
) -> tuple[npt.NDArray[np.int8], FloatArray, FloatArray]:
    """Evaluate the closed form of the crank-rocker: status (n,), kernel rows (n, k) and singularities (n, 3)."""
    result = CRANK_ROCKER.evaluate_closed_form(np.column_stack([lengths, np.ones(len(lengths)), branch]))
    return result.status, result.kernel, result.singular


def coefficient_of_variation(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Standard deviation over absolute mean, shape (n,), from values and weights at nodes, both (n, t)."""
    length = weights.sum(axis=-1)
    mean = (weights * values).sum(axis=-1) / length
    variance = (weights * (values - mean[:, None]) ** 2).sum(axis=-1) / length
    return np.asarray(np.sqrt(variance) / np.abs(mean))
