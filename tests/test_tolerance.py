"""`explore tolerance`: yields against brute force and known answers, results files, and bad input."""

import json
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from command_line import assert_refused, call, run, succeed
from linkage_cases import CASES, linkage_of, values_of
from matplotlib.colors import to_hex
from scipy.special import ndtr
from scipy.stats import binomtest
from stopping import interrupt
from studies import GOOD, crank_rockers, sweep_text, swept

import explore
from explore import charts
from explore.analysis.tolerancing import outcomes
from explore.analysis.tolerancing.public import plan_tolerances
from explore.analysis.tolerancing.runs import ToleranceRun
from explore.base.errors import ConfigError, RequestError, ResultsError
from explore.cli.commands.tolerance import _yield_lines
from explore.figures.charts.style import RED
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.running.clusters import processors

STUDY = (
    crank_rockers((40, 60), (800, 1000), (60, 300), (800, 1000))
    + """\
[sampling]
method = "sobol"
count = 512
seed = 1
[evaluate]
metrics = ["swing_angle", "transmission_angle_min", "cv"]
[constraints]
transmission_angle_min = { min = 40 }
transmission_angle_max = { max = 140 }
[rank]
metrics = ["cv", "swing_angle:max", "transmission_angle_min:max"]
[tolerances]
crank = 0.5
coupler = { plus_minus = "2 mm", distribution = "uniform" }
rocker = 0.5
"""
)
folder = swept(STUDY, give=lambda results: results.path.parent)


@pytest.fixture(scope="module")
def robustness(folder):
    return explore.tolerance(folder / "study.h5", draws=65536, path=folder / "robust.h5")


def test_the_yield_is_the_share_of_feasible_parts(folder, robustness):
    """Brute force: evaluate with the study's constraints, on the parts that were drawn."""
    source = explore.open_results(folder / "study.h5")
    assert list(robustness.designs.index) == list(explore.rank(source).index)
    limits = {"transmission_angle_min": {"min": 40}, "transmission_angle_max": {"max": 140}}
    counted = 0
    for number, row in robustness.designs.iterrows():
        sample = robustness.sample(number)
        design = {name: row[name] for name in ("crank", "coupler", "rocker", "ground")}
        for name in ("crank", "coupler", "rocker"):
            design[name] = design[name] + sample[f"{name}_deviation"].to_numpy()
        table = explore.evaluate("crank-rocker", design, metrics=["cv"], constraints=limits)
        assert (table["feasible"] == sample["feasible"]).all()
        if robustness.failures.loc[number, "method"] == "draws":
            assert row["yield"] == pytest.approx(table["feasible"].mean(), rel=1e-15)
            counted += 0 < row["failure_probability"] < 1
        n_failures = int((~table["feasible"]).sum())
        assert binomtest(n_failures, len(table), row["failure_probability"]).pvalue > 1e-4
        assert row["yield_low"] <= row["yield"] <= row["yield_high"]
        assert row["failure_probability"] == pytest.approx(1 - row["yield"], abs=1e-16)
    assert counted > 3


def test_robust_metrics(robustness):
    """Mean and three standard deviations of the sample, which is all that was drawn; no worst beats the nominal."""
    for number, row in robustness.designs.iterrows():
        sample = robustness.sample(number)
        assert row["cv_robust"] == pytest.approx(sample["cv"].mean() + 3 * sample["cv"].std(), rel=1e-9)
        swing = sample["swing_angle"]
        assert row["swing_angle_robust"] == pytest.approx(swing.mean() - 3 * swing.std(), rel=1e-9)
        assert row["cv_worst"] >= row["cv"]
        assert row["swing_angle_worst"] <= row["swing_angle"]
    first = robustness.metrics["std_first_order"] / robustness.metrics["std"]
    assert first.xs("swing_angle", level="metric").between(0.95, 1.05).all()  # nearly linear over these tolerances


def test_columns_say_to_which_side_robust_values_are(folder, robustness):
    columns = {column.name: column.long_name for column in explore.open_results(folder / "robust.h5").columns}
    for name, side in (("cv", "plus"), ("swing_angle", "minus")):
        words = f"mean of {name} over the parts that have it {side} three standard deviations"
        assert columns[f"{name}_robust"] == words


