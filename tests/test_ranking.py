"""Pareto fronts against brute force, with ties, duplicates and numbers that are not finite."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import explore
from explore.model.columns import Column
from explore.model.request import Objective
from explore.results.ranking import pareto
from explore.results.ranking.joint import _differences
from explore.results.ranking.pareto import find_front, find_fronts, front_numbers, is_nondominated
from explore.results.ranking.tallies import Tally


def brute_force(values):
    """Mask of the rows that no row dominates: at least as good in all columns and better in one."""
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
    for few_rows in (len(values) + 1, 0):  # sorted at once, or what the grid leaves of it
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pareto, "_FEW_ROWS", few_rows)
            np.testing.assert_array_equal(is_nondominated(values), brute_force(values))


@pytest.mark.parametrize("outlier", [1e6, -1e6])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_the_grid_leaves_few_rows_and_each_one_of_the_front(m, outlier):
    rng = np.random.default_rng(m)
    values = rng.normal(size=(65_536, m))
    values[::1000, 0] = outlier * np.abs(values[::1000, 0])  # as accelerations near a change point are

    kept = pareto._may_be_nondominated(values)

    assert kept[is_nondominated(values)].all()
    assert kept.sum() < 0.05 * len(values)  # else it would not pay; 0.026 at most here


def brute_force_fronts(values, most):
    """The front of each row by removing one front after the other; 0 beyond the first `most`."""
    numbers = np.zeros(len(values), dtype=int)
    for number in range(1, most + 1):
        remaining = np.flatnonzero(numbers == 0)
        numbers[remaining[brute_force(values[remaining])]] = number
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
    rows, numbers = find_fronts(blocks_of(frame, [*sizes, rest]), objectives, most)

    np.testing.assert_array_equal(rows, np.flatnonzero(expected))
    np.testing.assert_array_equal(numbers, expected[expected > 0])


@pytest.mark.parametrize(
    ("sizes", "most", "share"),
    [
        ([4000], 1, 1),  # a table, or the front of a sweep and one more block of it
        ([0, 4000, 0, 0], 1, 1),
        ([4000], 3, 1),
        ([1000] * 4, 1, 1 + 0.5 + 1),  # each block; the first two; all
    ],
)
def test_a_front_that_keeps_everything_is_not_sorted_again(monkeypatch, sizes, most, share):
    """Rows that reach the sorting library, as a share of all rows."""
    sorted_rows = []

    def counting(values):
        sorted_rows.append(len(values))
        return is_nondominated(values)

    monkeypatch.setattr(pareto, "is_nondominated", counting)
    values = np.abs(np.random.default_rng(5).standard_normal((4000, 5)))
    values /= np.linalg.norm(values, axis=1, keepdims=True)
    frame = pd.DataFrame(values, columns=list("abcde")).assign(design=np.arange(4000))

    rows, numbers = find_fronts(blocks_of(frame, sizes), [Objective(name, "min") for name in "abcde"], most)

    np.testing.assert_array_equal(rows, np.arange(4000))
    np.testing.assert_array_equal(numbers, 1)
    assert sum(sorted_rows) == share * 4000


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_never_reaches_the_sorting_library(bad):
    with pytest.raises(explore.RequestError, match="finite"):
        is_nondominated(np.array([[1.0, 2.0], [bad, 0.0]]))


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
    tally = Tally(("gain_margin",), {3: "crank_blocked"})

    rows = find_front(blocks_of(frame, [1, 999, 1500, 500]), objectives, tally)

    usable = frame["feasible"] & np.isfinite(frame["gain"])
    values = frame.loc[usable, ["cost", "gain"]].to_numpy() * [1, -1]
    np.testing.assert_array_equal(rows, frame.loc[usable, "design"][brute_force(values)])
    assert tally.n_ranked == usable.sum()
    assert tally.n_not_finite == (frame["feasible"] & ~np.isfinite(frame["gain"])).sum()
    assert tally.by_status["crank_blocked"] == (frame["status"] == 3).sum()
    assert tally.by_constraint["gain_margin"] == ((frame["gain_margin"] < 0) & (frame["status"] == 1)).sum()


def test_labels_of_a_table_may_repeat():
    table = pd.DataFrame({"a": [1.0, 2, 3, 4], "b": [1.0, 2, 3, 4]}, index=[0, 0, 1, 1])

    ranked = explore.rank(table, objectives=["a:min", "b:min"], fronts=4)

    assert ranked["a"].tolist() == [1, 2, 3, 4]
    assert ranked["front"].tolist() == [1, 2, 3, 4]


def test_any_table_can_be_ranked_in_fronts():
    table = pd.DataFrame(
        {"cv": [1.0, 2.0, 2.0, 3.0, 1.0], "swing_angle": [1.0, 5.0, 5.0, 4.0, 0.0]}, index=list("abcde")
    )

    first = explore.rank(table, objectives=["cv", "swing_angle:max"], order_by="swing_angle:max")
    both = explore.rank(table, objectives=["cv", "swing_angle:max"], fronts=5)

    assert first.index.tolist() == ["b", "c", "a"]
    assert both.index.tolist() == ["a", "b", "c", "e", "d"]
    assert both["front"].tolist() == [1, 1, 1, 2, 2]


@pytest.mark.parametrize("value", [np.inf, -np.inf])
def test_rows_of_a_table_with_an_infinite_objective_are_left_out_with_a_word(value):
    """Unlike an undefined objective an infinite one has an order, in which such a row could be the best."""
    table = pd.DataFrame({"cost": [1.0, value, 3.0, value], "cv": [3.0, 1.0, 2.0, 0.0], "feasible": [1, 1, 1, 0]})
    with pytest.warns(RuntimeWarning, match="^rows left out, because an objective is infinite: 1$"):
        assert explore.rank(table, objectives=["cost:min", "cv"]).index.tolist() == [0, 2]


@pytest.mark.parametrize(
    ("objectives", "message"),
    [
        (["swing_angel:max"], "did you mean 'swing_angle'"),
        (["swing_angle"], "swing_angle:min or swing_angle:max"),
        (["swing_angle:big"], "unknown sense 'big' of swing_angle; write swing_angle:min or swing_angle:max"),
        (None, "give `objectives`"),
        ([], "give `objectives`"),
        (["words:min"], "does not hold numbers"),
    ],
)
def test_wrong_objectives_get_one_line(objectives, message):
    with pytest.raises(explore.RequestError, match=message):
        explore.rank(pd.DataFrame({"cv": [1.0], "swing_angle": [1.0], "words": ["a"]}), objectives=objectives)


def test_a_table_may_have_a_column_of_designs():
    """Its numbers are those of the user: no row is found by them."""
    table = pd.DataFrame({"design": [50, 3, 1, 2, 0], "a": [1.0, 2, 3, 0, 5]})
    assert explore.rank(table, objectives=["a:max"], where="design < 3")["a"].tolist() == [5.0]
    assert explore.rank(table, objectives=["design:max"])["a"].tolist() == [1.0]
    missing = table.assign(a_margin=-table["a"])
    assert explore.nearest(missing, 1, where="design > 1 and a > 0")["design"].tolist() == [50]


@pytest.mark.parametrize("unknown", [[True, np.nan], ["True", "False"], pd.array([True, None], dtype="boolean")])
def test_rows_of_unknown_feasibility_are_refused(unknown):
    table = pd.DataFrame({"a": [1.0, 2.0], "feasible": unknown})
    with pytest.raises(explore.RequestError, match="column 'feasible' must be true or false in each row"):
        explore.rank(table, objectives=["a:min"])


def test_nothing_feasible_gives_an_empty_table():
    table = pd.DataFrame({"cv": [1.0, 2.0], "feasible": [False, False]})

    with pytest.warns(explore.NothingFeasibleWarning, match="no row"):
        ranked = explore.rank(table, objectives=["cv"])

    assert ranked.empty
    assert "front" in ranked.columns


@pytest.mark.parametrize(
    ("status", "margins", "missed", "undefined"),
    [
        ([1, 1, 1], [0.0, -1e-300, 1.0], 1, 0),  # a margin of exactly 0 is met
        ([1, 3, 6], [np.nan, np.nan, np.nan], 0, 1),  # undefined only where the design was computed
        ([6, 6, 3], [-1.0, 2.0, -1.0], 1, 0),  # a screened design misses its constraint
    ],
)
def test_missed_and_undefined_constraints_are_counted(status, margins, missed, undefined):
    tally = Tally(("cv_margin",))
    tally.count({"status": np.array(status), "cv_margin": np.array(margins)}, np.zeros(3, bool), np.ones(3, bool))
    assert tally.by_constraint["cv_margin"] == missed
    assert tally.by_undefined_constraint["cv_margin"] == undefined


def test_only_feasible_designs_count_as_not_finite():
    columns = {"feasible": np.array([True, False, True, False]), "cv": np.array([np.nan, np.nan, 1.0, 1.0])}
    tally = Tally()

    find_front([columns], [Objective("cv", "min")], tally)

    assert (tally.n_ranked, tally.n_not_finite) == (1, 1)


def test_any_number_of_objectives_counts():
    """Each row is the best in one column and the worst in the others, so that leaving one out loses a row."""
    table = pd.DataFrame(1.0 - np.eye(6), columns=list("abcdef"))

    assert len(explore.rank(table, objectives=[f"{name}:min" for name in table])) == 6


@pytest.mark.parametrize(
    ("units", "message"), [(("mm", "1"), "size is in mm in a and 1 in b"), (("", "m"), "a number in a and m in b")]
)
def test_results_in_other_units_are_not_ranked_together(units, message):
    a, b = (SimpleNamespace(columns=(Column("size", unit, "size", "metric"),), drive="") for unit in units)
    with pytest.raises(explore.RequestError, match=f"{message}, so they cannot be ranked together"):
        _differences("a", a, "b", b, ["size"])
    assert _differences("a", a, "b", a, ["size"]) == []
