"""Knee, crowding and hypervolume against brute force."""

import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import explore
from explore.model.request import Objective
from explore.results.ranking.pareto import is_nondominated
from explore.results.ranking.quality import (
    MAX_POINTS,
    add_quality_columns,
    crowding_distances,
    hypervolume_shares,
    is_knee,
    scale_to_unit_range,
)
from explore.results.ranking.spreading import spread_rows


@st.composite
def fronts_of_points(draw, most_objectives=4):
    """Points of one front, all different, in lexicographic order, scaled."""
    shape = st.tuples(st.integers(1, 9), st.integers(1, most_objectives))
    values = np.unique(draw(hnp.arrays(np.float64, shape, elements=st.integers(0, 12).map(float))), axis=0)
    return scale_to_unit_range(values[is_nondominated(values)])


def volume(points, reference):
    """Hypervolume by adding up the cells of the grid through all coordinates."""
    if not len(points):
        return 0.0
    axes = [np.unique([*column, end]) for column, end in zip(points.T, reference, strict=True)]
    cells = itertools.product(*(range(len(axis) - 1) for axis in axes))
    return math.fsum(
        math.prod(axis[k + 1] - axis[k] for axis, k in zip(axes, cell, strict=True))
        for cell in cells
        if any(all(point[j] <= axes[j][k] for j, k in enumerate(cell)) for point in points)
    )


@settings(derandomize=True, deadline=None, max_examples=150)
@given(fronts_of_points())
def test_the_share_is_what_the_hypervolume_loses(points):
    reference = np.full(points.shape[1], 1.1)
    whole = volume(points, reference)
    lost = [whole - volume(np.delete(points, k, axis=0), reference) for k in range(len(points))]
    # Each volume is a sum of at most some hundred cells of a box of 1.1^m.
    np.testing.assert_allclose(hypervolume_shares(points), np.array(lost) / whole, rtol=1e-12, atol=1e-14)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(fronts_of_points())
def test_crowding_is_the_sum_of_the_gaps_between_neighbours(points):
    expected = []
    for k, point in enumerate(points):
        total = 0.0 if len(points) > 1 else math.inf
        for j in range(points.shape[1]):
            line = sorted((float(other[j]), i) for i, other in enumerate(points))
            place = line.index((float(point[j]), k))
            if line[0][0] == line[-1][0]:
                continue
            ends = place in (0, len(line) - 1)
            total += math.inf if ends else line[place + 1][0] - line[place - 1][0]
        expected.append(total)
    np.testing.assert_allclose(crowding_distances(points), expected, rtol=1e-14)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(fronts_of_points())
def test_the_knee_is_the_farthest_from_the_plane_through_the_extremes(points):
    # The plane by a point and its normal; of several points that are best in one objective, the best in the others.
    extremes = [min((p for p in points if p[j] == 0), key=math.fsum) for j in range(points.shape[1])]
    normal = np.full(points.shape[1], points.shape[1] ** -0.5)
    distances = [normal @ (np.mean(extremes, axis=0) - point) for point in points]
    # Coordinates are fractions of spans up to 12: distances that differ, differ by more than 1e-6.
    expected = [d > 1e-9 and d >= max(distances) - 1e-9 for d in distances]
    np.testing.assert_array_equal(is_knee(points), expected)


def test_the_knee_of_two_objectives_is_that_of_the_line_between_the_ends():
    x = np.linspace(1.0, 9.0, 33)
    front = np.column_stack([x, 10 / x])  # convex: a knee
    a, b = front[0], front[-1]
    span = np.ptp(front, axis=0)
    along, towards = (b - a) / span, (front - a) / span
    off = np.abs(along[0] * towards[:, 1] - along[1] * towards[:, 0]) / np.hypot(*along)

    assert np.flatnonzero(is_knee(scale_to_unit_range(front))).tolist() == [np.argmax(off)]
    assert not is_knee(scale_to_unit_range(np.column_stack([x, -x]))).any(), "a straight front has no knee"
    outwards = np.column_stack([x, np.sqrt(82 - x**2)])
    assert not is_knee(scale_to_unit_range(outwards)).any(), "nor has one that bulges outwards"