def test_the_results_file_is_ranked_by_yield(folder, robustness):
    results = explore.open_results(folder / "robust.h5")
    assert results.objectives == (
        "yield:max",
        "cv_robust:min",
        "swing_angle_robust:max",
        "transmission_angle_min_robust:max",
    )
    assert results.verify() == []
    frame = results.to_pandas()
    assert (frame["parent"].to_numpy() == robustness.designs.index.to_numpy()).all()
    for name in ("yield", "cv_robust", "swing_angle_worst", "crank", "cv"):
        assert (frame[name].to_numpy() == robustness.designs[name].to_numpy()).all()
    best = explore.rank(results, objectives=["yield:max"]).iloc[0]
    assert best["yield"] == robustness.designs["yield"].max()
    front, same = explore.rank(results), explore.rank(robustness.designs)
    assert list(front["parent"]) == list(same.index)
    assert results.units["cv_worst"] == "1"
    assert results.constraints == explore.open_results(folder / "study.h5").constraints
    run("plot", "pareto", "robust.h5", "--x", "cv_robust", "--y", "yield", "-o", "front.svg", cwd=folder)
    run("report", "robust.h5", "-o", "robust.html", cwd=folder)
    with pytest.raises(ResultsError, match=r"robust.h5 exists; name another file"):
        explore.tolerance(folder / "study.h5", path=folder / "robust.h5")
    with pytest.raises(RequestError, match="holds the designs"):
        explore.tolerance(folder / "study.h5", path=folder / "study.h5", restart=True)


def test_designs_of_the_results_file_keep_the_objectives_of_their_study(folder, robustness):
    """A design as a study, a control curve, and an analysis with other tolerances."""
    results = explore.open_results(folder / "robust.h5")
    run("export", "robust.h5", "--design", 0, "-o", "one.toml", cwd=folder)
    objectives = explore.load_study(folder / "one.toml").objectives
    assert [each.metric for each in objectives] == ["cv", "swing_angle", "transmission_angle_min"]
    assert run("tune", "robust.h5", "--design", 0, "--parameter", "crank", cwd=folder).stdout.startswith("cv exists")
    again = explore.tolerance(results, {"crank": 0.1}, 0, draws=100)
    assert tuple(again.designs.attrs["objectives"]) == results.objectives


def test_the_text_of_a_robustness_is_its_size_and_yields(robustness):
    yields = robustness.designs["yield"]
    expected = f"<Robustness of {len(yields)} designs: yield {yields.min():.6g} to {yields.max():.6g}>"
    assert repr(robustness) == expected


def test_an_objective_that_is_a_parameter_stays_one(tmp_path):
    study = sweep_text(tmp_path, f'{GOOD}[rank]\nmetrics = ["coupler:min", "cv"]\n')
    explore.tolerance(study, {"crank": 0.1}, int(explore.rank(study).index[0]), draws=100, path=tmp_path / "robust.h5")
    results = explore.open_results(tmp_path / "robust.h5")
    assert results.objectives == ("yield:max", "coupler:min", "cv_robust:min")
    assert results.own_objectives == ("coupler:min", "cv:min")


def test_a_metric_with_the_name_of_a_column_that_is_added_is_refused(tmp_path):
    formula = '[metrics]\ncv_worst = { formula = "2 * cv", unit = "1" }\n'
    sweep_text(tmp_path, f'{GOOD}[evaluate]\nmetrics = ["cv"]\n{formula}')
    with pytest.raises(RequestError, match="cv_worst: the analysis adds a column of this name"):
        explore.tolerance(tmp_path / "study.h5", {"crank": 0.1})


def test_no_result_depends_on_the_workers_or_the_other_designs(folder, robustness):
    number = int(robustness.designs.index[2])
    alone = explore.tolerance(folder / "study.h5", designs=number, draws=65536, workers=1)
    assert alone.designs.iloc[0].equals(robustness.designs.loc[number])
    assert alone.failures.iloc[0].equals(robustness.failures.loc[number])
    other = explore.tolerance(folder / "study.h5", designs=number, draws=65536, seed=1)
    assert other.designs["cv_robust"].iloc[0] != alone.designs["cv_robust"].iloc[0]


