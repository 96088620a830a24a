"""The numerics of tolerances, against mpmath, known probabilities, and brute force."""

from itertools import product

import mpmath
import numpy as np
import pytest
from exact_linkage import slope_of
from scipy.special import ndtr
from scipy.stats import binomtest, chi2

from explore.analysis.tolerancing.box import find_worst_case
from explore.analysis.tolerancing.derivatives import contributions, differentiate
from explore.analysis.tolerancing.failures import ENOUGH, estimate_failure, find_failures, share_of
from explore.analysis.tolerancing.outcomes import Outcomes, TolerancedRequest
from explore.analysis.tolerancing.spreads import CHUNK, Spread, chunk_deviations, count_parts, merge_counts
from explore.evaluation.evaluate import evaluate_columns
from explore.studies.config.linkage import Linkage
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_objective, make_request
from explore.studies.request.tolerances import make_tolerances

PUBLISHED = {"crank": 50.0, "coupler": 940.62, "rocker": 211.79, "ground": 869.44}
LENGTHS = list(PUBLISHED)


def toleranced(metrics, tolerances, constraints=None, objectives=()):
    mechanism = find_mechanism("crank-rocker")
    request = make_request(mechanism, metrics=metrics, constraints=constraints)
    return TolerancedRequest.of(
        request, [make_objective(request, text) for text in objectives], make_tolerances(mechanism, tolerances)
    )


EXACT = {
    "swing_angle": lambda linkage: mpmath.degrees(linkage.swing),
    "time_ratio": lambda linkage: linkage.time_ratio,
    "transmission_angle_min": lambda linkage: mpmath.degrees(linkage.transmission_angle_min),
    "transmission_angle_max": lambda linkage: mpmath.degrees(linkage.transmission_angle_max),
    "grashof_margin": lambda linkage: linkage.grashof_margin,
    "cv": lambda linkage: exact_cv(linkage),
}


def exact_cv(linkage):
    """CV of the rocker velocity over the slow stroke, which passes half a turn in the published optimum."""
    _, (mean, variance), *_ = linkage.moments(*linkage.stroke(through_zero=False))
    return mpmath.sqrt(variance) / abs(mean)


@pytest.mark.parametrize("name", EXACT)
def test_derivatives_are_those_of_mpmath(name):
    """To 1e-12, and the angle of the rocker, 1/300 of the others, to 5e-12; each within its own error."""
    derivatives = differentiate(toleranced(list(EXACT), dict.fromkeys(LENGTHS, 0.1)), PUBLISHED)
    for k, length in enumerate(LENGTHS):
        if name == "cv" and length in ("coupler", "ground"):  # quadrature of 60 digits takes seconds
            continue
        exact = float(slope_of(EXACT[name], PUBLISHED, length, 12))
        assert derivatives.slopes[name][k] == pytest.approx(exact, rel=5e-12, abs=0)
        assert abs(derivatives.slopes[name][k] - exact) <= derivatives.errors[name][k] + 1e-16 * abs(exact)
        assert derivatives.errors[name][k] <= 1e-10 * abs(exact)


def test_a_fold_has_no_derivative():
    """16^2 + 63^2 = 33^2 + 56^2, where both strokes last equally long and the longer over the shorter has a fold."""
    derivatives = differentiate(
        toleranced(["time_ratio", "swing_angle"], dict.fromkeys(LENGTHS, 0.1)),
        {"crank": 16.0, "coupler": 56.0, "rocker": 33.0, "ground": 63.0},
    )
    assert np.isnan(derivatives.slopes["time_ratio"]).all()
    assert (derivatives.errors["swing_angle"] < 1e-10).all()


def test_a_design_without_motion_has_no_derivative():
    derivatives = differentiate(toleranced(["cv"], {"crank": 0.1}), {**PUBLISHED, "crank": 500.0})
    assert np.isnan(derivatives.slopes["cv"]).all()
    assert np.isnan(contributions(derivatives.slopes["cv"], [0.1])).all()


def test_shares_of_the_variance():
    """Standard deviations 3 x 1 and 1 x 4 make variances 9 and 16 of 25; 0.36 and 0.64 are rounded once."""
    assert contributions(np.array([3.0, 1.0]), [1.0, 4.0]) == pytest.approx([0.36, 0.64], rel=1e-15)


