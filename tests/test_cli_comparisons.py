"""`explore precision`, `explore stability`, `explore simulate --method` as a user runs them."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_line import assert_refused, call, succeed
from few_methods import only

from explore.cli.paths import atomic_files
from explore.comparison import random_starts, stability, timing
from explore.comparison.methods.registry import METHODS

#: A scene of its own file.
MINE = (
    'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083\nrocker = 541\nground = 691\n'
    '[scene]\ntitle = "Mine"\nabout = "A test."\nmodel = "positions"\nquestion = "Where is it?"\n'
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(params=["few methods", pytest.param("all methods", marks=pytest.mark.slow)])
def methods(request, monkeypatch):
    """The methods that are compared: one of each kind, at one setting, timed once and at few angles; or all, fully."""
    few = ("closed-form", "textbook", "newton", "pylinkage", "rk4", "rk45")
    with only(*(few if request.param == "few methods" else METHODS)) as methods:
        if request.param == "few methods":
            methods.update({name: settings[:1] for name, settings in methods.items()} | {"pylinkage": ()})
            monkeypatch.setattr(timing, "_MAX_RUNS", 1)
            monkeypatch.setattr(stability, "STEP_COUNTS", (24, stability.DEFAULT_STEP_COUNT))
        yield methods


def test_precision_writes_tables_and_charts_and_prints_the_fastest(methods):
    out, err = succeed("precision", "tiny_swing", "unassemblable", "-o", "tables", seconds=300)
    assert "closed-form" in out
    assert "to tables" in err
    assert {path.name for path in Path("tables").iterdir()} == {
        "motions.csv", "averages.csv", "levels.csv", "overview.png", "overview.svg", "averages.png", "averages.svg",
        "tiny_swing.png", "tiny_swing.svg", "unassemblable.png", "unassemblable.svg",
    }  # fmt: skip
    table = pd.read_csv("tables/motions.csv")
    assert list(table["scene"].unique()) == ["tiny_swing", "unassemblable"]
    assert table["processor"].notna().all()
    assert (table.loc[table["scene"] == "unassemblable", "verdict"] == "correctly rejected").any()
    assert set(table["method"]) == {name for name, settings in methods.items() if settings}
    missing = "left out: pylinkage; pip install 'linkage-explore[peers]'\n"
    assert (missing in err) == (methods["pylinkage"] == ())


def test_precision_of_a_scene_file_as_json(folder, methods):
    (folder / "mine.toml").write_text(MINE)
    out, _ = succeed("precision", "mine.toml", "--json", "-o", "tables", seconds=300)
    tables = json.loads(out)
    assert {row["scene"] for row in tables["motions"]} == {"mine"}
    assert set(tables["machine"]) >= {"processor", "python", "numpy"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["smoth"], "unknown scene 'smoth'; did you mean 'smooth'?"),
        (["nothing.toml"], "nothing.toml"),
        (["smooth", "-o", "taken"], "-o taken is a file; name a folder"),
    ],
)
def test_wrong_requests_write_nothing(arguments, words):
    Path("taken").write_text("x")
    assert_refused(call("precision", *arguments), (1, 2), words)
    assert [path.name for path in Path().iterdir()] == ["taken"]


def test_scenes_with_the_same_chart_name_are_refused(folder):
    for name in ("smooth", "overview"):
        (folder / f"{name}.toml").write_text(MINE)
        reply = call("precision", "smooth", f"{name}.toml", "-o", "tables")
        assert_refused(reply, 2, f"error: two charts would be named '{name}'; give the scene's file another name\n")
    assert not Path("tables").exists()


def test_a_folder_without_write_permission_is_an_error_before_anything_is_computed(unprivileged):
    folder, lower = unprivileged
    folder.chmod(0o555)
    lower()
    with pytest.raises(OSError, match="Permission denied") as caught, atomic_files(folder):
        pytest.fail("this would be computed")
    assert caught.value.filename == str(folder)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("existing", [True, False])
def test_an_interrupt_leaves_the_folder_unchanged(folder, existing, capsys):
    if existing:
        (folder / "charts").mkdir()
        (folder / "charts" / "motions.csv").write_text("old")

    def write():
        with atomic_files(Path("charts")) as place:
            (place / "motions.csv").write_text("new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert capsys.readouterr().err == "interrupted; nothing was written to charts\n"
    assert [path.read_text() for path in folder.rglob("*") if path.is_file()] == ["old"] * existing
    assert Path("charts").exists() == existing


@pytest.mark.parametrize("command", [["precision"], ["stability"]])
def test_an_interrupt_ends_a_comparison(command, folder, tmp_path_factory):
    """A real process, interrupted as soon as it has begun; its work is long enough for a slow test to be in time."""
    printed = tmp_path_factory.mktemp("printed") / "errors"
    with printed.open("w") as errors:
        process = subprocess.Popen([sys.executable, "-m", "explore", *command, "-o", "charts"], stderr=errors)
    while process.poll() is None and not list(folder.glob("charts/.unfinished-*")):
        time.sleep(0.01)
    time.sleep(0.2)  # the folder appears a moment before Python's own bookkeeping of it is done
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=240) == 130, printed.read_text()
    assert printed.read_text().splitlines()[-1] == "interrupted; nothing was written to charts"
    assert list(folder.iterdir()) == []


#: Loses an interrupt in a callback of C code, once it is to be orderly; works on until it is raised again.
LOSES_AN_INTERRUPT = """
import ctypes, signal, time
from explore.cli.termination import keep_interrupts, terminable
keep_interrupts()
try:
    with terminable():
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()
        end = time.monotonic() + 60.0
        while time.monotonic() < end:
            time.sleep(0.01)
