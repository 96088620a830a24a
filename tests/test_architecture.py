"""The architecture: no import cycle, a diagram that is up to date, and comments that say what constants are."""

import ast
import importlib.util
import re
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


#: First words of comments that do not say what a constant is.
NO_NOUNS = {
    "adding", "all", "as", "by", "called", "fewest", "for", "from", "how", "if", "in", "most", "of", "one", "run",
    "takes", "that", "these", "those", "to", "what", "when", "where", "whether", "which", "why",
}  # fmt: skip


def _comments_of_constants(source: str):
    """Line and problem of each `#:` comment that is no line of its own above one constant, with a noun first."""
    lines = source.split("\n")
    ends, statements = {}, {}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            ends[node.lineno] = node.end_lineno
            statements[node.lineno] = len(targets) == 1 and isinstance(targets[0], ast.Name)
    for number, line in enumerate(lines, 1):
        if not line.lstrip().startswith("#: "):
            continue
        words = re.findall(r"\w+", line.lower())
        if words[0] in NO_NOUNS or "those" in words:
            yield number, "begins with no noun, or has the word 'those'"
        if not statements.get(number + 1):
            yield number, "is not followed by one constant"
        elif ends[number + 1] + 1 in statements:
            yield number, "is followed by a second constant without a comment or an empty line"


def test_a_comment_says_what_one_constant_is():
    problems = [
        f"{path.relative_to(ROOT)}:{number} {problem}"
        for path in sorted((ROOT / "explore").rglob("*.py"))
        for number, problem in _comments_of_constants(path.read_text(encoding="utf-8"))
    ]

    assert not problems, "\n".join(problems)


#: Packages that serve any mechanism.
GENERIC = (
    "base", "model", "evaluation", "results", "studies", "running", "analysis", "comparison", "figures", "service",
    "cli", "testing",
)  # fmt: skip
#: Names of mechanisms that these packages do not contain.
MECHANISM_NAME = re.compile(r"(crank[_-]rocker|slider[_-]crank|variable[_-]crank|test-rig)", re.IGNORECASE)
#: Files that name a mechanism, with the reason.
NAMING = {
    "analysis/covering.py": "the swing that exchangeable cranks cover, a closed form of crank-rockers",
    "cli/application.py": "examples of the help",
    "cli/commands/atlas.py": "the atlas is of crank-rockers",
    "evaluation/quadrature/tails.py": "the designs that a constant was measured on",
    "figures/charts/ratio.py": "the chart of the published study, of crank-rockers",
    "service/folder.py": "an example in a message",
    "studies/config/study.py": "an example in a docstring",
}


def test_generic_packages_name_no_mechanism():
    paths = (path for package in GENERIC for path in (ROOT / "explore" / package).rglob("*.py"))
    named = {path for path in paths if MECHANISM_NAME.search(path.read_text(encoding="utf-8"))}

    assert {path.relative_to(ROOT / "explore").as_posix() for path in named} == NAMING.keys()
