"""The architecture: no import cycle, and a diagram in the documentation that shows the code as it is."""

import importlib.util
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def drawing():
    spec = importlib.util.spec_from_file_location("architecture_diagram", ROOT / "docs" / "architecture_diagram.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_no_module_imports_itself_through_others(drawing):
    modules = drawing.module_imports(ROOT / "explore")

    TopologicalSorter(modules).prepare()  # raises CycleError
    assert modules["explore.cli.application"], "nothing was read"


def test_the_diagram_is_that_of_the_code(drawing):
    assert drawing.DIAGRAM.read_text(encoding="utf-8") == drawing.diagram(ROOT / "explore"), (
        "run `python docs/architecture_diagram.py`"
    )
