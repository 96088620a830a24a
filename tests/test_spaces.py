"""Designs of every sampling method, and blocks computed from their numbers."""

import itertools
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from explore.studies.designs.samplers import SAMPLERS
from explore.studies.designs.spaces import (
    BLOCK_SIZE,
    ContinuousAxis,
    Grid,
    ListedAxis,
    Sample,
    SpacedAxis,
    Table,
    TableAxis,
)

AXES = (
    ListedAxis("crank", (1.0, 5.0, 2.0)),
    SpacedAxis("coupler", 10.0, 11.0, 7),
    ListedAxis("rocker", (3.0,)),
    ListedAxis("speed", (4.0, 6.0)),
)
METHODS = ("grid", *SAMPLERS, "table")
COUNTS = st.integers(1, 300) | st.builds(
    lambda n, more: n * BLOCK_SIZE + more, st.integers(1, 2), st.integers(-2, 9999)
)


def space_of(method, count, seed=7):
    """A space of this method with about this count and every kind of axis that the method has."""
    if method == "grid":
        return Grid.over(
            (SpacedAxis("crank", 1.0, 2.0, -(-count // 6)), *AXES[2:], ListedAxis("phases", (1.0, 2.0, 3.0)))
        )
    if method == "table":
        rows = np.random.default_rng(seed).random((2, count)) + 1.0
        return Table((TableAxis("crank", rows[0]), ListedAxis("rocker", (3.0,)), TableAxis("speed", rows[1])), count)
    axes = (ContinuousAxis("crank", 1.0, 2.0), ContinuousAxis("ground", 0.5, 800.0, log=True), *AXES[1:])
    return Sample(axes, count, method, seed)


def assert_equal(columns, others):
    assert list(columns) == list(others)
    for name, column in columns.items():
        np.testing.assert_array_equal(column, others[name])


# The grid


def test_a_grid_is_the_product_with_the_last_axis_fastest():
    space = Grid.over(AXES)
    expected = list(itertools.product((1.0, 5.0, 2.0), np.linspace(10, 11, 7), (3.0,), (4.0, 6.0)))

    columns = space.designs(0, space.n_designs)

    assert space.n_designs == 42
    assert list(columns) == ["crank", "coupler", "rocker", "speed"]
    np.testing.assert_allclose(np.column_stack(list(columns.values())), expected, rtol=1e-15)  # one rounding
    assert columns["coupler"].max() == 11.0  # both ends exactly


def test_a_block_is_computed_from_its_number_without_the_grid():
    space = Grid.over((SpacedAxis("crank", 1.0, 2.0, 10**9), SpacedAxis("coupler", 1.0, 2.0, 10**6)))

    block = space.block(space.n_blocks - 1)

    assert space.n_designs == 10**15
    assert block.start == (space.n_blocks - 1) * BLOCK_SIZE
    assert block.columns["crank"][-1] == 2.0
    assert block.columns["coupler"][-1] == 2.0


def test_the_edges_of_a_grid_of_a_million_million_designs():
    space = Grid.over((SpacedAxis("crank", 0.0, 999.0, 1000), SpacedAxis("coupler", 0.0, 99_999.0, 10**5), *AXES[2:3],
                       SpacedAxis("speed", 0.0, 9_999.0, 10_000)))  # fmt: skip
    assert space.n_designs == 10**12
    # The axes count up, so a design's number can be read from its values.
    for start in (0, 9_998, 10**9 - 2, 2**31 - 2, 2**32 - 2, 10**12 // 2, 10**12 - 4):
        columns = space.designs(start, start + 4)
        numbers = (columns["crank"] * 10**5 + columns["coupler"]) * 10**4 + columns["speed"]
        np.testing.assert_array_equal(numbers, np.arange(start, start + 4))


# All methods


@pytest.mark.parametrize("method", METHODS)
def test_blocks_are_slices_of_the_whole(method):
    space = space_of(method, 160_801)
    whole = space.designs(0, space.n_designs)

    for number in (2, 0, 1):
        block = space.block(number)
        assert block.start == number * BLOCK_SIZE
        assert_equal(block.columns, {k: v[block.start : block.start + BLOCK_SIZE] for k, v in whole.items()})


@settings(max_examples=60, derandomize=True, database=None, deadline=None)
@given(st.data(), st.sampled_from(METHODS), COUNTS, st.integers(0, 2**63 - 1))
def test_any_split_gives_the_same_designs_within_the_bounds(data, method, count, seed):
    space = space_of(method, count, seed)
    whole = space.designs(0, space.n_designs)
    cuts = data.draw(st.lists(st.integers(0, space.n_designs), max_size=3))
    splits = [sorted({0, space.n_designs, *cuts}), [*range(0, space.n_designs, BLOCK_SIZE), space.n_designs]]

    for split in splits:
        parts = [space.designs(start, stop) for start, stop in itertools.pairwise(split)]
        assert_equal(whole, {name: np.concatenate([part[name] for part in parts]) for name in whole})
    copy = pickle.loads(pickle.dumps(space))
    for number in range(space.n_blocks):
        block, other = space.block(number), copy.space_for_block(number).block(number)
        assert (block.number, block.start) == (other.number, other.start)
        assert_equal(block.columns, other.columns)

    assert all(column.shape == (space.n_designs,) and column.dtype == np.float64 for column in whole.values())
    for axis in space.axes:
        column = whole[axis.name]
        if isinstance(axis, ContinuousAxis):
            assert ((column >= axis.low) & (column <= axis.high)).all()
        elif not isinstance(axis, TableAxis):
            assert np.isin(column, axis.values_at(np.arange(len(axis)))).all()


@pytest.mark.parametrize("method", METHODS)
def test_another_process_makes_the_same_designs(method):
    space = space_of(method, 2 * BLOCK_SIZE)
    program = (
        "import pickle, sys; space = pickle.load(sys.stdin.buffer); pickle.dump(space.block(1), sys.stdout.buffer)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONHASHSEED": "1"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        input=pickle.dumps(space.space_for_block(1)), capture_output=True, check=True, env=environment,
    )  # fmt: skip
    assert_equal(space.block(1).columns, pickle.loads(done.stdout).columns)


@pytest.mark.parametrize("method", METHODS)
def test_the_space_sent_to_a_worker_is_small(method):
    space = space_of(method, 20 * BLOCK_SIZE)
    size = len(pickle.dumps(space.space_for_block(13)))
    # two columns of eight bytes, and some hundred bytes of names and axes
    assert size < (2 * 8 * BLOCK_SIZE if method == "table" else 0) + 1000


@pytest.mark.parametrize("method", METHODS)
def test_designs_belong_to_the_caller(method):
    space = space_of(method, 100)
    before = {name: column.copy() for name, column in space.designs(0, 100).items()}
    for column in space.designs(0, 100).values():
        column[:] = -1.0
    assert_equal(space.designs(0, 100), before)


# Drawing


@pytest.mark.parametrize("method", SAMPLERS)
def test_fixed_values_only_are_repeated(method):
    columns = Sample((ListedAxis("crank", (3.0,)),), 5, method).designs(0, 5)
    np.testing.assert_array_equal(columns["crank"], [3.0] * 5)


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube"])
def test_designs_fill_the_box_evenly_and_follow_the_seed(method):
    axes = (
        ContinuousAxis("crank", 2.0, 4.0),
        ContinuousAxis("ground", 1.0, 1000.0, log=True),
        ListedAxis("phases", (1.0, 2.0, 3.0, 4.0)),
    )
    columns = Sample(axes, 4096, method, 1).designs(0, 4096)

    # Exactly one of 4096 points lies in each of 4096 equal slices of every axis.
    np.testing.assert_array_equal(np.sort(np.floor((columns["crank"] - 2) / 2 * 4096)), np.arange(4096))
    np.testing.assert_array_equal(np.unique(columns["phases"], return_counts=True)[1], [1024] * 4)
    # evenly in the logarithm; slices shifted by rounding at their edges may hold 0 or 2
    slices = np.floor(np.log(columns["ground"]) / np.log(1000) * 4096)
    assert len(np.unique(slices)) > 4000
    assert (columns["crank"] != Sample(axes, 4096, method, 2).designs(0, 4096)["crank"]).any()


@pytest.mark.parametrize("count", [10_000, 10_001, 65_539])
def test_lists_in_a_latin_hypercube_are_balanced(count):
    axes = (ListedAxis("crank", (5.0, 1.0, 3.0)), SpacedAxis("coupler", 1.0, 2.0, 7))
    for name, column in Sample(axes, count, "latin-hypercube", 1).designs(0, count).items():
        values, counts = np.unique(column, return_counts=True)
        assert len(values) == {"crank": 3, "coupler": 7}[name]
        # of the slices that a value shares with its neighbours, one at either end, it gets all or nothing
        assert np.abs(counts - count / len(values)).max() < 2


def test_random_designs_follow_their_distributions():
    n = 100_000
    axes = (
        ListedAxis("crank", (5.0, 1.0, 3.0)),
        ContinuousAxis("ground", 0.01, 1000.0, log=True),
        ContinuousAxis("rocker", -1, 3),
    )
    columns = Sample(axes, n, "random", 3).designs(0, n)

    counts = np.unique(columns["crank"], return_counts=True)[1]
    assert np.abs(counts - n / 3).max() < 4 * np.sqrt(n * 2 / 9)  # 4 standard deviations of a binomial count
    # The Kolmogorov-Smirnov distance passes 1.95 / sqrt(n) once in a thousand samples; the seed is fixed.
    assert stats.kstest(np.log10(columns["ground"]), stats.uniform(-2, 5).cdf).statistic < 1.95 / np.sqrt(n)
    assert stats.kstest(columns["rocker"], stats.uniform(-1, 4).cdf).statistic < 1.95 / np.sqrt(n)


@pytest.mark.parametrize("count", [1, BLOCK_SIZE, 2 * BLOCK_SIZE, 2 * BLOCK_SIZE + 1])
def test_no_block_is_empty(count):
    space = Sample((ContinuousAxis("crank", 1.0, 2.0),), count, "random", 1)
    assert space.n_blocks == {1: 1, BLOCK_SIZE: 1, 2 * BLOCK_SIZE: 2, 2 * BLOCK_SIZE + 1: 3}[count]
    assert len(space.block(space.n_blocks - 1).columns["crank"]) == (count - 1) % BLOCK_SIZE + 1


@pytest.mark.parametrize("log", [False, True])
def test_rounding_leaves_no_value_outside_its_range(log):
    """The exponential of a logarithm, or a sum, may miss a bound by a unit in the last place."""
    ends = np.array([0.0, np.nextafter(1.0, 0.0)])
    for low, high in np.sort(np.random.default_rng(1).uniform(0.1, 1000.0, (500, 2)), axis=1).tolist():
        values = ContinuousAxis("crank", low, high, log=log).values_at_fractions(ends)
        assert low <= values.min() <= values.max() <= high


def test_an_even_axis_ends_exactly_at_its_stop():
    """The sum of the start and all steps misses it now and then."""
    for start, stop in np.sort(np.random.default_rng(2).uniform(0.1, 1000.0, (300, 2)), axis=1).tolist():
        assert SpacedAxis("crank", start, stop, 50).values_at(np.array([0, 49])).tolist() == [start, stop]


@pytest.mark.parametrize(
    ("start", "stop", "expected"),
    [
        (0.01, 1.0, [k / 100 for k in range(1, 101)]),
        (1.1, 1.9, [k / 10 for k in range(11, 20)]),
        (-0.3, 0.3, [k / 10 for k in range(-3, 4)]),
        (25.4, 254.0, [254 * k / 10 for k in range(1, 11)]),
        (1e-3, 1e3, [1e-3, 166.6675, 333.334, 500.0005, 666.667, 833.3335, 1e3]),
        (0.3, 3000000.3, [k + 0.3 for k in range(0, 3000001, 100000)]),
    ],
)
def test_an_even_axis_has_the_decimals_that_a_condition_names(start, stop, expected):
    """0.06 and not 0.060000000000000005, which `crank <= 0.06` would leave out."""
    count = len(expected)
    assert SpacedAxis("crank", start, stop, count).values_at(np.arange(count)).tolist() == expected


def test_an_even_axis_of_a_narrow_range_keeps_its_values():
    stop = 1.0 + 100 * np.spacing(1.0)
    values = SpacedAxis("crank", 1.0, stop, 101).values_at(np.arange(101))
    assert values.tolist() == (1.0 + np.arange(101) * np.spacing(1.0)).tolist()
    thirds = SpacedAxis("crank", 0.0, 1.0, 4).values_at(np.arange(4))
    assert thirds.tolist() == [0.0, 1 / 3, 2 / 3, 1.0]
