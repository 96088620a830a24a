"""Plant small mistakes, one at a time in a copy of the tree, and run the tests nearest to each.

``python tests/mutants/run.py --draw 300 --seed 1`` draws mistakes at random places of the package (extra ``mutants``)
and prints a line for each and a share for each package; without ``--draw`` it takes those of ``by_hand.toml``. The exit
code is not 0 when the tests notice less than 80 % of what was drawn, or 90 % of the others.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

sys.path.insert(0, str(Path(__file__).parents[1]))

from mutants.drawing import draw_mistakes
from mutants.mistakes import ROOT, Mistake, problems_of, read_mistakes

#: Share of the mistakes by hand that the tests must notice.
REQUIRED_BY_HAND = 0.9
#: Share of the drawn mistakes that the tests must notice: some of them change nothing.
REQUIRED_DRAWN = 0.8
#: Files of the tree that no test needs, at any depth.
_LEFT_OUT = shutil.ignore_patterns(".git", "node_modules", ".*_cache", ".hypothesis")
#: Folders of the root that no test needs.
_LEFT_OUT_OF_ROOT = {"site", "results"}
#: Pytest's exit codes where nothing failed: all passed, and all left out, as in a file of slow tests.
_PASSED = (0, 5)
#: Verdicts by pytest's exit code: all passed, some failed, interrupted, conftest.py fails, and none without an end.
_VERDICTS = {0: "NOT NOTICED", 1: "noticed", 2: "noticed", 4: "noticed", None: "noticed"}


@dataclass(frozen=True)
class Outcome:
    """The verdict on a mistake, "noticed", "NOT NOTICED" or "ERROR", and the last line that pytest printed."""

    mistake: Mistake
    verdict: str
    seconds: float
    last_line: str


def copy_tree(root: Path, target: Path) -> None:
    """Copy what tests need, with the cache of compiled functions."""

    def left_out(folder: str, names: list[str]) -> set[str]:
        return _LEFT_OUT(folder, names) | (_LEFT_OUT_OF_ROOT if Path(folder) == root else set())

    shutil.copytree(root, target, ignore=left_out)


def plant(mistake: Mistake, tree: Path) -> None:
    """Put a mistake into a copy of the tree."""
    path = tree / mistake.file
    path.write_text(path.read_text(encoding="utf-8").replace(mistake.text, mistake.replacement), encoding="utf-8")


def run_tests(tree: Path, tests: Iterable[str], limit: float) -> tuple[int | None, str]:
    """Exit code of pytest in a tree, None where it ran out of time, and the last line that it printed."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # starts sooner
    # A change of the same length within a second would leave Python's cached code valid.
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
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


class Baseline:
    """What the test files say without a mistake, each run once; that also fills the cache of compiled functions.

    `seconds` is what each took.
    """

    def __init__(self, tree: Path) -> None:
        self.tree = tree
        self.seconds: dict[str, float] = {}
        self._failures: dict[str, str] = {}
        self._lock = Lock()

    def failures(self, tests: Iterable[str]) -> list[str]:
        """For each of some tests that fails without a mistake the last line that pytest printed."""
        with self._lock:
            for test in tests:
                if test not in self._failures:
                    start = time.monotonic()
                    code, last_line = run_tests(self.tree, [test], 3600.0)
                    self.seconds[test] = time.monotonic() - start
                    self._failures[test] = "" if code in _PASSED else last_line
            return [self._failures[test] for test in tests if self._failures[test]]


def try_mistake(mistake: Mistake, baseline: Baseline, limit: float) -> Outcome:
    """Plant a mistake in a copy of its own and run its tests."""
    if failures := baseline.failures(mistake.tests):
        return Outcome(mistake, "ERROR", 0.0, f"fails without any mistake: {failures[0]}")
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(baseline.tree, tree)
        plant(mistake, tree)
        code, last_line = run_tests(tree, mistake.tests, limit + 2 * sum(baseline.seconds[t] for t in mistake.tests))
    return Outcome(mistake, _VERDICTS.get(code, "ERROR"), time.monotonic() - start, last_line)


def row(outcome: Outcome) -> str:
    """The line of a mistake, and beneath it what pytest printed where the mistake was not noticed."""
    line = f"{outcome.verdict:11}  {outcome.seconds:5.1f} s  {outcome.mistake.place}  {outcome.mistake.change}"
    return line if outcome.verdict == "noticed" else f"{line}\n{'':22}{outcome.last_line}"


def share_noticed(outcomes: list[Outcome]) -> float:
    """The share of the mistakes that the tests noticed."""
    return sum(outcome.verdict == "noticed" for outcome in outcomes) / len(outcomes)


def shares(outcomes: list[Outcome]) -> str:
    """A line for each package, and one for all."""
    packages = defaultdict(list)
    for outcome in outcomes:
        packages[Path(outcome.mistake.file).parts[1]].append(outcome)
    return "\n".join(
        f"{name:14} {share_noticed(those):4.0%} of {len(those)}"
        for name, those in [*sorted(packages.items()), ("all", outcomes)]
    )


def main() -> int:
    """Run the campaign; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--draw", type=int, metavar="N", help="draw this many mistakes at random")
    parser.add_argument("--seed", type=int, default=1, help="the seed of the generator")
    parser.add_argument("--only", default="", metavar="TEXT", help="mistakes in files whose path contains this text")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="mistakes tried at the same time")
    parser.add_argument("--limit", type=float, default=300.0, metavar="SECONDS", help="added to twice what tests take")
    arguments = parser.parse_args()
    if arguments.draw:
        mistakes = list(draw_mistakes(arguments.draw, arguments.seed, ROOT, arguments.only))
    else:
        mistakes = [mistake for mistake in read_mistakes() if arguments.only in mistake.file]
    problems = [problem for mistake in mistakes for problem in problems_of(mistake)]
    if problems or not mistakes:
        print("\n".join(problems or ["no mistake is in such a file"]), file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        master = Path(folder) / "master"
        copy_tree(ROOT, master)
        baseline, outcomes = Baseline(master), []
        with ThreadPoolExecutor(arguments.workers) as pool:
            for outcome in pool.map(lambda m: try_mistake(m, baseline, arguments.limit), mistakes):
                print(row(outcome), flush=True)
                outcomes.append(outcome)
    print(shares(outcomes))
    return 0 if share_noticed(outcomes) >= (REQUIRED_DRAWN if arguments.draw else REQUIRED_BY_HAND) else 1


if __name__ == "__main__":
    sys.exit(main())