def test_a_cluster_gives_the_same(folder, robustness):
    from distributed import Client

    numbers = [int(number) for number in robustness.designs.index[:2]]
    with Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address="127.0.0.1:0") as client:
        there = explore.tolerance(folder / "study.h5", designs=numbers, draws=65536, client=client)
    assert there.designs.equals(robustness.designs.loc[numbers])


@pytest.fixture(scope="module")
def near_the_change_point(tmp_path_factory):
    """A linkage 1 mm from where the crank no longer turns: the margin is linear in the lengths."""
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={"crank": 50, "coupler": 101, "rocker": 80, "ground": 130},
        metrics=["swing_angle", "grashof_margin"],
    )
    return explore.sweep(study, tmp_path_factory.mktemp("change") / "one.h5")


@pytest.mark.parametrize("sigmas", [0.5, 2.5, 4.75, 5.5])
def test_parts_that_cannot_turn_are_failures_with_a_known_probability(near_the_change_point, sigmas):
    """The margin of 1 mm is the sum of four normals of equal spread; down to 1e-6 and 2e-8."""
    width = 3.0 / (2.0 * sigmas)
    tolerances = dict.fromkeys(("crank", "coupler", "rocker", "ground"), width)
    robustness = explore.tolerance(near_the_change_point, tolerances, draws=1 << 17)
    row, exact = robustness.failures.loc[0], ndtr(-sigmas)
    # Three in four intervals of half of the width would hold it: this is one seed, so allow twice the distance.
    slack = (row["high"] - row["low"]) / 2
    assert row["low"] - slack <= exact <= row["high"] + slack
    assert row["high"] - row["low"] < 0.1 * exact
    assert row["method"] == ("weighted" if sigmas > 2.4 else "draws")
    design = robustness.designs.loc[0]
    assert design["assembled"] == pytest.approx(1 - exact, abs=6e-3)
    # The box is three standard deviations wide: its corner is at six of the sum.
    assert np.isnan(design["swing_angle_worst"]) == (sigmas < 6.0)
    assert not row["box_assembled"]


