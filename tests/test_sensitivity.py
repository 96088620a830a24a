"""Sensitivity indices: analytic functions, SALib on the same samples, and brute force on a study."""

import json
import math
import warnings

import numpy as np
import pandas as pd
import pytest
from command_line import call, run
from distributed import Client, LocalCluster
from stopping import interrupt
from studies import published_box, sweep_text, swept

import explore
from explore.analysis.sensitivity.given_data import first_order
from explore.analysis.sensitivity.paired_points import PairedPoints
from explore.analysis.sensitivity.public import SensitivityPlan
from explore.base.errors import RequestError, ResultsError
from explore.charts import sensitivity_chart
from explore.studies.designs.samplers import sobol

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # SALib's imports are deprecated by their packages
    from SALib.analyze import sobol as salib

STUDY = published_box(65_536)
LIMITS = {"transmission_angle_min": {"min": 30}, "transmission_angle_max": {"max": 150}}
#: Evaluations of the classical indices in tests of anything but their values.
FEW = 6000
results = swept(STUDY)


def evaluate(function, dimensions, evaluations, seed=0):
    """The points, the sums of each replicate, and the values of each part."""
    points = PairedPoints.within(evaluations, dimensions, seed)
    moments, values = np.zeros((points.replicates, dimensions, 3, 3)), []
    for number in range(points.n_parts):
        values.append(function(points.part(number)))
        moments[points.replicate(number)] += points.moments(values[-1])
    return points, moments, values


def indices(function, dimensions, evaluations, seed=0):
    points, moments, _ = evaluate(function, dimensions, evaluations, seed)
    return points.indices(moments)


def ishigami(points):
    x = math.pi * (2.0 * points - 1.0)
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


_ALONE = np.array([0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2, 49.0 / 8.0, 0.0])
_TOGETHER = 8.0 * 0.01 * math.pi**8 / 225.0
ISHIGAMI_FIRST = _ALONE / (_ALONE.sum() + _TOGETHER)
ISHIGAMI_TOTAL = (_ALONE + _TOGETHER * np.array([1.0, 0.0, 1.0])) / (_ALONE.sum() + _TOGETHER)

G_WEIGHTS = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0])


def g_function(points):
    return np.prod((np.abs(4.0 * points - 2.0) + G_WEIGHTS) / (1.0 + G_WEIGHTS), axis=1)


_PARTS = 1.0 / (3.0 * (1.0 + G_WEIGHTS) ** 2)
G_FIRST = _PARTS / (np.prod(1.0 + _PARTS) - 1.0)
G_TOTAL = _PARTS * np.prod(1.0 + _PARTS) / (1.0 + _PARTS) / (np.prod(1.0 + _PARTS) - 1.0)


def in_half_space(points):
    return points[:, 0] + points[:, 1] < 1.0


def in_disc(points):
    return points[:, 0] ** 2 + points[:, 1] ** 2 < 1.0


# The mean at a given x is sqrt(1 - x^2), whose square has the mean 2/3; the share of the disc is pi / 4.
DISC = (2.0 / 3.0 - math.pi**2 / 16.0) / (math.pi / 4.0 * (1.0 - math.pi / 4.0))


@pytest.mark.parametrize(
    ("function", "first", "total"),
    [
        (ishigami, ISHIGAMI_FIRST, ISHIGAMI_TOTAL),
        (g_function, G_FIRST, G_TOTAL),
        (in_half_space, [1 / 3, 1 / 3, 0.0], [2 / 3, 2 / 3, 0.0]),
        (in_disc, [DISC, DISC], [1.0 - DISC, 1.0 - DISC]),
    ],
)
def test_analytic_indices(function, first, total):
    """The error falls nearly like 1 / N for smooth functions; the interval is at most twice the tolerance."""
    for estimate, exact in zip(indices(function, len(first), 2**19), (first, total), strict=True):
        assert estimate.value == pytest.approx(exact, abs=0.004)
        assert (estimate.high - estimate.low < 0.016).all()
        # 95 % of the intervals hold the value; half of it more holds all of these
        assert (np.abs(estimate.value - exact) <= 0.75 * (estimate.high - estimate.low) + 1e-12).all()


