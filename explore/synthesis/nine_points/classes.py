"""Classes of solutions: each linkage occurs with its dyads in both orders and with its two cognates, six times."""

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.equations import N_POINTS

#: Number of classes of nine points in general position (Wampler, Morgan, Sommese 1992).
N_CLASSES = 1442
#: Distance of keys of one class; ill-conditioned keys are off by 1e-7, different classes were 5e-3 apart and more.
SAME = 1e-5
#: Rounding of vectors between points, in units of their size.
_ROUNDING = 4.0 * np.finfo(np.float64).eps


@np.errstate(all="ignore")  # as of `keys`
def cognate(solutions: ComplexArray) -> ComplexArray:
    """The next of the three cognates of each solution, shape (…, 8); three steps lead back."""
    found = np.empty_like(solutions)
    for o in (0, 1):
        x, a, y, b = (solutions[..., k + o] for k in (0, 2, 4, 6))
        found[..., o] = (x - a) * y / (x - y)
        found[..., 2 + o] = (b * x - a * y) / (x - y)
        found[..., 4 + o], found[..., 6 + o] = a - x, a
    return found


def exchange(solutions: ComplexArray) -> ComplexArray:
    """The same linkages with their dyads in the other order."""
    return solutions[..., [4, 5, 6, 7, 0, 1, 2, 3]]


def cognates(solutions: ComplexArray) -> list[ComplexArray]:
    """The solutions and their two cognates."""
    second = cognate(solutions)
    return [solutions, second, cognate(second)]


def members(solutions: ComplexArray) -> ComplexArray:
    """The six members of each class, shape (6 n, …, 8): first the given ones, then their cognates."""
    found = cognates(solutions)
    return np.concatenate([*found, *(exchange(each) for each in found)])


def combined(one: int, other: int) -> int:
    """Which member is the member `one` of the member `other`, in the order of `members`."""
    (is_exchanged, steps), (is_other_exchanged, other_steps) = divmod(one, 3), divmod(other, 3)
    return 3 * (is_exchanged ^ is_other_exchanged) + ((-steps if is_other_exchanged else steps) + other_steps) % 3


@np.errstate(all="ignore")  # solutions that were lost are NaN or overflow; they get no key
def keys(solutions: ComplexArray) -> FloatArray:
    """Numbers that are the same for all six members of a class, shape (n, 12), of compressed size.

    Symmetric functions of the three pivots of a cognate triple, and the sums of x y over it; a difference of two keys
    is about the relative difference of the numbers where they are large.
    """
    triple = cognates(solutions)
    invariants = []
    for o in (0, 1):
        first, second, third = (member[:, 2 + o] for member in triple)
        invariants += [first + second + third, first * second + second * third + third * first]
        invariants.append(np.sum([member[:, o] * member[:, 4 + o] for member in triple], axis=0))
    return compressed(np.array(invariants).T)


def compressed(numbers: ComplexArray) -> FloatArray:
    """Real and imaginary parts, shape (n, 2 k), of sizes x as arsinh x: differences of large numbers are relative."""
    sizes = np.abs(numbers)
    table = numbers * (np.arcsinh(sizes) / np.maximum(sizes, 1e-30))
    return np.hstack([table.real, table.imag])


def distinct(solutions: ComplexArray, tolerance: float = 1e-7) -> npt.NDArray[np.intp]:
    """Rows of the first member of each class."""
    from scipy.spatial import cKDTree

    table = keys(solutions)
    tree = cKDTree(table)
    is_seen, kept = np.zeros(len(table), dtype=bool), []
    for row in range(len(table)):
        if not is_seen[row]:
            kept.append(row)
            is_seen[tree.query_ball_point(table[row], tolerance)] = True
    return np.array(kept, dtype=np.intp)


def link_vectors(solutions: ComplexArray) -> ComplexArray:
    """The vectors of the six links and their hats, shape (12, n)."""
    parts = [[solutions[:, k + o] for k in (0, 2, 4, 6)] for o in (0, 1)]
    return np.array([vector for x, a, y, b in parts for vector in (x, y, x - y, x - a, y - b, a - b)])


@np.errstate(all="ignore")  # as above
def is_degenerate(solutions: ComplexArray, tolerance: float) -> npt.NDArray[np.bool_]:
    """Whether solutions are none of a linkage: a link without length, equal dyads, or not finite."""
    # A large linkage, nearly one with a slider, may have a link of the size of the points.
    sizes = [np.clip(np.abs(solutions[:, o::2]).max(axis=1), 1e-300, 100.0) for o in (0, 1)]
    is_short = np.abs(link_vectors(solutions)) < tolerance * np.repeat(sizes, 6, axis=0)
    return np.asarray(is_short.any(axis=0) | ~np.isfinite(solutions).all(axis=1))


def shortest_link(solutions: ComplexArray) -> FloatArray:
    """The least size of a link's vector or its hat, shape (n,)."""
    return np.asarray(np.abs(link_vectors(solutions)).min(axis=0))


def has_point(solutions: ComplexArray) -> npt.NDArray[np.bool_]:
    """Whether a link is so short that the rounding of the points may be all of it."""
    return shortest_link(solutions) < _ROUNDING


@np.errstate(all="ignore")  # as above
def residuals(solutions: ComplexArray, parameters: ComplexArray) -> FloatArray:
    """The largest relative error of g + g^ + g g^ = 0 over the points, with g and g^ by Cramer's rule, (n,)."""
    d, dh = parameters[:N_POINTS], parameters[N_POINTS:]
    x, xh, a, ah, y, yh, b, bh = (solutions[:, [k]] for k in range(8))
    a1, b1, c1 = (ah - dh) * x, (a - d) * xh, d * (ah - xh) + dh * (a - x) - d * dh
    a2, b2, c2 = (bh - dh) * y, (b - d) * yh, d * (bh - yh) + dh * (b - y) - d * dh
    e = a1 * b2 - a2 * b1
    g, h = (b1 * c2 - b2 * c1) / e + 1.0, (c1 * a2 - c2 * a1) / e + 1.0
    return np.asarray((np.abs(g * h - 1.0) / (1.0 + np.abs(g) * np.abs(h))).max(axis=1))