def test_a_study_with_tolerances_is_the_same_study(tmp_path):
    plain = GOOD
    (tmp_path / "plain.toml").write_text(plain, encoding="utf-8")
    (tmp_path / "with.toml").write_text(plain + "[tolerances]\ncrank = 0.1\n", encoding="utf-8")
    first, second = (explore.load_study(tmp_path / name) for name in ("plain.toml", "with.toml"))
    assert first == second
    assert first.sha256 == second.sha256
    study = explore.Study(
        mechanism="crank-rocker", parameters={"crank": 100, "coupler": 1000, "rocker": 500, "ground": 700},
        metrics=["swing_angle"], tolerances={"crank": {"plus_minus": "1 mm"}},
    )  # fmt: skip
    results = explore.sweep(study, tmp_path / "study.h5")
    plan = plan_tolerances(results, {"crank": 0, "coupler": "10 um"}, 0, draws=2, seed=0)
    assert [(t.parameter, t.plus_minus) for t in plan.run.request.tolerances] == [("coupler", 0.01)]


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("cranck = 0.1", "tolerances.cranck: crank-rocker has no such parameter; did you mean 'crank'?"),
        ("branch = 1", "tolerances.branch: has only listed values, so it cannot deviate; leave it out"),
        ("crank = -0.1", "tolerances.crank: must be at least 0, got -0.1"),
        ("crank = { distribution = 'normal' }", "tolerances.crank: the key 'plus_minus' is missing"),
        (
            "crank = { plus_minus = 1, distribution = 'gauss' }",
            "tolerances.crank.distribution: must be normal or uniform, got 'gauss'",
        ),
        ("crank = { plus_minus = 1, sigma = 3 }", "tolerances.crank.sigma: unknown key; available"),
    ],
)
def test_bad_tolerances_of_a_study(tmp_path, section, message):
    (tmp_path / "study.toml").write_text(f"{GOOD}[tolerances]\n{section}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        explore.load_study(tmp_path / "study.toml")
    assert len(caught.value.problems) == 1
    assert message.partition("; available")[0] in caught.value.problems[0]
    assert "study.toml:8: " in caught.value.problems[0]


def test_the_command(folder, robustness):
    number = str(robustness.designs.index[0])
    out = run("tolerance", "study.h5", "--design", number, "--draws", "65536", "--tolerance", "ground=0.1 mm",
              "-o", "parts.svg", "-o", "parts.csv", cwd=folder)  # fmt: skip
    assert out.stdout.startswith(f"design {number}: yield ")
    assert "share of the variance to first order" in out.stdout
    assert "± 0.1" in out.stdout
    assert (folder / "parts.svg").read_text(encoding="utf-8").count("crank") > 1
    assert "yield,yield_low" in (folder / "parts.csv").read_text(encoding="utf-8")
    table = json.loads(
        run("tolerance", "study.h5", "--design", number, "--draws", "65536", "--json", cwd=folder).stdout
    )
    assert table["designs"][0]["yield"] == robustness.designs["yield"].iloc[0]
    assert table["tolerances"]["coupler"] == {"plus_minus": 2.0, "distribution": "uniform"}
    assert table["derivatives"][0]["parameter"] == "crank"
    front = run("tolerance", "study.h5", "--draws", "4096", cwd=folder).stdout
    assert "that nothing beats in yield, cv_robust, swing_angle_robust" in front


def test_a_spread_that_derivatives_do_not_explain_is_said(tmp_path):
    """Beside equal strokes every fourth part drives by the other stroke: cv jumps from 0.124 to 0.296."""
    links = {"crank": 50, "coupler": 123.7682627, "rocker": 70.32828513, "ground": 133.2517565}
    study = explore.Study(
        mechanism="crank-rocker", parameters=links | {"phases": 3}, window="clutch",
        metrics=["mean", "cv", "transmission_angle_min"],
    )  # fmt: skip
    explore.sweep(study, tmp_path / "drill.h5")
    out = run("tolerance", "drill.h5", "--tolerance", "0.1", "--draws", "10000", cwd=tmp_path)
    assert "derivatives do not tell the std of mean, cv, because of" in out.stdout
    out = run("tolerance", "drill.h5", "--tolerance", "0.0001", "--draws", "10000", cwd=tmp_path)
    assert "derivatives do not tell" not in out.stdout


def test_parts_that_miss_the_error_bound_are_said(tmp_path):
    """A near-kite, which no constraint excludes: all of its parts fail, and so does the design."""
    study = explore.Study(
        mechanism="crank-rocker", metrics=["rocker_acceleration_std"], constraints={"swing_angle": {"min": 1.0}},
        objectives=["rocker_acceleration_std"], tolerance=1e-12,
        parameters={"crank": 100.0, "coupler": 1000.0, "rocker": 1000.001, "ground": 100.005},
    )  # fmt: skip
    explore.sweep(study, tmp_path / "kite.h5")
    options = ("--design", "0", "--tolerance", "ground=0.0001", "--draws", "100")
    lines = run("tolerance", "kite.h5", *options, cwd=tmp_path).stdout.splitlines()
    assert lines[0].startswith("design 0: yield 0 %")
    assert lines[1] == "of 100 parts drawn 100 miss the error bound"
    assert "some parts within the tolerances miss the error bound" in lines
    assert "or the error bound missed" in run("rank", "kite.h5", "--nearest", "1", cwd=tmp_path).stdout.replace(
        "\n", " "
    )


def test_parts_without_values_are_said_by_their_status(tmp_path):
    """A press whose ram turns back twice or four times: parts move, but have no two strokes."""
    table = CASES["toggle-press"]["table"].replace("c = 150", "c = 136.25")
    results = sweep_text(tmp_path, f'mechanism = "linkage"\n{table}[evaluate]\nmetrics = ["time_ratio"]\n', "press")
    failures = explore.tolerance(results, {"c": 0.5}, [0], draws=200).failures.iloc[0]
    assert 0 < failures["not_assembled"] < 200
    assert failures["statuses"] == {"no_strokes": failures["not_assembled"]}
    said = run("tolerance", "press.h5", "--design", "0", "--tolerance", "c=0.5", "--draws", "200", cwd=tmp_path).stdout
    assert f"of 200 parts drawn {failures['not_assembled']} have the status no_strokes\n" in said


def test_parts_without_a_metric_are_said(tmp_path):
    """A root is undefined where a swing is below its limit; mean and robust value are of the other parts."""
    study = explore.Study(
        mechanism="crank-rocker", metrics=["root"], objectives=["root:max"],
        parameters={"crank": [50.0, 49.99, 60.0], "coupler": 940.62, "rocker": 211.79, "ground": 869.44},
        formulas={"root": {"formula": "sqrt(swing_angle - 30.5)", "unit": "1"}},
    )  # fmt: skip
    results = explore.sweep(study, tmp_path / "root.h5")
    table = explore.tolerance(results, {"crank": 0.1}, [0], draws=1000)
    n_undefined = int(table.sample(0)["root"].isna().sum())
    assert 0 < n_undefined == table.metrics["undefined"].iloc[0] < 1000
    with pytest.raises(RequestError, match="^design 1 was not analysed; available: 0$"):
        table.sample(1)
    options = ("tolerance", "root.h5", "--tolerance", "crank=0.1", "--draws", "1000")
    said = run(*options, "--design", "0", cwd=tmp_path).stdout
    assert said.endswith(f"\n{n_undefined} parts that move have no root: mean and std are of the others\n")
    said = run(*options, "--design", "0", "--design", "1", cwd=tmp_path).stdout
    assert said.endswith("root is undefined in parts of 2 designs that move: mean and std are of the others\n")
    said = run(*options, "--design", "0", "--design", "2", cwd=tmp_path).stdout
    assert said.endswith("root is undefined in parts of 1 design that move: mean and std are of the others\n")


@pytest.mark.parametrize(
    ("limit", "title", "caption"),
    [
        (0.0, "1 of 21 designs that nothing beats", ""),
        (170.0, "21 designs, none of them feasible", "the first 20 of 21; -o FILE.h5 writes all"),
    ],
)
def test_a_table_says_how_many_designs_it_leaves_out(tmp_path, limit, title, caption):
    study = explore.Study(
        mechanism="crank-rocker", metrics=["swing_angle"], objectives=["swing_angle:max"],
        parameters={"crank": np.linspace(40.0, 50.0, 21), "coupler": 940.0, "rocker": 210.0, "ground": 870.0},
        constraints={"swing_angle": {"min": limit}},
    )  # fmt: skip
    explore.sweep(study, tmp_path / "swing.h5")
    numbers = [word for number in range(21) for word in ("--design", str(number))]
    said = run("tolerance", "swing.h5", "--tolerance", "0.1", "--draws", "100", *numbers, cwd=tmp_path).stdout
    assert said.startswith(title)
    assert ("the first" in said, caption in said) == (bool(caption), True)


def test_the_interval_of_a_yield_is_printed_from_low_to_high():
    row = {"parts": 100, "probability": 0.02, "low": 0.01, "high": 0.05, "missed_cv": 2, "not_assembled": 0}
    row |= {"statuses": {}, "box_tolerance_met": True}
    lines = _yield_lines(3, {**row, "method": "weighted", "box_assembled": True, "box_feasible": False})
    assert lines[0] == "design 3: yield 98 %, with 95 % confidence 95 to 99 %"
    assert lines[2] == "a part fails with probability 0.02 (0.01 to 0.05), by importance sampling"


def test_at_80_columns_the_front_keeps_the_lengths_and_leaves_out_statistics(folder, robustness):
    lines = call("tolerance", folder / "study.h5", "--draws", "1024")[1].splitlines()
    headings = " ".join(lines[1:5]).split()
    assert {"yield", "crank", "coupler", "rocker", "ground"} <= set(headings)
    assert max(map(len, lines[1:-1])) <= 80
    assert "2 columns left out: swing_angle_robust, transmission_angle_min_robust; --json prints all" in lines
    (row,) = [line.split() for line in lines if line.split()[:1] == [str(robustness.designs.index[0])]]
    lengths = robustness.designs.iloc[0][["crank", "coupler", "rocker", "ground"]]
    assert [float(cell) for cell in row[-4:]] == pytest.approx(lengths.tolist(), rel=1e-5)


def test_an_analysis_that_was_killed_is_finished(folder, robustness, tmp_path, monkeypatch):
    """Before its commit its file is there, without a design; after it the file is complete, and left as it is.

    A repeated run has all tables, of which the file has one.
    """
    source, path = folder / "study.h5", tmp_path / "killed.h5"
    three = robustness.designs.index[:3]
    whole = explore.tolerance(source, designs=three, path=tmp_path / "whole.h5")

    with monkeypatch.context() as patch:
        patch.setattr(AllDesignsWriter, "commit", interrupt)
        with pytest.raises(KeyboardInterrupt):
            explore.tolerance(source, designs=three, path=path)
    out, _ = succeed("show", str(path))
    assert "run its `explore tolerance` again to continue" in out
    with pytest.raises(ResultsError, match=r"killed\.h5 exists; name another file"):
        explore.tolerance(source, designs=three, seed=1, path=path)
    for _ in range(2):
        found = explore.tolerance(source, designs=three, path=path)
        assert path.read_bytes() == (tmp_path / "whole.h5").read_bytes()
        for table in ("designs", "metrics", "derivatives", "failures"):
            assert getattr(found, table).equals(getattr(whole, table))


@pytest.mark.parametrize(("width", "left_out"), [("80", []), ("64", ["mean"])])
def test_a_finished_file_is_told_so_and_units_stay(folder, robustness, tmp_path, monkeypatch, width, left_out):
    monkeypatch.setenv("COLUMNS", width)
    design, path = str(robustness.designs.index[0]), tmp_path / "one.h5"
    command = ["tolerance", str(folder / "study.h5"), "--design", design, "--draws", "1024", "-o", str(path)]
    code, out, err = call(*command)
    assert (code, err.splitlines()[-1]) == (0, f"wrote {path}")
    assert ("1 column left out: mean; --json prints all" in out) == bool(left_out)
    lines = [line.split() for line in out.splitlines()]
    wanted = [name for name in ("metric", "nominal", "mean", "std", "lowest", "highest") if name not in left_out]
    assert wanted in lines
    assert ["swing_angle", "[deg]"] in [words[:2] for words in lines]
    code, _, err = call(*command)
    assert (code, err.splitlines()[-1]) == (0, f"{path} is complete already: 1 designs")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--tolerance", "crank"], 2, "--tolerance crank: write NAME=VALUE, such as crank=0.1"),
        (["--tolerance", "crank=0", "--tolerance", "coupler=0", "--tolerance", "rocker=0"], 2, "no dimension has"),
        (["--tolerance", "crank=0.1", "--tolerance", "crank=0.2"], 2, "--tolerance crank is given several times"),
        (["--tolerance", "0.1", "--tolerance", "0.2"], 2, "--tolerance 0.2: a tolerance of all lengths is given"),
        (["--design", "9999"], 1, "9999"),
        (["-o", "robust.h5"], 1, "robust.h5 exists; name another file with -o or move it aside with --restart"),
        (["-o", "study.h5"], 2, "-o study.h5 is the results file itself"),
        (["-o", "robust.txt"], 2, "the name must end in"),
    ],
)
def test_bad_input_gives_one_line(folder, robustness, monkeypatch, arguments, code, message):
    monkeypatch.chdir(folder)
    assert_refused(call("tolerance", "study.h5", *arguments), code, message)


