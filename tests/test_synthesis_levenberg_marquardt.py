"""The batched method of Levenberg and Marquardt: against SciPy's, within bounds, and where it ends."""

import numpy as np
import pytest

from explore.synthesis.levenberg_marquardt import LARGEST_DAMPING, MOST_SLOW, gauss_newton, improve

BOUNDS = np.array([0.5, -1.0]), np.array([4.0, 0.3])


def residuals(values):
    """Of Rosenbrock's valley from (1, 1), with a third, shape (n, 3), and their slopes, shape (n, 2, 3)."""
    x, y = values.T
    found = np.stack([10.0 * (y - x**2), 1.0 - x, 0.1 * y], axis=1)
    zero, one = np.zeros_like(x), np.ones_like(x)
    slopes = [np.stack([-20.0 * x, -one, zero], axis=1), np.stack([10.0 * one, zero, 0.1 * one], axis=1)]
    return found, np.stack(slopes, axis=1)


def fitted(starts, most_steps=200, met=0.0):
    trials = []

    def evaluate(values, rows):
        trials.extend(rows.tolist())
        found, slopes = residuals(values)
        return np.square(found).sum(axis=1), (found, slopes)

    def step(values, kept, _, damping):
        return gauss_newton(values, *kept, damping, BOUNDS)

    return *improve(starts, evaluate, step, most_steps, 1e-12, met), np.bincount(trials, minlength=len(starts))


def test_starts_end_where_scipy_does():
    from scipy.optimize import least_squares

    starts = np.random.default_rng(1).uniform(*BOUNDS, (20, 2))
    values, costs, trials = fitted(starts)
    for start, value, cost in zip(starts, values, costs, strict=True):
        best = least_squares(
            lambda at: residuals(at[None])[0][0], start, bounds=BOUNDS, xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        assert cost == pytest.approx(2.0 * best.cost, rel=1e-9)
        # A least sum is flat: half the digits of the sum are those of its place.
        np.testing.assert_allclose(value, best.x, atol=1e-6)
    assert (values[:, 1] == BOUNDS[1][1]).all()
    assert trials.max() < 200


def test_a_start_ends_where_its_sum_is_met_and_others_go_on():
    starts = np.array([[0.55, 0.3], [3.9, -0.9]])
    met = residuals(starts)[0][0] @ residuals(starts)[0][0] + 1e-9
    values, _, trials = fitted(starts, met=met)
    assert values[0].tolist() == starts[0].tolist()
    assert trials[0] == 1 < trials[1]


def test_a_start_that_nothing_improves_ends_by_its_damping():
    """From 1e-2, four times as much after each step: 17 steps reach the limit; no gain counts as slow."""
    calls = []

    def evaluate(values, rows):
        calls.append(len(rows))
        return 1.0 + np.abs(values[:, 0]), ()

    values, _ = improve(
        np.zeros((3, 1)), evaluate, lambda values, _kept, rows, _: (values + 1.0, np.ones(len(rows), bool)), 99, 1e-9
    )
    assert (values == 0.0).all()
    assert len(calls) == 1 + int(np.ceil(np.log(LARGEST_DAMPING / 1e-2) / np.log(4.0)))
    assert len(calls) > MOST_SLOW
