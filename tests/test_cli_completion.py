"""Words that the shell completes."""

import json
import os
import subprocess
import sys
from unittest import mock

import pytest
from command_line import COMMANDS, call
from studies import FEW

import explore
from explore.cli.commands.plot import KINDS
from explore.cli.completion import complete_mechanisms
from explore.mechanisms.registry import MECHANISMS

#: Packages that take long to import; pydantic is typer's own.
HEAVY = ("numpy", "scipy", "pandas", "h5py", "dask", "distributed", "numba", "moocore", "matplotlib")


def environment(line, shell="bash"):
    """The variables by which a shell asks for the completions of a line's last word."""
    request = (
        {"COMP_WORDS": line, "COMP_CWORD": str(len(f"{line}x".split()) - 1)}
        if shell == "bash"
        else {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    )
    return request | {"_EXPLORE_COMPLETE": f"complete_{shell}"}


def complete(line, shell="bash"):
    """The completions of the last word of a line."""
    with mock.patch.dict(os.environ, environment(line, shell)):
        code, out, err = call()
    assert (code, err) == (0, "")
    return [word for word in out.splitlines() if word]


def test_names_are_completed_without_heavy_imports():
    """In a fresh process, and each as in this one."""
    completions = {
        "explore pl": ["plot"],
        "explore plot pa": ["pareto", "path", "parallel"],
        "explore mechanisms ": sorted(MECHANISMS),
        "explore simulate --mechanism t": ["test-rig"],
    }
    script = f"""
import json, os, sys
from explore.cli import main
sys.argv = ["explore"]
for environment in {[environment(line) for line in completions]}:
    os.environ.update(environment)
    try: main()
    except SystemExit: pass
    print("--")
print(json.dumps(sorted(set({HEAVY}) & set(sys.modules))))
"""
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=240, check=True)
    *words, imported = process.stdout.split("--\n")
    assert (json.loads(imported), process.stderr) == ([], "")
    assert [text.split() for text in words] == list(completions.values())
    assert {line: complete(line) for line in completions} == completions


def test_every_command_mechanism_and_kind_of_figure_is_completed():
    assert complete("explore ") == list(COMMANDS)
    assert complete("explore plot ") == list(KINDS)
    assert complete("explore init --mechanism ") == complete_mechanisms() == sorted(MECHANISMS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with results in it, and others elsewhere."""
    folder = tmp_path_factory.mktemp("shell")
    (folder / "results").mkdir()
    (folder / "few.toml").write_text(FEW)
    other = FEW + '[evaluate]\nmetrics = ["rocker_velocity_max", "linkage_class"]\n'
    (folder / "other.toml").write_text(other)
    explore.sweep(explore.load_study(folder / "few.toml"), folder / "results/few.h5")
    explore.sweep(explore.load_study(folder / "other.toml"), folder / "other.h5")
    return folder


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("explore rank --metric t", ["time_ratio", "transmission_angle_min", "transmission_angle_max"]),
        ("explore rank --metric cv --metric sw", ["swing_angle"]),
        ("explore rank other.h5 --metric r", ["rocker", "rocker_velocity_max"]),
        ("explore rank other.h5 --metric l", []),  # a label
        ("explore plot pareto other.h5 --x r", ["rocker", "rocker_velocity_max"]),
        ("explore plot pareto --x cv --y ti", ["time_ratio"]),
        ("explore plot map other.h5 --metric no", ["nodes"]),  # drawn, but no objective
        ("explore rank other.h5 --metric no", []),
        ("explore sensitivity other.h5 --metric rocker_vel", ["rocker_velocity_max"]),
        ("explore tune other.h5 --metric ro", ["rocker_velocity_max"]),
        ("explore tune other.h5 --parameter ro", ["rocker"]),
        ("explore tune --mechanism slider-crank --parameter of", ["offset"]),
        ("explore tune --mechanism slider-crank --metric st", ["stroke"]),
        ("explore tune --mechanism no-such --metric st", []),
        ("explore rank few.toml --metric ", []),  # no results: nothing, and no traceback
    ],
)
def test_columns_of_the_results_are_completed(folder, monkeypatch, line, words):
    monkeypatch.chdir(folder)
    assert complete(line) == words


def test_columns_come_with_their_meaning_where_the_shell_shows_it(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert complete("explore rank --metric swing", "fish") == ["swing_angle\tswing of the rocker"]


def test_without_results_no_column_is_completed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert complete("explore rank --metric c") == []
    assert list(tmp_path.iterdir()) == []