def test_ctrl_c_leaves_nothing(folder, monkeypatch):
    monkeypatch.setattr(ToleranceRun, "compute", interrupt)
    monkeypatch.chdir(folder)
    code, out, err = call("tolerance", "study.h5", "-o", "new.h5")
    assert (code, out) == (130, "")
    assert "interrupted; nothing was written" in err
    assert not (folder / "new.h5").exists()


def test_progress_counts_all_parts(folder, robustness):
    seen = []
    explore.tolerance(
        folder / "study.h5", designs=int(robustness.designs.index[0]), draws=(1 << 18) + 10,
        report_progress=lambda done, total: seen.append((done, total)),
    )  # fmt: skip
    assert len(seen) >= 3  # after each piece, the rest, and each second
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    totals = [total for _, total in seen]
    assert totals == sorted(totals, reverse=True), "what is not needed is left out when the failures are counted"
    assert seen[-1][0] == totals[-1] > (1 << 18) + 10


@pytest.mark.parametrize("draws", [1 << 18, 2])  # while parts are drawn, and while rare failures are searched
def test_slow_parts_are_counted_and_end_at_once(folder, robustness, monkeypatch, draws):
    """Ctrl-C reaches the threads between two slices of parts, not after a piece of 262,144."""
    evaluate, seen, evaluated, raised = outcomes.evaluate_columns, [], [], []

    def slowly(request, columns):
        time.sleep(0.6)
        evaluated.append(len(columns["crank"]))
        return evaluate(request, columns)

    def interrupt(done, total):
        seen.append((done, total))
        if len(seen) >= 2 and done > 2:
            raised.append(len(evaluated))
            raise KeyboardInterrupt

    monkeypatch.setattr(outcomes, "evaluate_columns", slowly)
    with pytest.raises(KeyboardInterrupt):
        explore.tolerance(
            folder / "study.h5", designs=int(robustness.designs.index[0]), draws=draws, report_progress=interrupt
        )
    assert len(evaluated) - raised[0] <= processors()  # the slices that run
    assert 0 < seen[0][0] < seen[-1][0] < seen[-1][1]
    assert sum(evaluated) < 1 << 14
    assert not [thread for thread in threading.enumerate() if "_compute_all" in thread.name]


