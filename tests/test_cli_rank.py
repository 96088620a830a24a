"""`explore rank` as a user meets it, in the test's own process."""

import json
import sys

import numpy as np
import pandas as pd
import pytest
from command_line import assert_refused, call, on_terminal, succeed
from studies import box, sweep_text, swept

import explore
from explore.base.json_text import json_text
from explore.cli.table_files import markdown, with_labels
from explore.model.columns import Column
from explore.results.ranking.joint import rank_sources
from explore.results.ranking.rankings import RankRequest
from explore.results.store.open_results import open_results

STUDY = box("""\
count = 32_768
[evaluate]
metrics = ["cv", "swing_angle", "time_ratio", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 30 }
transmission_angle_max = { max = 150 }
time_ratio = { min = 1, max = 1.5 }
[rank]
metrics = ["cv", "swing_angle:max", "transmission_angle_min:max"]
""")


@pytest.fixture(autouse=True)
def wide_terminal(monkeypatch):
    """A terminal that holds every column."""
    monkeypatch.setenv("COLUMNS", "200")


#: A folder with a finished sweep of some thousand designs.
sweep_folder = swept(STUDY, "all", give=lambda results: results.path.parent)


#: A finished sweep whose designs are all on the front of two metrics.
opposites = swept(
    box("""\
count = 32_768
[metrics]
shortness = { formula = "-coupler", unit = "mm" }
[evaluate]
metrics = ["shortness"]
"""),
    "opposites",
    give=lambda results: results.path,
)


def records(*arguments):
    """What `explore rank --json` prints."""
    out, _ = succeed("rank", *arguments, "--json", seconds=240)
    return json.loads(out)


def error_line(*arguments, code=2):
    """The one line that a wrong command gets."""
    reply = call("rank", *arguments, seconds=240)
    assert_refused(reply, code)
    return reply[2]


def test_fronts_are_counted_and_shown(sweep_folder):
    rows = records(sweep_folder / "all.h5", "--fronts", 3)
    table = explore.rank(explore.read_results(sweep_folder / "all.h5"), fronts=3)

    assert [(r["design"], r["front"]) for r in rows] == list(zip(table.index, table["front"], strict=True))
    assert {r["front"] for r in rows} == {1, 2, 3}
    out, err = succeed("rank", sweep_folder / "all.h5", "--fronts", 2, "--top", 0)
    assert f"{(table['front'] == 2).sum()} more are in front 2\n" in err
    heading = next(line for line in out.splitlines() if "alike" in line)
    assert heading.split()[:3] == ["design", "alike", "front"]
    assert len([line for line in out.splitlines() if line.split()[:1] and line.split()[0].isdigit()]) == sum(
        table["front"] <= 2
    )
    assert "front" not in call("rank", sweep_folder / "all.h5")[1]


def test_conditions_and_limits_select_as_pandas_does(sweep_folder):
    table = explore.read_results(sweep_folder / "all.h5")
    arguments = ["--where", "swing_angle > 40 and not time_ratio >= 1.2", "--limit", "transmission_angle_min=35",
                 "--limit", "time_ratio>=1.05", "--limit", "transmission_angle_max=145"]  # fmt: skip
    selection = table[
        (table["swing_angle"] > 40)
        & ~(table["time_ratio"] >= 1.2)
        & (table["transmission_angle_min"] >= 35)
        & (table["time_ratio"] >= 1.05)
        & (table["transmission_angle_max_margin"] >= 5)
    ]
    expected = explore.rank(selection, fronts=2)

    rows = records(sweep_folder / "all.h5", "--fronts", 2, *arguments)

    assert [(r["design"], r["front"]) for r in rows] == list(zip(expected.index, expected["front"], strict=True))
    assert len(rows) > 5
    assert table.loc[selection.index, "feasible"].sum() < table["feasible"].sum()
    limits = {"transmission_angle_min": 35, "time_ratio": {"min": 1.05}, "transmission_angle_max": 145}
    for results in (table, sweep_folder / "all.h5"):
        same = explore.rank(results, fronts=2, where=arguments[1], limits=limits)
        assert same.index.tolist() == expected.index.tolist()


