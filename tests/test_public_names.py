"""A user's program: it runs, and uses every public name; `mypy --strict` checks it in the lint step of .ci/run."""

import re
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import explore
from explore import charts

DOWNSTREAM = Path(__file__).parent / "typing" / "downstream.py"


@pytest.fixture
def downstream(monkeypatch):
    monkeypatch.syspath_prepend(str(DOWNSTREAM.parent))
    import downstream

    yield downstream
    sys.modules.pop("downstream")


def test_a_program_of_a_user(downstream, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    downstream.main(tmp_path)
    plt.close("all")
    out = capsys.readouterr().out
    assert "Study(mechanism='crank-rocker', designs=60" in out
    assert "unknown metric 'cvv'; did you mean 'cv'?" in out


def test_it_uses_every_public_name():
    text = DOWNSTREAM.read_text(encoding="utf-8")
    used = set(re.findall(r"\b(?:explore|charts)\.(\w+)", text))
    assert not {*explore.__all__, *charts.__all__} - used


def test_the_reference_lists_every_public_name():
    text = (Path(__file__).parents[1] / "docs" / "reference.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^::: explore\.(?:charts\.)?(\w+)$", text, re.MULTILINE))
    assert not {*explore.__all__, *charts.__all__} - listed - {"__version__", "charts"}


def test_types_are_part_of_the_package():
    assert (Path(explore.__file__).parent / "py.typed").exists()
