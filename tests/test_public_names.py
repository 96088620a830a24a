"""A user's program: it runs, and uses every public name; `mypy --strict` checks it in the lint step of .ci/run."""

import ast
import doctest
import inspect
import re
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import explore
from explore import charts
from explore.cli.options import name_options

PACKAGE = Path(explore.__file__).parent
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
    assert not {*explore.__all__, *charts.__all__} - used - {"charts"}


def test_the_reference_lists_every_public_name():
    text = (Path(__file__).parents[1] / "docs" / "reference.md").read_text(encoding="utf-8")
    listed = re.findall(r"^::: explore\.((?:charts\.)?\w+)$", text, re.MULTILINE)
    public = {*explore.__all__, *(f"charts.{name}" for name in charts.__all__)} - {"__version__", "charts"}
    assert sorted(listed) == sorted(public)


def test_examples_of_docstrings_run_as_printed(tmp_path, monkeypatch):
    """Those of the modules of all public names, but for lines that need a service or results."""
    monkeypatch.chdir(tmp_path)
    modules = {getattr(getattr(explore, name), "__module__", "explore") for name in explore.__all__}
    found = [doctest.testmod(sys.modules[module]) for module in sorted(modules)]
    assert sum(each.failed for each in found) == 0
    assert sum(each.attempted for each in found) >= 3


def test_no_switch_is_on_unless_it_is_set():
    """But for that of `evaluate`, which gives a table."""
    functions = {name: getattr(explore, name) for name in explore.__all__ if inspect.isfunction(getattr(explore, name))}
    defaults = [(name, each) for name, one in functions.items() for each in inspect.signature(one).parameters.values()]
    assert [(name, each.name) for name, each in defaults if each.default is True] == [("evaluate", "table")]


def test_types_are_part_of_the_package():
    assert (PACKAGE / "py.typed").exists()


def texts_of_errors():
    """The texts in the library, without docstrings; the command line and what runs it are no part of it."""
    for file in PACKAGE.rglob("*.py"):
        if not file.is_relative_to(PACKAGE / "cli") and file != PACKAGE / "testing/commands.py":
            nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
            docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
            for node in nodes:
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
                    yield node.value


def test_library_errors_name_arguments_and_the_command_line_names_its_options():
    texts = list(texts_of_errors())
    assert [text for text in texts if re.search(r"(^|[ (`])-(o\b|-\w)", text)] == []
    quoted = {word for text in texts for word in re.findall(r"`[^` ]+`", text)}
    assert {"`path`", "`restart=True`", '`keep="all"`', "`design`"} <= quoted
    settings = {"`drive`", "`phases`", "`phase_shift`", "`module`"}  # described, not arguments
    options = {name_options(word) for word in quoted - settings}
    assert all(option.startswith("-") for option in options), options
