"""Mistakes: what they change, whether they can be planted, and the files that import what they change."""

import ast
import difflib
import os
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Mistakes by hand that no operator makes.
BY_HAND = Path(__file__).with_name("by_hand.toml")

#: Letters shown before and after what changes.
_BEFORE, _AFTER = 25, 15

#: For each file of the package the files that it imports.
Imports = dict[str, set[str]]


@dataclass(frozen=True)
class Mistake:
    """A piece of text that occurs once in a file, what replaces it, and the tests that should fail then."""

    file: str
    text: str
    replacement: str
    tests: tuple[str, ...]

    @property
    def place(self) -> str:
        """The file, and the first line that changes."""
        before, match, _ = (ROOT / self.file).read_text(encoding="utf-8").partition(self.text)
        line = before.count("\n") + 1 + self._changed_lines()[0]
        return f"{self.file}:{line if match else '?'}"

    @property
    def change(self) -> str:
        """What changes, in one line, with some of what stands before and after it."""
        old, new = self.text, self.replacement
        start = len(os.path.commonprefix([old, new]))  # noqa: RUF071  (letters are meant, not folders)
        end = len(os.path.commonprefix([old[start:][::-1], new[start:][::-1]]))  # noqa: RUF071  (likewise)
        first, last = max(start - _BEFORE, old.rfind("\n", 0, start) + 1), end - _AFTER
        return "  ->  ".join(_short(text[first : len(text) - max(last, 0)]) for text in (old, new))

    def _changed_lines(self) -> tuple[int, int, int]:
        """The first line that changes, the end of the lines that change, and the end of what replaces them."""
        old, new = self.text.splitlines(), self.replacement.splitlines()
        changes = [c for c in difflib.SequenceMatcher(a=old, b=new, autojunk=False).get_opcodes() if c[0] != "equal"]
        return (changes[0][1], changes[-1][2], changes[-1][4]) if changes else (0, 0, 0)


def _short(text: str) -> str:
    """A text in one line of at most 60 letters."""
    line = " ".join(text.split())
    return line if len(line) <= 60 else f"{line[:59]}…"


def read_mistakes(path: Path = BY_HAND) -> list[Mistake]:
    """The mistakes by hand."""
    entries = tomllib.loads(path.read_text(encoding="utf-8"))["mistake"]
    return [Mistake(e["file"], e["text"], e["replacement"], tuple(e["tests"])) for e in entries]


def problems_of(mistake: Mistake, root: Path = ROOT) -> list[str]:
    """Why a mistake cannot be planted: its text is gone or not unique, its replacement is the same, a test is gone."""
    path = root / mistake.file
    if not path.is_file():
        return [f"{mistake.file}: there is no such file"]
    count = path.read_text(encoding="utf-8").count(mistake.text)
    problems = [] if count == 1 else [f"{mistake.file}: {mistake.text!r} occurs {count} times, not once"]
    if mistake.text == mistake.replacement:
        problems.append(f"{mistake.file}: {mistake.text!r} is replaced by itself")
    for test in mistake.tests:
        name, _, function = test.partition("::")
        if not (root / name).is_file():
            problems.append(f"{mistake.file}: there is no {name}")
        elif function and f"def {function.partition('[')[0]}(" not in (root / name).read_text(encoding="utf-8"):
            problems.append(f"{mistake.file}: there is no {test}")
    return problems


def read_imports(tree: Path) -> Imports:
    """The files of the package, and for each the files that it imports anywhere in it."""
    return {
        str(path.relative_to(tree)): imports_of_file(path, tree) for path in sorted((tree / "explore").rglob("*.py"))
    }


def imports_of_file(module: Path, tree: Path) -> set[str]:
    """Files that a module may import, anywhere in it."""
    names = []
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
    paths = [Path(*name.split(".")) for name in names]
    return {str(file) for path in paths for file in (path.with_suffix(".py"), path / "__init__.py")}
