"""Quadrature over the slow stroke, which turns the velocities of any method into a coefficient of variation."""

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.contract import Outcome
from explore.comparison.methods.geometry import geometric_outcome
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, COUNT, HALF, PANEL_CAPACITY, SCALE, TARGET, count_nodes
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.windows import map_window, window_ends
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.model.quantities import FloatArray
from explore.model.status import Status

_LOG_TOLERANCE = float(np.log(1e-13))


def stroke_nodes(lengths: FloatArray, branch: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes, rad, and weights of the graded rule over the slow stroke, as many as the hardest design needs, (n, t).

    Designs without strokes have the nodes of the first design with strokes.
    """
    n = len(lengths)
    parameters = _parameters(lengths, branch)
    status = CRANK_ROCKER.evaluate_closed_form(parameters).status
    rocks = np.flatnonzero((geometric_outcome(lengths) == Outcome.OK) & (status == Status.OK))
    panels = np.concatenate(
        map_window(CRANK_ROCKER, CRANK_ROCKER.constants(parameters[:, rocks]), CRANK_ROCKER.window("drive"), "slow"),
        axis=1,
    )
    buffer = np.zeros((panels.shape[0], PANEL_CAPACITY))
    buffer[:, : panels.shape[1]] = panels
    buffer[TARGET // PANEL_CAPACITY] = _LOG_TOLERANCE
    count_nodes(buffer.reshape(-1), panels.shape[1], 2)
    size_of, row_of, table = gauss_legendre_rules()
    count = int(size_of[int(buffer[COUNT // PANEL_CAPACITY, : panels.shape[1]].max())])
    abscissas, rule = _full_rule(table[row_of[count] : row_of[count] + (count + 1) // 2], count)
    anchor, centre, half, scale = (panels[row // PANEL_CAPACITY][:, None] for row in (ANCHOR, CENTRE, HALF, SCALE))
    t = centre + half * abscissas
    tangent = scale * np.sinh(t)
    crank_angle, weights = np.empty((n, count)), np.empty((n, count))
    crank_angle[rocks] = np.pi * anchor + 2.0 * np.arctan(tangent)
    weights[rocks] = 2.0 * half * rule * scale * np.cosh(t) / (1.0 + tangent * tangent)
    others = np.setdiff1d(np.arange(n), rocks)
    crank_angle[others], weights[others] = crank_angle[rocks[0]], weights[rocks[0]]
    return crank_angle, weights


def _full_rule(half: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """All abscissas, ascending, and weights of a stored rule."""
    mirrored = half[count // 2 - 1 :: -1]
    return np.concatenate([-half[:, 0], mirrored[:, 0]]), np.concatenate([half[:, 1], mirrored[:, 1]])


def _parameters(lengths: FloatArray, branch: FloatArray) -> FloatArray:
    """Parameters of the crank-rocker's closed form, shape (p, n)."""
    return np.stack([*lengths.T, np.ones(len(lengths)), branch])


def evaluate_geometry(lengths: FloatArray, branch: FloatArray) -> npt.NDArray[np.int8]:
    """Evaluate the closed form of the crank-rocker; return the status, shape (n,)."""
    return CRANK_ROCKER.evaluate_closed_form(_parameters(lengths, branch)).status


def stroke_ends(lengths: FloatArray, branch: FloatArray) -> FloatArray:
    """First and last crank angle of the slow stroke, rad, shape (n, 2); NaN for a linkage that does not rock."""
    ends = np.full((len(lengths), 2), np.nan)
    rocks = evaluate_geometry(lengths, branch) == Status.OK
    constants = CRANK_ROCKER.constants(_parameters(lengths[rocks], branch[rocks]))
    ends[rocks] = window_ends(CRANK_ROCKER, constants, CRANK_ROCKER.window("drive"), "slow")
    return ends


def coefficient_of_variation(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Standard deviation over absolute mean, shape (n,), from values and weights at nodes, both (n, t)."""
    length = weights.sum(axis=-1)
    mean = (weights * values).sum(axis=-1) / length
    variance = (weights * (values - mean[:, None]) ** 2).sum(axis=-1) / length
    return np.asarray(np.sqrt(variance) / np.abs(mean))
