"""A mechanism: its declaration and its compiled functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from explore.model.checks import check_declaration
from explore.model.closed_form import ClosedFormResult
from explore.model.declaration import Declaration
from explore.model.quantities import FloatArray


@dataclass(frozen=True, kw_only=True)
class Mechanism(Declaration):
    """A declaration and three compiled functions; everything else is generic.

    A declaration that contradicts itself or the kernel raises ValueError when the mechanism is made.

    Attributes
    ----------
    closed_form
        ``closed_form(parameters[n, p], metrics[m, n], status[n], kernel[n, k], singular[n, 3], noise[n])`` fills the
        arrays of `explore.model.closed_form.ClosedFormResult`.
    pieces
        ``pieces(kernel_row, window_code, drive_code, start, stop, out[4, 3]) -> count`` gives a window as at most
        three pieces (anchor, half-tangent of start, half-tangent of end); ``out[3]`` is the averaging length and the
        part of it over which the signal is 0, rad.
    fill
        ``fill(kernel_row, sin_half, cos_half, count, needs, out[s, t])`` fills the signals at the nodes.
    """

    closed_form: Callable[..., None]
    pieces: Callable[..., int]
    fill: Callable[..., None]

    def __post_init__(self) -> None:
        check_declaration(self)

    def evaluate_closed_form(self, parameters: FloatArray) -> ClosedFormResult:
        """Evaluate the closed form.

        Parameters
        ----------
        parameters : (n, p) array
            Designs, with the columns of `kernel_parameters` in declared units.
        """
        result = ClosedFormResult.allocate(len(self.metrics), len(parameters), self.kernel_size)
        inputs = np.ascontiguousarray(parameters, dtype=np.float64)
        self.closed_form(inputs, result.metrics, result.status, result.kernel, result.singular, result.noise)
        return result
