"""Mean and variance of signals over a window from the integrals of a mechanism, and the statistics that follow."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from explore.base.compiling import INTEGRALS
from explore.evaluation.quadrature.integrals import integrate
from explore.evaluation.statistics import moment_statistic
from explore.evaluation.windows import interval_half_tangents, specify_window
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray
from explore.model.window import Window


def integrate_window(
    mechanism: Mechanism, parameters: FloatArray, window: Window, drive: str, rows: Collection[int]
) -> dict[int, FloatArray]:
    """Mean, variance and bounds of their errors of the signals in these rows, each of shape (4, n), by row.

    Rows without integrals are left out. `parameters` (p, n) are those of the closed form.
    """
    kind, start_row, stop_row, *_ = specify_window(mechanism, window, drive)
    start, stop = interval_half_tangents(mechanism, window)
    numbers = [number for number, row in enumerate(mechanism.integrated_rows) if row in rows]
    results = np.empty((len(numbers), INTEGRALS, parameters.shape[1]))
    integrate(
        mechanism.close, mechanism.integrals, parameters, mechanism.record_rows, mechanism.first_parameter, kind,
        start_row, stop_row, start, stop, len(mechanism.integrated_rows), np.array(numbers, dtype=np.int64), results,
    )  # fmt: skip
    return {mechanism.integrated_rows[number]: result for number, result in zip(numbers, results, strict=True)}


def from_moments(statistic: str, moments: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value, bound of its error, and scale of that, of one of MOMENT_STATISTICS, each of shape (n,).

    `moments` (4, n) are mean, variance, and bounds of their errors.
    """
    mean, variance, of_mean, of_variance = moments
    value = moment_statistic(statistic, mean, variance, tolerance)
    if statistic == "cv":
        return _cv(value, mean, variance, of_mean, of_variance)
    square = mean * mean + variance
    # The variance may be all error, the mean be exact.
    rms = np.sqrt(np.maximum(mean * mean, square - of_variance))
    match statistic:
        case "mean":
            return value, of_mean, rms
        case "variance":
            return value, of_variance, square
        case "std":
            return value, 0.5 * of_variance / value, rms
    return value, (np.abs(mean) * of_mean + 0.5 * of_variance) / rms, rms


def _cv(
    value: FloatArray, mean: FloatArray, variance: FloatArray, of_mean: FloatArray, of_variance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value, bound and scale of a coefficient of variation."""
    bound = value * (0.5 * of_variance / variance + of_mean / np.abs(mean))
    is_defined = np.isfinite(value)
    if is_defined.all():
        return value, bound, value
    # Where there is none, mean and variance are as exact as they are.
    square = mean * mean + variance
    undefined = np.maximum(of_mean / np.sqrt(square), of_variance / square)
    return value, np.where(is_defined, bound, undefined), np.where(is_defined, value, 1.0)
