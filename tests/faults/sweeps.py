"""The real command as a separate process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import call
from studies import grid

_REST = """\
[constraints]
transmission_angle_min = { min = 20 }
[rank]
metrics = ["cv", "transmission_angle_min:max"]
"""


def night(*values: object) -> object:
    """Parameters of the slow form."""
    return pytest.param(*values, marks=pytest.mark.slow)


def study(folder: Path, num: int = 16) -> Path:
    """A study of a crank-rocker with, by default, three blocks."""
    path = folder / f"study{num}.toml"
    path.write_text(grid(_REST, num))
    return path


def words(config: Path | int, results: Path, keep: str) -> list[str]:
    """The words of a sweep of a study, or of an atlas of so many linkages."""
    if isinstance(config, int):
        return ["atlas", "--count", str(config), "-o", str(results), "--quiet"]
    return ["sweep", str(config), "-o", str(results), "--quiet", "--keep", keep]


def sweep_here(config: Path | int, results: Path, keep: str = "all") -> None:
    """Carry out a command in this process, without a word."""
    assert call(*words(config, results, keep)) == (0, "", "")


class Command:
    """A running `python -m explore sweep`, or `atlas`.

    Parameters
    ----------
    config, results
        The study, or the number of linkages of an atlas, and where its results go.
    environment
        Added to this process's; the recorder's orders, for instance.
    keep
        What it keeps.
    """

    def __init__(
        self, config: Path | int, results: Path, environment: dict[str, str] | None = None, keep: str = "all"
    ) -> None:
        command = [sys.executable, "-m", "explore", *words(config, results, keep)]
        surrounding = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "NO_COLOR": "1"}
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        self._process = subprocess.Popen(command, env=surrounding | (environment or {}), **pipes)

    @property
    def running(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    @property
    def process(self) -> int:
        """Its process number."""
        return self._process.pid

    def finish(self) -> tuple[int, str]:
        """Wait for its end; return the exit code and stderr."""
        if not self._process.stderr.closed:
            self._errors = self._process.communicate(timeout=240)[1]
        return self._process.returncode, self._errors

    def kill(self) -> None:
        """Kill -9."""
        self._process.kill()
        self.finish()
