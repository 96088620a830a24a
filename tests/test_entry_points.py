"""Mechanisms of installed packages: found by name, everywhere; loaded when they are used; broken ones stop no other."""

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import call

import explore
from explore.mechanisms import registry as registry_module
from explore.mechanisms.entry_points import registered_entries
from explore.mechanisms.registry import MECHANISMS, Registry, mechanism_by_name

HERE = Path(__file__).parent
PROJECT = """[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
[project]
name = "sliders"
version = "1.0"
[project.entry-points."explore.mechanisms"]
simple-slider = "simple_slider:SIMPLE_SLIDER"
[tool.hatch.build.targets.wheel]
include = ["simple_slider.py"]
"""
#: The mechanisms of this package.
OWN = [name for name, (entry, *_) in registered_entries().items() if entry.dist is None]
#: With cranks of 40, 100 and 160 mm 8, 5 and none of 8 designs have a long enough rod.
TOO_SHORT = ("stop = 60, num = 3", "stop = 160, num = 3")


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder in which pip installed a package that registers the mechanism of simple_slider.py."""
    folder = tmp_path_factory.mktemp("sliders")
    source, target = folder / "source", folder / "installed"
    source.mkdir()
    (source / "pyproject.toml").write_text(PROJECT)
    (source / "simple_slider.py").write_text((HERE / "simple_slider.py").read_text())
    offline = ["--no-build-isolation", "--no-deps", "--no-index", "--disable-pip-version-check", "--quiet"]
    subprocess.run([sys.executable, "-m", "pip", "install", *offline, "--target", target, source], check=True)
    return target


def register(folder, package, **entries):
    """Write what an installed package has that registers mechanisms by these entries."""
    metadata = folder / f"{package}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    lines = [f"{name} = {value}" for name, value in entries.items()]
    (metadata / "entry_points.txt").write_text("\n".join(["[explore.mechanisms]", *lines]))


@pytest.fixture
def registry(tmp_path, monkeypatch):
    """A registry that also finds what is registered in `tmp_path`, in place of that of the package."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(MECHANISMS, "_loaded", {})
    registered_entries.cache_clear()
    yield MECHANISMS
    registered_entries.cache_clear()