def test_a_rare_indicator():
    """One point in 1,000 is feasible: both inputs below 0.0316. Alone each explains p (1 - s) / (s (1 - p)) of it."""
    share = math.sqrt(1e-3)
    first, total = indices(lambda points: (points < share).all(axis=1), 2, 2**19)
    exact = 1e-3 * (1.0 - share) / (share * (1.0 - 1e-3))
    assert first.value == pytest.approx([exact] * 2, abs=0.02)
    assert (first.low < exact).all()
    assert (first.high > exact).all()
    assert total.value == pytest.approx([1.0 - exact] * 2, abs=0.02)


@pytest.mark.parametrize("share", [1e-3, 1e-2])
def test_intervals_of_a_rare_indicator_hold_the_truth(share):
    """All of four inputs below a bound; next to no pair that shares one input has two such points.

    Of 10 seeds and 40 intervals of each kind; fewer than 34 with a probability of 1 % if the intervals are right.
    """
    bound = share**0.25
    first_order = share * (1.0 / bound - 1.0) / (1.0 - share)
    held = np.zeros(2)
    for seed in range(10):
        estimates = indices(lambda points: (points < bound).all(axis=1), 4, 2**16, seed)
        for k, exact in enumerate((first_order, (1.0 - bound) / (1.0 - share))):
            held[k] += ((estimates[k].low <= exact) & (exact <= estimates[k].high)).sum()
    assert (held >= 34).all()


def test_intervals_hold_the_truth_in_19_of_20_cases():
    """Of 30 seeds; fewer than 25 would hold it with a probability of 0.3 % if the intervals are right."""
    held = np.zeros((2, 3))
    for seed in range(30):
        for estimate, exact, row in zip(
            indices(ishigami, 3, FEW, seed), (ISHIGAMI_FIRST, ISHIGAMI_TOTAL), held, strict=True
        ):
            row += (estimate.low <= exact) & (exact <= estimate.high)
    assert (held >= 25).all()


def test_an_input_alone_explains_all_of_it():
    first, total = indices(lambda points: points[:, 0] < 0.3, 1, FEW)
    assert first.value == pytest.approx([1.0], abs=0.02**2)
    assert total.value == pytest.approx([1.0], abs=0.02)


def test_an_input_without_effect_has_indices_of_0():
    first, total = indices(in_half_space, 3, FEW)
    for estimate in (first, total):
        assert (estimate.value[2], estimate.low[2]) == pytest.approx((0.0, 0.0), abs=1e-15)
        # An effect on 3.7 pairs would show in 39 of 40 samples; 500 or more have a point in the half space.
        assert 0.0 < estimate.high[2] < 3.7 / 500


@pytest.mark.parametrize("function", [ishigami, lambda points: in_half_space(points).astype(float)])
def test_salib_agrees_on_the_same_samples(function):
    points, moments, values = evaluate(function, 3, 2**17)
    a, b, *mixed = np.concatenate([part.reshape(5, -1) for part in values], axis=1)
    problem = {"num_vars": 3, "names": ["x", "y", "z"], "bounds": [[0.0, 1.0]] * 3}
    theirs = salib.analyze(
        problem, np.column_stack([a, *mixed, b]).ravel(), calc_second_order=False, num_resamples=2, seed=0
    )
    first, total = points.indices(moments)
    # Its total is Jansen's over the variance of A and B, ours over that of both points of each pair.
    scale = [np.var(np.concatenate([a, other])) / np.var(np.concatenate([a, b])) for other in mixed]
    assert total.value * scale == pytest.approx(theirs["ST"], rel=1e-11, abs=1e-13)
    # Its first-order estimator is another: five times its standard deviation, from products of this size.
    error = 5.0 * np.std(b * (np.array(mixed) - a), axis=1) / np.var(a) / math.sqrt(len(a))
    assert (np.abs(first.value - theirs["S1"]) <= error + 1e-15).all()