def test_excluded_designs_are_counted(sweep_folder):
    table = explore.read_results(sweep_folder / "all.h5")
    feasible = table[table["feasible"]]
    within_limit = feasible[feasible["transmission_angle_min"] >= 40]
    matching = within_limit[within_limit["swing_angle"] > 60]

    _, err = succeed(
        "rank", sweep_folder / "all.h5", "--where", "swing_angle > 60", "--limit", "transmission_angle_min=40"
    )
    assert f" of {len(matching):,} feasible designs that meet the request are Pareto-optimal" in err
    assert (
        f"{len(feasible) - len(within_limit):,} feasible ones that miss the limit transmission_angle_min >= 40" in err
    )
    assert f"{len(within_limit) - len(matching):,} feasible ones that do not meet swing_angle > 60" in err
    assert (
        "meets the request, so there is nothing to rank"
        in call("rank", sweep_folder / "all.h5", "--where", "cv < 0")[2]
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--where", "swing_angle > 20 and"], "where: at the end: expected a comparison here"),
        (["--limit", "cv_margin<=0.4"], "no metric 'cv_margin'; available: crank, coupler, rocker, ground, cv, "),
    ],
)
def test_a_wrong_condition_or_limit_gets_one_line(sweep_folder, arguments, message):
    assert message in error_line(sweep_folder / "all.h5", *arguments)


def test_a_condition_on_a_front_warns_of_missing_designs(sweep_folder, tmp_path):
    study = explore.load_study(sweep_folder / "all.toml")
    explore.sweep(study, tmp_path / "front.h5", keep="front")
    every = explore.rank(sweep_folder / "all.h5", limits={"cv": {"max": 0.9}})

    warning = call("rank", tmp_path / "front.h5", "--where", "time_ratio < 1.1")[2]
    code, _, err = call("rank", tmp_path / "front.h5", "--limit", "cv<=0.9")

    assert "the best in this request may be missing" in warning
    assert (code, "missing" in err) == (0, False), "nothing that a limit on an objective leaves out beats what is left"
    assert explore.rank(tmp_path / "front.h5", limits={"cv": {"max": 0.9}}).index.tolist() == every.index.tolist()
    assert len(every) > 3


def test_a_line_counts_all_equal_designs_even_if_few_lines_are_printed(opposites):
    objectives = ["--metric", "coupler:min", "--metric", "shortness:min"]
    out, _ = succeed("rank", opposites, *objectives, "--top", 3)
    ranked = explore.rank(opposites, objectives=["coupler:min", "shortness:min"])
    assert len(ranked) > 9000
    lines = [line.split() for line in out.splitlines()]
    assert [line[0] for line in lines if line and line[0].isdigit()] == [str(n) for n in ranked.index[:3]]
    different = ranked["coupler"].nunique()
    assert f"{different - 3:,} more lines" in out
    four = ["--where", f"coupler < {sorted(ranked['coupler'].unique())[4]}"]
    assert "\n1 more line:" in call("rank", opposites, *objectives, *four, "--top", 3)[1]


def test_one_design_is_spoken_of_as_one(sweep_folder):
    number = explore.rank(sweep_folder / "all.h5").index[0]
    err = call("rank", sweep_folder / "all.h5", "--where", f"design == {number}")[2]
    assert err.startswith("1 of 1 feasible design that meets the request is Pareto-optimal")


def test_quality_is_shown_and_printed(sweep_folder):
    table = explore.rank(sweep_folder / "all.h5", quality=True)
    rows = records(sweep_folder / "all.h5", "--quality")
    out = call("rank", sweep_folder / "all.h5", "--quality", "--top", 0)[1]

    assert [r["knee"] for r in rows] == table["knee"].tolist()
    assert table["knee"].sum() == 1
    assert [r["crowding"] for r in rows] == [None if v == float("inf") else v for v in table["crowding"]]
    assert [r["hypervolume_share"] for r in rows] == table["hypervolume_share"].tolist()
    (knee,) = (line.split() for line in out.splitlines() if " yes " in line)
    assert knee[0] == str(table.index[table["knee"]][0])
    assert "crowding" not in call("rank", sweep_folder / "all.h5")[1]


# --- several results -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def other_results(sweep_folder):
    """A sweep of other designs, with a parameter that the first has not."""
    text = STUDY.replace("count = 32_768", "count = 20_000\nseed = 7").replace("crank = 50", "crank = 50\nspeed = 2")
    sweep_text(sweep_folder, text, "other")
    return sweep_folder / "other.h5"


@pytest.mark.parametrize("fronts", [1, 3])
def test_several_results_are_ranked_as_one_table(sweep_folder, other_results, fronts):
    files = [sweep_folder / "all.h5", other_results]
    tables = [explore.read_results(file).assign(results=str(file)) for file in files]
    table = pd.concat(tables)
    table.attrs = tables[0].attrs
    expected = explore.rank(table, fronts=fronts, quality=True)

    joint = explore.rank(files, fronts=fronts, quality=True)
    rows = records(*files, "--fronts", fronts, "--quality")

    keys = ["results", "front", "cv", "knee", "hypervolume_share"]
    pd.testing.assert_frame_equal(joint[keys], expected[keys], check_exact=True)
    assert [(r["design"], r["results"], r["front"]) for r in rows] == list(
        zip(joint.index, joint["results"], joint["front"], strict=True)
    )
    assert set(joint["results"]) == {str(file) for file in files}
    assert joint.loc[joint["results"] == str(other_results), "speed"].eq(2).all()