def test_the_chart_marks_limits_and_shares(robustness):
    number = int(robustness.designs["yield"].idxmin())
    figure = charts.tolerance_chart(robustness, number)
    bars, histograms = figure.axes[::2], figure.axes[1::2]
    assert [bar.get_ylabel().replace("\n", " ") for bar in bars] == [
        "swing angle [deg]", "transmission angle min [deg]", "cv", "transmission angle max [deg]",
    ]  # fmt: skip
    for bar in bars:
        assert sum(patch.get_width() for patch in bar.patches) == pytest.approx(100.0, rel=1e-12)
    sample = robustness.sample(number)
    assert sum(patch.get_height() for patch in histograms[0].patches) == len(sample)
    for histogram, missed in (
        (histograms[1], sample["transmission_angle_min"] < 40),
        (histograms[3], sample["transmission_angle_max"] > 140),
    ):
        red = [patch.get_height() for patch in histogram.patches if to_hex(patch.get_facecolor()) == RED]
        assert sum(red) == missed.sum()
    assert 0 < missed.sum() < len(sample)
    with pytest.raises(RequestError, match="design -1 was not analysed"):
        charts.tolerance_chart(robustness, -1)


def test_the_chart_tells_more_parameters_apart_than_there_are_colours(tmp_path):
    case = CASES["jansen"]
    values = values_of(case)
    study = explore.Study(mechanism=linkage_of(case), parameters=values, metrics=["transmission_angle_min"])
    explore.sweep(study, tmp_path / "leg.h5")
    robustness = explore.tolerance(tmp_path / "leg.h5", dict.fromkeys(values, 0.1), draws=64)
    figure = charts.tolerance_chart(robustness)
    bars = figure.axes[0].patches
    assert len({(to_hex(bar.get_facecolor()), bar.get_hatch()) for bar in bars}) == len(values) > 8
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert legend.get_window_extent().x1 <= figure.bbox.x1