def test_the_sums_of_an_indicator_are_exact_in_any_order():
    points, moments, _ = evaluate(in_half_space, 2, FEW)
    numbers = list(range(points.n_parts))[::-1]
    again = np.zeros_like(moments)
    for number in numbers:
        again[points.replicate(number)] += points.moments(in_half_space(points.part(number)))
    assert np.array_equal(moments, again)
    assert not np.array_equal(moments, evaluate(in_half_space, 2, FEW, seed=1)[1])


def test_parts_do_not_change_the_points(monkeypatch):
    whole = PairedPoints.within(4 * 16 * 256, 2, 3)
    parts = [whole.part(number).reshape(4, -1, 2) for number in range(whole.n_parts)]
    monkeypatch.setattr("explore.analysis.sensitivity.paired_points.BLOCK_SIZE", 4 * 64)
    assert whole.n_parts == 4 * len(parts)
    for number, part in enumerate(parts):
        pieces = [whole.part(4 * number + k).reshape(4, -1, 2) for k in range(4)]
        assert {whole.replicate(4 * number + k) for k in range(4)} == {number}
        assert np.array_equal(np.concatenate(pieces, axis=1), part)


@pytest.mark.parametrize("n", [2000, 200_000])
def test_given_data_of_random_designs(n):
    draws = np.random.default_rng(n).random((n, 3))
    for x, exact in zip(draws.T, ISHIGAMI_FIRST, strict=True):
        found = first_order(x, ishigami(draws), "random", 0)
        assert found.low <= exact <= found.high
        assert found.high - found.low < 6.0 / math.sqrt(n)
        assert found.n_designs == n


def test_given_data_intervals_hold_the_truth():
    """Of 60 seeds; fewer than 52 with a probability of 0.3 %."""
    held = np.zeros((2, 3))
    for seed in range(60):
        for row, draws, filling in (
            (held[0], np.random.default_rng(seed).random((2048, 3)), "random"),
            (held[1], sobol(3, 0, 2048, 2048, seed), "even"),
        ):
            found = [first_order(x, ishigami(draws), filling, seed) for x in draws.T]
            row += [one.low <= exact <= one.high for one, exact in zip(found, ISHIGAMI_FIRST, strict=True)]
    assert (held >= 52).all()


def test_the_correction_for_random_designs_is_too_large_for_sobol_designs():
    """The reason for the wider interval: with the correction alone the true index, 0, is outside."""
    draws = sobol(3, 0, 4096, 4096, 1)
    random, even = (first_order(draws[:, 2], ishigami(draws), filling, 0) for filling in ("random", "even"))
    assert random.high < 0.0
    assert even.low < 0.0 < even.high


def test_more_bins_are_needed_where_a_metric_is_steep():
    """exp(-x / w) and noise of uniform z: the variances are known."""
    w = 5e-3
    steep = w * (1.0 - math.exp(-2.0 / w)) / 2.0 - (w * (1.0 - math.exp(-1.0 / w))) ** 2
    exact = steep / (steep + 0.02**2 / 12.0)
    found = {}
    for n in (1000, 400_000):
        x, z = np.random.default_rng(n).random((2, n))
        found[n] = first_order(x, np.exp(-x / w) + 0.02 * z, "random", 0)
    assert not found[1000].has_converged
    assert found[400_000].has_converged
    assert found[400_000].value == pytest.approx(exact, abs=0.01)
    assert found[400_000].low < exact < found[400_000].high


def test_undefined_values_are_left_out_and_counted():
    draws = np.random.default_rng(0).random((4000, 3))
    values = ishigami(draws)
    gaps = values.copy()
    gaps[5], gaps[70], gaps[900] = np.nan, np.inf, -np.inf
    found = first_order(draws[:, 0], gaps, "random", 0)
    kept = np.isfinite(gaps)
    assert found == first_order(draws[kept, 0], values[kept], "random", 0)
    assert found.n_designs == 3997