except KeyboardInterrupt:
    print("interrupted")
"""


def test_an_interrupt_that_a_callback_drops_is_raised_again():
    done = subprocess.run([sys.executable, "-c", LOSES_AN_INTERRUPT], text=True, capture_output=True, timeout=120)
    assert (done.stdout, done.stderr) == ("interrupted\n", "")


def test_stability_prints_the_smallest_accurate_margins(methods):
    out, _ = succeed("stability", "-o", "tables", "--accuracy", "1e-4", seconds=300)
    assert "closed-form" in out
    assert "Order of convergence" in out
    assert {path.name for path in Path("tables").iterdir()} == {
        "map.csv", "safe.csv", "turn.csv", "orders.csv", "map.png", "map.svg", "turn.png", "turn.svg",
    }  # fmt: skip
    safe = pd.read_csv("tables/safe.csv").set_index("setting")
    assert safe.loc["closed-form", "smallest_accurate_margin"] < 1e-14


@pytest.mark.parametrize(
    ("mechanism", "distance"),
    [
        ("slider-crank", "distance of rod from 200 mm, over the longest link"),
        ("variable-crank", "distance of a crank angle from the singular one, deg"),
    ],
)
def test_stability_of_a_mechanism_with_a_slider(mechanism, distance, methods):
    out, err = succeed("stability", mechanism, seconds=300)
    assert f"Smallest {distance}, down to which errors are at most 1e-06" in " ".join(out.split())
    assert "Order of convergence" not in out, "it is measured on the four-bar"
    assert "left out" not in err, "pylinkage solves four-bars only"
    folder = Path(f"results/stability-{mechanism}")
    assert {path.name for path in folder.iterdir()} == {
        "map.csv", "safe.csv", "turn.csv", "map.png", "map.svg", "turn.png", "turn.svg",
    }  # fmt: skip
    assert distance.split(",")[0] in (folder / "map.svg").read_text()
    safe = pd.read_csv(folder / "safe.csv").set_index("setting")["smallest_accurate_margin"]
    assert safe["closed-form"] < 1.1e-13
    assert safe["textbook"] < 0.011


def test_precision_of_mechanisms_with_a_slider(methods):
    out, err = succeed("precision", "slider_crank", "variable_crank", "-o", "tables", seconds=300)
    assert "variable_crank" in out
    rows = pd.read_csv("tables/motions.csv")
    closed = rows[rows["method"] == "closed-form"]
    assert (closed["acceleration_error_max"] < 2e-14).all()
    assert set(rows["method"]) == {name for name, settings in methods.items() if settings} - {"circles", "pylinkage"}
    assert set(pd.read_csv("tables/averages.csv")["scene"]) == {"slider_crank"}, "only that has two strokes"
    assert "left out: averages of variable_crank: no strokes" in err


def test_stability_of_gears_counts_the_outcomes_of_random_starts(monkeypatch):
    monkeypatch.setattr(random_starts, "START_COUNT", 40)
    out, _ = succeed("stability", "gears", "-o", "tables", seconds=300)
    counts = pd.read_csv("tables/counts.csv")
    assert counts["starts"].sum() == len(pd.read_csv("tables/starts.csv")) == 40
    for outcome, starts in zip(counts["outcome"], counts["starts"], strict=True):
        assert f"{outcome} {starts}" in " ".join(out.split())
    assert {path.name for path in Path("tables").iterdir()} == {"starts.csv", "counts.csv", "starts.png", "starts.svg"}


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("slider-crnk", "did you mean 'slider-crank'?"),
        ("nothing", "available: crank-rocker, slider-crank, variable-crank, gears"),
    ],
)
def test_stability_of_an_unknown_mechanism(name, hint):
    reason = f"no stability map of '{name}'; a study of a linkage is a .toml file; {hint}"
    assert_refused(call("stability", name), 2, f"error: {reason}\n")
    assert not Path("results").exists()


DESIGN = ["--mechanism", "crank-rocker", "--set", "crank=100", "--set", "coupler=1083.4236", "--set", "rocker=541.7118",
          "--set", "ground=691.7118", "--angles", "12"]  # fmt: skip


def test_simulate_by_an_inaccurate_method_warns_in_one_line():
    out, err = succeed("simulate", *DESIGN, "--method", "rk45(rtol=0.001)")
    assert out.startswith("crank_angle,")
    assert err.startswith("warning: rk45(rtol=0.001) misses the tolerance 1e-09 for this design: its errors")
    left_out = "left out: output_velocity, which only the closed form has\n"
    assert err.count("\n") == 2
    assert err.endswith(left_out)
    assert call("simulate", *DESIGN, "--method", "newton")[2] == left_out


def test_simulate_writes_no_number_as_null_into_json(folder):
    blocked = [word.replace("crank=100", "crank=150").replace("691.7118", "691.7119") for word in DESIGN]
    arguments = ["simulate", *blocked, "--method", "newton"]
    assert call(*arguments, "-o", "motion.JSON")[0] == 0
    text = Path("motion.JSON").read_text()
    assert "null" in text
    assert json.loads(text, parse_constant=pytest.fail) == json.loads(call(*arguments, "--json")[1])


def test_simulate_of_a_table_by_another_method_says_what_is_left_out(folder):
    call("init", "six.toml", "--linkage", "watt-2")
    _, err = succeed("simulate", "six.toml", "--angles", "8", "--method", "newton", "-o", "newton.csv")
    assert "left out: A_x and 37 more, which only the closed form has\n" in err
    _, _, err = call("simulate", "six.toml", "--angles", "8", "-o", "closed.csv")
    assert "left out" not in err
    newton, closed = (pd.read_csv(name) for name in ("newton.csv", "closed.csv"))
    assert len(closed.columns) == len(newton.columns) + 38
    # loops that are closed to 1e-12, times the condition of this linkage, far from singular
    np.testing.assert_allclose(newton, closed[newton.columns], rtol=0, atol=1e-10 * np.abs(closed).max().max())


def test_a_package_that_is_not_installed_leaves_its_method_without_settings():
    """A real process in which no module `pylinkage` can be found."""
    code = (
        "import importlib.util; find = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *rest: None if name == 'pylinkage' else find(name, *rest)\n"
        "from explore.comparison.methods.registry import METHODS; print(METHODS['pylinkage'])"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout == "()\n"
