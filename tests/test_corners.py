"""The search for corners: what samples may hide, brackets of zeros, and how these are narrowed, in every lane."""

import numpy as np
import pytest

from explore.base.compiling import LANES
from explore.evaluation.quadrature import corners
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.quadrature.work_space import Sizes, make_work_space


@pytest.mark.parametrize("gap", [-1e-6, -1e-3, 0.0])
def test_a_dip_that_may_reach_zero_between_samples_is_doubtful(gap):
    """Parabolas whose samples at -0.1, 0 and 0.1 are above 0 and whose vertex, between them, is not."""
    vertices = np.linspace(-0.04, 0.04, LANES)
    samples = np.concatenate([(x - vertices) ** 2 + gap * vertices**2 for x in (-0.1, 0.0, 0.1)])
    doubts = np.zeros(LANES)
    corners._doubt_sample(samples, np.full(LANES, 1e-18), 0.1, 0.1, doubts)
    assert (doubts == corners._DIP).all()
    doubts[:] = 0.0
    corners._doubt_sample(samples + 0.1, np.full(LANES, 1e-18), 0.1, 0.1, doubts)
    assert (doubts == 0.0).all()


def test_a_dip_whose_neighbours_are_equal_is_doubtful():
    """Of 0.01 + x^2 + (x^3 - x) / 2, which falls to -0.046."""
    samples, doubts = np.repeat([1.01, 0.01, 1.01], LANES), np.zeros(LANES)
    corners._doubt_sample(samples, np.full(LANES, 1e-18), 1.0, 1.0, doubts)
    assert (doubts == corners._DIP).all()


@pytest.mark.parametrize(("slope", "is_doubtful"), [(-1e-3, True), (0.0, True), (1.0, False)])
def test_an_end_that_is_zero_is_doubtful_where_the_signal_may_turn_back(slope, is_doubtful):
    """A parabola from 0 but for rounding at the end, with samples at 0.02 and 0.08 from it."""
    end, near, second = (np.full(LANES, slope * x + x * x + 5e-16) for x in (0.0, 0.02, 0.08))
    roundings, doubts = np.full(LANES, 1e-15), np.zeros(LANES)
    corners._doubt_end(end, near, second, roundings, roundings, 0.02, 0.06, 1.0, doubts)
    assert (doubts == float(is_doubtful)).all()


@pytest.mark.parametrize(("left", "is_doubtful"), [(1e-3, True), (4e-16, False)])
def test_a_dip_of_rounding_is_clear(left, is_doubtful):
    """Where both neighbours are rounding, too."""
    samples, doubts = np.repeat([left, 1e-16, 4e-16], LANES), np.zeros(LANES)
    corners._doubt_sample(samples, np.full(LANES, 1e-15), 0.1, 0.1, doubts)
    assert (doubts == (corners._DIP if is_doubtful else 0.0)).all()


def test_both_ends_may_be_doubtful_but_not_of_rounding():
    end, near, second = (np.full(LANES, x * x) for x in (0.0, 0.02, 0.08))
    near[0], second[0] = 1e-17, 5e-16
    roundings, doubts = np.full(LANES, 1e-15), np.zeros(LANES)
    for side in (corners._FIRST_END, corners._LAST_END):
        corners._doubt_end(end, near, second, roundings, roundings, 0.02, 0.06, side, doubts)
    assert doubts[0] == 0.0
    assert (doubts[1:] == corners._FIRST_END + corners._LAST_END).all()


@pytest.mark.parametrize("seed", range(5))
def test_all_changes_of_sign_between_samples_are_bracketed(seed):
    """But between samples that are both rounding, and beside an end that is."""
    count, rng = 12, np.random.default_rng(seed)
    samples = rng.choice([-1.0, -1e-17, 0.0, 1e-17, 1.0], (count + 2, LANES), p=[0.35, 0.1, 0.1, 0.1, 0.35])
    samples[5] = 1.0  # the largest one, by which all are rounded
    work, tile, _ = make_work_space(Sizes(0, 0, 0, 0, 1, -1, -1, 0), 0)
    tile.signals[: samples.size], tile.lane_designs[:], work.noise[0] = samples.ravel(), 0, 0.0
    corners._take_row(1, 0, -1, 0.0, count + 2, work, tile)
    _, row_of, table = gauss_legendre_rules()
    places = np.concatenate([[-1.0], np.polynomial.legendre.leggauss(count)[0], [1.0]])
    first, last, active = (tile.search[row : row + LANES] for row in (corners._X1, corners._X2, corners._ACTIVE))
    found = [[] for _ in range(LANES)]
    while corners._next_brackets(tile, row_of[count], table, count, LANES - 1):
        for lane in np.flatnonzero(active):
            found[lane].append((first[lane], last[lane]))
    for lane in range(LANES - 1):
        is_zero, sign = np.abs(samples[:, lane]) < 1e-16, samples[:, lane] > 0.0
        is_end = np.isin(np.arange(count + 2), (0, count + 1))
        hidden = is_zero[:-1] & is_zero[1:] | (is_zero & is_end)[:-1] | (is_zero & is_end)[1:]
        k = np.flatnonzero((sign[:-1] != sign[1:]) & ~hidden)
        # NumPy's nodes are a few units in the last place off
        assert np.ravel(found[lane]) == pytest.approx(np.stack([places[k], places[k + 1]], 1).ravel(), abs=1e-14)
    assert found[-1] == []


@pytest.mark.parametrize("power", [1, 3, 9])
def test_brackets_are_narrowed_to_the_last_bit(power):
    """Of signals that cross 0 ever flatter; a quadratic step alone does not end there."""
    roots, state = np.linspace(-0.9, 0.8, LANES), np.zeros(corners.SEARCH_SIZE)
    signal = lambda x: np.sign(x - roots) * np.abs(np.exp(x) - np.exp(roots)) ** power  # noqa: E731
    rows = [state[row : row + LANES] for row in (corners._X1, corners._X2, corners._F1, corners._F2)]
    x1, x2, f1, f2 = rows
    x1[:], x2[:] = -1.0, 1.0
    f1[:], f2[:] = signal(x1), signal(x2)
    share, active = (state[row : row + LANES] for row in (corners._SHARE, corners._ACTIVE))
    share[:], active[:] = 0.5, 1.0
    for _ in range(80):
        corners._update(state, signal(x1 + share * (x2 - x1)), 0.0, LANES)
    assert (active == 0.0).all()
    assert np.abs(x1 - roots).max() <= 1e-15
