"""Function generators: four-bars whose output follows a function of their input.

With input and output angles phi and psi from the line of the pivots (F. Freudenstein, Approximate synthesis
of four-bar linkages, Trans. ASME 77 (1955) 853-861)::

    K1 cos(phi) + K2 cos(psi) + K3 = cos(phi - psi)
    K1 = -ground/rocker,   K2 = ground/crank,   K3 = (crank^2 + rocker^2 + ground^2 - coupler^2) / (2 crank rocker)

It is linear in K1, K2, K3: three positions are met exactly. More are met in the least-squares sense of this equation,
which is not that of the output; `turning_generators` minimises the true error of the output.
"""

from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class FourBarGenerator:
    """A four-bar generator with a ground of 1; a negative crank or rocker stands for the opposite direction."""

    crank: float
    coupler: float
    rocker: float
    branch: int

    def outputs(self, inputs: FloatArray) -> FloatArray:
        """The output angles at input angles, rad, shape (n,); NaN where the linkage cannot be assembled."""
        return output_angles(np.array([self.crank, self.coupler, self.rocker]), inputs, self.branch)


def output_angles(lengths: FloatArray, inputs: FloatArray, branch: int) -> FloatArray:
    """Output angles of a four-bar with crank, coupler, rocker and a ground of 1, rad; NaN where there are none.

    The vector from the pin of the crank to the pivot of the rocker, d, and the rocker form a triangle with the coupler:
    the rocker leaves the direction -d by its angle there, to the side that `branch` chooses.
    """
    crank, coupler, rocker = lengths
    diagonal = 1.0 - crank * np.exp(1j * np.asarray(inputs))
    square = np.abs(diagonal) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        turned = np.arccos((rocker**2 + square - coupler**2) / (2.0 * rocker * np.sqrt(square)))
    return np.asarray(np.angle(-diagonal) + branch * turned)


def fit_four_bar(inputs: FloatArray, outputs: FloatArray) -> FourBarGenerator:
    """The four-bar that meets three pairs of angles exactly, or more in the least-squares sense of its equation.

    Angles of crank and rocker from the line of the pivots, rad, (n,). Raises `RequestError` if they determine no
    linkage of finite, real lengths.
    """
    inputs, outputs = np.asarray(inputs, dtype=np.float64), np.asarray(outputs, dtype=np.float64)
    matrix = np.column_stack([np.cos(inputs), np.cos(outputs), np.ones_like(inputs)])
    k1, k2, k3 = _solve(matrix, np.cos(inputs - outputs))
    scale = max(abs(k1), abs(k2), abs(k3))
    if min(abs(k1), abs(k2)) <= 1e-12 * scale:
        raise RequestError("input and output turn alike, which only a parallelogram does; give another function")
    crank, rocker = 1.0 / k2, -1.0 / k1
    # K3 is a mean, so that this is the mean square distance of the pins over the pairs.
    square = crank**2 + rocker**2 + 1.0 - 2.0 * crank * rocker * k3
    lengths = np.array([crank, float(np.sqrt(square)), rocker])
    return FourBarGenerator(crank, lengths[1].item(), rocker, branch_of(lengths, inputs, outputs))


def branch_of(lengths: FloatArray, inputs: FloatArray, outputs: FloatArray) -> int:
    """The branch with the smaller errors."""
    errors = [np.nanmean(np.abs(wrapped(output_angles(lengths, inputs, b) - outputs))) for b in (1, -1)]
    return 1 if errors[0] <= errors[1] else -1


def wrapped(angles: FloatArray) -> FloatArray:
    """Angles within -pi … pi that differ from the given by whole turns."""
    return np.asarray((np.asarray(angles) + np.pi) % (2.0 * np.pi) - np.pi)


def _solve(matrix: FloatArray, right: FloatArray) -> tuple[float, float, float]:
    """Solve a linear system by QR; not by normal equations, which lose half of the digits."""
    if len(matrix) < 3:
        raise RequestError(f"three pairs or more determine a linkage, not {len(matrix)}")
    scales = np.abs(matrix).max(axis=0)
    scales[scales == 0.0] = 1.0
    q, r = np.linalg.qr(matrix / scales)
    if abs(np.diag(r)).min() <= 1e-12 * abs(np.diag(r)).max():
        raise RequestError(
            "these pairs determine no linkage: two are alike, input and output turn alike, or one does not turn"
        )
    k1, k2, k3 = (np.linalg.solve(r, q.T @ right) / scales).tolist()
    return k1, k2, k3
