"""Four-bar function generators with free initial angles: least true error of the output, over the whole range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.functions import FourBarGenerator, fit_four_bar, output_angles, wrapped

#: Number of initial angles of input and output that are tried, evenly over the turn.
_N_ANGLES = 36
#: Number of starts that are improved, the best of all that were tried.
_N_STARTS = 24
#: Residual in place of one where the linkage cannot be assembled, rad.
_NOT_ASSEMBLED = 1.0
#: Difference of parameters below which linkages are the same.
_SAME = 1e-3


@dataclass(frozen=True)
class FunctionTask:
    """A function between two angles, each counted from an initial angle that is free.

    A table of the angles that crank and rocker turn from there, rad, (n,); the least angle between coupler and rocker,
    or its supplement, over the range, rad; the largest ratio of the longest to the shortest link.
    """

    inputs: FloatArray
    outputs: FloatArray
    transmission_angle_min: float = 0.0
    link_ratio_max: float = np.inf


@dataclass(frozen=True)
class FoundGenerator:
    """A generator, its initial angles from the line of the pivots, and its errors at the pairs of the task, rad."""

    generator: FourBarGenerator
    input_start: float
    output_start: float
    error_rms: float
    error_max: float


def find_generators(task: FunctionTask) -> list[FoundGenerator]:
    """Generators of least mean square error of the output, each a local optimum, best first.

    The initial angles start on a grid over the turn, with the lengths that the linear equation gives, and all five are
    improved by Levenberg and Marquardt's method on the error of the output angle itself. Raises `RequestError` if none
    of the starts leads to a linkage that can be assembled over the whole range.
    """
    starts = sorted(_starts(task), key=lambda start: start[0])[:_N_STARTS]
    found: list[FoundGenerator] = []
    for _, parameters, branch in starts:
        candidate = _improved(task, parameters, branch)
        if candidate is not None and not any(_is_same(candidate, other) for other in found):
            found.append(candidate)
    if not found:
        raise RequestError("no four-bar within these limits reaches over the whole range; narrow it or ease them")
    return sorted(found, key=lambda each: each.error_rms)


def _starts(task: FunctionTask) -> list[tuple[float, FloatArray, int]]:
    """Error, parameters and branch of the linkages that the linear equation gives; the lengths come first."""
    starts = []
    angles = np.arange(_N_ANGLES) * (2.0 * np.pi / _N_ANGLES)
    for input_start in angles:
        for output_start in angles:
            try:
                fitted = fit_four_bar(input_start + task.inputs, output_start + task.outputs)
            except RequestError:
                continue
            # A negative length is a link in the opposite direction.
            parameters = np.array([
                abs(fitted.crank), fitted.coupler, abs(fitted.rocker),
                input_start + np.pi * (fitted.crank < 0.0), output_start + np.pi * (fitted.rocker < 0.0),
            ])  # fmt: skip
            for branch in (1, -1):
                error = float(np.square(_residuals(parameters, task, branch)).mean())
                starts.append((error, parameters, branch))
    return starts


def _residuals(parameters: FloatArray, task: FunctionTask, branch: int) -> FloatArray:
    """Errors of the output, and by how much the limits are missed."""
    lengths, (input_start, output_start) = parameters[:3], parameters[3:]
    inputs = input_start + task.inputs
    outputs = output_angles(lengths, inputs, branch)
    errors = wrapped(outputs - output_start - task.outputs)
    missed = [np.where(np.isnan(errors), _NOT_ASSEMBLED, errors)]
    if task.transmission_angle_min > 0.0:
        angles = _transmission_angles(lengths, inputs)
        worst = np.minimum(angles, np.pi - angles)
        missed.append(np.clip(task.transmission_angle_min - np.nan_to_num(worst), 0.0, None))
    if np.isfinite(task.link_ratio_max):
        links = np.append(np.abs(lengths), 1.0)
        missed.append(np.clip(np.atleast_1d(np.log(links.max() / links.min() / task.link_ratio_max)), 0.0, None))
    return np.concatenate(missed)


def _transmission_angles(lengths: FloatArray, inputs: FloatArray) -> FloatArray:
    crank, coupler, rocker = lengths
    square = np.abs(1.0 - crank * np.exp(1j * inputs)) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.arccos((coupler**2 + rocker**2 - square) / (2.0 * coupler * rocker)))


def _improved(task: FunctionTask, parameters: FloatArray, branch: int) -> FoundGenerator | None:
    """The local optimum from a start; None where it cannot be assembled over the range or misses a limit."""
    from scipy.optimize import least_squares

    tight: dict[str, Any] = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    solution = least_squares(_residuals, parameters, args=(task, branch), method="trf", x_scale="jac", **tight)
    lengths, (input_start, output_start) = solution.x[:3], solution.x[3:]
    errors = wrapped(output_angles(lengths, input_start + task.inputs, branch) - output_start - task.outputs)
    limits = _residuals(solution.x, task, branch)[len(errors) :]
    if np.isnan(errors).any() or (limits > 1e-9).any():
        return None
    crank, coupler, rocker = lengths.tolist()
    generator = FourBarGenerator(crank, coupler, rocker, branch)
    rms, largest = float(np.sqrt(np.mean(errors**2))), float(np.abs(errors).max())
    return FoundGenerator(generator, float(wrapped(input_start)), float(wrapped(output_start)), rms, largest)


def _is_same(first: FoundGenerator, second: FoundGenerator) -> bool:
    def parameters(found: FoundGenerator) -> FloatArray:
        lengths = [found.generator.crank, found.generator.coupler, found.generator.rocker]
        return np.array([*np.log(np.abs(lengths)), found.input_start, found.output_start])

    return bool(np.abs(parameters(first) - parameters(second)).max() < _SAME)
