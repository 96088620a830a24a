"""`explore rank` as a user meets it, in the test's own process."""

import json

import pytest
from command_line import call

import explore

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = 50
coupler = { min = 50, max = 1000 }
rocker = { min = 50, max = 500 }
ground = { min = 50, max = 1000 }
[sampling]
method = "sobol"
count = 32_768
[evaluate]
metrics = ["cv", "swing_angle", "time_ratio", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 30 }
transmission_angle_max = { max = 150 }
time_ratio = { min = 1, max = 1.5 }
[rank]
metrics = ["cv", "swing_angle:max", "transmission_angle_min:max"]
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A finished sweep of some thousand designs, not to be changed."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "study.toml").write_text(STUDY)
    explore.sweep(explore.load_study(folder / "study.toml"), folder / "all.h5")
    return folder


def records(*arguments):
    """What `explore rank --json` prints."""
    code, out, err = call("rank", *arguments, "--json", seconds=60)
    assert code == 0, err
    return json.loads(out)


def refused(*arguments, code=2):
    """The one line that a wrong command gets."""
    found, out, err = call("rank", *arguments, seconds=60)
    assert (found, out) == (code, ""), err
    assert err.startswith("error: ")
    assert err.count("\n") == 1, err
    return err


def test_fronts_are_counted_and_shown(swept):
    found = records(swept / "all.h5", "--fronts", 3)
    table = explore.rank(explore.read_results(swept / "all.h5"), fronts=3)

    assert [(r["design"], r["front"]) for r in found] == list(zip(table.index, table["front"], strict=True))
    assert {r["front"] for r in found} == {1, 2, 3}
    code, out, err = call("rank", swept / "all.h5", "--fronts", 2, "--top", 0)
    assert code == 0
    assert f"{(table['front'] == 2).sum()} more are in fronts 2 to 2" in err
    heading = next(line for line in out.splitlines() if "alike" in line)
    assert heading.split()[:3] == ["design", "alike", "front"]
    assert len([line for line in out.splitlines() if line.split()[:1] and line.split()[0].isdigit()]) == sum(
        table["front"] <= 2
    )
    assert "front" not in call("rank", swept / "all.h5")[1]


def test_conditions_and_limits_choose_as_pandas_does(swept):
    table = explore.read_results(swept / "all.h5")
    arguments = ["--where", "swing_angle > 40 and not time_ratio >= 1.2", "--limit", "transmission_angle_min=35",
                 "--limit", "time_ratio>=1.05", "--limit", "transmission_angle_max=145"]  # fmt: skip
    chosen = table[
        (table["swing_angle"] > 40)
        & ~(table["time_ratio"] >= 1.2)
        & (table["transmission_angle_min"] >= 35)
        & (table["time_ratio"] >= 1.05)
        & (table["transmission_angle_max_margin"] >= 5)
    ]
    expected = explore.rank(chosen, fronts=2)

    found = records(swept / "all.h5", "--fronts", 2, *arguments)

    assert [(r["design"], r["front"]) for r in found] == list(zip(expected.index, expected["front"], strict=True))
    assert len(found) > 5
    assert table.loc[chosen.index, "feasible"].sum() < table["feasible"].sum()
    limits = {"transmission_angle_min": 35, "time_ratio": {"min": 1.05}, "transmission_angle_max": 145}
    for results in (table, swept / "all.h5"):
        same = explore.rank(results, fronts=2, where=arguments[1], limits=limits)
        assert same.index.tolist() == expected.index.tolist()


def test_what_was_chosen_is_counted(swept):
    table = explore.read_results(swept / "all.h5")
    feasible = table[table["feasible"]]
    narrow = feasible[feasible["transmission_angle_min"] >= 40]
    rest = narrow[narrow["swing_angle"] > 60]

    code, _, err = call("rank", swept / "all.h5", "--where", "swing_angle > 60", "--limit", "transmission_angle_min=40")

    assert code == 0
    assert f" of {len(rest):,} feasible designs that meet the request are Pareto-optimal" in err
    assert f"{len(feasible) - len(narrow):,} feasible ones that miss the limit transmission_angle_min >= 40" in err
    assert f"{len(narrow) - len(rest):,} feasible ones that do not meet swing_angle > 60" in err
    assert "meets the request, so there is nothing to rank" in call("rank", swept / "all.h5", "--where", "cv < 0")[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--where", "swing_angel > 20"],
            "where: at character 1: no column 'swing_angel'; did you mean 'swing_angle'?",
        ),
        (["--where", "swing_angle > 20 and"], "where: at the end: a comparison is wanted here"),
        (["--limit", "transmission_angle_min=20"], "20 is below the min of 30 that the designs were swept with"),
        (["--limit", "time_ratio=1.2"], "constrained on both sides, so write time_ratio>=VALUE or time_ratio<=VALUE"),
        (["--limit", "cv=0.4"], "no constraint, so write cv>=VALUE or cv<=VALUE"),
        (["--limit", "cv_margin<=0.4"], "no metric 'cv_margin'; there is crank, coupler, rocker, ground, cv, "),
        (["--limit", "status<=1"], "no metric 'status'"),
        (["--limit", "cv"], "write METRIC=VALUE"),
    ],
)
def test_a_wrong_choice_gets_one_line(swept, arguments, message):
    assert message in refused(swept / "all.h5", *arguments)


def test_a_front_that_was_narrowed_says_what_it_cannot_know(swept, tmp_path):
    study = explore.load_study(swept / "study.toml")
    explore.sweep(study, tmp_path / "front.h5", keep="front")
    every = explore.rank(swept / "all.h5", limits={"cv": {"max": 0.9}})

    narrowed = call("rank", tmp_path / "front.h5", "--where", "time_ratio < 1.1")[2]
    code, _, err = call("rank", tmp_path / "front.h5", "--limit", "cv<=0.9")

    assert "the best in this request may be missing" in narrowed
    assert (code, "missing" in err) == (0, False), "nothing that a limit on an aim leaves out beats what is left"
    assert explore.rank(tmp_path / "front.h5", limits={"cv": {"max": 0.9}}).index.tolist() == every.index.tolist()
    assert len(every) > 3


def test_quality_is_shown_and_printed(swept):
    table = explore.rank(swept / "all.h5", quality=True)
    found = records(swept / "all.h5", "--quality")
    out = call("rank", swept / "all.h5", "--quality", "--top", 0)[1]

    assert [r["knee"] for r in found] == table["knee"].tolist()
    assert table["knee"].sum() == 1
    assert [r["crowding"] for r in found] == [None if v == float("inf") else v for v in table["crowding"]]
    assert [r["hypervolume_share"] for r in found] == table["hypervolume_share"].tolist()
    (knee,) = (line.split() for line in out.splitlines() if " yes " in line)
    assert knee[0] == str(table.index[table["knee"]][0])
    assert "crowding" not in call("rank", swept / "all.h5")[1]
