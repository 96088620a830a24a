"""`explore precision`, `explore stability`, `explore simulate --method` as a user runs them."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from command_line import call

from explore.cli.output import whole_files


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


def test_scenes_whose_charts_would_have_one_name_are_refused(folder):
    text = (
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083\nrocker = 541\nground = 691\n'
        '[scene]\ntitle = "Mine"\nabout = "A test."\nmodel = "positions"\nquestion = "Where is it?"\n'
    )
    for name in ("smooth", "overview"):
        (folder / f"{name}.toml").write_text(text)
        code, out, err = call("precision", "smooth", f"{name}.toml", "-o", "found")
        assert (code, out) == (2, "")
        assert err == f"error: two charts would be named '{name}'; give the scene's file another name\n"
    assert not Path("found").exists()


def test_a_folder_that_takes_no_files_is_said_before_anything_is_computed(unprivileged):
    folder, lower = unprivileged
    folder.chmod(0o555)
    lower()
    with pytest.raises(OSError, match="Permission denied") as caught, whole_files(folder):
        pytest.fail("this would be computed")
    assert caught.value.filename == str(folder)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("command", [["precision", "smooth"], ["stability"]])
def test_an_interrupt_leaves_what_was_there(command, folder):
    """A real process, interrupted as soon as it has begun."""
    (folder / "kept").mkdir()
    (folder / "kept" / "motions.csv").write_text("old")
    for place in ("kept", "made"):
        process = subprocess.Popen(
            [sys.executable, "-m", "explore", *command, "-o", place], stderr=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
        while process.poll() is None and not list(folder.glob(f"{place}/.unfinished-*")):
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 130, errors
        assert errors.splitlines()[-1] == f"interrupted; nothing was written to {place}"
    assert [path.name for path in folder.iterdir()] == ["kept"]
    assert [path.read_text() for path in (folder / "kept").iterdir()] == ["old"]


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


def test_a_package_that_is_missing_is_said():
    """A real process in which no module `pylinkage` can be found."""
    code = (
        "import importlib.util, sys; find = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *rest: None if name == 'pylinkage' else find(name, *rest)\n"
        "from explore.cli import main; sys.argv = ['explore', 'precision', 'unassemblable', '-o', 'found']; main()"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "left out: pylinkage; pip install 'linkage-explore[peers]'" in run.stderr
    assert "pylinkage" not in set(pd.read_csv("found/motions.csv")["method"])
