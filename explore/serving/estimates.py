"""How long a sweep would take, measured in a process of its own: compiling would hold up the service."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from explore.config.study import Study
from explore.serving.job_files import Refinement, read_job_file
from explore.serving.plans import Plan
from explore.sweeping.clusters import processors
from explore.sweeping.timing import seconds_per_design

#: Seconds after which the measurement is given up; compiling takes up to a minute, once per machine.
_PATIENCE = 120.0


def estimate_seconds(content: bytes, plan: Plan, results: Path, workers: int | None) -> float | None:
    """Seconds of computing with so many threads (None: one for each processor).

    None for a task, whose search ends when it has found enough, and where it cannot be measured. `results` is the
    folder of the results that a refinement starts from.
    """
    if plan.designs is None:
        return None
    command = [sys.executable, "-m", "explore.serving.estimates", str(results)]
    try:
        finished = subprocess.run(command, input=content, capture_output=True, timeout=_PATIENCE, check=True)  # noqa: S603 -- our own module
        return float(finished.stdout) * plan.designs / (workers or processors())
    except (OSError, subprocess.SubprocessError, ValueError):
        return None


def _main(results: Path) -> None:
    """Print the seconds per design of the study on stdin, or of the study that the refinement there belongs to."""
    job_file = read_job_file("job", sys.stdin.buffer.read())
    study = job_file.plan(results).study if isinstance(job_file, Refinement) else job_file
    assert isinstance(study, Study)  # noqa: S101 -- tasks are not estimated
    sys.stdout.write(f"{seconds_per_design(study)}\n")


if __name__ == "__main__":
    _main(Path(sys.argv[1]))
