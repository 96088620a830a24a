"""Plant small mistakes, one at a time in a copy of the tree, and run the tests nearest to each.

``python tests/mutants/run.py`` plants all mistakes of ``mistakes/*.toml`` and prints a line for each; the exit code is
not 0 when the tests notice fewer than 90 %. ``--only TEXT`` takes the mistakes whose place, text or tests contain a
text.
"""

from __future__ import annotations

import argparse
import ast
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
LISTS = Path(__file__).parent / "mistakes"
#: Share of the mistakes that the tests must notice.
REQUIRED_SHARE = 0.9
#: Folders of the tree that no test needs.
_LEFT_OUT = shutil.ignore_patterns(".git", "node_modules", ".*_cache", ".hypothesis", "site", "results")
#: Exit codes of pytest: all passed; some failed; interrupted, as by a module that cannot be imported.
_PASSED, _FAILED, _INTERRUPTED = 0, 1, 2
_VERDICTS = {_PASSED: "NOT NOTICED", _FAILED: "noticed", _INTERRUPTED: "noticed", None: "noticed"}

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
        """The file, and the line in which the text begins."""
        before, match, _ = (ROOT / self.file).read_text(encoding="utf-8").partition(self.text)
        return f"{self.file}:{before.count(chr(10)) + 1 if match else '?'}"


@dataclass(frozen=True)
class Outcome:
    """The verdict on a mistake, "noticed", "NOT NOTICED" or "ERROR", and the last line that pytest printed."""

    mistake: Mistake
    verdict: str
    seconds: float
    last_line: str


def read_mistakes(folder: Path = LISTS) -> list[Mistake]:
    """All mistakes of the lists, in the order of the files' names."""
    return [
        Mistake(entry["file"], entry["text"], entry["replacement"], tuple(entry["tests"]))
        for path in sorted(folder.glob("*.toml"))
        for entry in tomllib.loads(path.read_text(encoding="utf-8"))["mistake"]
    ]


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


def plant(mistake: Mistake, tree: Path, imports: Imports) -> None:
    """Put a mistake into a copy of the tree, and remove what was compiled from that file or from what imports it.

    Numba notices a change of the file that holds a function, not of the files whose functions were inlined into it.
    """
    path = tree / mistake.file
    path.write_text(path.read_text(encoding="utf-8").replace(mistake.text, mistake.replacement), encoding="utf-8")
    for file in dependants(mistake.file, imports):
        for cached in (tree / file).parent.glob(f"__pycache__/{Path(file).stem}.*"):
            if cached.suffix in (".nbi", ".nbc"):
                cached.unlink()


def read_imports(tree: Path) -> Imports:
    """The files of the package, and for each the files that it imports anywhere in it."""
    return {
        str(path.relative_to(tree)): {str(file.relative_to(tree)) for file in _imported(path, tree)}
        for path in (tree / "explore").rglob("*.py")
    }


def dependants(file: str, imports: Imports) -> set[str]:
    """The files of the package that import a file, directly or through others, and the file itself."""
    reached, waiting = {file}, [file]
    while waiting:
        imported = waiting.pop()
        new = {importer for importer, files in imports.items() if imported in files} - reached
        reached |= new
        waiting += new
    return reached


def _imported(module: Path, tree: Path) -> Iterator[Path]:
    """Files of the package that a module imports, anywhere in it."""
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            path = tree.joinpath(*name.split("."))
            yield from (path.with_suffix(".py"), path / "__init__.py")


def run_tests(tree: Path, tests: Iterable[str], limit: float) -> tuple[int | None, str]:
    """Exit code of pytest in a tree, None where it ran out of time, and the last line that it printed."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # starts sooner
    environment.pop("NUMBA_CACHE_DIR", None)  # the copy brings its own cache
    with subprocess.Popen(
        command, cwd=tree, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as process:  # fmt: skip
        try:
            output, _ = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return None, f"no end after {limit:.0f} s"
    lines = output.strip().splitlines() or [""]
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return process.returncode, (failed or lines)[-1][:160]


def try_mistake(mistake: Mistake, master: Path, imports: Imports, limit: float) -> Outcome:
    """Plant a mistake in a copy of its own and run its tests."""
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(master, tree)
        plant(mistake, tree, imports)
        code, last_line = run_tests(tree, mistake.tests, limit)
    return Outcome(mistake, _VERDICTS.get(code, "ERROR"), time.monotonic() - start, last_line)


def row(outcome: Outcome) -> str:
    """The line of a mistake, and beneath it what pytest printed where the mistake was not noticed."""
    change = f"{_short(outcome.mistake.text)}  ->  {_short(outcome.mistake.replacement)}"
    line = f"{outcome.verdict:11}  {outcome.seconds:5.1f} s  {outcome.mistake.place}  {change}"
    return line if outcome.verdict == "noticed" else f"{line}\n{'':22}{outcome.last_line}"


def share_noticed(outcomes: list[Outcome]) -> float:
    """The share of the mistakes that the tests noticed."""
    return sum(outcome.verdict == "noticed" for outcome in outcomes) / len(outcomes)


def _short(text: str) -> str:
    """A text in one line of at most 60 letters."""
    line = " ".join(text.split())
    return line if len(line) <= 60 else f"{line[:59]}…"


def main() -> int:
    """Run the campaign; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", action="append", default=[], metavar="TEXT", help="mistakes that contain this text")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="mistakes tried at the same time")
    parser.add_argument("--trust", action="store_true", help="take it that the tests pass without any mistake")
    parser.add_argument("--limit", type=float, default=300.0, metavar="SECONDS", help="for the tests of one mistake")
    arguments = parser.parse_args()
    everything = read_mistakes()
    mistakes = [m for m in everything if not arguments.only or any(text in repr(m) for text in arguments.only)]
    problems = [problem for mistake in mistakes for problem in problems_of(mistake)]
    if problems or not mistakes:
        print("\n".join(problems or ["no mistake contains that text"]), file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        master = Path(folder) / "master"
        shutil.copytree(ROOT, master, ignore=_LEFT_OUT)
        if not arguments.trust:  # this also fills the cache of compiled functions
            code, last_line = run_tests(master, sorted({test for m in mistakes for test in m.tests}), 3600.0)
            if code != _PASSED:
                print(f"the tests fail without any mistake: {last_line}", file=sys.stderr)
                return 2
        outcomes = []
        with ThreadPoolExecutor(arguments.workers) as pool:
            imports = read_imports(master)
            for outcome in pool.map(lambda m: try_mistake(m, master, imports, arguments.limit), mistakes):
                print(row(outcome), flush=True)
                outcomes.append(outcome)
    share = share_noticed(outcomes)
    print(f"{share:.0%} of {len(outcomes)} mistakes noticed")
    return 0 if share >= REQUIRED_SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
