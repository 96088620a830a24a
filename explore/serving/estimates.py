"""How long a sweep would take, measured in a process of its own: compiling would hold up the service."""

from __future__ import annotations

import subprocess
import sys

from explore.sweeping.clusters import processors

#: Seconds after which the measurement is given up; compiling takes up to a minute, once per machine.
_PATIENCE = 120.0


def estimate_seconds(content: bytes, n_designs: int, workers: int | None) -> float | None:
    """Seconds of computing with so many threads (None: one for each processor); None if it cannot be measured."""
    command = [sys.executable, "-m", "explore.serving.estimates"]
    try:
        finished = subprocess.run(command, input=content, capture_output=True, timeout=_PATIENCE, check=True)  # noqa: S603 -- our own module
        return float(finished.stdout) * n_designs / (workers or processors())
    except (OSError, subprocess.SubprocessError, ValueError):
        return None


def _main() -> None:
    """Print the seconds per design of the study on stdin."""
    from pathlib import Path

    from explore.config.study_file import parse_study
    from explore.sweeping.timing import seconds_per_design

    text = sys.stdin.buffer.read().decode("utf-8-sig")
    sys.stdout.write(f"{seconds_per_design(parse_study(text, 'study', Path()))}\n")


if __name__ == "__main__":
    _main()
