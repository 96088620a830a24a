"""The mistakes by hand fit the tree, drawn ones are reproducible, and the script that plants them does what it says."""

from dataclasses import replace

import pytest
from mutants.drawing import _NearestTests, draw_mistakes
from mutants.mistakes import ROOT, Mistake, problems_of, read_mistakes
from mutants.run import (
    REQUIRED_BY_HAND,
    REQUIRED_DRAWN,
    Baseline,
    Outcome,
    copy_tree,
    plant,
    row,
    run_tests,
    share_noticed,
    shares,
    try_mistake,
)

MISTAKES = read_mistakes()
EXAMPLE = Mistake("explore/base/suggest.py", "allowed = list(names)", "allowed = []", ("tests/test_example.py",))


def test_every_mistake_by_hand_can_be_planted():
    """After a change of the code its mistakes have to be changed, too, in ``tests/mutants/by_hand.toml``."""
    assert [problem for mistake in MISTAKES for problem in problems_of(mistake)] == []
    assert 80 <= len(set(MISTAKES)) == len(MISTAKES) <= 100


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
    """A tree of one module and one test."""
    package = tmp_path / "explore"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "__init__.pyi").write_text("from .doubling import double as double\n")
    (package / "doubling.py").write_text(
        "def double(x: int | None, *, y=None) -> int | None:\n    return x and 2 * x\n"
    )
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/test_example.py").write_text(
        "from explore.doubling import double\n\ndef test_example():\n    assert double(2) == 4\n"
    )
    return tmp_path


def test_a_planted_mistake_is_noticed(tree):
    example = Mistake("explore/doubling.py", "2 * x", "3 * x", ("tests/test_example.py",))
    outcome = try_mistake(example, Baseline(tree), 60.0)
    assert outcome.verdict == "noticed"
    assert "test_example" in outcome.last_line
    plant(example, tree)
    assert try_mistake(example, Baseline(tree), 60.0).last_line.startswith("fails without any mistake: FAILED")


def test_drawn_mistakes_follow_from_the_seed_and_leave_types_alone(tree):
    pytest.importorskip("cosmic_ray")
    drawn = list(draw_mistakes(30, 1, tree))

    assert drawn == list(draw_mistakes(30, 1, tree))
    assert drawn != list(draw_mistakes(30, 2, tree))
    assert {mistake.replacement.splitlines()[0] for mistake in drawn} == {drawn[0].text.splitlines()[0]}
    assert {mistake.tests for mistake in drawn} == {("tests/test_example.py",)}
    for mistake in drawn:
        compile(mistake.replacement, "", "exec")
    assert {"x or 2 * x", "x and 2 / x"} <= {mistake.replacement.partition("return ")[2].strip() for mistake in drawn}


def test_the_nearest_tests_are_those_that_import_a_module_or_are_named_after_it_or_run_it():
    nearest = _NearestTests(ROOT)
    of_gears = nearest.of("explore/mechanisms/gears/sine_law.py")

    assert all((ROOT / test).is_file() for test in of_gears)
    assert any("gears" in test for test in of_gears)
    assert "tests/test_cli_comparisons.py" in nearest.of("explore/cli/commands/stability.py")


def test_tests_without_end_are_stopped(tree):
    (tree / "tests/test_example.py").write_text("import time\n\ndef test_example():\n    time.sleep(600)\n")
    assert run_tests(tree, ("tests/test_example.py",), 2.0) == (None, "no end after 2 s")


def test_a_copy_lacks_results_but_not_the_room_of_that_name(tree, tmp_path):
    for name in ("results", "site", "explore/results", ".git"):
        (tree / name).mkdir()
    copy_tree(tree, tmp_path / "copy")
    assert {path.name for path in (tmp_path / "copy").iterdir()} == {"explore", "tests"}
    assert (tmp_path / "copy/explore/results").is_dir()


def test_the_share_counts_what_was_noticed():
    outcomes = [Outcome(EXAMPLE, "noticed", 1.0, ""), Outcome(EXAMPLE, "NOT NOTICED", 2.0, "1 passed")]
    assert share_noticed(outcomes) == 0.5 < REQUIRED_DRAWN <= REQUIRED_BY_HAND <= 1.0
    assert shares(outcomes).split("\n") == ["base            50% of 2", "all             50% of 2"]
    first, last = row(outcomes[1]).splitlines()
    assert first.startswith("NOT NOTICED    2.0 s  explore/base/suggest.py:")
    assert first.endswith("allowed = list(names)  ->  allowed = []")
    assert last.strip() == "1 passed"
