"""Turns of signals of which nothing is known: what samples claim is above the error; who has equal steps, who not."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exact_by_hand import moments, watt, whitworth
from shapes_mechanism import SHAPES
from toy_mechanism import PEAK

from explore.base.compiling import LANES
from explore.evaluation import sampled
from explore.evaluation.evaluate import evaluate_columns
from explore.evaluation.quadrature.resolving import CHECKS, COUNTS, PARTS_SIZE, place_checks, resolve_rows, turn_factors
from explore.evaluation.quadrature.tiles import DEVIATIONS, FIRST_TAIL, INTEGRAL, SUMS_SIZE
from explore.model.quadrature import Adaptive
from explore.model.status import Status
from explore.studies.request.requests import make_request

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
from by_hand import BY_HAND, WATT_RANGES, WHITWORTH_RANGES

TOLERANCES = (1e-6, 1e-9, 1e-12)
EXACT = {"watt": watt, "whitworth": whitworth}
#: Nodes of a turn by the adaptive rule, at least.
ADAPTIVE = 2 * 16 * 18


def claimed(signal, count):
    """The error that is claimed of a signal of the angle in 16 variants, (16, n) of (n,), and its mean, of each."""
    angles = np.pi * (2.0 * np.arange(count) + 1.0 - count) / count
    tangents = np.empty((count + CHECKS) * LANES)
    place_checks(count, tangents)
    checks = 2.0 * np.arctan(tangents.reshape(-1, LANES)[count:, 0])
    samples = signal(np.concatenate([angles, checks]))
    sums, mean = np.zeros(SUMS_SIZE), samples[:, :count].mean(axis=1)
    sums[INTEGRAL : INTEGRAL + LANES] = 2.0 * np.pi * mean
    deviations = ((samples[:, :count] - mean[:, None]) ** 2).mean(axis=1)
    sums[DEVIATIONS : DEVIATIONS + LANES] = 2.0 * np.pi * deviations
    parts = np.empty(PARTS_SIZE)
    resolve_rows(np.ascontiguousarray(samples.T).reshape(-1), 1, np.array([1]), count, turn_factors(), sums, parts)
    return sums[FIRST_TAIL : FIRST_TAIL + LANES], mean, deviations


def errors(signal, count, dense_count=2**14):
    """What is claimed of the signal's mean and variance, and the larger error of both, relative."""
    claim, mean, variance = claimed(signal, count)
    dense = signal(np.pi * (2.0 * np.arange(dense_count) + 1.0) / dense_count - np.pi)
    exact, spread = dense.mean(axis=1), dense.var(axis=1)
    rms = np.sqrt(exact**2 + spread)
    return claim, np.maximum(np.abs(mean - exact) / rms, np.abs(variance - spread) / rms**2)


