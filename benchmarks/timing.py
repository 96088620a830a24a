"""Times of jobs in turns, so that a busy moment harms all alike: in this process, or in one for each source tree."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def cpu_times(jobs: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, list[float]]:
    """CPU seconds of every repetition by job; a first run of each warms up."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for repetition in range(repetitions + 1):
        for name, job in jobs.items():
            start = time.process_time()
            job()
            if repetition:
                seconds[name].append(time.process_time() - start)
    return seconds


def edition_times(
    script: str, other: str, jobs: Mapping[str, object], repetitions: int
) -> dict[str, tuple[list[list[float]], list[list[float]]]]:
    """What a script measures of each job in another edition and in this one, in each repetition.

    Parameters
    ----------
    script
        Path of a script that calls `serve` where its arguments are ``--serve``; it runs once for each edition.
    other
        The folder of the other edition's source tree.
    jobs
        What the script is asked to run, by name; can be written as JSON.
    """
    processes = [
        subprocess.Popen(
            [sys.executable, script, "--serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(tree)},
        )
        for tree in (Path(other).resolve(), ROOT)
    ]  # fmt: skip
    times: dict[str, tuple[list[list[float]], list[list[float]]]] = {name: ([], []) for name in jobs}
    for repetition in range(repetitions + 1):
        for name, job in jobs.items():
            for process, measured in zip(processes, times[name], strict=True):
                process.stdin.write(json.dumps(job) + "\n")
                process.stdin.flush()
                numbers = json.loads(process.stdout.readline())
                if repetition:  # the first run compiles
                    measured.append(numbers)
    for process in processes:
        process.stdin.close()
        process.wait()
    return times


def serve(measure: Callable[[object], list[float]]) -> None:
    """Measure the jobs that are read, one a line, and print the numbers."""
    for line in sys.stdin:
        print(json.dumps(measure(json.loads(line))), flush=True)