def test_alike_designs_share_their_figures_and_later_fronts_have_none():
    table = pd.DataFrame({"cost": [1.0, 2, 2, 4, 5, 5], "gain": [1.0, 5, 5, 6, 5.5, 2], "scale": 1e300})
    ranked = explore.rank(table, objectives=["cost:min", "gain:max"], fronts=3, quality=True).sort_index()

    assert ranked["front"].tolist() == [1, 1, 1, 1, 2, 3]
    assert ranked["knee"].tolist() == [False, True, True, False, False, False]
    assert ranked["crowding"].tolist() == [math.inf, 2, 2, math.inf, math.inf, math.inf]
    # Scaled, the points are (0, 1), (1/3, 1/5), (1, 0): strips of 1.1 - 0, 1.1 - 1/3, 1.1 - 1 in width.
    parts = np.array([1 / 3 * 0.1, 2 / 3 * 0.8, 0.1 * 0.2])
    whole = 1.1 * 0.1 + (1.1 - 1 / 3) * 0.8 + 0.1 * 0.2
    expected = parts[[0, 1, 1, 2]] / whole
    np.testing.assert_allclose(ranked["hypervolume_share"], [*expected, 0, 0], rtol=1e-14)


def test_the_figures_do_not_depend_on_units_or_on_the_order_of_the_designs():
    rng = np.random.default_rng(4)
    values = rng.random((200, 3))
    table = pd.DataFrame(values, columns=["a", "b", "c"])
    objectives = ["a:min", "b:min", "c:min"]
    here = explore.rank(table, objectives=objectives, quality=True)
    there = explore.rank(
        (table * [1e150, 2.0**-40, 8.0]).sample(frac=1, random_state=1), objectives=objectives, quality=True
    )

    assert here.index.tolist() == there.index.tolist()
    pd.testing.assert_frame_equal(here.iloc[:, 3:], there.iloc[:, 3:], rtol=1e-12)


@pytest.mark.parametrize("objectives", [4, 5, 6, 7])
def test_more_points_than_can_be_done_have_no_share(objectives):
    most = MAX_POINTS[min(objectives, 6) - 4]
    points = np.abs(np.random.default_rng(1).normal(size=(most + 1, objectives)))
    points = 1 - points / np.linalg.norm(points, axis=1)[:, None]

    assert np.isnan(hypervolume_shares(points)).all()


def test_nothing_ranked_has_no_figures():
    empty = pd.DataFrame({"a": np.empty(0), "b": np.empty(0), "front": np.empty(0, dtype=np.int64)})
    found = add_quality_columns(empty, [Objective("a", "min"), Objective("b", "min")])

    assert found.dtypes[["knee", "crowding", "hypervolume_share"]].tolist() == [bool, float, float]


@pytest.mark.parametrize("extreme", [1.7e308, 5e-324])
def test_objectives_may_be_as_large_or_as_close_as_doubles_are(extreme):
    table = pd.DataFrame({"a": [-extreme, 0.0, extreme], "b": [3.0, 1.0, 0.0]})
    ranked = explore.rank(table, objectives=["a:min", "b:min"], quality=True)

    assert ranked["knee"].tolist() == [False, True, False]
    assert np.isfinite(ranked["hypervolume_share"]).all()


def test_few_rows_of_a_front_are_even_parts_of_it_and_the_next_front_fills_up():
    places = np.random.default_rng(3).permutation(np.linspace(0, 1, 101))
    front = np.column_stack([places, 1 - places])
    assert sorted(places[spread_rows(front, 5)]) == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    ends = sorted([101 + int(places.argmin()), 101 + int(places.argmax())])
    assert sorted(spread_rows(np.vstack([front, front + 1]), 103)) == [*range(101), *ends]


def test_no_row_is_taken_twice_where_rows_are_equal():
    values = np.array([[0.0, 1.0], [0.0, 1.0], [1.0, 0.0], [0.5, 0.5], [1.0, 0.0]])
    assert [len(set(spread_rows(values, count))) for count in range(1, 7)] == [1, 2, 3, 4, 5, 5]
