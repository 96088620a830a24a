"""The test's side of `writing.py`: start writers, kill them, read their output."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

_HERE = Path(__file__).parent


@dataclass
class Writing:
    """A process that writes."""

    server: Server
    process: int
    output_path: Path
    error_path: Path

    def kill(self) -> int:
        """Kill -9 and wait."""
        os.kill(self.process, signal.SIGKILL)
        return self.code

    @cached_property
    def code(self) -> int:
        """Exit code, or minus the signal; waits for the end."""
        return self.server.ask({"wait": self.process, "timeout": 60})

    @property
    def lines(self) -> list[str]:
        """Its lines so far."""
        return self.output_path.read_text().splitlines() if self.output_path.exists() else []

    def numbers(self, word: str) -> list[int]:
        """The block numbers that it printed after a word."""
        return [int(line.split()[1]) for line in self.lines if line.startswith(word + " ")]

    @property
    def errors(self) -> str:
        """The content of its stderr."""
        return self.error_path.read_text() if self.error_path.exists() else ""


class Server:
    """The process that forks writers."""

    def __init__(self, recorder: Path, scratch: Path) -> None:
        self._scratch = scratch
        self._numbers = itertools.count()
        self._log = (scratch / "server.log").open("w")
        environment = os.environ | {
            "LD_PRELOAD": str(recorder),
            "PYTHONPATH": os.pathsep.join([str(_HERE.parent), *filter(None, sys.path)]),
            "OPENBLAS_NUM_THREADS": "1",  # no threads before a fork
            "NO_COLOR": "1",
        }
        command = [sys.executable, "-W", "error", "-m", "faults.writing"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": self._log}
        self._process = subprocess.Popen(command, env=environment, text=True, **pipes)

    def ask(self, order: dict[str, Any]) -> int:
        """Send an order and return the answer."""
        self._process.stdin.write(json.dumps(order) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        assert answer, f"the server ended: {(self._scratch / 'server.log').read_text()}"
        return int(answer)

    def start(self, path: Path, **order: Any) -> Writing:
        """Start a writer of a file; see `writing.run` and `writing.write` for the orders."""
        number = next(self._numbers)
        output, errors = self._scratch / f"{number}.output", self._scratch / f"{number}.errors"
        order |= {"path": str(path), "output": str(output), "errors": str(errors)}
        return Writing(self, self.ask(order), output, errors)

    def write(self, path: Path, **order: Any) -> Writing:
        """Run a writer of a file to its end."""
        writing = self.start(path, **order)
        _ = writing.code
        return writing

    def close(self) -> None:
        """Let the process end."""
        self._process.stdin.close()
        self._process.wait(timeout=240)
        self._process.stdout.close()
        self._log.close()