@pytest.mark.parametrize(("dimensions", "distance"), [(1, 4.75), (4, 4.75), (8, 5.5)])
def test_a_linear_limit_of_normals(dimensions, distance):
    """At least 16 of 20 intervals of 95 % hold the true probability, of 1e-6 and 2e-8; of 1 in 400 trials fewer do."""
    direction = np.random.default_rng(dimensions).standard_normal(dimensions)
    direction /= np.linalg.norm(direction)
    exact, hits = ndtr(-distance), 0
    for seed in range(20):
        found = estimate_failure(
            lambda scores: direction @ scores > distance, dimensions, 0, 1 << 18, np.random.default_rng(seed)
        )
        assert found.method == "weighted"
        assert found.high < 1.06 * found.low
        hits += found.low <= exact <= found.high
    assert hits >= 16


@pytest.mark.parametrize(
    ("fails", "dimensions", "exact"),
    [
        (lambda scores: np.abs(scores[0]) > 4.5, 4, 2 * ndtr(-4.5)),
        (lambda scores: (scores[0] > 4.7) | (scores[1] < -4.9), 3, 1 - (1 - ndtr(-4.7)) * (1 - ndtr(-4.9))),
        (lambda scores: (scores**2).sum(axis=0) > chi2.isf(1e-6, 2), 2, 1e-6),
        (lambda scores: (scores**2).sum(axis=0) > chi2.isf(1e-6, 4), 4, 1e-6),
    ],
)
def test_failures_on_several_sides_and_all_around(fails, dimensions, exact):
    """Within four standard errors; the whole sphere is the hardest: points around it cover no direction between."""
    found = estimate_failure(fails, dimensions, 0, 1 << 18, np.random.default_rng(1))
    assert found.method == "weighted"
    spread = np.log(found.high / found.low) / (2 * 1.96)
    assert abs(np.log(found.probability / exact)) < 4 * spread < 0.15


def test_points_are_drawn_around_farther_failures_too():
    """Two limits in eight dimensions, where no step leads from the second to the first."""
    points = find_failures(lambda scores: (scores[0] > 4.0) | (scores[1] < -4.5), 8, np.random.default_rng(1))
    assert points[0, 0] > 4.0
    assert (points[:, 1] < -4.5).any()


def test_what_contradicts_the_drawn_parts_is_not_believed():
    """Failures that importance sampling does not see: of every other draw, whatever the scores."""
    found = estimate_failure(lambda scores: scores[0] > 4.75, 2, 500, 1 << 18, np.random.default_rng(0))
    assert found == share_of(500, 1 << 18)


def test_without_a_failure_there_is_still_an_upper_bound():
    found = estimate_failure(lambda scores: np.zeros(scores.shape[1], dtype=bool), 4, 0, 1000, np.random.default_rng(0))
    assert (found.probability, found.low, found.method) == (0.0, 0.0, "draws")
    assert found.high == pytest.approx(1 - 0.025 ** (1 / 1000), rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_no_estimate_exceeds_1(seed):
    """Where all parts fail, and too few were drawn: half of the weighted estimates would, by up to 0.1 %."""
    random = np.random.default_rng(seed)
    found = estimate_failure(lambda scores: np.ones(scores.shape[1], dtype=bool), 2, 100, 100, random)
    assert 0.99 < found.low <= found.probability <= found.high <= 1.0


@pytest.mark.parametrize(("failures", "count"), [(0, 50), (1, 50), (25, 50), (50, 50), (ENOUGH, 10**7)])
def test_the_interval_of_a_share_is_exact(failures, count):
    """Clopper and Pearson's, as SciPy's own; both invert the same incomplete beta function by other code."""
    found, expected = share_of(failures, count), binomtest(failures, count).proportion_ci(0.95, method="exact")
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), rel=1e-9)


WIDE = {"crank": 0.1, "coupler": 0.5, "rocker": {"plus_minus": 0.2, "distribution": "uniform"}, "ground": 0.5}
STUDIED = ["swing_angle", "transmission_angle_min", "transmission_angle_max", "cv"]


