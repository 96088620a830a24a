"""The samplers of the unit cube against SciPy, counting and probability theory."""

import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

import numpy as np
import pytest
from scipy import stats

from explore.studies.designs import samplers
from explore.studies.designs.samplers import MOST_SOBOL, SAMPLERS, STRETCH, latin_hypercube, random, sobol
from explore.studies.designs.sobol import scrambled_sobol


@pytest.mark.parametrize("dimensions", [1, 5])
def test_sobol_is_bit_for_bit_that_of_scipy(dimensions):
    n = 70  # across an edge of a stretch where there is one
    places = [n, STRETCH - 30, 2 * STRETCH, 3 * STRETCH - 1, 2**20 - 5, 5 * 2**20 + 12_345, 2**27 - 3]
    places += [2**29 - 30, MOST_SOBOL - STRETCH - 7, MOST_SOBOL - n]
    engine = stats.qmc.Sobol(dimensions, scramble=True, rng=11)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="The balance properties")
        np.testing.assert_array_equal(sobol(dimensions, 0, n, MOST_SOBOL, 11), engine.random(n))
    for start in places:
        engine.fast_forward(start - engine.num_generated)
        np.testing.assert_array_equal(sobol(dimensions, start, start + n, MOST_SOBOL, 11), engine.random(n))


@pytest.mark.parametrize("dimensions", [2, 40, 200])
@pytest.mark.parametrize("seed", [0, 2**70])
def test_sobol_does_without_the_files_of_scipy(dimensions, seed, monkeypatch, tmp_path):
    own = scrambled_sobol(dimensions, seed)
    monkeypatch.setattr("explore.studies.designs.sobol._DIRECTIONS", tmp_path / "moved.npz")
    first, steps = samplers._sobol_basis(dimensions, 2, seed)
    np.testing.assert_array_equal(own[0], first[0])
    np.testing.assert_array_equal(own[1][4] ^ own[0], first[16])
    np.testing.assert_array_equal(own[1][16:18], steps)


@pytest.mark.parametrize("count", [1, 2, STRETCH, STRETCH + 1, 2 * STRETCH, 2 * STRETCH + 1])
def test_sobol_does_not_depend_on_the_count(count):
    last = sobol(3, count - 1, count, count, 4)
    np.testing.assert_array_equal(last, sobol(3, count - 1, count, MOST_SOBOL, 4))


def test_the_first_random_points_do_not_change_when_the_count_grows():
    few = random(2, 0, 1000, 1000, 5)
    np.testing.assert_array_equal(few, random(2, 0, 1000, 10**9, 5))


def test_random_streams_differ_between_blocks_and_seeds():
    # [seed, number] as plain entropy would give seed 5 + 7 * 2^32 in block 0 the stream of seed 5 in block 7
    streams = [(5, 0), (5, 7), (7, 5), (5 + 7 * 2**32, 0), (6, 0)]
    first = {random(1, number * STRETCH, number * STRETCH + 1, 2**40, seed)[0, 0] for seed, number in streams}
    assert len(first) == len(streams)


@pytest.mark.parametrize("start", [0, 2**40 * STRETCH - 50_000])
def test_random_points_are_uniform_and_independent(start):
    n = 100_000
    points = random(3, start, start + n, 2**62, 3)
    # The Kolmogorov-Smirnov distance passes 1.95 / sqrt(n) once in a thousand samples; the seed is fixed.
    for column in points.T:
        assert stats.kstest(column, "uniform").statistic < 1.95 / np.sqrt(n)
    # Correlations, between dimensions and from point to point, have standard deviation 1 / sqrt(n); 4 of these.
    pairs = np.corrcoef(np.column_stack([points[:-1], points[1:]]).T)
    assert np.abs(pairs - np.eye(6)).max() < 4 / np.sqrt(n)


@pytest.mark.parametrize("count", [1, 2, 7, 1000, STRETCH, 3 * STRETCH + 17, 1_000_003])
def test_a_latin_hypercube_has_one_point_in_each_slice_of_each_dimension(count):
    points = latin_hypercube(3, 0, count, count, 1)
    for column in np.sort(points, axis=0).T:
        np.testing.assert_array_equal(np.floor(column * count), np.arange(count))