@pytest.mark.parametrize("count", COUNTS)
def test_a_wave_claims_its_coefficient_or_what_the_interpolant_misses(count):
    """Slow waves are resolved down to rounding, the eight fastest have a coefficient, others appear between nodes."""
    phases = np.linspace(0.0, 2.0 * np.pi, LANES, endpoint=False)[:, None] + 0.1
    for order in (1, 2, count // 2 - 8):
        claim, _, _ = claimed(lambda angles, order=order: 2.0 + np.cos(order * angles - phases), count)
        assert (claim < 1e-14 * count).all()
    for order in range(count // 2 - 7, count // 2):
        claim, _, _ = claimed(lambda angles, order=order: np.cos(order * angles - phases), count)
        assert claim == pytest.approx(np.full(LANES, 4.0 * math.sqrt(2.0)), rel=1e-11)
    for order in range(count // 2 + 1, 6 * count):
        claim, _, _ = claimed(
            lambda angles, order=order: np.cos(angles) + 1e-3 * np.cos(order * angles - phases), count
        )
        # what the interpolant misses is twice the sine of half the difference of two phases
        assert (claim > 1e-4).all()


@pytest.mark.parametrize("count", COUNTS)
def test_what_is_claimed_of_corners_is_above_the_error(count):
    """Powers of |sin| have jumps in their first to fifth derivative; none is resolved to 1e-9 but the smoothest."""
    places = np.random.default_rng(count).uniform(0.0, 2.0 * np.pi, LANES)[:, None]
    for power in (1, 3, 5):
        claim, error = errors(lambda angles, power=power: np.abs(np.sin(0.5 * (angles - places))) ** power, count)
        assert (error < claim).all()
        assert (claim > (3.0 * count) ** -(power + 1.0)).all()
    claim, error = errors(lambda angles: (np.cos(angles - places) > 0.3) * 1.0, count)
    assert (error < claim).all()
    assert (claim > 1e-3).all()


@pytest.mark.parametrize("count", COUNTS)
def test_what_is_claimed_of_poles_is_above_the_error(count):
    """Of poles near and far, whose residues fall with the distance, as beside a change point."""
    rng, above, resolved = np.random.default_rng(count), 0, 0
    for _ in range(40):
        distances, places, turns = (
            10.0 ** rng.uniform(-2, 0.5, (LANES, 3, 1)), rng.uniform(0.0, 2.0 * np.pi, (LANES, 3, 1)),
            np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, (LANES, 3, 1))),
        )  # fmt: skip
        powers = rng.choice([-0.5, 0.5, 1.0, 2.0], (LANES, 3, 1))
        sizes = distances ** np.maximum(powers, 0.5) * 10.0 ** rng.uniform(-3, 0, (LANES, 3, 1))

        def signal(angles, distances=distances, places=places, turns=turns, powers=powers, sizes=sizes):
            inside = 1.0 - np.exp(-distances + 1j * (angles - places))
            return np.real(sizes * turns * inside**-powers).sum(axis=1) + np.cos(angles)

        claim, error = errors(signal, count, dense_count=2**12)  # the nearest pole is at 0.01: it errs by exp(-41)
        enough = claim < 1e-4  # the largest tolerance
        above += np.count_nonzero((error > claim + 4e-15)[enough])
        resolved += np.count_nonzero(enough)
        assert (error <= 10.0 * claim + 4e-15)[enough].all()
    assert 100 < resolved < 40 * LANES
    assert above <= 1e-3 * resolved


def test_rounding_errors_are_claimed():
    rng, noise = np.random.default_rng(0), 10.0 ** np.linspace(-15, -6, LANES)[:, None]
    claim, _, _ = claimed(lambda angles: np.cos(angles) + noise * rng.normal(size=(LANES, len(angles))), 128)
    # the mean of 128 samples errs by a tenth of the noise, and what the interpolant misses is about the noise
    assert (claim > 0.5 * noise[:, 0]).all()
    assert (claim < 20.0 * noise[:, 0] + 1e-14).all()


def test_equal_samples_claim_nothing():
    """A pulse may stand between them."""
    claim, _, _ = claimed(lambda angles: np.maximum(0.0, np.cos(angles - 0.01) - 0.9999) + np.zeros((LANES, 1)), 64)
    assert (claim == np.inf).all()


def evaluate(mechanism, designs, names, tolerance, window="cycle"):
    return evaluate_columns(make_request(mechanism, metrics=names, window=window, tolerance=tolerance), designs).columns


def turning(name, designs, count):
    """The first of the designs that turn, and the name."""
    turns = evaluate(BY_HAND[name][0], designs, ["margin"], 1e-9)["status"] == Status.OK
    return name, {key: column[turns][:count].copy() for key, column in designs.items()}


#: Watt six-bars of any proportions.
ANY_WATT = {
    "crank": (1, 60), "coupler": (20, 200), "rocker": (20, 150), "ground": (30, 200), "arm": (5, 80), "tilt": (0, 360),
    "link": (20, 200), "output": (20, 150), "right": (-150, 150), "up": (-150, 150),
}  # fmt: skip


def families(count, seed):
    """Designs about a good one, of any proportions, and near their limits: name of the mechanism and designs."""
    rng = np.random.default_rng(seed)
    watts, others, whitworths = (
        {key: rng.uniform(*bounds, 6 * count) for key, bounds in ranges.items()}
        for ranges in (WATT_RANGES, ANY_WATT, WHITWORTH_RANGES)
    )
    yield turning("watt", watts, count)
    yield turning("watt", others, count)
    gap, distance = 10.0 ** rng.uniform(-5, -1, 6 * count), np.hypot(watts["right"], watts["up"])
    yield turning("watt", watts | {"link": distance + watts["arm"] - watts["output"] + 50.0 * gap}, count)
    yield turning("whitworth", whitworths, count)
    yield turning("whitworth", whitworths | {"offset": whitworths["crank"] * (1.0 - 5.0 * gap)}, count)


def check_bounds(count, seed):
    """Errors of moments over bounds of all families at all tolerances, and the share with equal steps."""
    ratios, equal = [], []
    for name, designs in families(count, seed):
        mechanism, _ = BY_HAND[name]
        exact, known = moments(EXACT[name], designs)
        names = [f"{signal}_{statistic}" for signal in exact for statistic in ("mean", "variance")]
        for tolerance in TOLERANCES:
            columns = evaluate(mechanism, designs, names, tolerance)
            error = np.zeros(len(known))
            for signal, (mean, variance) in exact.items():
                square = mean**2 + variance
                error = np.fmax(error, np.abs(columns[f"{signal}_mean"] - mean) / np.sqrt(square))
                error = np.fmax(error, np.abs(columns[f"{signal}_variance"] - variance) / square)
            ratios.append((error / columns["error"])[known])
            equal.append(columns["nodes"] < 480)
    return np.concatenate(ratios), np.mean(np.concatenate(equal))


def test_bounds_hold():
    ratios, equal = check_bounds(40, 0)
    assert (ratios <= 1.0).all()
    assert equal > 0.6


@pytest.mark.slow
def test_campaign_of_bounds():
    ratios, _ = check_bounds(5_500, 1)
    assert len(ratios) > 60_000
    assert np.mean(ratios > 1.0) <= 1e-3
    assert ratios.max() < 10.0


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_extremes_agree_with_those_of_the_adaptive_rule(tolerance, monkeypatch):
    compared = 0
    for name, designs in families(150, 2):
        mechanism, _ = BY_HAND[name]
        names = [f"{signal.name}_{statistic}" for signal in mechanism.signals for statistic in ("min", "max", "mean")]
        columns = evaluate(mechanism, designs, names, tolerance)
        with monkeypatch.context() as patch:
            patch.setattr(sampled, "LARGEST_EXCESS", -1.0)
            other = evaluate(mechanism, designs, names, tolerance)
        computed = columns["status"] == Status.OK
        compared += np.count_nonzero(computed & (columns["nodes"] < 480))
        for signal in mechanism.signals:
            low, high = f"{signal.name}_min", f"{signal.name}_max"
            scale = np.maximum(np.abs(other[low]), np.abs(other[high])) * (columns["error"] + other["error"])
            for statistic in (low, high):
                assert (np.abs(columns[statistic] - other[statistic]) <= scale)[computed].all()
    assert compared > 300


def test_designs_that_are_left_have_every_bit_of_the_adaptive_rule(monkeypatch):
    designs, names = {"distance": 10.0 ** np.linspace(-5.0, 1.0, 200)}, ["height_mean", "height_std", "height_max"]
    columns = evaluate(PEAK, designs, names, 1e-9)
    monkeypatch.setattr(sampled, "LARGEST_EXCESS", -1.0)
    other = evaluate(PEAK, designs, names, 1e-9)
    left = columns["nodes"] > 480
    assert 0.3 < left.mean() < 0.9
    for name in ("height_mean", "height_std", "height_max", "error", "status"):
        assert (columns[name] == other[name])[left].all()
    assert (columns["nodes"] < other["nodes"])[~left].all()


def test_no_result_depends_on_neighbours():
    name, designs = next(families(100, 3))
    mechanism, names = BY_HAND[name][0], ["output_velocity_std", "output_acceleration_max"]
    together = evaluate(mechanism, designs, names, 1e-9)
    for i in (0, 17, 99):
        alone = evaluate(mechanism, {key: column[i : i + 1] for key, column in designs.items()}, names, 1e-9)
        assert all(alone[key][0] == together[key][i] for key in alone)


def test_only_whole_turns_without_corners_have_equal_steps():
    count = 4
    designs = {"place": np.full(count, 1.0), "distance": np.full(count, 5.0), "order": np.full(count, 3.0)}
    assert (evaluate(SHAPES, designs, ["polynomial_mean"], 1e-9)["nodes"] == COUNTS[0] + CHECKS).all()
    interval = evaluate(SHAPES, designs, ["polynomial_mean"], 1e-9, {"from": 10.0, "to": 200.0})
    signals = tuple(replace(signal, has_corners=True) for signal in SHAPES.signals)
    cornered = evaluate(replace(SHAPES, signals=signals), designs, ["polynomial_mean"], 1e-9)
    graded = replace(SHAPES, quadrature=Adaptive(((0, 0),)))
    # two pieces of 24 and 16 nodes, for 110 and 80 degrees, and their ends; with digits of 1e-9 beyond those of 1e-6
    assert (interval["nodes"] < 100).all()
    assert (cornered["nodes"] == ADAPTIVE).all()
    assert (evaluate(graded, designs, ["polynomial_mean"], 1e-9)["nodes"] == COUNTS[0] + CHECKS).all()
