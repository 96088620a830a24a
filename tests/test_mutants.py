"""The list of planted mistakes fits the tree, and the script that plants them does what it says."""

from dataclasses import replace
from pathlib import Path

import pytest
from mutants.run import (
    REQUIRED_SHARE,
    ROOT,
    Mistake,
    Outcome,
    dependants,
    plant,
    problems_of,
    read_imports,
    read_mistakes,
    row,
    run_tests,
    share_noticed,
)

MISTAKES = read_mistakes()
EXAMPLE = Mistake("explore/base/suggest.py", "allowed = list(names)", "allowed = []", ("tests/test_example.py",))


def test_every_mistake_can_be_planted():
    """After a change of the code its mistakes have to be changed, too, in ``tests/mutants/mistakes``."""
    assert [problem for mistake in MISTAKES for problem in problems_of(mistake)] == []
    assert len(MISTAKES) == len(set(MISTAKES)) >= 122
    assert {Path(mistake.file).parts[1].removesuffix(".py") for mistake in MISTAKES} >= {
        path.name for path in (ROOT / "explore").iterdir() if (path / "__init__.py").exists()
    }


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"file": "explore/nowhere.py"}, "there is no such file"),
        ({"text": "no such text"}, "'no such text' occurs 0 times, not once"),
        ({"text": "names"}, "times, not once"),
        ({"replacement": EXAMPLE.text}, "is replaced by itself"),
        ({"tests": ("tests/test_nothing.py",)}, "there is no tests/test_nothing.py"),
        ({"tests": ("tests/test_mutants.py::test_nothing",)}, "there is no tests/test_mutants.py::test_nothing"),
    ],
)
def test_what_cannot_be_planted_is_an_error(change, problem):
    (found,) = problems_of(replace(EXAMPLE, **{"tests": ("tests/test_mutants.py",), **change}))
    assert problem in found


@pytest.fixture
def tree(tmp_path):
    """A tree of three modules of which the second imports the first and the third the second, and one test."""
    package = tmp_path / "explore"
    (package / "__pycache__").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "suggest.py").write_text("def allowed_of(names):\n    allowed = list(names)\n    return allowed\n")
    (package / "middle.py").write_text("from explore.base.suggest import allowed_of\n")
    (package / "last.py").write_text("def late():\n    from explore import middle\n    return middle\n")
    (package / "other.py").write_text("import math\n")
    for name in ("suggest", "last", "other"):
        (package / "__pycache__" / f"{name}.known-1.py311.nbi").touch()
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/test_example.py").write_text(
        "from explore.base.suggest import allowed_of\n\n"
        "def test_example():\n    assert allowed_of('ab') == ['a', 'b']\n"
    )
    return tmp_path


def test_a_planted_mistake_is_noticed_and_nothing_compiled_from_before_is_used(tree):
    assert run_tests(tree, EXAMPLE.tests, 60.0)[0] == 0
    plant(EXAMPLE, tree, read_imports(tree))
    code, last_line = run_tests(tree, EXAMPLE.tests, 60.0)
    assert code == 1
    assert "test_example" in last_line
    files = {f"explore/{name}.py" for name in ("suggest", "middle", "last")}
    assert dependants("explore/base/suggest.py", read_imports(tree)) == files
    assert [path.name for path in tree.rglob("*.nbi")] == ["other.known-1.py311.nbi"]


def test_tests_without_end_are_stopped(tree):
    (tree / "tests/test_example.py").write_text("import time\n\ndef test_example():\n    time.sleep(600)\n")
    assert run_tests(tree, EXAMPLE.tests, 2.0) == (None, "no end after 2 s")


def test_the_share_counts_what_was_noticed():
    outcomes = [Outcome(EXAMPLE, "noticed", 1.0, ""), Outcome(EXAMPLE, "NOT NOTICED", 2.0, "1 passed")]
    assert share_noticed(outcomes) == 0.5 < REQUIRED_SHARE <= 1.0
    first, last = row(outcomes[1]).splitlines()
    assert first.startswith("NOT NOTICED    2.0 s  explore/base/suggest.py:")
    assert first.endswith("allowed = list(names)  ->  allowed = []")
    assert last.strip() == "1 passed"
