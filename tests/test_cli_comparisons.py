"""`explore precision`, `explore stability`, `explore simulate --method` as a user runs them."""

import json
from pathlib import Path

import pandas as pd
import pytest
from command_line import call


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_precision_writes_tables_and_charts_and_says_who_is_fastest():
    code, out, err = call("precision", "tiny_swing", "unassemblable", "-o", "found", seconds=120)
    assert code == 0, err
    assert "closed-form" in out
    assert "found" in err
    assert {path.name for path in Path("found").iterdir()} == {
        "motions.csv", "averages.csv", "levels.csv", "overview.png", "overview.svg", "averages.png", "averages.svg",
        "tiny_swing.png", "tiny_swing.svg", "unassemblable.png", "unassemblable.svg",
    }  # fmt: skip
    table = pd.read_csv("found/motions.csv")
    assert list(table["scene"].unique()) == ["tiny_swing", "unassemblable"]
    assert table["processor"].notna().all()
    assert (table.loc[table["scene"] == "unassemblable", "verdict"] == "rightly refused").any()


def test_a_scene_of_ones_own_and_json(folder):
    (folder / "mine.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083\nrocker = 541\nground = 691\n'
        '[scene]\ntitle = "Mine"\nabout = "A test."\nmodel = "positions"\nquestion = "Where is it?"\n'
    )
    code, out, err = call("precision", "mine.toml", "--json", "-o", "found", seconds=120)
    assert code == 0, err
    found = json.loads(out)
    assert {row["scene"] for row in found["motions"]} == {"mine"}
    assert set(found["machine"]) >= {"processor", "python", "numpy"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["smoth"], "unknown scene 'smoth'; did you mean 'smooth'?"),
        (["nothing.toml"], "nothing.toml"),
        (["smooth", "-o", "taken"], "-o taken is a file; name a folder"),
    ],
)
def test_wrong_requests_leave_nothing(arguments, words):
    Path("taken").write_text("x")
    code, out, err = call("precision", *arguments)
    assert code in (1, 2)
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert words in err
    assert out == ""
    assert [path.name for path in Path().iterdir()] == ["taken"]


def test_a_study_that_is_no_scene_is_refused(folder):
    (folder / "study.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083\nrocker = 541\nground = 691\n'
    )
    code, _, err = call("precision", "study.toml")
    assert code == 2
    assert "study.toml:1: scene: is missing" in err


def test_stability_says_how_near_each_method_may_be_trusted():
    code, out, err = call("stability", "-o", "found", "--accuracy", "1e-4", seconds=120)
    assert code == 0, err
    assert "closed-form" in out
    assert "Order of convergence" in out
    assert {path.name for path in Path("found").iterdir()} == {
        "map.csv",
        "safe.csv",
        "orders.csv",
        "map.png",
        "map.svg",
    }
    safe = pd.read_csv("found/safe.csv").set_index("setting")
    assert safe.loc["closed-form", "safe_down_to"] < 1e-14


DESIGN = ["--mechanism", "crank-rocker", "--set", "crank=100", "--set", "coupler=1083.4236", "--set", "rocker=541.7118",
          "--set", "ground=691.7118", "--angles", "12"]  # fmt: skip


def test_simulate_by_a_method_that_is_wrong_warns_in_one_line():
    code, out, err = call("simulate", *DESIGN, "--method", "rk45(rtol=0.001)")
    assert code == 0
    assert out.startswith("crank_angle,")
    assert err.startswith("warning: rk45(rtol=0.001) misses 1e-09 here: it is off by ")
    assert err.count("\n") == 1
    assert call("simulate", *DESIGN, "--method", "newton")[2] == ""


def test_simulate_by_an_unknown_method():
    code, out, err = call("simulate", *DESIGN, "--method", "newtn")
    assert (code, out) == (2, "")
    assert "unknown method 'newtn'; did you mean 'newton'?" in err