@pytest.mark.parametrize("exponent", [600, -600])
def test_the_size_of_a_metric_does_not_matter(exponent):
    """Squares of 1e200 were infinite, those of 1e-200 were 0, and there was no index."""
    draws = np.random.default_rng(3).random((1000, 2))
    values = draws[:, 0] + draws[:, 1] ** 2
    assert first_order(draws[:, 0], np.ldexp(values, exponent), "random", 0) == first_order(
        draws[:, 0], values, "random", 0
    )


def test_each_listed_value_has_its_bin():
    generator = np.random.default_rng(0)
    x, z = generator.integers(0, 5, 50_000).astype(float), generator.random(50_000)
    levels = np.array([0.0, 3.0, -1.0, 2.0, 7.0])
    found = first_order(x, levels[x.astype(int)] + z, "random", 0)
    exact = levels.var() / (levels.var() + 1.0 / 12.0)
    assert (found.n_bins, found.has_converged) == (5, True)
    assert found.low <= exact <= found.high
    assert found.value == pytest.approx(exact, abs=5e-4)


def test_a_bin_that_keeps_one_value_without_a_group_has_no_line():
    """The interval leaves out each group of designs: one in its bin has a value of its own, 15 share another."""
    x = np.arange(256.0)
    x[17:32] = 17.0
    found = first_order(x, x, "random", 0)
    assert found.n_bins == 16
    # lines in all bins, so that only rounding is left: 256 squares of at most 1, over a variance of about 1/12
    assert [found.value, found.low, found.high] == pytest.approx([1.0, 1.0, 1.0], abs=1e-12)


def test_too_few_or_equal_values_give_no_index():
    x = np.linspace(0.0, 1.0, 300)
    for found in (first_order(x[:255], x[:255], "random", 0), first_order(x, np.ones(300), "random", 0)):
        assert np.isnan([found.value, found.low, found.high]).all()
        assert not found.has_converged


def nested(parameter, n_outer=300, n_inner=1500):
    """First-order indices by brute force: many random designs at each of evenly spaced values of a parameter.

    Returns that of the feasibility, and that of cv given feasible, corrected for the noise of the inner means.
    """
    generator = np.random.default_rng(7)
    ranges = {"coupler": (50.0, 1000.0), "rocker": (50.0, 500.0), "ground": (50.0, 1000.0)}
    designs = {name: generator.uniform(*ends, n_outer * n_inner) for name, ends in ranges.items()}
    low, high = ranges[parameter]
    designs[parameter] = np.repeat(low + (high - low) * (np.arange(n_outer) + 0.5) / n_outer, n_inner)
    frame = pd.DataFrame({"crank": 50.0, **designs})
    found = explore.evaluate("crank-rocker", frame, metrics="cv", window="drive", drive="slow", constraints=LIMITS)
    feasible = found["feasible"].to_numpy(dtype=float).reshape(n_outer, n_inner)
    cv = np.where(feasible == 1.0, found["cv"].to_numpy().reshape(n_outer, n_inner), 0.0)
    share = feasible.mean(axis=1)
    noise = (share * (1.0 - share)).mean() / (n_inner - 1)
    of_feasibility = (share.var() - noise) / (share.mean() * (1.0 - share.mean()))
    counts, sums, squares = feasible.sum(axis=1), cv.sum(axis=1), (cv**2).sum(axis=1)
    rows = counts > 1
    counts, sums, squares = counts[rows], sums[rows], squares[rows]
    mean = sums.sum() / counts.sum()
    variance = squares.sum() / counts.sum() - mean**2
    within = (squares - sums**2 / counts) / (counts - 1.0)
    between = (counts * (sums / counts - mean) ** 2 - within).sum() / counts.sum()
    return of_feasibility, between / variance


