"""Circuits, branches and order against tracing the linkage step by step."""

import numpy as np
import pytest

from explore.synthesis.defects import (
    MISSES,
    OTHER_BRANCH,
    OTHER_CIRCUIT,
    PASSES,
    SENTENCES,
    WRONG_ORDER,
    _ranges,
    find_passage,
)
from explore.synthesis.linkages import FourBar

TURNING = FourBar(1 + 1j, 1 + 1j + 4 * np.exp(0.3j), 1.0, 3.5, 2.5, 0.6 + 0.7j)
#: A triple-rocker: the crank moves on both sides of the frame, on one circuit through both branches.
ROCKING = FourBar(0j, 6 + 0j, 2.0, 3.0, 2.5, 0.4 + 0.5j)
#: The rocker is the shortest: two circuits, one on each side of the frame.
SIDES = FourBar(0j, 4 + 0j, 2.5, 3.5, 1.0, 0.4 + 0.5j)


def other(linkage, branch):
    return FourBar(
        linkage.crank_pivot, linkage.rocker_pivot, linkage.crank, linkage.coupler, linkage.rocker, linkage.point, branch
    )


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_turning_crank_passes_in_either_sense(branch, sense):
    angles = 0.5 + sense * np.linspace(0, 5.5, 9)
    passage = find_passage(TURNING, other(TURNING, branch).points(angles))
    assert passage.fate == PASSES
    turned = (passage.angles - angles) / (2 * np.pi)
    assert turned == pytest.approx(np.full(9, round(turned[0])), abs=1e-9)


def test_the_order():
    angles = np.array([0.1, 2.0, 1.0, 3.0])
    assert find_passage(TURNING, TURNING.points(angles)).fate == WRONG_ORDER
    # More than one turn is another order, too.
    assert find_passage(TURNING, TURNING.points(np.array([0.0, 3.0, 6.0, 1.0]))).fate == WRONG_ORDER


def test_another_circuit():
    points = np.concatenate([TURNING.points([0.2, 0.9]), other(TURNING, -1).points([1.5])])
    passage = find_passage(TURNING, points)
    assert passage.fate == OTHER_CIRCUIT
    assert "taken apart" in SENTENCES[passage.fate]
    upper, lower = SIDES.points([0.8, 1.2]), SIDES.points([-1.0])
    assert np.isfinite(upper).all()
    assert find_passage(SIDES, np.concatenate([upper, lower])).fate == OTHER_CIRCUIT


def test_another_branch():
    """The rocking crank reaches both branches on one circuit, past its dead point."""
    first, second = ROCKING.points([0.1, 0.3]), other(ROCKING, -1).points([0.2])
    assert find_passage(ROCKING, np.concatenate([first, second])).fate == OTHER_BRANCH
    assert find_passage(ROCKING, ROCKING.points([0.3, 0.1, -0.2])).fate == PASSES


def test_a_point_off_the_curve():
    points = TURNING.points([0.2, 0.9, 1.5])
    points[1] += 0.01
    passage = find_passage(TURNING, points)
    assert passage.fate == MISSES
    assert np.isnan(passage.angles).tolist() == [False, True, False]
    assert find_passage(TURNING, np.array([100 + 0j])).fate == MISSES


@pytest.mark.parametrize(
    ("lengths", "kind"),
    [((1.0, 3.5, 2.5, 4.0), "turn"), ((2.0, 3.0, 2.5, 6.0), "front"), ((2.0, 4.5, 2.0, 2.5), "back"),
     ((2.5, 3.5, 1.0, 4.0), "sides")],
)  # fmt: skip
def test_where_the_crank_moves(lengths, kind):
    """Against dense assembly over the turn."""
    crank, coupler, rocker, ground = lengths
    linkage = FourBar(0j, complex(ground), crank, coupler, rocker, 0.5j)
    found, first, second = _ranges(linkage)
    assert found == kind
    angles = np.linspace(-np.pi, np.pi, 20001)
    expected = (np.abs(angles) >= first) & (np.abs(angles) <= second)
    assert (np.isfinite(linkage.points(angles)) == expected).mean() > 0.9999


def test_random_linkages_pass_their_own_points():
    """Points of one sweep of the crank on one branch, of 1,000 linkages of all kinds."""
    rng = np.random.default_rng(20)
    done, kinds = 0, set()
    while done < 1000:
        pivots, point = rng.normal(size=(2, 2)) @ [1, 1j], complex(*rng.normal(size=2))
        linkage = FourBar(*(2 * pivots).tolist(), *rng.uniform(0.3, 3, 3).tolist(), point, int(rng.choice([1, -1])))
        angles = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.uniform(0.01, 0.3, 6))
        path = linkage.points(np.linspace(angles[0], angles[-1], 200))
        if np.isnan(path).any():
            continue
        done += 1
        kinds.add(_ranges(linkage)[0])
        passage = find_passage(linkage, linkage.points(angles))
        assert passage.fate == PASSES, linkage
        assert np.diff(passage.angles) == pytest.approx(np.diff(angles), abs=1e-6)
    assert kinds == {"turn", "front", "back", "sides"}


@pytest.mark.parametrize("point", [1.0, 0.0, 1e-12, 1e-4j])
def test_a_point_that_the_curve_passes_twice_or_at_the_pin_of_the_crank(point):
    """The pin of the rocker goes there and back along an arc; at the pin of the crank both branches draw a circle."""
    linkage = FourBar(TURNING.crank_pivot, TURNING.rocker_pivot, 1.0, 3.5, 2.5, complex(point))
    for start in np.arange(0.0, 6.0, 0.4):
        angles = start + np.linspace(0, 5.5, 8)
        passage = find_passage(linkage, linkage.points(angles))
        assert passage.fate == PASSES
        assert np.exp(1j * passage.angles) == pytest.approx(np.exp(1j * angles), abs=1e-6) or point == 1.0
    assert find_passage(linkage, linkage.points(angles[[0, 2, 1, 3, 6, 4, 5, 7]])).fate == WRONG_ORDER
    assert find_passage(linkage, linkage.points(angles) + 0.01).fate == MISSES


@pytest.mark.parametrize("branch", [1, -1])
def test_a_point_at_the_pivot_of_the_crank_is_passed(branch):
    """Where the arm of the point is as long as the crank, the point returns to the pivot: found by bisection."""
    point = TURNING.crank / TURNING.coupler * np.exp(0.8j)
    linkage = FourBar(TURNING.crank_pivot, TURNING.rocker_pivot, 1.0, 3.5, 2.5, point, branch)
    pins = linkage.crank_pins(angles := np.linspace(0, 2 * np.pi, 100_001))
    fold = np.angle((linkage.rocker_pins(angles) - pins) * point / (linkage.crank_pivot - pins))
    start = angles[np.flatnonzero((fold[:-1] * fold[1:] <= 0.0) & (np.abs(fold[1:]) < 1.0))[0]]
    path = linkage.points(start + np.array([0.0, 0.7, 1.9, 3.0]))
    path[0] = linkage.crank_pivot
    passage = find_passage(linkage, path)
    assert passage.fate == PASSES
    assert passage.angles[0] % (2 * np.pi) == pytest.approx(start, abs=1e-4)
    # with another arm the point stays off the pivot
    off = FourBar(TURNING.crank_pivot, TURNING.rocker_pivot, 1.0, 3.5, 2.5, 1.1 * point, branch)
    assert find_passage(off, path[:1]).fate == MISSES


def test_every_fate_has_a_sentence():
    assert list(SENTENCES) == [PASSES, WRONG_ORDER, OTHER_BRANCH, OTHER_CIRCUIT, MISSES]