def test_results_with_other_constraints_are_told(tmp_path):
    """Each design keeps those of its own study, so one that the first would exclude may win."""
    for name, limit in (("bound", 40.0), ("alike", 40.0), ("wider", 30.0)):
        study = explore.Study(
            mechanism="crank-rocker",
            parameters={
                "crank": {"start": 30, "stop": 60, "num": 5}, "coupler": 200, "rocker": 150, "ground": 180
            },
            metrics=["swing_angle", "transmission_angle_min"], constraints={"transmission_angle_min": {"min": limit}},
            objectives=["swing_angle:max"],
        )  # fmt: skip
        explore.sweep(study, tmp_path / f"{name}.h5")
    for name, count in (("alike", 0), ("wider", 1)):
        _, _, told = call("rank", f"{tmp_path}/bound.h5", f"{tmp_path}/{name}.h5")
        words = f"{tmp_path}/wider.h5 has other constraints than {tmp_path}/bound.h5, on transmission_angle_min: each"
        assert told.count(words) == count


def test_progress_counts_the_designs_of_all_results(sweep_folder, other_results):
    sources = {str(file): open_results(file) for file in (sweep_folder / "all.h5", other_results)}
    steps = []
    rank_sources(sources, RankRequest(), lambda *step: steps.append(step))
    assert steps == [(32_768, 52_768), (52_768, 52_768)]


def test_a_bar_on_a_terminal(sweep_folder):
    output, terminal_text = on_terminal("rank", "all.h5", cwd=sweep_folder)
    assert "ranking" in terminal_text
    assert "100%" in terminal_text
    assert output.startswith("Pareto set, best cv first\n")


def test_the_share_of_each_file_is_printed(sweep_folder, other_results):
    files = [sweep_folder / "all.h5", other_results]
    joint = explore.rank(files)["results"].value_counts()
    alone = [len(explore.rank(file)) for file in files]

    out, err = succeed("rank", *files, "--top", 0)
    shares = ", ".join(f"{joint[str(file)]} from {file}" for file in files)
    assert f"together {joint.sum()} designs are Pareto-optimal: {shares}\n" in err
    for file, count in zip(files, alone, strict=True):
        assert f"{file}: {count} of " in err
    assert joint.sum() < sum(alone)
    assert next(line for line in out.splitlines() if "alike" in line).split()[:3] == ["design", "alike", "results"]


def test_one_design_is_singular(tmp_path):
    (tmp_path / "one.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083.4236\nrocker = 541.7118\n'
        'ground = 691.7118\n[rank]\nmetrics = ["cv"]\n'
    )
    _, err = succeed("sweep", tmp_path / "one.toml", "-o", tmp_path / "one.h5")
    assert "1 design in " in err
    assert "1 of 1 feasible design is Pareto-optimal in cv (min)\n" in call("rank", tmp_path / "one.h5")[2]


def test_one_of_two_may_have_nothing_to_rank(sweep_folder, other_results):
    files = [sweep_folder / "all.h5", other_results]
    where = f"cv < {explore.rank(other_results)['cv'].min() * (1 - 1e-12)}"
    _, err = succeed("rank", *files, "--where", where)
    assert f"no feasible design of {other_results} meets the request" in err
    assert f" from {files[0]}, 0 from {other_results}\n" in err
    assert explore.rank(files, where="cv < 0").empty


def test_incompatible_results_are_refused(sweep_folder, other_results, tmp_path):
    text = STUDY.replace("32_768", "64").replace('"cv", "swing_angle",', '"swing_angle",').replace('["cv", ', "[")
    sweep_text(tmp_path, text, "without")
    (tmp_path / "cycle.toml").write_text(
        STUDY.replace("32_768", "64").replace("[evaluate]", '[evaluate]\nwindow = "return"')
    )
    explore.sweep(explore.load_study(tmp_path / "cycle.toml"), tmp_path / "cycle.h5")

    assert f"{tmp_path / 'without.h5'}: no column 'cv' to rank by in these results" in error_line(
        other_results, tmp_path / "without.h5", "--metric", "cv"
    )
    assert f"{other_results} is named twice" in error_line(other_results, sweep_folder / "all.h5", other_results)
    assert "missing.h5 does not exist" in error_line(other_results, tmp_path / "missing.h5", code=1)
    assert "window drive in" in call("rank", other_results, tmp_path / "cycle.h5")[2]
    with pytest.warns(RuntimeWarning, match="cv is the coefficient of variation .* but the"):
        explore.rank([other_results, tmp_path / "cycle.h5"])
    with pytest.raises(explore.RequestError, match="at least one file"):
        explore.rank([])
    with pytest.raises(explore.RequestError, match="from files, not from a DataFrame"):
        explore.rank([pd.DataFrame()])