def test_a_latin_hypercube_at_its_limit():
    count = samplers.MOST_LATIN_HYPERCUBE
    seen = np.zeros(count, dtype=np.int8)
    for start in range(0, count, 10 * STRETCH):
        column = latin_hypercube(1, start, min(start + 10 * STRETCH, count), count, 1)[:, 0]
        seen[np.floor(column * count).astype(np.int64)] += 1
    assert (seen == 1).all()


class EdgeStream:
    """Random numbers that are all at one end of their range; permutations are those of the seed."""

    def __init__(self, stream, at_end):
        self.shuffle, self._at_end = stream.shuffle, at_end

    def random(self, shape, dtype):
        smallest, largest = 0.0, 1.0 - 2.0**-24  # 24 random bits in single precision
        return np.full(shape, largest if self._at_end else smallest, dtype)


@pytest.mark.parametrize("count", [7, 1000, samplers.MOST_LATIN_HYPERCUBE])
@pytest.mark.parametrize("at_end", [False, True])
def test_points_of_a_latin_hypercube_keep_off_the_edges_of_their_slices(monkeypatch, count, at_end):
    """A random number of exactly 0 occurs once in 2^24 points: a point on an edge may round into the slice before."""
    stream = samplers._stream
    monkeypatch.setattr(samplers, "_stream", lambda *key: EdgeStream(stream(*key), at_end))
    points = latin_hypercube(1, 0, min(count, 1000), count, 8)[:, 0]
    inside = [Fraction(point) * count % 1 for point in points.tolist()]  # in exact arithmetic
    # The sum of slice and offset has at most 24 + 25 bits and is exact. The quotient, below 1, is rounded by at most
    # 2^-54, which is less than 0.02 of an offset of 2^-25 even in slices of 1e-7.
    expected = 1.0 - 2.0**-25 if at_end else 2.0**-25
    assert max(abs(place - Fraction(expected)) for place in inside) <= count * Fraction(1, 2**54)


def test_a_latin_hypercube_is_random_within_its_slices_and_in_their_order():
    n = 50_000
    points = latin_hypercube(2, 0, n, n, 2)
    inside = points * n % 1.0
    for column in inside.T:
        assert stats.kstest(column, "uniform").statistic < 1.95 / np.sqrt(n)  # as above
    pairs = np.corrcoef(np.column_stack([points, inside, np.arange(n)]).T)
    assert np.abs(pairs - np.eye(5)).max() < 4 / np.sqrt(n)
    assert (latin_hypercube(2, 0, n, n, 3) != points).all()


def test_the_mean_of_a_sum_is_far_better_with_a_latin_hypercube_than_with_random_points():
    n, seeds = 256, 40
    errors = {
        sampler: np.array([sampler(3, 0, n, n, seed).sum(axis=1).mean() - 1.5 for seed in range(seeds)])
        for sampler in (random, latin_hypercube)
    }
    # In theory 3 / (12 n) and, as only the place within a slice is free, 3 / (12 n^3). Variances of 40 samples
    # scatter by sqrt(2 / 39) = 0.23; 4 of these.
    for sampler, variance in ((random, 3 / (12 * n)), (latin_hypercube, 3 / (12 * n**3))):
        assert errors[sampler].var(ddof=1) == pytest.approx(variance, rel=4 * np.sqrt(2 / (seeds - 1)))


@pytest.mark.parametrize("name", SAMPLERS)
def test_an_empty_range_is_empty(name):
    for place in (0, 5, STRETCH, 100_000):
        assert SAMPLERS[name](2, place, place, 100_000, 0).shape == (0, 2)


def test_threads_share_one_computation(monkeypatch):
    calls = []

    @samplers._cache_for_threads
    def slow(dimensions, count, seed):
        calls.append(threading.get_ident())
        time.sleep(0.05)
        return dimensions + count + seed

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(lambda _: slow(1, 2, 3), range(8))) == [6] * 8
    assert len(calls) == 1


def test_the_permutations_are_made_once_and_cannot_be_changed():
    first = samplers._permutations(2, 1000, 9)
    assert samplers._permutations(2, 1000, 9) is first
    assert first.dtype == np.int32
    assert not first.flags.writeable