def run(folder, *words):
    """The result of `explore` in a process of its own, with the installed package."""
    search = os.pathsep.join([str(folder), *sys.path])
    return subprocess.run(
        [sys.executable, "-m", "explore", *map(str, words)],
        env={**os.environ, "PYTHONPATH": search},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_an_installed_mechanism_is_like_any_other(installed, tmp_path):
    listed = run(installed, "mechanisms", "--json")
    assert json.loads(listed.stdout)["simple-slider"] == "a crank that moves a slider to and fro"
    assert listed.stderr == ""
    study, results = tmp_path / "study.toml", tmp_path / "a.h5"
    assert run(installed, "init", study, "--mechanism", "simple-slider").returncode == 0
    study.write_text(study.read_text().replace(*TOO_SHORT))
    swept = run(installed, "sweep", study, "-o", results, "--processes", "--workers", "1", "--quiet")
    assert (swept.returncode, swept.stderr) == (0, "")
    ranked = run(installed, "rank", results)
    assert ranked.returncode == 0, ranked.stderr
    assert "11 too_short: the rod is too short for the crank to turn" in ranked.stderr
    # without the package: the file itself has the words of its statuses
    assert "simple-slider" not in MECHANISMS
    assert explore.open_results(results).counts == {"ok": 13, "too_short": 11}
    code, out, _ = call("show", str(results), "--design", "23")
    assert (code, "too_short: the rod is too short" in out) == (0, True)


def test_an_unknown_mechanism_is_one_line(tmp_path):
    code, _, err = call("mechanisms", "simple-slider")
    assert (code, err) == (
        2,
        f"error: unknown mechanism 'simple-slider'; available: {', '.join(OWN)}\n",
    )
    with pytest.raises(explore.RequestError, match="^the mechanism 'simple-slider' is not installed here$"):
        mechanism_by_name("simple-slider")


BROKEN = {
    "missing": ("no_such_module:X", "ModuleNotFoundError: No module named 'no_such_module'"),
    "unnamed": ("broken_mechanism:ABSENT", "AttributeError: module 'broken_mechanism' has no attribute 'ABSENT'"),
    "another": ("explore.mechanisms.rig.declaration:TEST_RIG",
                "explore.mechanisms.rig.declaration:TEST_RIG is the mechanism 'test-rig'"),
    "number": ("broken_mechanism:NUMBER", "broken_mechanism:NUMBER is no mechanism"),
    "leaving": ("leaving_mechanism:X", "SystemExit: 3"),
    "raising": ("raising_mechanism:X", "ValueError: mechanism 'a': the parameter 'b' is declared twice"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "entry", "reason"), [(name, *row) for name, row in BROKEN.items()])
def test_a_broken_mechanism_is_one_line_and_stops_no_other(registry, tmp_path, name, entry, reason):
    (tmp_path / "broken_mechanism.py").write_text("NUMBER = 1")
    (tmp_path / "leaving_mechanism.py").write_text("import sys\nsys.exit(3)")
    (tmp_path / "raising_mechanism.py").write_text(
        "raise ValueError(\"mechanism 'a':\\nthe parameter 'b' is declared twice\")"
    )
    register(tmp_path, "clumsy", **{name: entry})
    line = f"the mechanism '{name}' of clumsy cannot be loaded: {reason}"
    code, out, err = call("mechanisms", "--json")
    assert (code, err) == (0, f"warning: {line}\n")
    assert list(json.loads(out)) == OWN
    with pytest.warns(RuntimeWarning) as caught:
        assert set(explore.list_mechanisms()) == set(OWN)
    assert [str(warning.message) for warning in caught] == [line]
    code, _, err = call("mechanisms", name)
    assert (code, err) == (2, f"error: {line}\n")


def test_a_package_whose_import_hangs_is_named(registry, tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(registry_module, "_PATIENCE", 0.05)
    (tmp_path / "slow_mechanism.py").write_text("import time\ntime.sleep(1)\nX = 1")
    register(tmp_path, "clumsy", slow="slow_mechanism:X")
    with pytest.raises(explore.RequestError, match="slow_mechanism:X is no mechanism"):
        MECHANISMS["slow"]
    line = "warning: loading the mechanism 'slow' of clumsy takes long; uninstall clumsy if it never ends\n"
    assert capfd.readouterr().err == line


def test_a_name_that_is_taken_twice_is_an_error(registry, tmp_path):
    entry = "explore.mechanisms.crank_rocker.declaration:CRANK_ROCKER"
    register(tmp_path, "first", twin=entry, **{"crank-rocker": entry})
    register(tmp_path, "second", twin=entry)
    line = "the mechanism 'twin' is registered by first and by second; uninstall all but one of them"
    own = "the mechanism 'crank-rocker' is registered by explore and by first; uninstall all but one of them"
    code, out, err = call("mechanisms", "--json")
    assert (code, list(json.loads(out))) == (0, OWN[1:])
    assert err.splitlines() == [f"warning: {own}", f"warning: {line}"]
    with pytest.raises(explore.RequestError) as caught:
        explore.evaluate("crank-rocker", {"crank": 1.0, "coupler": 3.0, "rocker": 3.0, "ground": 3.0})
    assert str(caught.value) == own


def test_names_are_known_without_loading_anything(registry, tmp_path):
    register(tmp_path, "clumsy", missing="no_such_module:X")
    assert list(Registry()) == [*OWN, "missing"]
    assert len(Registry()) == len(OWN) + 1


def test_a_mechanism_is_pickled_as_its_name():
    mechanism = MECHANISMS["crank-rocker"]
    text = pickle.dumps(mechanism)
    assert pickle.loads(text) is mechanism
    assert len(text) < 100