# --- files -----------------------------------------------------------------------------------------------------------


def with_status_labels(frame):
    """A ranking as it is exported: labels beside the codes."""
    table = frame.copy()
    table.insert(table.columns.get_loc("status") + 1, "status_label", "ok")
    return table


def test_the_file_ending_selects_the_format(sweep_folder, tmp_path):
    expected = with_status_labels(explore.rank(sweep_folder / "all.h5", quality=True))
    for ending in ("csv", "json", "md", "MD"):
        code, _, err = call("rank", sweep_folder / "all.h5", "--quality", "-o", tmp_path / f"best.{ending}")
        assert (code, f"wrote {len(expected)} designs to " in err) == (0, True), err

    table = pd.read_csv(tmp_path / "best.csv", index_col="design")
    pd.testing.assert_frame_equal(table, expected, check_dtype=False, rtol=1e-15)
    rows = json.loads((tmp_path / "best.json").read_text())
    assert rows == records(sweep_folder / "all.h5", "--quality")
    assert list(rows[0]) == ["design", *expected.columns]
    assert {record["status_label"] for record in rows} == {"ok"}
    lines = (tmp_path / "best.md").read_text().splitlines()
    assert lines[0].startswith("| design | crank (mm) | coupler (mm) | ")
    assert " | status | status_label | " in lines[0]
    assert set(lines[1]) == set("| -:")
    assert len(lines) == 2 + len(expected)
    assert len({line.count("|") for line in lines}) == 1
    assert lines[2].split(" | ")[5] == f"{expected['cv'].iloc[0]:.6g}"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["best.MD", "best.csv", "best.json", "best.md"]


def test_parquet_holds_the_same_table(sweep_folder, tmp_path):
    pytest.importorskip("pyarrow", reason="pyarrow is not installed, so no Parquet file can be read back")
    files = [sweep_folder / "all.h5"]
    assert call("rank", *files, "-o", tmp_path / "best.parquet")[0] == 0

    table = pd.read_parquet(tmp_path / "best.parquet")
    pd.testing.assert_frame_equal(
        table, with_status_labels(explore.rank(files[0])), check_exact=True, check_column_type=False
    )


def test_every_code_has_its_label_beside_it():
    """Also where results beside others lack the column, where a code is unknown, and where the name is taken."""
    status = Column("status", "", "what became of it", "bookkeeping", "|i1", {1: "ok", 3: "crank_blocked"})
    kind = Column("kind", "", "which", "metric", "|i1", {0: "short", -1: "undefined"})
    frame = pd.DataFrame({"kind": [0.0, np.nan], "cv": [1.0, 2.0], "status": [3, 9]})

    table = with_labels(frame, [status, kind])

    assert list(table) == ["kind", "kind_label", "cv", "status", "status_label"]
    assert json_text(table.to_dict(orient="list")["status_label"]) == json_text(["crank_blocked", None])
    assert table["kind_label"].iloc[0] == "short"
    assert with_labels(table, [status, kind]).equals(table)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("best.xlsx", "the name must end in .csv, .json, .md or .parquet"),
        ("best", "the name must end in"),
        ("no/best.csv", "there is no folder"),
        ("folder.csv", "it is a folder"),
    ],
)
def test_an_impossible_output_is_refused_before_ranking(sweep_folder, tmp_path, name, message):
    (tmp_path / "folder.csv").mkdir()
    assert message in error_line(sweep_folder / "all.h5", "-o", tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


def test_parquet_without_pyarrow_is_refused(sweep_folder, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)  # what Python itself notes of a module that is not there
    assert 'needs pyarrow: pip install "linkage-explore[parquet]"' in error_line(
        sweep_folder / "all.h5", "-o", tmp_path / "best.parquet"
    )
    assert list(tmp_path.iterdir()) == []


def test_markdown_escapes_bars_and_line_breaks():
    frame = pd.DataFrame({"a|b": [1.5], "results": ["x|y\nz.h5"]}, index=pd.Index([3], name="design"))
    assert markdown(frame, {"a|b": "m|m"}).splitlines()[0::2] == [
        r"| design | a\|b (m\|m) | results |",
        r"| 3 | 1.5 | x\|y?z.h5 |",
    ]
