"""Mistakes drawn at random over the package by the operators of Cosmic Ray, and the tests nearest to each."""

import ast
import random
from collections import Counter
from collections.abc import Iterator
from math import log
from pathlib import Path
from typing import Any

from mutants.mistakes import Mistake, imports_of_file, read_imports

#: Operators whose mistakes are equivalent to the code or are none that a person makes.
_LEFT_OUT = ("Variable", "RemoveDecorator", "_Invert", "_UAdd", "Binary", "_Is")
#: Replacements of binary operators by those that a person mistakes for them.
_BINARY = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Mul_Add", "FloorDiv_Div", "Mod_FloorDiv", "BitAnd_BitOr",
           "BitOr_BitAnd", "Pow_Mul", "LShift_RShift")  # fmt: skip
#: Nodes of the syntax tree below which nothing is computed.
_NOT_COMPUTED = {"annassign", "tfpdef", "import_name", "import_from", "decorator"}
#: Test files that are run for one mistake.
NEAREST = 4
#: Folders of the tests that need a browser or start clusters, and tests that run the blocks of every page.
_SLOW = {"browser", "clusters", "test_docs.py"}
#: Steps of imports counted between a module and a test that does not import it.
_FAR = 6


def draw_mistakes(count: int, seed: int, root: Path, only: str = "") -> Iterator[Mistake]:
    """Mistakes at random places of the package: a file by its length, a place in it, an operator that fits there.

    Parameters
    ----------
    count, seed
        How many, and the seed of the generator.
    root
        The tree.
    only
        A part of the paths of the files to draw from.
    """
    generator = random.Random(seed)
    operators = _operators()
    nearest = _NearestTests(root)
    files = sorted(path for path in (root / "explore").rglob("*.py") if only in str(path.relative_to(root)))
    sources = {path: path.read_text(encoding="utf-8") for path in files}
    lengths = [source.count("\n") for source in sources.values()]
    while count:
        path = generator.choices(files, lengths)[0]
        places = _places(sources[path], operators)
        mutated = _mutate(sources[path], *generator.choice(generator.choice(places))) if places else ""
        if mutated and _is_python(mutated):
            file = str(path.relative_to(root))
            yield Mistake(file, sources[path], mutated, tuple(nearest.of(file)))
            count -= 1


def _operators() -> list[Any]:
    """The operators that are drawn from."""
    from cosmic_ray import plugins

    names = [name for name in plugins.operator_names() if not any(part in name for part in _LEFT_OUT)]
    names += [f"core/ReplaceBinaryOperator_{pair}" for pair in _BINARY]
    return [plugins.get_operator(name)() for name in names]


def _places(source: str, operators: list[Any]) -> list[list[tuple[Any, int]]]:
    """For each place of a source, the operators that fit there and how many places of each come before."""
    from cosmic_ray.ast import ast_nodes, get_ast

    nodes = [(node, _is_left_out(node)) for node in ast_nodes(get_ast(source))]
    places: dict[tuple[int, int], list[tuple[Any, int]]] = {}
    for operator in operators:
        occurrence = 0
        for node, is_left_out in nodes:
            for start, _ in operator.mutation_positions(node):
                if not is_left_out:
                    places.setdefault(start, []).append((operator, occurrence))
                occurrence += 1
    return list(places.values())


def _is_left_out(node: Any) -> bool:
    """Whether a node is a type, an import, a decorator, or the star between parameters."""
    if node.type == "operator" and node.parent.type == "parameters":
        return True
    while node is not None:
        parent = node.parent
        if node.type in _NOT_COMPUTED or (parent and parent.type == "funcdef" and node is parent.annotation):
            return True
        node = parent
    return False


def _mutate(source: str, operator: Any, occurrence: int) -> str:
    """The source with one mistake."""
    from cosmic_ray.mutating import mutate_code

    mutated = mutate_code(source, operator, occurrence)
    assert mutated is not None, (operator, occurrence)
    return mutated


def _is_python(source: str) -> bool:
    """Whether a source compiles: a star before an argument is taken for an operator."""
    try:
        compile(source, "", "exec")
    except SyntaxError:
        return False
    return True


class _NearestTests:
    """The test files nearest to a module: by the steps of imports between them, less what words their names share.

    A shared word counts the more the fewer test files have it in their names. A test that has the name of a command in
    quotation marks runs the module of the command.
    """

    def __init__(self, root: Path) -> None:
        self._imports = read_imports(root)
        names = {f"explore.{name}": module for name, module in _public_names(root).items()}
        names |= {f'"{Path(file).stem}"': file for file in self._imports if file.startswith("explore/cli/commands/")}
        self._tests = {}
        for path in sorted((root / "tests").rglob("test_*.py")):
            text = path.read_text(encoding="utf-8")
            used = {module for name, module in names.items() if name in text}
            if not _SLOW.intersection(path.parts):
                self._tests[str(path.relative_to(root))] = imports_of_file(path, root) & self._imports.keys() | used
        self._counts = Counter(word for test in self._tests for word in _words(test))

    def of(self, file: str) -> list[str]:
        """The nearest test files of a file of the package."""
        steps, near = dict.fromkeys(self._tests, len(self._imports)), {file}
        for step in range(len(self._imports)):
            steps |= {test: min(step, steps[test]) for test, files in self._tests.items() if files & near}
            before = len(near)
            near |= {importer for importer, files in self._imports.items() if files & near}
            if len(near) == before:
                break
        words = _words(file)
        distances = {
            test: min(steps[test], _FAR) - sum(log(len(self._tests) / self._counts[w]) for w in words & _words(test))
            for test in self._tests
        }
        near = {test for test, distance in distances.items() if distance < _FAR}
        return sorted(near, key=lambda test: (distances[test], len(self._tests[test]), test))[:NEAREST]


def _words(path: str) -> set[str]:
    """The beginnings of the words of a path, which forms of one word share."""
    words = {word for part in Path(path).with_suffix("").parts[1:] for word in part.split("_")}
    return {word[:4] for word in words if len(word) > 2} - {"test"}


def _public_names(root: Path) -> dict[str, str]:
    """The file of each public name of the package."""
    tree = ast.parse((root / "explore/__init__.pyi").read_text(encoding="utf-8"))
    return {
        alias.name: f"explore/{node.module.replace('.', '/')}.py"
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }
