"""The best chords of points in order, against all orders by brute force."""

import math

import numpy as np
import pytest
from synthesis_cases import least_ordered

from explore.mechanisms.targets.path_errors.ordering import choose_order, make_search, search_order
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN


@pytest.mark.parametrize(("n", "count"), [(3, 128), (12, 128), (60, 128), (12, 512), (60, 512)])
@pytest.mark.parametrize("peak", [1, 8])
def test_no_order_has_a_smaller_sum(n, count, peak):
    """Random distances, also few small ones, of points that nothing orders."""
    rng, search = np.random.default_rng(n + count), make_search(n, count)
    for _ in range(5):
        squares = rng.random((n, count)) ** peak
        search.distances[:] = squares[:, np.arange(count).reshape(LANES_OF_TURN, -1).T.ravel()]
        # the same sums, in the same order but for the sense
        least, total = least_ordered(squares), choose_order(count, math.inf, search)
        assert total == pytest.approx(least, rel=1e-13)
        chords, order = search.chords, search.order
        assert order.tolist() in (list(range(n)), list(range(n))[::-1])
        assert (np.diff(chords) >= 0).all()
        assert chords[-1] - chords[0] <= count
        assert squares[order, chords % count].sum() == pytest.approx(total, rel=1e-13)
        # neither sense has a sum below a limit that is below the least one
        senses = np.arange(n), np.arange(n)[::-1].copy()
        assert [search_order(count, order, least * (1 - 1e-8), search) for order in senses] == [math.inf, math.inf]
        assert min(search_order(count, order, math.inf, search) for order in senses) == total


def test_rows_begin_with_lines_of_the_cache():
    """Each row that the search loads vectors from."""
    search = make_search(7, 128)
    for rows in (search.distances, search.sums, search.entering):
        assert {row.ctypes.data % 64 for row in rows} == {0}