def test_brute_force_agrees_on_a_study(results):
    """Nested loops of 450,000 designs for each parameter; their own error is about 0.003 and 0.02."""
    table = explore.sensitivity(results, "cv", evaluations=2**20).set_index(["output", "parameter"])
    for parameter in ("coupler", "rocker", "ground"):
        of_feasibility, of_cv = nested(parameter)
        assert table.loc[("feasible", parameter), "first_order"] == pytest.approx(of_feasibility, abs=0.01)
        row = table.loc[("cv", parameter)]
        assert row["first_order_low"] - 0.03 < of_cv < row["first_order_high"] + 0.03
        assert row["first_order"] == pytest.approx(of_cv, abs=0.06)
    assert table.attrs["notes"] == []


def test_feasibility_given_all_designs_of_the_file_agrees(results):
    """Over all designs the parameters are independent, so that given data estimate the classical first-order index."""
    frame = results.to_pandas()
    table = explore.sensitivity(results).set_index(["output", "parameter"])
    for parameter in ("coupler", "rocker", "ground"):
        given = first_order(frame[parameter].to_numpy(), frame["feasible"].to_numpy(dtype=float), "even", 0)
        row = table.loc[("feasible", parameter)]
        assert given.low <= row["first_order_high"]
        assert row["first_order_low"] <= given.high
        assert row[["undefined", "bins"]].tolist() == [0, 0]
    assert 0.9 * 65_536 < table["designs"].iloc[0] <= 65_536
    share = table.attrs["feasible"] / table["designs"].iloc[0]
    # Three times the standard deviation of random designs; both samples are more even.
    assert share == pytest.approx(frame["feasible"].mean(), abs=3.0 * 0.45 / math.sqrt(65_536))


def test_workers_do_not_change_the_table(results):
    tables = [explore.sensitivity(results, evaluations=100_000, workers=workers) for workers in (1, 3)]
    with (
        LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
    ):
        tables.append(explore.sensitivity(results, evaluations=100_000, client=client))
    for table in tables[1:]:
        pd.testing.assert_frame_equal(table, tables[0], check_exact=True)
    other = explore.sensitivity(results, evaluations=100_000, seed=1)
    assert (other["first_order"] != tables[0]["first_order"]).any()


def test_a_full_grid_is_exact(tmp_path):
    ranges = {"coupler": (50, 1000, 19), "rocker": (50, 500, 10), "ground": (50, 1000, 20)}
    text = STUDY.replace('method = "sobol"\ncount = 65_536\nseed = 1', 'method = "grid"')
    for name, (start, stop, num) in ranges.items():
        text = text.replace(
            f"{name} = {{ min = {start}, max = {stop} }}",
            f"{name} = {{ start = {start}, stop = {stop}, num = {num} }}",
        )
    results = sweep_text(tmp_path, text)
    frame = results.to_pandas()
    feasible = frame[frame["feasible"] == 1]
    table = explore.sensitivity(results, "cv").set_index(["output", "parameter"])
    for name in ranges:
        means = feasible.groupby(name)["cv"].transform("mean")
        row = table.loc[("cv", name)]
        assert row["first_order"] == pytest.approx(means.var(ddof=0) / feasible["cv"].var(ddof=0), rel=1e-10)
        assert row["first_order_low"] == row["first_order"] == row["first_order_high"]
        assert row["converged"]
        shares = frame.groupby(name)["feasible"].mean()
        exact = shares.var(ddof=0) / frame["feasible"].var(ddof=0)
        drawn = table.loc[("feasible", name)]
        width = drawn["first_order_high"] - drawn["first_order_low"]
        assert drawn["first_order"] == pytest.approx(exact, abs=0.75 * width)
    assert "exact" in run("sensitivity", results.path, "--evaluations", FEW, cwd=tmp_path).stdout


def test_solved_lengths_follow_from_the_drawn_parameters(tmp_path):
    text = STUDY.replace("crank = 50", 'crank = { solve = "swing_angle", value = "30 deg" }').replace("65_536", "8192")
    results = sweep_text(tmp_path, text)
    table = explore.sensitivity(results, evaluations=100_000)
    assert list(table["parameter"].unique()) == ["coupler", "rocker", "ground"]
    share = table.attrs["feasible"] / table["designs"].iloc[0]
    assert share == pytest.approx(results.to_pandas(["feasible"])["feasible"].mean(), abs=3.0 * 0.5 / math.sqrt(8192))