def test_the_chart_tells_parts_without_a_value(tmp_path):
    """A metric that half of the parts have, one that none has, and one that varies by rounding; none has a sense."""
    formulas = {"half": "log(crank - 50)", "none": "log(crank - 60)", "rounding": "3 * crank / crank"}
    entries = "".join(f'{name} = {{ formula = "{text}", unit = "1" }}\n' for name, text in formulas.items())
    parameters = "[parameters]\ncrank = 50\ncoupler = 940.62\nrocker = 211.79\nground = 869.44\n"
    text = f'mechanism = "crank-rocker"\n{parameters}[evaluate]\nmetrics = {list(formulas)}\n[metrics]\n{entries}'
    results = sweep_text(tmp_path, f"{text}[tolerances]\ncrank = 0.1\n", "formulas")
    robust = explore.tolerance(results, designs=0, draws=1024)
    lacking = robust.sample(0)["half"].isna().sum()
    assert 400 < lacking < 600
    figure = charts.tolerance_chart(robust)
    half, none, rounding = figure.axes[1::2]
    assert [text.get_text() for text in half.texts] == [f"{lacking} undefined"]
    assert [text.get_text() for text in none.texts] == ["undefined"]
    assert sum(bar.get_height() for bar in rounding.patches) == 1024
    assert 0.0 < np.ptp(rounding.get_xlim()) < 1e-11


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [(7.0e-10, 7.2e-10, "failure probability 7e-10 to 7.2e-10"), (0.0, 1.4e-5, "yield 99.9986 to 100 %")],
)
def test_a_yield_that_rounds_to_1_is_told_by_the_failures(robustness, low, high, words):
    failures = robustness.failures.assign(low=low, high=high)
    assert words in charts.tolerance_chart(replace(robustness, failures=failures)).get_suptitle().replace("\xa0", " ")


