"""Samplers of the unit cube. Any range of points is computed from the numbers of the points alone."""

import functools
import threading
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.studies.designs.sobol import BITS, scrambled_sobol

#: Number of points that share one stream of random numbers; a power of two, as the Sobol' sequence requires.
STRETCH = 65_536
#: Number of points of SciPy's Sobol' sequence.
MOST_SOBOL = 2**BITS
#: Largest number of points of a Latin hypercube, which holds a permutation of all of them for each dimension.
MOST_LATIN_HYPERCUBE = 10**7

#: Number of bits of the numbers of points of a stretch.
_STRETCH_BITS = STRETCH.bit_length() - 1
#: Distance of neighbouring coordinates of Sobol' points.
_SOBOL_STEP = np.float64(2.0**-BITS)

Result = TypeVar("Result")
Sampler = Callable[[int, int, int, int, int], FloatArray]


def sobol(dimensions: int, start: int, stop: int, count: int, seed: int) -> FloatArray:
    """Points of the scrambled Sobol' sequence of `scipy.stats.qmc` (random linear matrix scramble and digital shift).

    The points start … stop - 1 of a sample of `count` are of shape (stop - start, dimensions), in [0, 1).
    """
    first, steps = _sobol_basis(dimensions, ((count - 1) // STRETCH).bit_length(), seed)

    def points(number: int, low: int, high: int) -> FloatArray:
        shift = np.zeros(dimensions, dtype=np.uint32)
        for bit, step in enumerate(steps):
            if number >> bit & 1:
                shift ^= step
        return (first[low:high] ^ shift) * _SOBOL_STEP

    return _by_stretch(dimensions, start, stop, points)


def random(dimensions: int, start: int, stop: int, count: int, seed: int) -> FloatArray:  # noqa: ARG001  (as `sobol`)
    """Independent, uniformly distributed points; parameters and result as of `sobol`."""

    def points(number: int, low: int, high: int) -> FloatArray:
        return _stream(seed, number).random((STRETCH, dimensions))[low:high]

    return _by_stretch(dimensions, start, stop, points)


def latin_hypercube(dimensions: int, start: int, stop: int, count: int, seed: int) -> FloatArray:
    """Points with one in each of `count` equal slices of every dimension; parameters and result as of `sobol`."""
    slices = _permutations(dimensions, count, seed)

    def points(number: int, low: int, high: int) -> FloatArray:
        inside = _stream(seed, 1, number).random((STRETCH, dimensions), dtype=np.float32)[low:high]
        # Half a step of the 24 random bits keeps every point off the edges of its slice by more than a rounding error.
        base = number * STRETCH
        return (slices[:, base + low : base + high].T + (inside + np.float64(2.0**-25))) / count

    return _by_stretch(dimensions, start, stop, points)


SAMPLERS: dict[str, Sampler] = {"sobol": sobol, "latin-hypercube": latin_hypercube, "random": random}


def _by_stretch(dimensions: int, start: int, stop: int, points: Callable[[int, int, int], FloatArray]) -> FloatArray:
    """Points start … stop - 1, by a function that computes points low … high - 1 of a stretch."""
    result = np.empty((stop - start, dimensions))
    for number in range(start // STRETCH, -(-stop // STRETCH)):
        base = number * STRETCH
        low, high = max(start, base), min(stop, base + STRETCH)
        result[low - start : high - start] = points(number, low - base, high - base)
    return result


def _stream(seed: int, *key: int) -> np.random.Generator:
    """The random numbers of one key. A spawn key, because entropy [seed, number] is ambiguous for large seeds."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def _cache_for_threads(function: Callable[[int, int, int], Result]) -> Callable[[int, int, int], Result]:
    """Cache the latest two results; threads that need the same one wait for a single computation."""
    lock = threading.Lock()
    cached = functools.lru_cache(maxsize=2)(function)

    @functools.wraps(function)
    def locked(dimensions: int, count: int, seed: int) -> Result:
        with lock:
            return cached(dimensions, count, seed)

    return locked


@_cache_for_threads
def _permutations(dimensions: int, count: int, seed: int) -> npt.NDArray[np.int32]:
    """The slice of each point, shape (dimensions, count)."""
    generator = _stream(seed, 0)
    slices = np.tile(np.arange(count, dtype=np.int32), (dimensions, 1))
    for row in slices:
        generator.shuffle(row)
    slices.setflags(write=False)
    return slices


@_cache_for_threads
def _sobol_basis(dimensions: int, doublings: int, seed: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """The first stretch of points, and X[2^k] ^ X[0] for each 2^k from STRETCH on.

    A point is affine over xor in the bits of its number: X[a ^ b] = X[a] ^ X[b] ^ X[0]. So each point is one of the
    first stretch, xor a step for each further bit of its number.
    """
    try:
        shift, all_steps = scrambled_sobol(dimensions, seed)
    except (OSError, KeyError):  # a SciPy with other files
        return _sobol_basis_of_scipy(dimensions, doublings, seed)
    first = np.empty((STRETCH, dimensions), dtype=np.uint32)
    first[0] = shift
    for bit, step in enumerate(all_steps[:_STRETCH_BITS]):
        first[1 << bit : 2 << bit] = first[: 1 << bit] ^ step
    return first, all_steps[_STRETCH_BITS : _STRETCH_BITS + doublings]


def _sobol_basis_of_scipy(
    dimensions: int, doublings: int, seed: int
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """The same by SciPy's engine, which computes all points before the last."""
    from scipy.stats import qmc

    engine = qmc.Sobol(dimensions, scramble=True, bits=BITS, rng=seed)
    first = _integers(engine.random(STRETCH))
    steps = np.empty((doublings, dimensions), dtype=np.uint32)
    for k in range(doublings):
        engine.fast_forward((STRETCH << k) - engine.num_generated)
        steps[k] = _integers(engine.random(1))[0] ^ first[0]
    return first, steps


def _integers(points: FloatArray) -> npt.NDArray[np.uint32]:
    return (points / _SOBOL_STEP).astype(np.uint32)
