"""What the closed form of a mechanism gives for a block of designs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class ClosedFormResult:
    """What the compiled closed form of a mechanism fills for n designs.

    Constants (k, n) are the first rows of the records, if they were asked for. Metrics (m, n) are in declared order and
    units, NaN where undefined; status (n,) has codes of `Declaration.status_labels`.
    """

    constants: FloatArray
    metrics: FloatArray
    status: npt.NDArray[np.int8]

    @classmethod
    def allocate(cls, constants: int, metrics: int, designs: int) -> ClosedFormResult:
        """Arrays to fill for so many constants, metrics and designs."""
        status = np.zeros(designs, dtype=np.int8)
        return cls(np.empty((constants, designs)), np.empty((metrics, designs)), status)
