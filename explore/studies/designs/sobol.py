"""The scrambled Sobol' points of `scipy.stats.qmc`, bit by bit, without importing `scipy.stats`, which takes 0.5 s."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import scipy

#: Number of bits of a point, SciPy's default.
BITS = 30

#: Direction numbers of Joe and Kuo (https://web.maths.unsw.edu.au/~fkuo/sobol), criterion D6, in a file of SciPy's.
_DIRECTIONS = Path(scipy.__file__).parent / "stats" / "_sobol_direction_numbers.npz"

_Integers = npt.NDArray[np.uint32]


def scrambled_sobol(dimensions: int, seed: int) -> tuple[_Integers, _Integers]:
    """The first point, shape (dimensions,), and X[2^k] ^ X[0] for each bit k of a number, (BITS, dimensions).

    The points X are affine over xor in the bits of their numbers, in steps of 2^-BITS. Their order is that of the Gray
    code; the scramble is a random lower triangular matrix over the bits, then a random shift. `OSError` or `KeyError`
    if SciPy has other files.
    """
    generator = np.random.default_rng(seed).spawn(1)[0]  # as SciPy does with a seed
    shift = generator.integers(2, size=(dimensions, BITS), dtype=np.uint32) @ (1 << np.arange(BITS, dtype=np.uint32))
    matrices = np.tril(generator.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32), -1)
    matrices += np.eye(BITS, dtype=np.uint32)
    weights = 1 << np.arange(BITS, dtype=np.uint32)[::-1]
    bits = (_direction_numbers(dimensions)[:, :, None] & weights != 0).astype(np.uint32)
    directions = (np.einsum("dpq,djq->djp", matrices, bits) & 1) @ weights
    steps = directions.copy()
    steps[:, 1:] ^= directions[:, :-1]  # the Gray code of 2^k has the bits k and k - 1
    return shift, steps.T


def _direction_numbers(dimensions: int) -> _Integers:
    """Direction numbers without a scramble, shape (dimensions, BITS), the most significant bit first."""
    with np.load(_DIRECTIONS) as file:
        polynomials, initial = file["poly"][:dimensions], file["vinit"][:dimensions]
    numbers = np.ones((dimensions, BITS), dtype=np.uint32)
    for row, polynomial, first in zip(numbers[1:], polynomials[1:].tolist(), initial[1:], strict=True):
        degree = polynomial.bit_length() - 1
        row[:degree] = first[:degree]
        for j in range(degree, BITS):
            row[j] = row[j - degree]
            for k in range(1, degree + 1):
                if polynomial >> (degree - k) & 1:
                    row[j] ^= row[j - k] << k
    return numbers << np.arange(BITS, dtype=np.uint32)[::-1]
