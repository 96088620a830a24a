"""True errors of statistics, in the norms of the column `error`."""

import numpy as np


def worst(name, value, mean, variance, extremes=None):
    """Error of one statistic of one signal over one window, each argument of shape (n,).

    |error of mean|/rms, |error of variance|/rms^2, of std and rms over rms, of cv relative, of extremes over the
    largest |signal|; `extremes` are the true minimum and maximum. NaN where the value is.
    """
    square = mean**2 + variance
    rms, std = np.sqrt(square), np.sqrt(variance)
    match name:
        case "mean":
            return np.abs(value - mean) / rms
        case "variance":
            return np.abs(value - variance) / square
        case "std":
            return np.abs(value - std) / rms
        case "rms":
            return np.abs(value - rms) / rms
        case "cv":
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.abs(value * np.abs(mean) / std - 1.0)
    low, high = extremes
    largest = np.maximum(np.abs(low), np.abs(high))
    true = {"min": low, "max": high, "peak": largest, "peak_to_peak": high - low}[name]
    return np.abs(value - true) / largest