def test_the_worst_case_is_a_corner_of_the_box():
    """All four metrics rise or fall along each length here, so all extremes are corners, bit by bit."""
    request = toleranced(STUDIED, WIDE)
    worst = find_worst_case(request, PUBLISHED, 0)
    corners = np.array(list(product(*[(-1.0, 1.0)] * 4))).T * request.widths[:, None]
    values = request.outcomes(PUBLISHED, corners).metrics
    for name in STUDIED:
        assert (worst.low[name].value, worst.high[name].value) == (values[name].min(), values[name].max())
        assert worst.low[name].is_corner
        assert worst.high[name].is_corner
        at = worst.high[name].deviations[:, None]
        assert request.outcomes(PUBLISHED, at).metrics[name][0] == worst.high[name].value
    assert not worst.has_unassembled


def test_the_worst_case_of_more_dimensions_than_all_corners_are_looked_at_is_a_corner():
    """Crank and rod of sixteen parts, of which only the sums count: the extremes are four corners of the box."""
    names = {"crank": [f"r{k}" for k in range(8)], "rod": [f"l{k}" for k in range(8)]}
    table = {
        "driver": "crank", "output": "ram", "frame": {"O": [0, 0]}, "branch": {"S": "far"},
        "links": {"crank": {"O": 0, "A": "+".join(names["crank"])}, "rod": {"A": 0, "S": "+".join(names["rod"])}},
        "slots": {"ram": {"pin": "S", "link": "frame", "along": [[0, 0], [1, 0]]}},
    }  # fmt: skip
    mechanism = find_mechanism(Linkage(table))
    parts = dict.fromkeys(names["crank"], 5.0) | dict.fromkeys(names["rod"], 20.0)
    request = make_request(mechanism, metrics=["stroke", "ram_velocity_max", "transmission_angle_min"])
    request = TolerancedRequest.of(request, [], make_tolerances(mechanism, dict.fromkeys(parts, 0.1)))
    worst = find_worst_case(request, parts | {"speed": 1.0}, 0)
    corners = [list(np.repeat(signs, 8)) for signs in product((-0.1, 0.1), repeat=2)]
    values = request.outcomes(parts | {"speed": 1.0}, np.array(corners).T).metrics
    for name in request.metrics:
        expected = values[name].min(), values[name].max()
        # Sums of eight parts in another order than the corners' differ by rounding.
        assert (worst.low[name].value, worst.high[name].value) == pytest.approx(expected, rel=1e-12)
        assert worst.low[name].is_corner
        assert worst.high[name].is_corner


def test_an_extreme_inside_the_box_is_found():
    """The strokes last equally long on a surface through the box, where the time ratio is 1."""
    design = {"crank": 16.0, "coupler": 56.03, "rocker": 33.0, "ground": 63.0}
    worst = find_worst_case(toleranced(["time_ratio"], dict.fromkeys(LENGTHS, 0.1)), design, 0)
    assert worst.low["time_ratio"].value == pytest.approx(1.0, abs=1e-7)  # the search ends 2^-24 of the box away
    assert not worst.low["time_ratio"].is_corner
    assert worst.high["time_ratio"].is_corner


def test_a_box_with_parts_that_do_not_move_has_no_worst_case():
    design = {"crank": 50.0, "coupler": 100.0, "rocker": 80.0, "ground": 129.9}  # 0.1 mm from the change point
    worst = find_worst_case(toleranced(["swing_angle"], dict.fromkeys(LENGTHS, 0.1)), design, 0)
    assert worst.has_unassembled
    assert np.isnan(worst.high["swing_angle"].value)


def test_a_box_without_motion_has_no_worst_case():
    """And no warning of infinities less infinities."""
    design = {"crank": 100.0, "coupler": 150.0, "rocker": 120.0, "ground": 200.0}
    worst = find_worst_case(toleranced(["swing_angle"], dict.fromkeys(LENGTHS, 0.1)), design, 0)
    for side in (worst.low, worst.high):
        assert np.isnan(side["swing_angle"].value)
        assert not side["swing_angle"].is_corner


