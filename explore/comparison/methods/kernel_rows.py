"""Rows of a mechanism's kernel for many designs, each at its own angles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.kernels import fill_motions
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray
from explore.model.status import Status


def kernel_rows(
    mechanism: Mechanism, parameters: FloatArray, angle: FloatArray, laws: npt.NDArray[np.int64], needs: int
) -> FloatArray:
    """Signals, (n, rows, t), of a mechanism whose anchor is at 0 or 90 degrees, at angles, rad, under laws, (n, t).

    The parameters are the first ones of the closed form; others have their defaults. Rows are meaningless where the
    bits of `needs` exclude a signal, and not finite for designs without a motion.
    """
    constants = np.ascontiguousarray(mechanism.constants(_complete(mechanism, parameters)).T)
    # tan(x/2) = sin x/(1 + cos x): a difference from half a turn would lose the digits beside it
    sine, cosine = np.sin(angle), np.cos(angle)
    along, across = (cosine, sine) if mechanism.anchor_angle == 0.0 else (sine, -cosine)
    anchors = (along < 0.0).astype(np.int64)
    tangents = np.where(along < 0.0, -across, across) / (1.0 + np.abs(along))
    rows = np.zeros((len(parameters), mechanism.signal_rows, angle.shape[1]))
    fill_motions(mechanism.fill, constants, anchors, np.ascontiguousarray(laws), np.ascontiguousarray(tangents), needs,
                 mechanism.signal_rows, rows)  # fmt: skip
    return rows


def kernel_status(mechanism: Mechanism, parameters: FloatArray) -> npt.NDArray[np.int8]:
    """Status of each design, from the first parameters of the closed form, shape (n, p)."""
    columns = zip(parameters.T, mechanism.kernel_parameters, strict=False)
    usable = np.all([declared.allows(values) for values, declared in columns], axis=0)
    status = mechanism.evaluate_closed_form(_complete(mechanism, np.where(usable[:, None], parameters, 1.0))).status
    return np.where(usable, status, np.int8(Status.NOT_FINITE))


def _complete(mechanism: Mechanism, parameters: FloatArray) -> FloatArray:
    """All parameters of the closed form, shape (p, n)."""
    defaults = [p.default for p in mechanism.kernel_parameters[parameters.shape[1] :]]
    return np.concatenate([parameters.T, np.tile(np.array(defaults, dtype=float)[:, None], (1, len(parameters)))])
