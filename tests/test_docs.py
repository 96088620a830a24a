"""The pages under docs: every Python block runs, and prints what the page says that it prints."""

import importlib
import re
from pathlib import Path

import pytest

import explore
from explore.cli.plots import KINDS

ROOT = Path(__file__).parents[1]
#: A Python block and, where its output is the same on every machine, the text block that follows it.
BLOCKS = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?", re.MULTILINE | re.DOTALL)


def run_page(name, capsys, **names):
    """Run the blocks of a page one after the other in one namespace."""
    blocks = BLOCKS.findall((ROOT / "docs" / name).read_text(encoding="utf-8"))
    assert blocks, f"{name} has no Python blocks"
    for source, expected in blocks:
        capsys.readouterr()
        exec(compile(source, name, "exec"), names)  # our own pages
        printed = capsys.readouterr().out
        if expected:
            assert printed.split() == expected.split(), f"{name}:\n{source}"


@pytest.mark.parametrize("page", ["physics.md", "published-study.md", "published-simulation.md", "methods.md"])
def test_page_is_true(page, capsys):
    run_page(page, capsys)


def test_sweeps_is_true(tmp_path, monkeypatch, capsys):
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    monkeypatch.chdir(tmp_path)
    run_page("sweeps.md", capsys)


def test_results_format_is_true(tmp_path, monkeypatch, capsys):
    for package in ("h5netcdf", "tables", "xarray"):
        pytest.importorskip(package)
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    explore.sweep(explore.load_study("configs/grid.toml"), "results/grid.h5")
    run_page("results-format.md", capsys)


def test_gallery_is_true(tmp_path, monkeypatch, capsys):
    """Each picture is that of the command above it, is there and is small; the Python block runs."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    figures = importlib.import_module("figures")
    page = (ROOT / "docs/gallery.md").read_text(encoding="utf-8")
    shown = re.findall(r"^explore plot (.*)\n```\n\n!\[.+\]\(gallery/(.*)\.png\)$", page, re.MULTILINE)
    assert {name: command.split() for command, name in shown} == figures.GALLERY
    assert {arguments[0] for arguments in figures.GALLERY.values()} == set(KINDS)
    for name in figures.GALLERY:
        assert 0 < (ROOT / f"docs/gallery/{name}.png").stat().st_size <= figures.LARGEST
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    run_page("gallery.md", capsys)
