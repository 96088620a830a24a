"""Solutions of the equations of nine points as four-bar linkages."""

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.nine_points.classes import cognate, exchange


@np.errstate(all="ignore")  # NaN is not real
def distance_from_real(solutions: ComplexArray) -> FloatArray:
    """The largest difference of a hat and a conjugate, relative to the largest unknown, (n,)."""
    plain, hatted = solutions[:, 0::2], solutions[:, 1::2]
    return np.asarray(np.abs(plain.conj() - hatted).max(axis=1) / np.abs(solutions).max(axis=1))


def linkages_of(solution: ComplexArray, origin: complex, size: float) -> list[FourBar]:
    """The three cognates of a real solution, each with the shorter of its turning links as its crank."""
    found = []
    member = solution[None]
    for _ in range(3):
        ordered = min((member, exchange(member)), key=lambda rows: abs(rows[0, 0] - rows[0, 2]))
        x, a, y, b = (complex(ordered[0, k]) * size for k in (0, 2, 4, 6))
        branch = 1 if ((b - x).conjugate() * (y - x)).imag > 0.0 else -1
        found.append(FourBar(origin + a, origin + b, abs(x - a), abs(y - x), abs(y - b), -x / (y - x), branch))
        member = cognate(member)
    return found
