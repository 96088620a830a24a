"""The best chords of points in order, against all orders by brute force."""

import numpy as np
import pytest
from synthesis_cases import least_ordered

from explore.mechanisms.targets.path_errors.ordering import choose_order, make_search
from explore.mechanisms.targets.path_errors.rows import LANES_OF_TURN


@pytest.mark.parametrize(("n", "count"), [(3, 128), (12, 128), (60, 128), (12, 512), (60, 512)])
@pytest.mark.parametrize("peak", [1, 8])
def test_no_order_has_a_smaller_sum(n, count, peak):
    """Random distances, also few small ones: whichever sense is tried first, for points that nothing orders."""
    rng, search = np.random.default_rng(n + count), make_search(n, count)
    for _ in range(5):
        squares = rng.random((n, count)) ** peak
        search.distances[:] = squares[:, np.arange(count).reshape(LANES_OF_TURN, -1).T.ravel()]
        for is_likely in (True, False):
            total, is_forwards = choose_order(count, is_likely, search)
            # the same sums, in the same order but for the sense
            assert total == pytest.approx(least_ordered(squares), rel=1e-13)
            chords, order = search.chords[0], search.order
            np.testing.assert_array_equal(order, np.arange(n) if is_forwards else np.arange(n)[::-1])
            assert (np.diff(chords) >= 0).all()
            assert chords[-1] - chords[0] <= count
            assert squares[order, chords % count].sum() == pytest.approx(total, rel=1e-13)


def test_rows_begin_with_lines_of_the_cache():
    """Each row that the search loads vectors from."""
    search = make_search(7, 128)
    for rows in (search.distances, search.sums, search.entering):
        assert {row.ctypes.data % 64 for row in rows} == {0}