def test_a_number_alone_is_of_all_lengths(folder):
    number = str(int(explore.rank(explore.open_results(folder / "study.h5")).index[0]))
    options = ("tolerance", str(folder / "study.h5"), "--design", number, "--draws", "1024", "--json")
    found = json.loads(call(*options, "--tolerance", "crank=0.2", "--tolerance", "50 um")[1])["tolerances"]
    assert {name: entry["plus_minus"] for name, entry in found.items()} == {
        "crank": 0.2, "coupler": 0.05, "rocker": 0.05, "ground": 0.05,
    }  # fmt: skip
    out, _ = succeed(*options[:-1], "--tolerance", "0.1")
    assert "first derivatives, in the unit of the metric per mm" in out


def test_the_clearance_of_a_pin_is_two_parameters_of_a_table(tmp_path):
    """As docs/tolerance.md writes it; of a swing, that along the coupler is as its length to first order."""
    links = {"crank": {"O": 0, "A": "r"}, "coupler": {"A": 0, "B": ["b + play_along", "play_across"]}}
    table = {
        "driver": "crank", "output": "rocker", "frame": {"O": [0, 0], "C": ["ground", 0]},
        "links": links | {"rocker": {"C": 0, "B": "c"}}, "branch": {"B": "left of A C"},
    }  # fmt: skip
    values = {"r": 20.0, "b": 52.0, "c": 50.0, "ground": 41.0, "play_along": 0.0, "play_across": 0.0}
    study = explore.Study(
        mechanism=explore.Linkage(table), metrics=["swing_angle"], window="cycle",
        parameters=values,
    )  # fmt: skip
    explore.sweep(study, tmp_path / "play.h5")
    tolerances = {"b": 0.05, "play_along": 0.02, "play_across": 0.02}
    found = explore.tolerance(tmp_path / "play.h5", tolerances, 0, draws=4096)
    slopes = found.by_dimension(0, "derivative")["swing_angle"]
    assert slopes["play_along"] == pytest.approx(slopes["b"], rel=1e-9)
    assert slopes["play_across"] == pytest.approx(0.0, abs=1e-9)
    shortest = values | {"b": 51.95, "play_along": -0.02}
    worst = explore.evaluate(explore.Linkage(table), shortest, metrics=["swing_angle"], window="cycle")
    assert found.metrics.loc[(0, "swing_angle"), "low"] == pytest.approx(worst["swing_angle"].iloc[0], rel=1e-7)
