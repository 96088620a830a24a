"""Grid and Sobol' designs: any block from its number, stable numbers."""

import itertools

import numpy as np
import pytest

from explore.design_space import BLOCK_SIZE, Continuous, DesignSpace, Listed, Spaced

AXES = (
    Listed("crank", (1.0, 5.0, 2.0)),
    Spaced("coupler", 10.0, 11.0, 7),
    Listed("rocker", (3.0,)),
    Listed("speed", (4.0, 6.0)),
)


def test_a_grid_is_the_product_with_the_last_axis_fastest():
    space = DesignSpace.grid(AXES)
    expected = list(itertools.product((1.0, 5.0, 2.0), np.linspace(10, 11, 7), (3.0,), (4.0, 6.0)))

    columns = space.designs(0, space.count)

    assert space.count == 42
    assert list(columns) == ["crank", "coupler", "rocker", "speed"]
    np.testing.assert_allclose(np.column_stack(list(columns.values())), expected, rtol=1e-15)  # one rounding
    assert columns["coupler"].max() == 11.0  # both ends exactly


def test_a_block_is_computed_from_its_number_without_the_grid():
    space = DesignSpace.grid((Spaced("crank", 1.0, 2.0, 10**9), Spaced("coupler", 1.0, 2.0, 10**6)))

    block = space.block(space.n_blocks - 1)

    assert space.count == 10**15
    assert block.start == (space.n_blocks - 1) * BLOCK_SIZE
    assert block.columns["crank"][-1] == 2.0
    assert block.columns["coupler"][-1] == 2.0


@pytest.mark.parametrize("method", ["grid", "sobol"])
def test_blocks_are_slices_of_the_whole(method):
    if method == "grid":
        space = DesignSpace.grid((Spaced("crank", 1.0, 2.0, 401), Spaced("coupler", 1.0, 9.0, 401)))
    else:
        space = DesignSpace((Continuous("crank", 1.0, 2.0), Listed("speed", (1.0, 2.0, 3.0))), "sobol", 160_801, 7)
    whole = space.designs(0, space.count)

    for number in (2, 0, 1):
        block = space.block(number)
        for name, column in block.columns.items():
            np.testing.assert_array_equal(column, whole[name][block.start : block.start + BLOCK_SIZE])


def test_sobol_designs_fill_the_box_evenly_and_follow_the_seed():
    axes = (
        Continuous("crank", 2.0, 4.0),
        Continuous("ground", 1.0, 1000.0, log=True),
        Listed("phases", (1.0, 2.0, 3.0, 4.0)),
    )
    columns = DesignSpace(axes, "sobol", 4096, 1).designs(0, 4096)

    # A scrambled Sobol' sequence puts exactly one of 4096 points into each of 4096 equal slices of every axis.
    np.testing.assert_array_equal(np.sort(np.floor((columns["crank"] - 2) / 2 * 4096)), np.arange(4096))
    np.testing.assert_array_equal(np.unique(columns["phases"], return_counts=True)[1], [1024] * 4)
    # evenly in the logarithm; slices shifted by rounding at their edges may hold 0 or 2
    slices = np.floor(np.log(columns["ground"]) / np.log(1000) * 4096)
    assert len(np.unique(slices)) > 4000
    assert (columns["crank"] != DesignSpace(axes, "sobol", 4096, 2).designs(0, 4096)["crank"]).any()


def test_sobol_of_fixed_values_only_repeats_them():
    columns = DesignSpace((Listed("crank", (3.0,)),), "sobol", 5, 0).designs(0, 5)

    np.testing.assert_array_equal(columns["crank"], [3.0] * 5)