def test_a_grid_without_a_feasible_design_says_so(tmp_path):
    grid = "crank = [40, 50]\ncoupler = [900, 950]\nrocker = 210\nground = 869\n"
    text = f'mechanism = "crank-rocker"\n[parameters]\n{grid}[evaluate]\nmetrics = ["cv"]\n'
    with pytest.raises(RequestError, match="; cv is not apportioned: no design is feasible$"):
        explore.sensitivity(sweep_text(tmp_path, f"{text}[constraints]\nmean = {{ min = 1e9 }}\n"), evaluations=FEW)


def test_what_is_not_applicable_is_said_in_one_line(tmp_path, results):
    front = explore.sweep(explore.load_study(results.path.with_suffix(".toml")), tmp_path / "front.h5", keep="front")
    table = explore.sensitivity(front, evaluations=FEW)
    assert set(table["output"]) == {"feasible"}
    (note,) = table.attrs["notes"]
    assert note.startswith(f"cv, mean_output_ratio: not apportioned, because {front.path} has only the Pareto set")

    few = sweep_text(tmp_path, STUDY.replace("65_536", "512"), "few")
    notes = explore.sensitivity(few, evaluations=FEW).attrs["notes"]
    assert notes[0].startswith("cv is not apportioned: it is defined in 1")
    assert notes[0].endswith("feasible designs, and 256 are needed; sweep more")

    none = sweep_text(tmp_path, STUDY.replace("{ min = 30 }", "{ min = 149 }").replace("65_536", "512"), "none")
    with pytest.raises(RequestError, match="none of 5,760 designs drawn is feasible; `explore rank` says"):
        explore.sensitivity(none, evaluations=FEW)

    frame = results.to_pandas(["coupler", "rocker", "ground"])[:4096]
    frame.assign(crank=50.0).to_csv(tmp_path / "designs.csv", index=False)
    parameters, sampling = STUDY.index("[parameters]"), STUDY.index("[evaluate]")
    text = STUDY[:parameters] + '[sampling]\nmethod = "table"\nfile = "designs.csv"\n' + STUDY[sampling:]
    table = explore.sensitivity(sweep_text(tmp_path, text, "table"))
    assert set(table["output"]) == {"cv", "mean_output_ratio"}
    assert set(table["parameter"]) == {"coupler", "rocker", "ground"}
    assert "the designs of a table have no ranges to draw others from" in table.attrs["notes"][0]


def test_refined_results_keep_only_the_feasibility(tmp_path, results):
    refined = explore.refine(results, tmp_path / "refined.h5", evaluations=1500)
    table = explore.sensitivity(refined, evaluations=FEW)
    assert set(table["output"]) == {"feasible"}
    assert "designs drawn around a Pareto set" in table.attrs["notes"][0]


def test_chosen_designs_keep_only_the_feasibility(tmp_path, results):
    few = [int(number) for number in explore.rank(results).index[:2]]
    explore.tolerance(results, {"crank": 0.1}, few, draws=64, path=tmp_path / "chosen.h5")
    table = explore.sensitivity(tmp_path / "chosen.h5", ["cv"], evaluations=FEW)
    assert set(table["output"]) == {"feasible"}
    assert "has designs that were chosen, not designs from all of the ranges" in table.attrs["notes"][0]


def test_wrong_requests_are_refused(tmp_path, results):
    with pytest.raises(RequestError, match="has no column of numbers 'cvv'; did you mean 'cv'?"):
        explore.sensitivity(results, ["cvv"])
    with pytest.raises(RequestError, match="evaluations = 100: the indices of 3 parameters need at least 5,120"):
        explore.sensitivity(results, evaluations=100)
    with pytest.raises(RequestError, match="seed = -1: must be at least 0"):
        explore.sensitivity(results, seed=-1)
    fixed = STUDY[: STUDY.index("coupler")] + "coupler = 940\nrocker = 211\nground = 869\n"
    fixed += STUDY[STUDY.index("[evaluate]") :]
    with pytest.raises(RequestError, match="no parameter of the study varies"):
        explore.sensitivity(sweep_text(tmp_path, fixed))


