"""Pareto sets against brute force, with everything that trips non-dominated sorting libraries."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import explore
from explore.ranking.pareto import front, front_numbers, fronts, nondominated
from explore.ranking.tallies import Tally
from explore.vocabulary import Objective


def brute_force(values):
    """Rows that no row beats: at least as good in all and better in one."""
    better = (values[:, None, :] <= values[None, :, :]).all(axis=2) & (values[:, None, :] < values[None, :, :]).any(
        axis=2
    )
    return ~better.any(axis=0)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    hnp.arrays(
        np.float64,
        st.tuples(st.integers(1, 40), st.integers(1, 4)),
        elements=st.one_of(st.integers(-3, 3).map(float), st.floats(-1e300, 1e300)),
    )
)
def test_the_front_is_that_of_brute_force_with_all_ties(values):
    np.testing.assert_array_equal(nondominated(values), brute_force(values))


def brute_force_fronts(values, most):
    """The front of each row by taking one front after the other away; 0 beyond the first `most`."""
    numbers = np.zeros(len(values), dtype=int)
    for number in range(1, most + 1):
        left = np.flatnonzero(numbers == 0)
        numbers[left[brute_force(values[left])]] = number
    return numbers


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    hnp.arrays(np.float64, st.tuples(st.integers(1, 60), st.integers(1, 4)), elements=st.integers(-4, 4).map(float)),
    st.integers(1, 5),
    st.lists(st.integers(0, 20), max_size=6),
)
def test_several_fronts_are_those_of_brute_force_however_the_designs_come(values, most, sizes):
    expected = brute_force_fronts(values, most)
    np.testing.assert_array_equal(front_numbers(values, most), expected)

    frame = pd.DataFrame(values, columns=[f"m{k}" for k in range(values.shape[1])]).assign(
        design=np.arange(len(values))
    )
    objectives = [Objective(name, "min") for name in frame.columns[:-1]]
    rest = max(len(values) - sum(sizes), 0)
    rows, numbers = fronts(blocks_of(frame, [*sizes, rest]), objectives, most)

    np.testing.assert_array_equal(rows, np.flatnonzero(expected))
    np.testing.assert_array_equal(numbers, expected[expected > 0])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_never_reaches_the_sorting_library(bad):
    with pytest.raises(explore.RequestError, match="finite"):
        nondominated(np.array([[1.0, 2.0], [bad, 0.0]]))


def blocks_of(frame, sizes):
    start = 0
    for size in sizes:
        yield {name: frame[name].to_numpy()[start : start + size] for name in frame.columns}
        start += size


def test_the_front_does_not_depend_on_blocks_and_leaves_out_what_does_not_count():
    rng = np.random.default_rng(3)
    n = 3000
    frame = pd.DataFrame(
        {
            "design": np.arange(n) + 1000,
            "cost": rng.integers(0, 40, n).astype(float),  # many ties
            "gain": rng.normal(size=n),
            "feasible": rng.random(n) < 0.7,
            "status": np.where(rng.random(n) < 0.9, 1, 3).astype(np.int8),
            "gain_margin": rng.normal(size=n),
        }
    )
    frame.loc[rng.random(n) < 0.05, "gain"] = np.nan
    frame.loc[::97, "gain"] = np.inf
    objectives = [Objective("cost", "min"), Objective("gain", "max")]
    tally = Tally(("gain_margin",))

    rows = front(blocks_of(frame, [1, 999, 1500, 500]), objectives, tally)

    usable = frame["feasible"] & np.isfinite(frame["gain"])
    values = frame.loc[usable, ["cost", "gain"]].to_numpy() * [1, -1]
    np.testing.assert_array_equal(rows, frame.loc[usable, "design"][brute_force(values)])
    assert tally.ranked == usable.sum()
    assert tally.not_finite == (frame["feasible"] & ~np.isfinite(frame["gain"])).sum()
    assert tally.by_status["crank_blocked"] == (frame["status"] == 3).sum()
    assert tally.by_constraint["gain_margin"] == ((frame["gain_margin"] < 0) & (frame["status"] == 1)).sum()


def test_labels_of_a_table_may_repeat():
    table = pd.DataFrame({"a": [1.0, 2, 3, 4], "b": [1.0, 2, 3, 4]}, index=[0, 0, 1, 1])

    ranked = explore.rank(table, ["a:min", "b:min"], fronts=4)

    assert ranked["a"].tolist() == [1, 2, 3, 4]
    assert ranked["front"].tolist() == [1, 2, 3, 4]


def test_an_undefined_constraint_is_counted_as_such():
    columns = {"feasible": np.array([False]), "status": np.array([1]), "cv_margin": np.array([np.nan])}
    tally = Tally(("cv_margin",))

    tally.add(columns, np.array([False]), np.array([True]))

    assert tally.undefined["cv_margin"] == 1
    assert tally.by_constraint["cv_margin"] == 0


def test_any_table_can_be_ranked_in_fronts():
    table = pd.DataFrame(
        {"cv": [1.0, 2.0, 2.0, 3.0, 1.0], "swing_angle": [1.0, 5.0, 5.0, 4.0, 0.0]}, index=list("abcde")
    )

    first = explore.rank(table, ["cv", "swing_angle:max"], order_by="swing_angle:max")
    both = explore.rank(table, ["cv", "swing_angle:max"], fronts=5)

    assert first.index.tolist() == ["b", "c", "a"]
    assert both.index.tolist() == ["a", "b", "c", "e", "d"]
    assert both["front"].tolist() == [1, 1, 1, 2, 2]


@pytest.mark.parametrize(
    ("metrics", "message"),
    [
        (["swing_angel:max"], "did you mean 'swing_angle'"),
        (["swing_angle"], "swing_angle:min or swing_angle:max"),
        (["swing_angle:big"], "min or max"),
        (None, "give metrics"),
        ([], "give metrics"),
        (["words:min"], "does not hold numbers"),
    ],
)
def test_wrong_objectives_get_one_line(metrics, message):
    with pytest.raises(explore.RequestError, match=message):
        explore.rank(pd.DataFrame({"cv": [1.0], "swing_angle": [1.0], "words": ["a"]}), metrics)


def test_nothing_feasible_gives_an_empty_table():
    table = pd.DataFrame({"cv": [1.0, 2.0], "feasible": [False, False]})

    ranked = explore.rank(table, ["cv"])

    assert ranked.empty
    assert "front" in ranked.columns
