"""An atlas of coupler curves: shapes of four-bars spread over all proportions, and what their curves look like.

Shapes have a crank of 1. A curve is described by the Fourier coefficients of its points at equal steps of its length:
their magnitudes do not change with place, turn, start and sense of travel, nor their ratios with size.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.paths.curves import step_paths

IntArray = npt.NDArray[np.intp]

#: Number of crank angles of a curve.
N_ANGLES = 128
#: Number of points of a curve at equal steps of its length.
N_STEPS = 64
#: Number of harmonics that describe a curve.
N_HARMONICS = 5
#: Least Grashof sum less twice the longest and shortest link, in cranks.
_LEAST_SUM = 0.02
#: Largest Grashof sum less twice the longest and shortest link, in cranks.
_LARGEST_SUM = 30.0
#: Least distance of the coupler point from the crank's pin over the mean of crank and coupler.
_LEAST_DISTANCE = 0.1
#: Largest distance of the coupler point from the crank's pin over the mean of crank and coupler.
_LARGEST_DISTANCE = 10.0


def draw_shapes(count: int, seed: int = 0, *, is_ground_longer: bool = True) -> FloatArray:
    """Crank, coupler, rocker, ground and both coordinates of the coupler point along the coupler, shape (count, 6).

    The logarithms of a = coupler + rocker - crank - ground, b = ground + rocker - crank - coupler and c = ground +
    coupler - crank - rocker, all positive for the shapes whose crank turns and is shortest, are spread evenly by Sobol'
    points. Double cranks, whose ground is shortest, are the same with crank and ground exchanged.
    """
    from scipy.stats import qmc

    u = qmc.Sobol(5, seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count]
    a, b, c = np.exp(np.log(_LEAST_SUM) + np.log(_LARGEST_SUM / _LEAST_SUM) * u[:, :3]).T
    coupler = 1.0 + 0.5 * (a + c)
    distance = np.exp(np.log(_LEAST_DISTANCE) + np.log(_LARGEST_DISTANCE / _LEAST_DISTANCE) * u[:, 4]) * np.sqrt(
        coupler
    )
    angle = 2.0 * np.pi * u[:, 3]
    ones = np.ones(count)
    shortest, longer = ones, 1.0 + 0.5 * (b + c)
    crank, ground = (shortest, longer) if is_ground_longer else (longer, shortest)
    lengths = [crank, coupler, 1.0 + 0.5 * (a + b), ground]
    return np.ascontiguousarray(np.column_stack([*lengths, distance * np.cos(angle), distance * np.sin(angle)]))


def even_points(shapes: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Points at equal steps of length, (n, N_STEPS), and the length up to each of N_ANGLES + 1 crank angles."""
    rays = np.exp(2j * np.pi * np.arange(N_ANGLES) / N_ANGLES)
    points = np.empty((len(shapes), N_STEPS), dtype=np.complex128)
    lengths = np.empty((len(shapes), N_ANGLES + 1))
    step_paths(shapes, rays, np.empty(N_ANGLES, dtype=np.complex128), points, lengths)
    return points, lengths


def describe(points: ComplexArray) -> FloatArray:
    """Descriptions, (n, 2 N_HARMONICS), of how closed curves look, from points at equal steps of their length.

    Magnitudes of the Fourier coefficients of both senses, over the root of the sum of all squares; the sense with the
    larger first one comes first.
    """
    harmonics = np.abs(np.fft.fft(points, axis=1))
    harmonics[:, 0] = 0.0
    harmonics /= np.sqrt((harmonics**2).sum(axis=1, keepdims=True)) + 1e-300
    forward, backward = harmonics[:, 1 : N_HARMONICS + 1], harmonics[:, : -N_HARMONICS - 1 : -1]
    swapped = (forward[:, 0] < backward[:, 0])[:, None]
    return np.hstack([np.where(swapped, backward, forward), np.where(swapped, forward, backward)])


@dataclass(frozen=True)
class Atlas:
    """Shapes and the features of their curves."""

    shapes: FloatArray
    features: FloatArray

    def nearest(self, features: FloatArray, count: int) -> IntArray:
        """Numbers of the shapes whose curves look most alike, nearest first."""
        distances = ((self.features - features.astype(np.float32)) ** 2).sum(axis=1)
        count = min(count, len(distances))
        found = np.argpartition(distances, count - 1)[:count]
        return np.asarray(found[np.argsort(distances[found], kind="stable")])


@lru_cache(maxsize=4)
def make_atlas(count: int, *, is_ground_longer: bool = True) -> Atlas:
    """An atlas of crank-rockers or double cranks; it is kept for the next task."""
    shapes = draw_shapes(count, is_ground_longer=is_ground_longer)
    chunks = [describe(even_points(shapes[k : k + 4096])[0]) for k in range(0, count, 4096)]
    return Atlas(shapes, np.concatenate(chunks).astype(np.float32))