def test_the_command(results, tmp_path):
    table, figure = tmp_path / "indices.csv", tmp_path / "indices.png"
    output = run(
        "sensitivity", results.path, "--evaluations", 100_000, "-o", table, "-o", figure, cwd=tmp_path
    )  # fmt: skip
    assert "feasibility of 97,280 newly drawn designs, 27." in output.stdout
    assert "first order" in output.stdout
    assert "cv of 18," in output.stdout
    assert "there is no total index" in output.stdout
    written = pd.read_csv(table)
    expected = explore.sensitivity(results, evaluations=100_000)
    assert list(written["output"]) == list(expected["output"])
    assert written["first_order"].to_numpy() == pytest.approx(expected["first_order"].to_numpy(), rel=1e-12)
    assert figure.stat().st_size > 10_000
    output = run("sensitivity", results.path, "--metric", "cv", "--evaluations", FEW, "--json", cwd=tmp_path)
    found = json.loads(output.stdout)
    assert found["notes"] == []
    assert [row["parameter"] for row in found["indices"]] == ["coupler", "rocker", "ground"] * 2
    assert found["indices"][3]["total"] is None
    code, _, err = call("sensitivity", results.path, "--metric", "cvv")
    assert (code, err.count("\n")) == (2, 1)
    code, _, err = call("sensitivity", results.path, "-o", tmp_path / "indices.txt")
    assert (code, err.count("\n")) == (2, 1)


def test_parameters_of_designs_that_are_all_feasible_do_not_depend_on_each_other(tmp_path):
    """In a narrow box about a crank-rocker."""
    ranges = {"crank": (24, 26), "coupler": (69, 71), "rocker": (59, 61), "ground": (79, 81)}
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={name: {"min": low, "max": high} for name, (low, high) in ranges.items()},
        sampling={"method": "sobol", "count": 1024},
        metrics=["swing_angle"],
        objectives=["swing_angle:max"],
    )
    explore.sweep(study, tmp_path / "all.h5")
    output = run("sensitivity", "all.h5", "--evaluations", 10_000, cwd=tmp_path)
    assert "swing_angle of 1,024 feasible designs" in output.stdout
    assert "depend on each other" not in output.stdout
    assert "designs drawn are feasible" in output.stderr


def test_ctrl_c_is_told_by_the_exit_code(results, tmp_path, monkeypatch):
    monkeypatch.setattr(SensitivityPlan, "table", interrupt)
    code, out, err = call("sensitivity", results.path, "--evaluations", FEW, "-o", tmp_path / "indices.csv")
    assert (code, out) == (130, "")
    assert "interrupted; nothing was written" in err
    assert list(tmp_path.iterdir()) == []


def test_the_chart_draws_each_index_and_its_interval(results):
    table = explore.sensitivity(results, evaluations=FEW)
    table.loc[3, "converged"] = False
    table.loc[3, "undefined"] = 1234
    figure = sensitivity_chart(table)
    assert len(figure.axes) == 3
    feasibility, cv, _ = figure.axes
    assert sorted(bar.get_width() for bar in feasibility.patches) == pytest.approx(
        sorted(table[["first_order", "total"]][:3].to_numpy().ravel())
    )
    assert [label.get_text() for label in cv.get_yticklabels()] == list(
        table[3:6].sort_values("first_order")["parameter"]
    )
    assert sum(bool(bar.get_hatch()) for bar in cv.patches) == 1
    assert "not converged" in cv.get_title(loc="left")
    assert ", without 1,234 where it is undefined" in cv.get_title(loc="left")


def test_unfinished_results_are_refused(tmp_path, results, monkeypatch):
    monkeypatch.setattr(type(results), "is_complete", False)
    with pytest.raises(ResultsError, match="is not finished: 65,536 of 65,536 designs; run the sweep again to go on"):
        explore.sensitivity(results)