class Bowl:
    """Parts with a metric that is least in the middle of the box and infinite at a corner, and an infinite one."""

    tolerances, widths, metrics = ("x", "y"), np.ones(2), ("bowl", "endless")

    def outcomes(self, _nominal, deviations):
        bowl = np.where((deviations == 1.0).all(axis=0), np.inf, (deviations**2).sum(axis=0))
        moves, endless = np.ones(len(bowl), dtype=bool), np.full(len(bowl), np.inf)
        return Outcomes({"bowl": bowl, "endless": endless}, moves, moves, moves.astype(np.int8), {})


def test_an_infinite_extreme_does_not_hide_the_other_one():
    """As of a buckling factor, infinite without compression; and nothing warns."""
    worst = find_worst_case(Bowl(), {}, 0)
    assert (worst.low["bowl"].value, worst.low["bowl"].is_corner) == (0.0, False)
    for extreme in (worst.high["bowl"], worst.low["endless"], worst.high["endless"]):
        assert (extreme.value, extreme.is_corner) == (np.inf, True)


def test_a_spread_of_infinite_values_has_an_infinite_mean_and_no_deviation():
    spread = Spread.of(np.array([1.0, np.inf])).merged(Spread.of(np.array([2.0, 3.0])))
    assert spread.high == np.inf
    assert np.isnan(spread.std)
    assert not Spread.of(np.array([1e200])).merged(Spread.of(np.array([-1e200]))).std < np.inf  # no OverflowError


def test_parts_are_counted_and_averaged_as_numpy_does():
    """Sums in another order differ by rounding: 1e-13 of sums of 200,000 terms."""
    request = toleranced(STUDIED, WIDE, {"transmission_angle_min": {"min": 49.6}}, ["swing_angle:max"])
    count = 3 * CHUNK + 1000
    parts = count_parts(request, PUBLISHED, 5, 0, count)
    sizes = [CHUNK] * 3 + [1000]
    deviations = np.concatenate([chunk_deviations(request, 5, k, n) for k, n in enumerate(sizes)], axis=1)
    columns = {name: PUBLISHED[name] + row for name, row in zip(LENGTHS, deviations, strict=True)}
    mechanism = find_mechanism("crank-rocker")
    constrained = make_request(mechanism, metrics=STUDIED, constraints={"transmission_angle_min": {"min": 49.6}})
    found = evaluate_columns(constrained, columns).columns
    assert parts.count == parts.assembled == count
    assert parts.feasible == found["feasible"].sum()
    assert parts.missed == {"transmission_angle_min": count - parts.feasible}
    everything = evaluate_columns(request.request, columns).columns
    for name in STUDIED:
        spread, values = parts.spreads[name], everything[name]
        assert spread.mean == pytest.approx(values.mean(), rel=1e-13)
        assert spread.std == pytest.approx(values.std(ddof=1), rel=1e-10)  # of differences of nearly equal numbers
        assert (spread.low, spread.high) == (values.min(), values.max())
    assert parts.spreads["cv"].robust("min") == parts.spreads["cv"].mean + 3 * parts.spreads["cv"].std
    assert request.senses["swing_angle"] == "max"
    uniform = deviations[2]
    assert np.abs(uniform).max() <= 0.2
    # Standard errors of the standard deviations of 200,000 draws are 0.0016 and 0.0010 of them; five of these.
    assert uniform.std() == pytest.approx(0.2 / 3**0.5, rel=0.005)
    assert deviations[0].std() == pytest.approx(0.1 / 3, rel=0.008)


def test_pieces_make_the_same_parts():
    request = toleranced(["swing_angle"], WIDE)
    whole = count_parts(request, PUBLISHED, 0, 0, 2 * CHUNK)
    halves = merge_counts([count_parts(request, PUBLISHED, 0, k * CHUNK, (k + 1) * CHUNK) for k in range(2)])
    assert halves == whole
    assert count_parts(request, PUBLISHED, 1, 0, CHUNK) != count_parts(request, PUBLISHED, 0, 0, CHUNK)


def test_scores_and_draws_have_the_same_distributions():
    """At the scores of the quartiles, 0.674490, a normal is there and a uniform half way."""
    request = toleranced(["swing_angle"], WIDE)
    quartile = 0.6744897501960817
    deviations = request.deviations(np.full((4, 1), quartile))[:, 0]
    assert deviations == pytest.approx([quartile * 0.1 / 3, quartile * 0.5 / 3, 0.1, quartile * 0.5 / 3], rel=1e-14)
