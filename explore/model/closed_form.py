"""What the closed form of a mechanism gives for a block of designs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class ClosedFormResult:
    """Arrays that the compiled closed form of a mechanism fills for n designs.

    Attributes
    ----------
    metrics : (m, n) array
        Closed-form metrics in declared order and units, NaN where undefined.
    status : (n,) array
        Codes of `explore.model.status.Status`.
    kernel : (n, k) array
        Constants of each design's motion, which the mechanism's `pieces` and `fill` take.
    singular : (n, 3) array
        Half-tangents of the distances of the motion's complex singularities from the real axis: nearest at the anchor
        angle, nearest at its opposite, second at the anchor angle; see `explore.quadrature.node_placement`.
    noise : (n,) array
        Amplification of rounding errors in velocities.
    """

    metrics: FloatArray
    status: npt.NDArray[np.int8]
    kernel: FloatArray
    singular: FloatArray
    noise: FloatArray

    @classmethod
    def allocate(cls, metrics: int, designs: int, kernel_size: int) -> ClosedFormResult:
        """Arrays to fill for so many metrics, designs and kernel constants."""
        return cls(
            np.empty((metrics, designs)),
            np.zeros(designs, dtype=np.int8),
            np.zeros((designs, kernel_size)),
            np.ones((designs, 3)),
            np.ones(designs),
        )
